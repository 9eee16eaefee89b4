"""One right call of each public function and method, whose arguments `test_wrong_arguments.py` replaces one at a time.

`CALLS` has, by the name that users write, a function that returns what to call and its arguments by name, made anew.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

import numpy as np
import sheetbend as sb
from wrong_calls_beside import BESIDE
from wrong_calls_more import MORE

Call = tuple[Callable[..., Any], dict[str, Any]]
TIMES = [0.0, 0.01, 0.02]
UP = (0.0, 0.0, 1.0)
KNOTS = np.arange(5) * 0.01
TURNS = np.tile([0.0, 0.0, 0.0, 1.0], (5, 1))
LINE = np.outer(KNOTS, [1.0, 0.0, 0.0])
STEP = sb.Solver(h=0.01)


def rope(**options: Any) -> sb.Scene:
    return sb.rope(0.3, 4, density=0.05, EA=1e3, EI=1e-3, bend_damping=1e-3, **options)


def sheet() -> sb.TriangleMesh:
    return sb.mesh.grid(0.2, 0.2, 3, 3, pattern="one_way")


def clothed() -> tuple[sb.Scene, sb.Cloth]:
    scene = sb.Scene()
    return scene, sb.add_cloth(scene, sheet(), density=0.2, warp=40.0, shear=5.0, bending=1e-4)


def blown() -> sb.Scene:
    scene = clothed()[0]
    scene.add_air(**_air(scene), normal=0.6, tangential=0.1)
    return scene


def bricks() -> sb.SolidMesh:
    return sb.mesh.bricks((0.2, 0.1, 0.1), (2, 1, 1))


def solids() -> tuple[sb.Scene, sb.Solid]:
    scene = sb.Scene()
    return scene, sb.add_solid(scene, bricks(), density=1000.0, E=1e6, poisson=0.3)


def bodies() -> tuple[sb.Scene, sb.Body]:
    scene = sb.Scene()
    return scene, scene.add_body("a", of=sb.Inertia.ball(1.0, 0.1))


@cache
def recording() -> sb.Recording:
    motion = sb.simulate(rope(), TIMES, STEP).positions
    return sb.Recording(motion + 1e-4 * np.random.default_rng(1).normal(size=motion.shape), TIMES, name="take")


def cloud() -> sb.Cloud:
    return sb.Cloud.of([np.eye(3), np.eye(3) + 1.0, np.eye(3)], TIMES)


def experiment(**fields: Any) -> dict[str, Any]:
    return {"scene": rope(), "recording": recording(), "solver": STEP, "sigma": 1e-3, **fields}


def readings() -> sb.ForceRecording:
    return sb.ForceRecording(KNOTS, LINE, torques=LINE, quaternions=TURNS)


def tool() -> sb.Tool:
    return sb.Tool(KNOTS, LINE, TURNS)


def fabric() -> dict[str, Any]:
    return {"density": 0.2, "warp": 40.0, "weft": 30.0, "shear": 5.0, "poisson": 0.1, "bending": 1e-4}


def _with(scene: sb.Scene, method: str, **arguments: Any) -> Call:
    return getattr(scene, method), arguments


def _particles() -> sb.Scene:
    scene = sb.Scene()
    scene.add_particles([[0, 0, 0], [1, 0, 0], [2, 0, 1]], 1.0)
    return scene


def _touching(**arguments: Any) -> Call:
    return _with(
        _particles(), "add_contact", what=[0, 1], collider=sb.Plane(point=(0, 0, -1)), friction=0.3, **arguments
    )


def _air(scene: sb.Scene) -> dict[str, Any]:
    (cloth,) = scene.cloths.values()
    return {"triangles": cloth.particles[cloth.mesh.triangles]}


def _balloon() -> sb.Scene:
    mesh = sb.mesh.icosphere(0.1, 0)
    scene = sb.Scene()
    scene.add_particles(mesh.vertices, 1.0)
    return scene


def _file(name: str, write: Callable[[Path], object]) -> str:
    path = Path(mkdtemp(prefix="wrong_")) / name
    write(path)
    return str(path)


def _two(scene: sb.Scene) -> tuple[sb.Body, sb.Body]:
    return scene.bodies["a"], scene.add_body("b", of=sb.Inertia.ball(1.0, 0.1), at=(0, 0, -1))


def _joint(kind: Callable[..., Any], **arguments: Any) -> Call:
    upper, lower = _two(bodies()[0])
    return kind, {"upper": upper, "lower": lower, "at": (0, 0, -0.5), "name": "j", **arguments}


def _rest() -> sb.Equilibrium:
    return sb.equilibrium(rope())


SCENE: dict[str, Callable[[], Call]] = {
    "Scene": lambda: (sb.Scene, {"name": "s", "gravity": (0, 0, -9.81)}),
    "Scene.add_particles": lambda: _with(
        sb.Scene(), "add_particles", positions=np.eye(3), mass=1.0, velocity=np.eye(3)
    ),
    "Scene.add_constraints": lambda: _with(
        _particles(),
        "add_constraints",
        kind="distance",
        particles=[[0, 1]],
        name="g",
        compliance=1e-3,
        damping=1e-3,
        rest=1.0,
    ),
    "Scene.add_constraints viscous": lambda: _with(
        _particles(),
        "add_constraints",
        kind="hinge",
        particles=[[0, 1, 2]],
        viscosity=1e-3,
        normal=(0, 1, 0),
        rest=None,
    ),
    "Scene.add_body": lambda: _with(
        sb.Scene(),
        "add_body",
        name="a",
        mass=1.0,
        inertia=np.eye(3),
        center=(0, 0, 0),
        at=(0, 0, 1),
        rotation=(0, 0, 0.1),
        velocity=(0, 0, 0),
        spin=(0, 0, 0),
        drag=1.0,
        turn_drag=1.0,
    ),
    "Scene.add_body of": lambda: _with(sb.Scene(), "add_body", of=sb.Inertia.ball(1.0, 0.1)),
    "Scene.add_body poses": lambda: _with(sb.Scene(), "add_body", of=sb.Inertia.ball(1.0, 0.1), poses=tool()),
    "Scene.add_force": lambda: _with(_particles(), "add_force", particles=[0], forces=np.ones((2, 1, 3)), times=[0, 1]),
    "Scene.add_point_mass": lambda: _with(_particles(), "add_point_mass", particle=0, mass=1.0, name="m"),
    "Scene.set_drag": lambda: _with(_particles(), "set_drag", linear=1.0, quadratic=1.0),
    "Scene.add_air": lambda: (
        lambda s: _with(
            s, "add_air", **_air(s), normal=1.0, tangential=0.1, wind=np.ones((2, 3)), times=[0, 1], name="c"
        )
    )(clothed()[0]),
    "Scene.add_pressure": lambda: (lambda s: _with(s, "add_pressure", **_air(s), pressure=1.0, name="c"))(clothed()[0]),
    "Scene.add_volume": lambda: _with(
        _balloon(), "add_volume", triangles=sb.mesh.icosphere(0.1, 0).triangles, compliance=1e-3, rest=1e-3, name="v"
    ),
    "Scene.add_contact": lambda: _touching(radius=0.01, stiffness=1e3, restitution=0.1, name="c"),
    "Scene.add_contact soft": lambda: _touching(stiffness=1e3, dissipation=0.1),
    "Scene.add_collisions": lambda: _with(
        _particles(), "add_collisions", what=[0, 1], radius=0.01, restitution=0.5, name="c"
    ),
    "Scene.add_collisions of several radii": lambda: _with(
        _particles(), "add_collisions", what=[0, 1], radius=[0.01, 0.02], restitution=0.5
    ),
    "Scene.add_contact of a body": lambda: (
        lambda s, b: _with(
            s, "add_contact", what=b, collider=sb.Plane(), friction=0.3, points=sb.box_corners((0.1, 0.1, 0.1))
        )
    )(*bodies()),
    "Scene.pin": lambda: _with(_particles(), "pin", particles=[0]),
    "Scene.drive": lambda: _with(_particles(), "drive", particles=[0], times=[0.0, 1.0], positions=np.zeros((2, 1, 3))),
    "Scene.add_quantity": lambda: _with(
        sb.Scene(), "add_quantity", name="q", value=1.0, unit="m", positive=True, scale=1.0, limits=(0.0, 2.0)
    ),
    "Scene.add_self_contact": lambda: (lambda s, c: _with(s, "add_self_contact", friction=0.3, radius=1e-3))(
        *clothed()
    ),
    "Scene.group": lambda: _with(rope(), "group", name="rope_bend"),
    "Body.point": lambda: (bodies()[1].point, {"at": (0, 0, 0.1), "along": (1, 0, 0), "name": "p"}),
    "Body.capsules": lambda: (bodies()[1].capsules, {"ends": [((0, 0, 0), (1, 0, 0))]}),
    "Body.turned": lambda: (bodies()[1].turned, {"way": (0, 0, 1)}),
    "Body.pose": lambda: (lambda s, b: (b.pose, {"motion": sb.simulate(s, TIMES, STEP), "values": None}))(*bodies()),
    "Body.angular_velocity": lambda: (lambda s, b: (b.angular_velocity, {"motion": sb.simulate(s, TIMES, STEP)}))(
        *bodies()
    ),
    "Body.angular_momentum": lambda: (
        lambda s, b: (b.angular_momentum, {"motion": sb.simulate(s, TIMES, STEP), "about": (0, 0, 0)})
    )(*bodies()),
    "Body.energy": lambda: (lambda s, b: (b.energy, {"motion": sb.simulate(s, TIMES, STEP)}))(*bodies()),
    "Plane": lambda: (sb.Plane, {"point": (0, 0, 0), "normal": UP}),
    "Sphere": lambda: (sb.Sphere, {"center": (0, 0, 0), "radius": 0.1}),
    "Capsule": lambda: (sb.Capsule, {"start": (0, 0, 0), "end": (1, 0, 0), "radius": 0.1}),
    "Cylinder": lambda: (sb.Cylinder, {"start": (0, 0, 0), "end": (1, 0, 0), "radius": 0.1, "edge_radius": 0.01}),
    "Box": lambda: (sb.Box, {"center": (0, 0, 0), "size": (1, 1, 1), "edge_radius": 0.01, "rotation": (0, 0, 0)}),
    "Box.moving": lambda: (
        sb.Sphere((0, 0, 0), 0.1).moving,
        {"times": KNOTS, "displacements": LINE, "rotations": LINE, "interpolation": "cubic"},
    ),
    "DistanceField": lambda: (
        sb.DistanceField,
        {
            "mesh": sb.mesh.icosphere(0.1, 0),
            "position": (0, 0, 0),
            "rotation": (0, 0, 0),
            "spacing": 0.02,
            "margin": 0.05,
        },
    ),
    "Inertia": lambda: (sb.Inertia, {"mass": 1.0, "matrix": np.eye(3), "center": (0, 0, 0)}),
    "Inertia.box": lambda: (sb.Inertia.box, {"mass": 1.0, "sides": (1, 1, 1)}),
    "Inertia.ball": lambda: (sb.Inertia.ball, {"mass": 1.0, "radius": 0.1}),
    "Inertia.cylinder": lambda: (sb.Inertia.cylinder, {"mass": 1.0, "radius": 0.1, "length": 0.2}),
    "Inertia.of_mesh": lambda: (sb.Inertia.of_mesh, {"mesh": sb.mesh.icosphere(0.1, 0), "density": 100.0}),
    "Inertia.welded": lambda: (sb.Inertia.welded, {"parts": [sb.Inertia.ball(1.0, 0.1)] * 2}),
    "Inertia.about": lambda: (sb.Inertia.ball(1.0, 0.1).about, {"point": (0, 0, 0)}),
    "Inertia.moved": lambda: (sb.Inertia.ball(1.0, 0.1).moved, {"at": (0, 0, 0), "rotation": (0, 0, 0.1)}),
    "box_corners": lambda: (sb.box_corners, {"sides": (1, 1, 1), "center": (0, 0, 0)}),
    "save_scene": lambda: (sb.save_scene, {"scene": rope(), "path": Path(mkdtemp(prefix="wrong_")) / "a.scene"}),
    "load_scene": lambda: (sb.load_scene, {"path": _file("a.scene", lambda p: sb.save_scene(rope(), p))}),
}

OBJECTS: dict[str, Callable[[], Call]] = {
    "rope": lambda: (
        sb.rope,
        {
            "length": 0.3,
            "segments": 4,
            "density": 0.05,
            "EA": 1e3,
            "EI": 1e-3,
            "name": "r",
            "gravity": (0, 0, -9.81),
            "pinned": (0,),
            "stretch_damping": 1e-3,
            "bend_damping": 1e-3,
            "drag_linear": 1e-3,
            "drag_quadratic": 1e-3,
            "velocity": np.zeros((5, 3)),
            "clamp_start": (1, 0, 0),
            "start": (0, 0, 0),
            "direction": (1, 0, 0),
            "plane": None,
        },
    ),
    "rope of points": lambda: (
        sb.rope,
        {
            "density": 0.05,
            "EI": 1e-3,
            "points": np.outer(np.arange(5), (0.1, 0, 0)),
            "loss_factor": 0.1,
            "loss_frequency": 2.0,
        },
    ),
    "rope in grips": lambda: (
        sb.rope,
        {
            "length": 0.3,
            "segments": 4,
            "density": 0.05,
            "EI": 1e-3,
            "pinned": (),
            "tilts": True,
            "shifts": True,
            "grip_start": sb.Grip.fixed((0, 0, 0), (1, 0, 0)),
            "grip_end": sb.Grip.fixed((0.3, 0, 0), (1, 0, 0)),
            "start_lead": 0.1,
            "end_lead": 0.1,
        },
    ),
    "rope with modes": lambda: (
        sb.rope,
        {
            "length": 0.3,
            "segments": 8,
            "density": 0.05,
            "EI": 1e-3,
            "plane": (0, 1, 0),
            "set_modes": (1, 2),
            "softness_modes": (1,),
        },
    ),
    "add_rope": lambda: (
        sb.add_rope,
        {"scene": sb.Scene(), "name": "r", "length": 0.3, "segments": 4, "density": 0.05, "EA": 1e3},
    ),
    "rod": lambda: (
        sb.rod,
        {
            "length": 0.3,
            "segments": 4,
            "density": 0.05,
            "EI": 1e-3,
            "GJ": 1e-3,
            "EA": 1e3,
            "GA": 1e2,
            "EI2": 2e-3,
            "name": "r",
            "gravity": (0, 0, -9.81),
            "start": sb.Grip.fixed((0, 0, 0), (1, 0, 0)),
            "director": (0, 0, 1),
            "stretch_damping": 1e-3,
            "bend_damping": 1e-3,
            "twist_damping": 1e-3,
            "shear_damping": 1e-3,
            "drag_linear": 1e-3,
            "drag_quadratic": 1e-3,
            "curvature_modes": (0,),
            "twist_modes": (0,),
            "softness_modes": (1,),
            "density_modes": (1,),
        },
    ),
    "rod that yields": lambda: (
        sb.rod,
        {
            "length": 0.3,
            "segments": 4,
            "density": 0.05,
            "EI": 1e-3,
            "GJ": 1e-3,
            "yield_curvature": 1.0,
            "yield_share": 0.5,
            "start": sb.Grip.fixed((0, 0, 0), (1, 0, 0)),
            "end": sb.Grip.fixed((0.3, 0, 0), (1, 0, 0)),
            "turns": 0,
            "tilts": True,
            "shifts": True,
            "roll": True,
            "slid_modes": (),
        },
    ),
    "rod of points": lambda: (
        sb.rod,
        {
            "length": 0.4,
            "segments": 4,
            "density": 0.05,
            "EI": 1e-3,
            "GJ": 1e-3,
            "points": np.outer(np.arange(5), (0.1, 0, 0)),
            "hold_roll": ("start",),
            "velocity": np.zeros((5, 3)),
        },
    ),
    "add_rod": lambda: (
        sb.add_rod,
        {"scene": sb.Scene(), "name": "r", "length": 0.3, "segments": 4, "density": 0.05, "EI": 1e-3, "GJ": 1e-3},
    ),
    "cloth": lambda: (
        sb.cloth,
        {
            "mesh": sheet(),
            **fabric(),
            "name": "c",
            "gravity": (0, 0, -9.81),
            "pinned": (0,),
            "bending_weft": 1e-4,
            "bending_twist": 1e-4,
            "law": sb.laws.Linear(),
            "velocity": np.zeros((16, 3)),
            "membrane_damping": 1e-3,
            "bend_damping": 1e-3,
            "drag_linear": 1e-3,
            "drag_quadratic": 1e-3,
            "held": (0,),
            "positions": sheet().vertices,
        },
    ),
    "cloth that yields": lambda: (
        sb.cloth,
        {"mesh": sheet(), **fabric(), "yield_curvature": 1.0, "yield_share": 0.5, "bending_model": "curvature"},
    ),
    "cloth of a size": lambda: (
        sb.cloth,
        {"mesh": sheet(), **fabric(), "warp_size": 1.0, "weft_size": 1.0, "stiffness_modes": 2},
    ),
    "add_cloth": lambda: (sb.add_cloth, {"scene": sb.Scene(), "mesh": sheet(), "name": "c", "fabric": "f", **fabric()}),
    "solid": lambda: (
        sb.solid,
        {
            "mesh": bricks(),
            "density": 1000.0,
            "name": "s",
            "gravity": (0, 0, -9.81),
            "pinned": (0,),
            "E": 1e6,
            "poisson": 0.3,
            "damping": 1e-3,
            "law": "strain",
            "held": (0,),
            "positions": bricks().vertices,
            "velocities": np.zeros((12, 3)),
        },
    ),
    "solid that yields": lambda: (
        sb.solid,
        {"mesh": bricks(), "density": 1000.0, "E": 1e6, "poisson": 0.3, "yield_stress": 1e4, "hardening": 1e4},
    ),
    "solid of clusters": lambda: (
        sb.solid,
        {
            "mesh": bricks(),
            "density": 1000.0,
            "E": 1e6,
            "clusters": sb.cluster_boxes(bricks(), 0.1),
            "stiffness_modes": 1,
        },
    ),
    "add_solid": lambda: (
        sb.add_solid,
        {
            "scene": sb.Scene(),
            "mesh": bricks(),
            "name": "s",
            "material": "m",
            "density": 1000.0,
            "orthotropic": sb.Orthotropic((1e6, 1e6, 1e6), (4e5, 4e5, 4e5)),
        },
    ),
    "cluster_boxes": lambda: (sb.cluster_boxes, {"mesh": bricks(), "size": 0.1}),
    "Orthotropic": lambda: (
        sb.Orthotropic,
        {"E": (1e6, 1e6, 1e6), "G": (4e5, 4e5, 4e5), "poisson": (0.1, 0.1, 0.1), "axes": np.eye(3)},
    ),
    "Fabric": lambda: (sb.Fabric, {**fabric(), "law": sb.laws.Linear(), "bending_weft": 1e-4, "bending_twist": 1e-4}),
    "laws.Sinh": lambda: (sb.laws.Sinh, {"warp": 1.0, "weft": 1.0, "shear": 1.0}),
    "laws.Spline": lambda: (sb.laws.Spline, {"spacing": (0.1, 0.1, 0.1), "warp": (1.0, 1.0, 1.0, 1.0)}),
    "add_tethers": lambda: (
        lambda s, c: (sb.add_tethers, {"scene": s, "cloth": c, "anchors": [0], "stretch": 0.1, "compliance": 1e-3})
    )(*clothed()),
    "add_unknown_force": lambda: (
        sb.add_unknown_force,
        {"scene": rope(), "particles": [2], "scale": 0.1, "spacing": 0.1, "duration": 0.2, "name": "push"},
    ),
    "add_unknown_wind": lambda: (
        sb.add_unknown_wind,
        {"scene": blown(), "scale": 0.1, "spacing": 0.1, "duration": 0.2, "name": "gust"},
    ),
    "add_mean": lambda: (
        sb.add_mean,
        {"scene": _particles(), "particles": [0, 1, 2], "weights": [1.0, 2.0, 1.0], "name": "middle", "mass": 1e-3},
    ),
    "add_arm": lambda: (
        sb.add_arm,
        {
            "scene": sb.Scene(),
            "name": "a",
            "mass": 1.0,
            "first_moment": 0.1,
            "inertia": 0.02,
            "length": 0.3,
            "pivot": (0, 0, 0),
            "angle": 0.1,
            "rate": 0.0,
            "viscosity": 1e-3,
            "friction": 1e-3,
            "slip_angle": 1e-3,
            "drag": 1e-3,
        },
    ),
    "add_pendulum": lambda: (
        sb.add_pendulum,
        {"scene": sb.Scene(), "name": "p", "length": 0.3, "mass": 1.0, "pivot": (0, 0, 0), "angle": 0.1, "rate": 0.0},
    ),
    "Arm.place": lambda: (sb.add_pendulum(sb.Scene(), length=0.3).place, {"radius": 0.1}),
    "ground": lambda: (sb.ground, {"scene": sb.Scene()}),
    "ball": lambda: _joint(sb.ball, compliance=1e-6),
    "hinge": lambda: _joint(
        sb.hinge,
        axis=(0, 1, 0),
        rate=0.0,
        stiffness=1.0,
        rest=0.0,
        viscosity=1e-3,
        friction=1e-3,
        slip_angle=1e-3,
        limits=(-1, 1),
        limit_stiffness=10.0,
        limit_damping=1e-3,
        limit_depth=1e-3,
    ),
    "hinge with a servo": lambda: _joint(sb.hinge, axis=(0, 1, 0), servo=(KNOTS, KNOTS)),
    "hinge with a motor": lambda: _joint(sb.hinge, axis=(0, 1, 0), torque=(KNOTS, KNOTS), rotor=1e-3),
    "hinge that gives way": lambda: _joint(sb.hinge, axis=(0, 1, 0), tilt_stiffness=10.0, tilt_damping=1e-3),
    "slider": lambda: _joint(
        sb.slider, axis=UP, rate=0.0, limits=(-1, 1), limit_stiffness=1e3, limit_damping=1e-3, limit_depth=1e-3
    ),
    "cylinder": lambda: _joint(sb.cylinder, axis=UP, rate=0.0, turn_rate=0.0),
    "universal": lambda: _joint(sb.universal, axes=[(1, 0, 0), (0, 1, 0)]),
    "fixed": lambda: _joint(sb.fixed),
    "attach": lambda: (
        lambda scene, body: (sb.attach, {"body": body, "particles": scene.add_particles(np.eye(3), 1.0), "name": "g"})
    )(*bodies()),
    "Joint.angle": lambda: (
        lambda call: (call[0](**call[1]).angle, {"motion": sb.simulate(call[1]["upper"].scene, TIMES, STEP)})
    )(_joint(sb.hinge, axis=(0, 1, 0))),
    "Junction.facing": lambda: (sb.Junction().facing, {"direction": (1, 0, 0)}),
    "Grip.fixed": lambda: (sb.Grip.fixed, {"position": (0, 0, 0), "direction": (1, 0, 0), "director": UP}),
    "Grip.from_poses": lambda: (
        sb.Grip.from_poses,
        {
            "times": KNOTS,
            "positions": LINE,
            "quaternions": TURNS,
            "direction": (1, 0, 0),
            "director": UP,
            "offset": (0, 0, 0),
            "frame": sb.HandEye("h"),
        },
    ),
    "Grip.from_markers": lambda: (
        sb.Grip.from_markers,
        {
            "times": KNOTS,
            "first": LINE,
            "second": LINE + np.array([0.01, 0, 0]),
            "end": False,
            "nominal": (1, 0, 0),
            "director": UP,
        },
    ),
    "Grip.from_body": lambda: (
        sb.Grip.from_body,
        {
            "times": KNOTS,
            "markers": LINE[:, None] + np.eye(3),
            "position": (0, 0, 0),
            "direction": (1, 0, 0),
            "director": UP,
        },
    ),
    "Grip.smoothed": lambda: (sb.Grip.from_poses(KNOTS, LINE, TURNS).smoothed, {"width": 0.02}),
    "HandEye": lambda: (
        sb.HandEye,
        {"name": "h", "position": (0, 0, 0), "quaternion": (0, 0, 0, 1), "about": (0, 0, 0)},
    ),
    "HandEye.points": lambda: (sb.HandEye("h").points, {"x": LINE}),
    "HandEye.parameters": lambda: (sb.HandEye("h").parameters, {"shift": 0.1, "turn": 0.1}),
    "Tool": lambda: (
        sb.Tool,
        {
            "times": KNOTS,
            "positions": LINE,
            "quaternions": TURNS,
            "frame": sb.HandEye("h"),
            "flex": 1e-4,
            "rod": (1, 0, 0),
        },
    ),
    "Tool.load": lambda: (
        sb.Tool.load,
        {
            "path": _file("t.npz", lambda p: np.savez(p, times=KNOTS, positions=LINE, quaternions=TURNS)),
            "frame": sb.HandEye("h"),
            "flex": 1e-4,
            "rod": (1, 0, 0),
            "body": None,
        },
    ),
    "Tool.shifted": lambda: (tool().shifted, {"t0": 0.1}),
    "Tool.between": lambda: (tool().between, {"start": 0.0, "stop": 0.03}),
    "Tool.path": lambda: (tool().path, {"points": np.eye(3)}),
    "Tool.placed": lambda: (tool().placed, {"points": np.eye(3), "time": 0.01}),
    "Tool.held": lambda: (tool().held, {"x": np.eye(3), "time": 0.01}),
    "Tool.drive": lambda: (tool().drive, {"scene": _particles(), "particles": [0], "points": np.zeros((1, 3))}),
    "Tool.carry": lambda: (tool().carry, {"collider": sb.Plane()}),
    "on_particle": lambda: (sb.on_particle, {"particle": 1}),
    "between": lambda: (sb.between, {"first": 0, "second": 1, "fraction": 0.5}),
    "on_rope": lambda: (sb.on_rope, {"rope": rope().ropes["rope"], "arc_length": 0.1, "interpolation": "cubic"}),
    "along_rope": lambda: (sb.along_rope, {"rope": rope().ropes["rope"], "count": 3, "interpolation": "cubic"}),
    "on_cloth": lambda: (sb.on_cloth, {"cloth": clothed()[1], "points": [(0.05, 0.05)]}),
    "on_solid": lambda: (sb.on_solid, {"solid": solids()[1], "points": [(0.05, 0.05, 0.05)]}),
    "on_body": lambda: (sb.on_body, {"body": bodies()[1], "points": np.eye(3)}),
    "Place.with_offset": lambda: (sb.on_particle(1).with_offset, {"offset": (0, 0, 0), "normal": (0, 1, 0)}),
    "mesh.grid": lambda: (sb.mesh.grid, {"width": 0.2, "height": 0.2, "nx": 2, "ny": 2, "pattern": "one_way"}),
    "mesh.equilateral": lambda: (sb.mesh.equilateral, {"width": 0.2, "height": 0.2, "n": 2}),
    "mesh.disk": lambda: (sb.mesh.disk, {"radius": 0.1, "rings": 2}),
    "mesh.icosphere": lambda: (sb.mesh.icosphere, {"radius": 0.1, "subdivisions": 0}),
    "mesh.bricks": lambda: (sb.mesh.bricks, {"size": (0.2, 0.1, 0.1), "cells": (2, 1, 1), "at": (0, 0, 0)}),
    "mesh.bricks_around": lambda: (sb.mesh.bricks_around, {"surface": sb.mesh.icosphere(0.1, 1), "size": 0.05}),
    "mesh.tetrahedra": lambda: (sb.mesh.tetrahedra, {"size": (0.2, 0.1, 0.1), "cells": (2, 1, 1), "at": (0, 0, 0)}),
    "mesh.renumbered": lambda: (sb.mesh.renumbered, {"mesh": sheet()}),
    "mesh.unfold": lambda: (
        sb.mesh.unfold,
        {"vertices": sheet().vertices, "triangles": sheet().triangles, "warp": (1, 0, 0)},
    ),
    "mesh.TriangleMesh": lambda: (
        sb.TriangleMesh,
        {"vertices": np.eye(3), "triangles": [[0, 1, 2]], "material": [(0, 0), (1, 0), (0, 1)], "sets": {"a": [0]}},
    ),
    "mesh.SolidMesh": lambda: (
        sb.SolidMesh,
        {"vertices": bricks().vertices, "elements": bricks().elements, "sets": {"a": [0]}, "fill": np.ones(2)},
    ),
    "read_mesh": lambda: (sb.read_mesh, {"path": _file("a.obj", lambda p: sb.mesh.write_obj(p, sheet()))}),
    "mesh.write_obj": lambda: (sb.mesh.write_obj, {"path": Path(mkdtemp(prefix="wrong_")) / "a.obj", "mesh": sheet()}),
    "mesh.write_ply": lambda: (sb.mesh.write_ply, {"path": Path(mkdtemp(prefix="wrong_")) / "a.ply", "mesh": sheet()}),
}

RECORDINGS: dict[str, Callable[[], Call]] = {
    "Recording": lambda: (
        sb.Recording,
        {
            "positions": np.ones((3, 2, 3)),
            "times": TIMES,
            "markers": ["a", "b"],
            "clamped": [0],
            "name": "r",
            "gravity": (0, 0, -9.81),
            "metadata": {"length": 0.3},
        },
    ),
    "Recording.load": lambda: (
        sb.Recording.load,
        {"path": _file("a.csv", lambda p: recording().save(p)), "units": None},
    ),
    "Recording.from_poses": lambda: (
        sb.Recording.from_poses,
        {
            "times": KNOTS,
            "positions": LINE,
            "quaternions": TURNS,
            "points": np.eye(3),
            "markers": ["a", "b", "c"],
            "name": "r",
        },
    ),
    "Recording.save": lambda: (recording().save, {"path": Path(mkdtemp(prefix="wrong_")) / "a.csv"}),
    "Recording.piece": lambda: (recording().piece, {"start": 0.0, "stop": 0.01}),
    "Recording.frames": lambda: (recording().frames, {"which": slice(0, 2)}),
    "Recording.hidden": lambda: (recording().hidden, {"spans": [(0.0, 0.01)]}),
    "Recording.compared": lambda: (recording().compared, {"markers": [0, 1], "name": "part"}),
    "Recording.select": lambda: (recording().select, {"markers": [0, 1]}),
    "Recording.resample": lambda: (recording().resample, {"times": TIMES, "kind": "linear", "max_gap": 0.1}),
    "Recording.shifted": lambda: (recording().shifted, {"t0": 0.1}),
    "Recording.filled": lambda: (recording().filled, {"max_gap": 0.1}),
    "Cloud.of": lambda: (sb.Cloud.of, {"points": [np.eye(3), np.eye(3)], "times": [0.0, 0.1], "name": "c"}),
    "Cloud.load": lambda: (sb.Cloud.load, {"path": _file("a.npz", lambda p: cloud().save(p)), "units": None}),
    "Cloud.frame": lambda: (cloud().frame, {"number": 0}),
    "Cloud.named": lambda: (cloud().named, {"name": "c"}),
    "Cloud.thinned": lambda: (cloud().thinned, {"most": 2, "seed": 0}),
    "Cloud.to_axis": lambda: (cloud().to_axis, {"camera": (0, 0, 3), "radius": 0.01}),
    "ForceRecording": lambda: (
        sb.ForceRecording,
        {"times": KNOTS, "forces": LINE, "torques": LINE, "quaternions": TURNS, "name": "f"},
    ),
    "ForceRecording.load": lambda: (sb.ForceRecording.load, {"path": _file("f.npz", lambda p: readings().save(p))}),
    "ForceRecording.save": lambda: (readings().save, {"path": Path(mkdtemp(prefix="wrong_")) / "f.npz"}),
    "read_recordings": lambda: (
        sb.read_recordings,
        {
            "folder": Path(_file("a.csv", lambda p: recording().save(p))).parent,
            "pattern": "*",
            "units": None,
            "refused": {},
        },
    ),
    "start_of_poses": lambda: (
        sb.start_of_poses,
        {"times": KNOTS, "positions": LINE, "quaternions": TURNS, "gravity": (0, 0, 0), "time": 0.01},
    ),
    "baseline": lambda: (sb.baseline, {"fitted": recording(), "held_out": recording(), "more": None}),
    "coordinate_error": lambda: (
        sb.coordinate_error,
        {"recording": recording(), "predicted": recording().positions, "given": 1},
    ),
    "scores": lambda: (sb.scores, {"recordings": [recording()], "predicted": [recording().positions], "given": 1}),
}

MOTION: dict[str, Callable[[], Call]] = {
    "Solver": lambda: (
        sb.Solver,
        {
            "h": 0.01,
            "integrator": "bdf2",
            "method": "direct",
            "iterations": 2,
            "threads": 1,
            "grain": 16,
            "force_tolerance": 1e-9,
            "cg_tolerance": 1e-9,
            "cg_iterations": 10,
            "memory": "1 GB",
            "extrapolate": 1,
        },
    ),
    "Solver.with_h": lambda: (STEP.with_h, {"h": 0.02}),
    "simulate": lambda: (
        sb.simulate,
        {"scene": rope(), "times": TIMES, "solver": STEP, "values": {"rope_EI": 1e-3}, "start": rope().positions},
    ),
    "rollout": lambda: (sb.rollout, {"scene": rope(), "times": TIMES, "solver": STEP, "values": {"rope_EI": 1e-3}}),
    "Rollout.gradient": lambda: (sb.rollout(rope(), TIMES, STEP).gradient, {"positions_bar": np.ones((3, 5, 3))}),
    "Gradient.require": lambda: (
        sb.rollout(rope(), TIMES, STEP).gradient(np.ones((3, 5, 3))).require,
        {"scales": {"rope_EI": 1e-3}},
    ),
    "check_gradients": lambda: (
        sb.check_gradients,
        {
            "scene": rope(),
            "times": TIMES[:2],
            "solver": STEP,
            "samples": 1,
            "seed": 0,
            "values": {"rope_EI": 1e-3},
            "seconds": 1.0,
        },
    ),
    "tape_plan": lambda: (sb.tape_plan, {"scene": rope(), "times": TIMES, "solver": STEP, "scenes": 1}),
    "equilibrium": lambda: (
        sb.equilibrium,
        {"scene": rope(), "start": rope().positions, "values": {"rope_EI": 1e-3}, "stable": True},
    ),
    "equilibria": lambda: (
        sb.equilibria,
        {"scene": rope(), "starts": [rope().positions], "values": {"rope_EI": 1e-3}, "tolerance": 1e-6},
    ),
    "Equilibrium.gradient": lambda: (
        _rest().gradient,
        {"positions_bar": np.ones((5, 3)), "forces_bar": {}, "pressures_bar": {}},
    ),
    "support_forces": lambda: (sb.support_forces, {"rest": _rest()}),
    "elastic_energy": lambda: (
        sb.elastic_energy,
        {"scene": rope(), "positions": rope().positions, "values": {"rope_EI": 1e-3}},
    ),
    "constraint_values": lambda: (
        sb.constraint_values,
        {"scene": rope(), "positions": rope().positions, "values": {"rope_EI": 1e-3}},
    ),
    "force_balance": lambda: (
        sb.force_balance,
        {"scene": rope(), "end": 0.02, "solver": sb.Solver(h=0.01, method="implicit"), "values": {"rope_EI": 1e-3}},
    ),
    "simulate_forces": lambda: (
        sb.simulate_forces,
        {"scene": rope(), "times": TIMES[1:], "at": [0], "solver": STEP, "values": {"rope_EI": 1e-3}, "start": "given"},
    ),
}

FITS: dict[str, Callable[[], Call]] = {
    "Experiment": lambda: (
        sb.Experiment,
        experiment(
            name="e",
            markers=[sb.on_particle(k) for k in range(5)],
            fit=(0.0, 0.02),
            held_out=None,
            static=False,
            start="given",
            start_time=0.0,
            time_offset=None,
            offsets={},
            driven_sigma=None,
            axes="xyz",
            radius=None,
            loss="squares",
            loss_scale=1.0,
            predict=None,
            forces=(),
            shooting=None,
        ),
    ),
    "ForceSensor": lambda: (
        sb.ForceSensor,
        {
            "recording": readings(),
            "at": [0],
            "sigma": 0.01,
            "name": "f",
            "torque_sigma": None,
            "axes": "xyz",
            "torque_axes": "xyz",
            "reads": "support",
            "quaternion": (0, 0, 0, 1),
            "arm": (0, 0, 0),
            "average": 0.0,
            "bias": False,
            "torque_bias": False,
            "tool": False,
            "time_offset": None,
        },
    ),
    "Shooting": lambda: (sb.Shooting, {"window": 0.1, "loss": 1.0, "behind": 0.1, "pace": 1.0, "steps": 3}),
    "Refinement": lambda: (sb.Refinement, {"halve_step": True, "finer": None, "linear": False}),
    "Smooth": lambda: (sb.Smooth, {"size": 0.1, "length": 0.1}),
    "Parameter": lambda: (
        sb.Parameter,
        {
            "name": "rope_EI",
            "initial": 1e-3,
            "lower": 1e-4,
            "upper": 1e-2,
            "log": True,
            "fixed": False,
            "tied_to": None,
            "factor": 1.0,
            "prior": (1e-3, 1e-4),
            "unit": "N m^2",
            "private": False,
            "scale": 1e-3,
        },
    ),
    "Parameters": lambda: (sb.Parameters, {"parameters": [sb.Parameter(name="a", initial=1.0)]}),
    "fit": lambda: (
        sb.fit,
        experiment(
            parameters=["rope_EI"],
            optimizer="scipy",
            starts=(),
            windows=(),
            tolerance=1e-3,
            refine=False,
            given={},
            smooth=None,
            leave_one_out=False,
            profiles=False,
            bootstrap=0,
            beginnings=False,
            max_iterations=1,
            threads=1,
            progress=None,
            journal=None,
            executor=None,
            markers=[sb.on_particle(k) for k in range(5)],
        ),
    ),
    "identify": lambda: (
        sb.identify,
        experiment(
            parameters=["rope_EI"],
            noise=1e-3,
            autocorrelation=0.0,
            instead=None,
            smooth=None,
            suggest=False,
            threads=1,
            markers=[sb.on_particle(k) for k in range(5)],
        ),
    ),
    "fit_many": lambda: (
        sb.fit_many,
        {
            "experiments": [sb.Experiment(**experiment(name=f"e{k}")) for k in range(20)],
            "parameters": ["rope_EI"],
            "max_iterations": 1,
            "progress": None,
            "executor": None,
        },
    ),
}

CALLS = {**SCENE, **OBJECTS, **RECORDINGS, **MOTION, **FITS, **BESIDE, **MORE}
