"""sheetbend: a differentiable XPBD simulator for parameter identification.

Ropes, rods, cloth, solids and rigid bodies with exact gradients in double precision: simulate, differentiate, and fit
physical parameters to recordings, with an interval and a verdict for each.
"""

import ast
import sys
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .moved import keep_old_modules, renamed
from .version import __version__ as __version__

if TYPE_CHECKING:  # each is imported when it is first asked for
    from . import mesh, plot
    from .errors import (
        ConfigError,
        DivergenceError,
        EmptyGradientError,
        InputError,
        MeshError,
        NoEquilibriumError,
        RecordingError,
        SceneError,
        SheetbendError,
        UnbalancedError,
        UnconvergedError,
    )
    from .experiment.experiment import Experiment
    from .experiment.force_readings import simulate_forces
    from .experiment.force_sensor import ForceSensor
    from .experiment.shooting import Shooting
    from .fitting.fit import Fit, fit
    from .fitting.identify import identify
    from .fitting.many import fit_many
    from .fitting.plan import Plan
    from .gripped.recipe import fit_rope
    from .mesh import SolidMesh, TriangleMesh, read_mesh
    from .minimum.discretization import Refinement
    from .minimum.smooth import Smooth
    from .motion.balance import ForceBalance, force_balance
    from .motion.contact_counts import ContactCounts, ContactMode
    from .motion.equilibrium import Equilibrium, equilibria, equilibrium
    from .motion.gradient_report import GradientReport
    from .motion.gradients import check_gradients
    from .motion.redundancy import RedundantConstraintsWarning
    from .motion.rollout import Gradient, Rollout, rollout
    from .motion.simulate import Trajectory, simulate
    from .motion.solver import Solver
    from .motion.tape import TapePlan, tape_plan
    from .motion.values import constraint_values, elastic_energy, support_forces
    from .objects import laws
    from .objects.arm import add_arm, add_pendulum
    from .objects.arm_data import Arm
    from .objects.body_end import attach
    from .objects.cloth import Cloth, add_cloth, cloth
    from .objects.fabric import Fabric
    from .objects.grip import Grip
    from .objects.hand_eye import HandEye
    from .objects.joint_making import Joint, ground
    from .objects.joints import ball, cylinder, fixed, hinge, slider, universal
    from .objects.locking import LockingWarning
    from .objects.markers import Place, along_rope, between, on_body, on_cloth, on_particle, on_rope, on_solid
    from .objects.mean import add_mean
    from .objects.over_time import OverTime, add_unknown_force, add_unknown_wind
    from .objects.rod import Rod, add_rod, rod
    from .objects.rod_junction import Junction
    from .objects.rope import Rope, add_rope, rope
    from .objects.solid import Solid, add_solid, solid
    from .objects.solid_clusters import cluster_boxes
    from .objects.solid_rows import Orthotropic
    from .objects.tethers import add_tethers
    from .objects.tool import Tool
    from .quantities.kinds import KINDS
    from .quantities.parameters import Parameter, Parameters
    from .recording.baseline import baseline
    from .recording.cloud import Cloud
    from .recording.force_recording import ForceRecording
    from .recording.io.folder import read_recordings
    from .recording.of_poses import start_of_poses
    from .recording.recording import Recording
    from .report.fit_result import FitResult
    from .report.many import ManyFit
    from .report.scores import Score, Scores, coordinate_error, scores
    from .scene.body import Body
    from .scene.body_points import box_corners
    from .scene.colliders import Box, Capsule, Cylinder, Plane, Sphere
    from .scene.distance_field import DistanceField
    from .scene.inertia import Inertia
    from .scene.scene import Scene
    from .scene.scene_file import load_scene, save_scene

keep_old_modules()
if not {"IPython", "marimo"}.isdisjoint(sys.modules):
    from .page.notebook import show_in_notebooks

    show_in_notebooks()


@cache
def _places() -> dict[str, str]:
    """The modules of the public names, which type checkers import above."""
    block = next(node for node in ast.parse(Path(__file__).read_text()).body if isinstance(node, ast.If))
    imports = (node for node in block.body if isinstance(node, ast.ImportFrom))
    return {alias.name: f"{__name__}.{node.module or ''}".rstrip(".") for node in imports for alias in node.names}


def __getattr__(name: str) -> Any:
    place = _places().get(name)
    if place is None:
        return renamed(name)
    module = import_module(place)
    found = vars(module)[name] if name in vars(module) else import_module(f"{place}.{name}")
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return [*globals(), *__all__]


__all__ = [
    "KINDS",
    "Arm",
    "Body",
    "Box",
    "Capsule",
    "Cloth",
    "Cloud",
    "ConfigError",
    "ContactCounts",
    "ContactMode",
    "Cylinder",
    "DistanceField",
    "DivergenceError",
    "EmptyGradientError",
    "Equilibrium",
    "Experiment",
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
    "Inertia",
    "InputError",
    "Joint",
    "Junction",
    "LockingWarning",
    "ManyFit",
    "MeshError",
    "NoEquilibriumError",
    "Orthotropic",
    "OverTime",
    "Parameter",
    "Parameters",
    "Place",
    "Plan",
    "Plane",
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
    "Shooting",
    "Smooth",
    "Solid",
    "SolidMesh",
    "Solver",
    "Sphere",
    "TapePlan",
    "Tool",
    "Trajectory",
    "TriangleMesh",
    "UnbalancedError",
    "UnconvergedError",
    "add_arm",
    "add_cloth",
    "add_mean",
    "add_pendulum",
    "add_rod",
    "add_rope",
    "add_solid",
    "add_tethers",
    "add_unknown_force",
    "add_unknown_wind",
    "along_rope",
    "attach",
    "ball",
    "baseline",
    "between",
    "box_corners",
    "check_gradients",
    "cloth",
    "cluster_boxes",
    "constraint_values",
    "coordinate_error",
    "cylinder",
    "elastic_energy",
    "equilibria",
    "equilibrium",
    "fit",
    "fit_many",
    "fit_rope",
    "fixed",
    "force_balance",
    "ground",
    "hinge",
    "identify",
    "laws",
    "load_scene",
    "mesh",
    "on_body",
    "on_cloth",
    "on_particle",
    "on_rope",
    "on_solid",
    "plot",
    "read_mesh",
    "read_recordings",
    "rod",
    "rollout",
    "rope",
    "save_scene",
    "scores",
    "simulate",
    "simulate_forces",
    "slider",
    "solid",
    "start_of_poses",
    "support_forces",
    "tape_plan",
    "universal",
]
