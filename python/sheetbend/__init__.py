"""sheetbend: a differentiable XPBD simulator for parameter identification.

Ropes and cloth with exact gradients in double precision: simulate, differentiate, and fit physical parameters
to recordings, with intervals and words for what the data cannot tell.
"""

from . import mesh
from .arm import add_arm, add_pendulum
from .arm_data import Arm
from .balance import ForceBalance, force_balance
from .baseline import no_physics
from .cloth import Cloth, add_cloth
from .discretization import Refinement
from .equilibrium import Equilibrium, NoEquilibriumError, equilibria, equilibrium
from .errors import (
    ConfigError,
    DivergenceError,
    EmptyGradientError,
    InputError,
    MeshError,
    RecordingError,
    SceneError,
    SheetbendError,
    UnbalancedError,
    UnconvergedError,
)
from .experiment import Experiment
from .fabric import Exponential, Fabric, Linear, Sinh, Spline
from .fit import Fit, fit
from .force_readings import simulate_forces
from .force_recording import ForceRecording
from .force_sensor import ForceSensor
from .gradients import GradientReport, check_gradients
from .grip import Grip
from .hand_eye import HandEye
from .io.folder import recordings
from .kinds import KINDS
from .markers import Place, along_rope, between, on_cloth, on_particle, on_rope
from .mesh import TriangleMesh, read_mesh
from .parameters import Parameter, Parameters
from .recording import Recording
from .redundancy import RedundantConstraintsWarning
from .result import FitResult
from .rod import Rod, add_rod, rod
from .rod_junction import Junction
from .rollout import Gradient, Rollout, rollout
from .rope import Rope, add_rope, rope
from .scene import Scene
from .scene_file import load_scene, save_scene
from .scores import Score, Scores, coordinate_error, scores
from .simulate import Trajectory, simulate
from .solver import Solver
from .tape import TapePlan, tape_plan
from .tethers import add_tethers
from .tool import Tool
from .values import constraint_values, elastic_energy, support_forces
from .version import __version__ as __version__

__all__ = [
    "KINDS",
    "Arm",
    "Cloth",
    "ConfigError",
    "DivergenceError",
    "EmptyGradientError",
    "Equilibrium",
    "Experiment",
    "Exponential",
    "Fabric",
    "Fit",
    "FitResult",
    "ForceBalance",
    "ForceRecording",
    "ForceSensor",
    "Gradient",
    "GradientReport",
    "Grip",
    "HandEye",
    "InputError",
    "Junction",
    "Linear",
    "MeshError",
    "NoEquilibriumError",
    "Parameter",
    "Parameters",
    "Place",
    "Recording",
    "RecordingError",
    "RedundantConstraintsWarning",
    "Refinement",
    "Rod",
    "Rollout",
    "Rope",
    "Scene",
    "SceneError",
    "Score",
    "Scores",
    "SheetbendError",
    "Sinh",
    "Solver",
    "Spline",
    "TapePlan",
    "Tool",
    "Trajectory",
    "TriangleMesh",
    "UnbalancedError",
    "UnconvergedError",
    "add_arm",
    "add_cloth",
    "add_pendulum",
    "add_rod",
    "add_rope",
    "add_tethers",
    "along_rope",
    "between",
    "check_gradients",
    "constraint_values",
    "coordinate_error",
    "elastic_energy",
    "equilibria",
    "equilibrium",
    "fit",
    "force_balance",
    "load_scene",
    "mesh",
    "no_physics",
    "on_cloth",
    "on_particle",
    "on_rope",
    "read_mesh",
    "recordings",
    "rod",
    "rollout",
    "rope",
    "save_scene",
    "scores",
    "simulate",
    "simulate_forces",
    "support_forces",
    "tape_plan",
]
