"""sheetbend: a differentiable XPBD simulator for parameter identification.

Ropes (and later cloth) with exact gradients in double precision: simulate, differentiate, and fit physical parameters
to recordings, with intervals and words for what the data cannot tell.
"""

from .baseline import no_physics
from .discretization import Refinement
from .equilibrium import Equilibrium, equilibria, equilibrium
from .errors import (
    ConfigError,
    DivergenceError,
    EmptyGradientError,
    InputError,
    MeshError,
    RecordingError,
    SceneError,
    SheetbendError,
)
from .experiment import Experiment
from .fit import Fit, fit
from .gradients import GradientReport, check_gradients
from .grip import Grip
from .io.folder import recordings
from .markers import Place, along_rope, between, on_particle, on_rope
from .mesh import (
    Places,
    TriangleMesh,
    disk,
    equilateral,
    grid,
    icosphere,
    read_mesh,
    unfold,
    write_obj,
    write_obj_sequence,
    write_ply,
)
from .parameters import Parameter, Parameters
from .recording import Recording
from .result import FitResult
from .rod import Rod, add_rod, rod
from .rod_junction import Junction
from .rollout import Gradient, Rollout, rollout
from .rope import Rope, add_rope, rope
from .scene import KINDS, Scene
from .scores import Score, Scores, coordinate_error, scores
from .simulate import Trajectory, simulate
from .solver import Solver
from .tape import TapePlan, tape_plan

__version__ = "0.1.0"

__all__ = [
    "KINDS",
    "ConfigError",
    "DivergenceError",
    "EmptyGradientError",
    "Equilibrium",
    "Experiment",
    "Fit",
    "FitResult",
    "Gradient",
    "GradientReport",
    "Grip",
    "InputError",
    "Junction",
    "MeshError",
    "Parameter",
    "Parameters",
    "Place",
    "Places",
    "Recording",
    "RecordingError",
    "Refinement",
    "Rod",
    "Rollout",
    "Rope",
    "Scene",
    "SceneError",
    "Score",
    "Scores",
    "SheetbendError",
    "Solver",
    "TapePlan",
    "Trajectory",
    "TriangleMesh",
    "add_rod",
    "add_rope",
    "along_rope",
    "between",
    "check_gradients",
    "coordinate_error",
    "disk",
    "equilateral",
    "equilibria",
    "equilibrium",
    "fit",
    "grid",
    "icosphere",
    "no_physics",
    "on_particle",
    "on_rope",
    "read_mesh",
    "recordings",
    "rod",
    "rollout",
    "rope",
    "scores",
    "simulate",
    "tape_plan",
    "unfold",
    "write_obj",
    "write_obj_sequence",
    "write_ply",
]
