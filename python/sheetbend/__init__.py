"""sheetbend: a differentiable XPBD simulator for parameter identification.

Ropes, rods, cloth, solids and rigid bodies with exact gradients in double precision: simulate, differentiate, and fit
physical parameters to recordings, with an interval and a verdict for each.
"""

import sys
from importlib import import_module
from typing import TYPE_CHECKING

from .moved import keep_old_modules, renamed
from .version import __version__ as __version__

if TYPE_CHECKING:  # the names of `_NAMES`, for type checkers and editors
    from . import mesh as mesh
    from . import plot as plot
    from .errors import ConfigError as ConfigError
    from .errors import DivergenceError as DivergenceError
    from .errors import EmptyGradientError as EmptyGradientError
    from .errors import InputError as InputError
    from .errors import MeshError as MeshError
    from .errors import NoEquilibriumError as NoEquilibriumError
    from .errors import RecordingError as RecordingError
    from .errors import SceneError as SceneError
    from .errors import SheetbendError as SheetbendError
    from .errors import UnbalancedError as UnbalancedError
    from .errors import UnconvergedError as UnconvergedError
    from .experiment.experiment import Experiment as Experiment
    from .experiment.force_readings import simulate_forces as simulate_forces
    from .experiment.force_sensor import ForceSensor as ForceSensor
    from .experiment.shooting import Shooting as Shooting
    from .fitting.fit import Fit as Fit
    from .fitting.fit import fit as fit
    from .fitting.identify import identify as identify
    from .fitting.many import fit_many as fit_many
    from .fitting.plan import Plan as Plan
    from .gripped.recipe import fit_rope as fit_rope
    from .mesh import SolidMesh as SolidMesh
    from .mesh import TriangleMesh as TriangleMesh
    from .mesh import read_mesh as read_mesh
    from .minimum.discretization import Refinement as Refinement
    from .motion.balance import ForceBalance as ForceBalance
    from .motion.balance import force_balance as force_balance
    from .motion.contact_counts import ContactCounts as ContactCounts
    from .motion.contact_counts import ContactMode as ContactMode
    from .motion.equilibrium import Equilibrium as Equilibrium
    from .motion.equilibrium import equilibria as equilibria
    from .motion.equilibrium import equilibrium as equilibrium
    from .motion.gradient_report import GradientReport as GradientReport
    from .motion.gradients import check_gradients as check_gradients
    from .motion.redundancy import RedundantConstraintsWarning as RedundantConstraintsWarning
    from .motion.rollout import Gradient as Gradient
    from .motion.rollout import Rollout as Rollout
    from .motion.rollout import rollout as rollout
    from .motion.simulate import Trajectory as Trajectory
    from .motion.simulate import simulate as simulate
    from .motion.solver import Solver as Solver
    from .motion.tape import TapePlan as TapePlan
    from .motion.tape import tape_plan as tape_plan
    from .motion.values import constraint_values as constraint_values
    from .motion.values import elastic_energy as elastic_energy
    from .motion.values import support_forces as support_forces
    from .objects import laws as laws
    from .objects.arm import add_arm as add_arm
    from .objects.arm import add_pendulum as add_pendulum
    from .objects.arm_data import Arm as Arm
    from .objects.body_end import attach as attach
    from .objects.cloth import Cloth as Cloth
    from .objects.cloth import add_cloth as add_cloth
    from .objects.cloth import cloth as cloth
    from .objects.fabric import Fabric as Fabric
    from .objects.grip import Grip as Grip
    from .objects.hand_eye import HandEye as HandEye
    from .objects.joint_making import Joint as Joint
    from .objects.joint_making import ground as ground
    from .objects.joints import ball as ball
    from .objects.joints import cylinder as cylinder
    from .objects.joints import fixed as fixed
    from .objects.joints import hinge as hinge
    from .objects.joints import slider as slider
    from .objects.joints import universal as universal
    from .objects.locking import LockingWarning as LockingWarning
    from .objects.markers import Place as Place
    from .objects.markers import along_rope as along_rope
    from .objects.markers import between as between
    from .objects.markers import on_body as on_body
    from .objects.markers import on_cloth as on_cloth
    from .objects.markers import on_particle as on_particle
    from .objects.markers import on_rope as on_rope
    from .objects.markers import on_solid as on_solid
    from .objects.mean import add_mean as add_mean
    from .objects.over_time import OverTime as OverTime
    from .objects.over_time import add_unknown_force as add_unknown_force
    from .objects.over_time import add_unknown_wind as add_unknown_wind
    from .objects.rod import Rod as Rod
    from .objects.rod import add_rod as add_rod
    from .objects.rod import rod as rod
    from .objects.rod_junction import Junction as Junction
    from .objects.rope import Rope as Rope
    from .objects.rope import add_rope as add_rope
    from .objects.rope import rope as rope
    from .objects.solid import Solid as Solid
    from .objects.solid import add_solid as add_solid
    from .objects.solid import solid as solid
    from .objects.solid_clusters import cluster_boxes as cluster_boxes
    from .objects.solid_rows import Orthotropic as Orthotropic
    from .objects.tethers import add_tethers as add_tethers
    from .objects.tool import Tool as Tool
    from .problem.smooth import Smooth as Smooth
    from .quantities.kinds import KINDS as KINDS
    from .quantities.parameters import Parameter as Parameter
    from .quantities.parameters import Parameters as Parameters
    from .recording.baseline import baseline as baseline
    from .recording.cloud import Cloud as Cloud
    from .recording.force_recording import ForceRecording as ForceRecording
    from .recording.io.folder import read_recordings as read_recordings
    from .recording.of_poses import start_of_poses as start_of_poses
    from .recording.recording import Recording as Recording
    from .report.fit_result import FitResult as FitResult
    from .report.many import ManyFit as ManyFit
    from .report.scores import Score as Score
    from .report.scores import Scores as Scores
    from .report.scores import coordinate_error as coordinate_error
    from .report.scores import scores as scores
    from .scene.body import Body as Body
    from .scene.body_points import box_corners as box_corners
    from .scene.colliders import Box as Box
    from .scene.colliders import Capsule as Capsule
    from .scene.colliders import Cylinder as Cylinder
    from .scene.colliders import Plane as Plane
    from .scene.colliders import Sphere as Sphere
    from .scene.distance_field import DistanceField as DistanceField
    from .scene.inertia import Inertia as Inertia
    from .scene.scene import Scene as Scene
    from .scene.scene_file import load_scene as load_scene
    from .scene.scene_file import save_scene as save_scene

