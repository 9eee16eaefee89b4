"""Every input of a scene and of an experiment is a quantity, is told among the given values, or is left out for a
reason that stands here."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.config.schema import GivenSection
from sheetbend.doubts.given import check_given
from sheetbend.doubts.told import GROUPS, told_numbers
from sheetbend.doubts.told_inputs import told_inputs
from sheetbend.experiment.force_sensor import INPUTS
from sheetbend.experiment.wanted import as_parameters
from sheetbend.problem.problem import FitProblem

Array = np.ndarray
TIMES, SOLVER = np.arange(6) / 60, sb.Solver(h=1 / 240)
KNOTS = np.linspace(0.0, 0.2, 9)

TOLD_ELSEWHERE = {
    "boundary": ("drive_place", "drive_size", "recording_clock", "recording_delay"),
}
"""Inputs whose errors are told by what the simulated markers do (`told._observe`)."""
LEFT_OUT = {
    "position": "of what is free: where a motion starts is seen by its markers, and start = 'estimated' fits it",
    "compliance": "one number for a group is a quantity; ropes, cloths and solids make arrays of quantities, and those "
    "of scenes built by hand stay as given",
    "damping": "as of compliance",
    "rest": "as of compliance: lengths of ropes are quantities; the flat size of a cloth is asked by doubts.cloth_size",
    "load": "no scene that Python builds has any: sheetbend.torch gives them to single substeps",
    "contact_weight": "where points of bodies touch: as given in the body's frame, whose center is quantities",
    "collider_pose": "its place is quantities; how it moves from there is measured where it is a tool's",
}
"""Inputs that are not told, and why."""
EXPERIMENT = {
    "scene": "its inputs are walked below",
    "recording": ("recording_clock", "recording_delay", "recording_size"),
    "name": "a word",
    "markers": ("markers", "marker_offset", "marker_mass"),
    "fit": "says what is seen",
    "held_out": "says what is predicted",
    "solver": "refine tells what its discretization changes",
    "static": "says what the recording shows",
    "start": "says how the scene starts",
    "start_time": ("recording_delay",),
    "time_offset": "a quantity",
    "offsets": "quantities",
    "sigma": "intervals are scaled by the residuals",
    "driven_sigma": "the report tells the noise of what drives a scene",
    "axes": "says what is compared",
    "radius": "scales what is printed",
    "loss": "a choice",
    "loss_scale": "a choice",
    "predict": "a choice",
    "forces": "their fields are walked below",
    "shooting": "a choice",
}
SENSOR = {
    "recording": ("force_size", "force_delay"),
    "at": "says where it is",
    "sigma": "intervals are scaled by the residuals",
    "name": "a word",
    "torque_sigma": "as sigma",
    "axes": "says what is compared",
    "torque_axes": "says what is compared",
    "reads": "a choice of sign, which a fit to the wrong one shows",
    "quaternion": ("force_direction",),
    "arm": "1 mm of it changes a torque by 1 mm of the force, which is below most sigmas; forces do not depend on it",
    "average": "half of it is a delay: force_delay",
    "bias": "quantities; otherwise force_zero and torque_zero",
    "torque_bias": "quantities",
    "tool": "quantities",
    "time_offset": "a quantity; otherwise force_delay",
}


def swung() -> sb.Scene:
    """A rope in a moving grip with a load, a drag and a speed, on a table that rubs, with what hangs on it."""
    quaternions = np.stack([0 * KNOTS, np.sin(KNOTS), 0 * KNOTS, np.cos(KNOTS)], axis=1)
    path = np.stack([KNOTS, 0 * KNOTS, 1.0 + KNOTS**2], axis=1)
    points = np.stack([np.linspace(0.0, 0.4, 9), np.zeros(9), np.ones(9)], axis=1)
    own = {"density": 0.05, "EI": 1e-3, "bend_damping": 0.01, "drag_linear": 0.01, "drag_quadratic": 0.01}
    grip = sb.Grip.from_poses(KNOTS, path, quaternions)
    v = np.linspace(0.0, 1.0, 9)[:, None] * [0.0, 0.1, 0.0]
    scene = sb.rope(0.4, 8, grip_start=grip, points=points, velocity=v, pinned=(), **own)
    scene.add_point_mass(8, 0.01, "knot")
    scene.add_force([8], np.tile([[[0.0, 0.1, 0.0]]], (len(KNOTS), 1, 1)), KNOTS)
    table = sb.Plane((0.0, 0.0, 0.5), (0.0, 0.0, 1.0), name="table")
    scene.add_contact(scene.ropes["rope"], table, friction=0.3, radius=0.005, stiffness=1e3, dissipation=0.1)
    return scene


def rod() -> sb.Scene:
    grips = {"start": sb.Grip.fixed([0, 0, 0], [1, 0, 0]), "end": sb.Grip.fixed([0.35, 0, 0], [1, 0, 0])}
    x = np.linspace(0.0, 0.35, 30)
    points = np.stack([x, 0 * x, -0.08 * np.sin(np.pi * x / 0.35) ** 2], axis=1)
    return sb.rod(0.4, 8, density=0.05, EI=1e-3, GJ=1e-3, bend_damping=0.01, points=points, **grips)


def flag() -> sb.Scene:
    """A cloth in the wind under a pressure; each triangle has its own."""
    mesh = sb.mesh.grid(0.3, 0.3, 3, 3, pattern="one_way")
    scene = sb.Scene("flag")
    cloth = sb.add_cloth(scene, mesh, density=0.1, warp=40.0, shear=10.0, bending=1e-5, name="cloth")
    scene.pin(cloth.particles[mesh.sets["top"]])
    scene.add_air(mesh.triangles, 0.6 + 0 * mesh.triangles[:, 0], 0.1, wind=(1.0, 0.0, 0.0))
    scene.add_pressure(mesh.triangles, np.full(len(mesh.triangles), 1e-3))
    return scene


def by_hand() -> sb.Scene:
    """Masses on springs, one of which is driven, and a body that a force pushes."""
    scene = sb.Scene("springs")
    particles = scene.add_particles([[0, 0, 0], [0.1, 0, 0], [0.2, 0, 0]], 0.01, [[0, 0, 0], [0, 0.1, 0], [0, 0, 0.1]])
    scene.add_constraints("distance", [[0, 1], [1, 2]], compliance=1e-3, damping=1e-3)
    scene.set_drag(linear=0.01, quadratic=0.02)
    scene.drive(particles[:1], KNOTS, np.stack([KNOTS, 0 * KNOTS, 0 * KNOTS], axis=1)[:, None])
    body = scene.add_body("block", mass=0.1, inertia=[1e-3, 1e-3, 1.5e-3], velocity=(0.1, 0, 0), drag=0.01)
    scene.add_force(body.point((0.1, 0, 0)), (0.0, 0.0, 1.0))
    return scene


def bag() -> sb.Scene:
    scene = sb.Scene("bag")
    scene.add_particles([[0, 0, 0.1], [0.1, 0, 0.1], [0, 0.1, 0.1], [0, 0, 0.2]], 0.01)
    scene.add_constraints("distance", [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]], compliance=1e-3)
    scene.add_volume([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], compliance=1e-6)
    return scene


def dropped() -> sb.Scene:
    """A rope above a ball off which it bounces, a body above a floor, and two marbles that hit each other."""
    scene = sb.rope(0.1, 3, density=0.05, EI=1e-3, points=[[0, 0, 0.1], [0.1, 0, 0.1]], pinned=())
    floor = sb.Plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), name="floor")
    ball = sb.Sphere((0.0, 0.0, -0.5), 0.5, name="ball")
    scene.add_contact(scene.ropes["rope"], ball, friction=0.3, radius=0.01, restitution=0.5)
    marbles = scene.add_particles([[0, 1, 0.5], [0.1, 1, 0.5]], 0.01, [[1.0, 0, 0], [-1.0, 0, 0]])
    scene.add_collisions(marbles, radius=0.01, restitution=0.5, name="marbles")
    body = scene.add_body("block", mass=0.1, inertia=[1e-3, 1e-3, 1.5e-3], at=(1, 0, 0.3))
    scene.add_contact(body, floor, friction=0.3, points=[[0.1, 0, 0], [-0.1, 0, 0]], name="corners")
    return scene


SCENES: dict[str, tuple[Callable[[], sb.Scene], str]] = {
    "swung": (swung, "rope_EI"),
    "rod": (rod, "rod_EI"),
    "flag": (flag, "cloth_warp"),
    "by hand": (by_hand, "distance_compliance"),
    "bag": (bag, "distance_compliance"),
    "dropped": (dropped, "rope_EI"),
}


def problem_of(scene: sb.Scene, parameter: str) -> FitProblem:
    seen = np.flatnonzero(~np.isin(np.arange(scene.particle_count), [*scene.held]))[-3:].tolist()
    recording = sb.Recording(positions=np.tile(scene.positions[seen], (len(TIMES), 1, 1)), times=TIMES, name="seen")
    solver = sb.Solver(h=SOLVER.h, method="implicit") if scene.contacts.contacts else SOLVER
    places = [sb.on_particle(p) for p in seen]
    e = sb.Experiment(scene=scene, recording=recording, markers=places, solver=solver)
    return FitProblem([e], as_parameters([parameter], [e]))


def test_the_lists_know_every_array() -> None:
    """A new input array of the core has to be told, or to be left out for a reason."""
    problems = [problem_of(scene(), parameter) for scene, parameter in SCENES.values()]
    told = {array for problem in problems for array in _told(problem)}
    made = {t.array for p in problems for t in p.experiments[0].scene.every_term if t.quantities}
    every = set(problems[0].experiments[0].scene.compiled.layout)
    assert every - told - made - {*LEFT_OUT, *TOLD_ELSEWHERE} == set()
    for groups in (*TOLD_ELSEWHERE.values(), *EXPERIMENT.values(), *SENSOR.values()):
        assert isinstance(groups, str) or set(groups) <= set(GROUPS)


def _told(problem: FitProblem) -> dict[str, set[int]]:
    """By array the entries that a told number changes."""
    u, (e,) = problem.parameters.initial(), problem.experiments
    theta, slots, _ = problem.known(u)
    own = theta[slots[0]]
    found: dict[str, set[int]] = {}
    for one in told_inputs(e, own):
        added = one.added if isinstance(one.added, list) else [one.added]
        for each in added:
            array, at, _ = each if isinstance(each, tuple) else ("gravity", np.arange(3), each)
            found.setdefault(array, set()).update(np.ravel(at).tolist())
    return found


@pytest.mark.parametrize("which", SCENES)
def test_every_number_of_a_scene_is_told_or_left_out_for_a_reason(which: str) -> None:
    made, parameter = SCENES[which]
    problem = problem_of(made(), parameter)
    scene = problem.experiments[0].scene
    compiled, told = scene.compiled, _told(problem)
    inputs, map_ = compiled.inputs(), compiled.map()
    named = set(map_["target"][np.diff(map_["first_factor"]) > 0].tolist())
    free = set(scene.free_nodes.tolist())
    forgotten = []
    for array, (first, size) in compiled.layout.items():
        for k in np.flatnonzero(inputs[first : first + size]).tolist():
            if first + k in named or k in told.get(array, ()):
                continue
            node = k // 3 if array in ("position", "velocity") else k
            if array in ("position", "velocity") and node not in free:
                continue  # what is held stands still, its places are told by the markers
            if array in ("mass", "drag_linear", "drag_quadratic") and node not in free:
                continue  # what is held does not feel them
            if array == "mass" and node >= scene.particle_count:
                continue  # small numbers that keep frames and stubs well posed
            if array not in LEFT_OUT and array not in TOLD_ELSEWHERE:
                forgotten.append((array, k))
    assert not forgotten


@pytest.mark.parametrize("which", SCENES)
def test_every_quantity_is_told(which: str) -> None:
    made, parameter = SCENES[which]
    problem = problem_of(made(), parameter)
    told, why = told_numbers(problem, problem.parameters.initial())
    assert not why
    known = {one.name for one in told} | {parameter}
    assert set(problem.experiments[0].scene.quantities) <= known


def test_every_field_is_told_or_left_out_for_a_reason() -> None:
    assert {f.name for f in fields(sb.Experiment)} == set(EXPERIMENT)
    assert {f.name for f in fields(sb.ForceSensor) if not f.name.startswith("_")} == set(SENSOR)
    assert INPUTS == 11  # biases, mass, center and clock: quantities


def test_every_name_stands_where_users_look_for_it() -> None:
    """In the help of a fit, in that of a configuration, and a standard deviation of it is taken."""
    problem = problem_of(rod(), "rod_EI")
    for name in GROUPS:
        assert f'"{name}"' in (sb.fit.__doc__ or ""), name
        assert f'"{name}"' in (GivenSection.__doc__ or ""), name
        check_given({name: 0.01}, problem)
