"""The tests of a textile laboratory, as experiments in the computer.

Each test takes a `Fabric` and returns what the laboratory would read, in its unit and in SI, the derivative of the
reading with respect to every number of the fabric, and the state of rest for pictures. Sizes are those of the
standards. `fit_fabric` goes the other way, from readings to a fabric, and `fit_tests` from all tests of a
laboratory. `read_curves` and `read_outline` read the files.
"""

from .bending_yield import BendingYield, bending_yield
from .bias_extension import BiasExtension, bias_extension
from .cantilever import Cantilever, cantilever
from .curve import Curve, Cycle, MeanCurve, mean_curve
from .curve_file import read_curves
from .drape import Drape, DrapeState, drape, drape_scene, drape_state
from .fabric_fit import FabricFit, Measured, fit_fabric
from .forecast import PullForecast, forecast_pull
from .kes import BendingLoop, ShearLoop, TensileLoop, bending_loop, shear_loop, tensile_loop
from .outline import Outline, read_outline
from .picture_frame import PictureFrame, picture_frame
from .pull import fit_pull, pulled, strains_under
from .reading import GRAM_FORCE, Reading
from .shear import Shear, shear
from .shear_yield import ShearYield, shear_yield
from .uniaxial import Uniaxial, uniaxial
from .whole_fabric import FabricTests, WholeFabric, fit_tests

__all__ = [
    "GRAM_FORCE",
    "BendingLoop",
    "BendingYield",
    "BiasExtension",
    "Cantilever",
    "Curve",
    "Cycle",
    "Drape",
    "DrapeState",
    "FabricFit",
    "FabricTests",
    "MeanCurve",
    "Measured",
    "Outline",
    "PictureFrame",
    "PullForecast",
    "Reading",
    "Shear",
    "ShearLoop",
    "ShearYield",
    "TensileLoop",
    "Uniaxial",
    "WholeFabric",
    "bending_loop",
    "bending_yield",
    "bias_extension",
    "cantilever",
    "drape",
    "drape_scene",
    "drape_state",
    "fit_fabric",
    "fit_pull",
    "fit_tests",
    "forecast_pull",
    "mean_curve",
    "picture_frame",
    "pulled",
    "read_curves",
    "read_outline",
    "shear",
    "shear_loop",
    "shear_yield",
    "strains_under",
    "tensile_loop",
    "uniaxial",
]