_NAMES = {
    "": "mesh plot",
    "errors": (
        "ConfigError DivergenceError EmptyGradientError InputError MeshError NoEquilibriumError "
        "RecordingError SceneError SheetbendError UnbalancedError UnconvergedError"
    ),
    "experiment.experiment": "Experiment",
    "experiment.force_readings": "simulate_forces",
    "experiment.force_sensor": "ForceSensor",
    "experiment.shooting": "Shooting",
    "fitting.fit": "Fit fit",
    "fitting.identify": "identify",
    "fitting.many": "fit_many",
    "fitting.plan": "Plan",
    "gripped.recipe": "fit_rope",
    "mesh": "SolidMesh TriangleMesh read_mesh",
    "minimum.discretization": "Refinement",
    "problem.smooth": "Smooth",
    "motion.balance": "ForceBalance force_balance",
    "motion.contact_counts": "ContactCounts ContactMode",
    "motion.equilibrium": "Equilibrium equilibria equilibrium",
    "motion.gradient_report": "GradientReport",
    "motion.gradients": "check_gradients",
    "motion.redundancy": "RedundantConstraintsWarning",
    "motion.rollout": "Gradient Rollout rollout",
    "motion.simulate": "Trajectory simulate",
    "motion.solver": "Solver",
    "motion.tape": "TapePlan tape_plan",
    "motion.values": "constraint_values elastic_energy support_forces",
    "objects": "laws",
    "objects.arm": "add_arm add_pendulum",
    "objects.arm_data": "Arm",
    "objects.body_end": "attach",
    "objects.cloth": "Cloth add_cloth cloth",
    "objects.fabric": "Fabric",
    "objects.grip": "Grip",
    "objects.hand_eye": "HandEye",
    "objects.joint_making": "Joint ground",
    "objects.joints": "ball cylinder fixed hinge slider universal",
    "objects.locking": "LockingWarning",
    "objects.markers": "Place along_rope between on_body on_cloth on_particle on_rope on_solid",
    "objects.mean": "add_mean",
    "objects.over_time": "OverTime add_unknown_force add_unknown_wind",
    "objects.rod": "Rod add_rod rod",
    "objects.rod_junction": "Junction",
    "objects.rope": "Rope add_rope rope",
    "objects.solid": "Solid add_solid solid",
    "objects.solid_clusters": "cluster_boxes",
    "objects.solid_rows": "Orthotropic",
    "objects.tethers": "add_tethers",
    "objects.tool": "Tool",
    "quantities.kinds": "KINDS",
    "quantities.parameters": "Parameter Parameters",
    "recording.baseline": "baseline",
    "recording.cloud": "Cloud",
    "recording.force_recording": "ForceRecording",
    "recording.io.folder": "read_recordings",
    "recording.of_poses": "start_of_poses",
    "recording.recording": "Recording",
    "report.fit_result": "FitResult",
    "report.many": "ManyFit",
    "report.scores": "Score Scores coordinate_error scores",
    "scene.body": "Body",
    "scene.body_points": "box_corners",
    "scene.colliders": "Box Capsule Cylinder Plane Sphere",
    "scene.distance_field": "DistanceField",
    "scene.inertia": "Inertia",
    "scene.scene": "Scene",
    "scene.scene_file": "load_scene save_scene",
}
"""The public names by module. A module is imported when one of its names is first used."""

_MODULES = {name: module for module, names in _NAMES.items() for name in names.split()}

keep_old_modules()
if not {"IPython", "marimo"}.isdisjoint(sys.modules):
    from .page.notebook import show_in_notebooks

    show_in_notebooks()

if not TYPE_CHECKING:  # to a type checker, `__getattr__` would make any name valid
    __all__ = sorted(_MODULES)

    def __getattr__(name: str) -> object:
        if name not in _MODULES:
            return renamed(name)
        place = f"{__name__}.{_MODULES[name]}".rstrip(".")
        module = import_module(place)
        found = vars(module)[name] if name in vars(module) else import_module(f"{place}.{name}")
        globals()[name] = found
        return found

    def __dir__() -> list[str]:
        return sorted({*globals(), *_MODULES})
