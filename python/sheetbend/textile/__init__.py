"""The tests of a textile laboratory, as experiments in the computer.

Each takes a `Fabric` and gives what the laboratory would read, in its unit and in SI, with the derivative by every
number of the fabric, and the state of rest for pictures. Sizes are those of the standards. `fit_fabric` goes the other
way, from what a laboratory has read to a fabric.
"""

from .bias_extension import BiasExtension, bias_extension
from .cantilever import Cantilever, cantilever
from .drape import Drape, DrapeState, drape, drape_scene, drape_state
from .fabric_fit import FabricFit, Measured, fit_fabric
from .picture_frame import PictureFrame, picture_frame
from .reading import GRAM_FORCE, Reading
from .shear import Shear, shear
from .uniaxial import Uniaxial, uniaxial

__all__ = [
    "GRAM_FORCE",
    "BiasExtension",
    "Cantilever",
    "Drape",
    "DrapeState",
    "FabricFit",
    "Measured",
    "PictureFrame",
    "Reading",
    "Shear",
    "Uniaxial",
    "bias_extension",
    "cantilever",
    "drape",
    "drape_scene",
    "drape_state",
    "fit_fabric",
    "picture_frame",
    "shear",
    "uniaxial",
]
