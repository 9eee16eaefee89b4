"""Given numbers that change inputs of a scene and are not quantities: gravity, colliders, what drives a scene, grips,
loads, the speed at the start, and the mass of markers."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from ..arrays.types import Array
from ..experiment.experiment import Experiment
from ..quantities.wording import short
from .held_directions import held_directions
from .isotropy import alike
from .marker_mass import MOST_EACH, marker_load, unseen_mass
from .tangents import Input

AXES = "xyz"
DEGREE, MILLIMETER = math.pi / 180.0, 1e-3
PERCENT = (0.01, "1 %")
OF_LOSSES = (0.1, "10 %")  # and of friction: such numbers are estimated rather than measured
STEPS = {"rad": (DEGREE, "1 degree"), "m": (MILLIMETER, "1 mm"), "s": (1e-3, "1 ms")}
GROUPS: Mapping[str, tuple[str, tuple[float, str]]] = {
    "gravity": ("rad", STEPS["rad"]),
    "gravity_size": ("", (3e-3, "0.3 %")),  # what it differs by on Earth
    "collider_direction": ("rad", STEPS["rad"]),
    "drive_size": ("", PERCENT),
    "grip_direction": ("rad", STEPS["rad"]),
    "load_direction": ("rad", STEPS["rad"]),
    "load_size": ("", PERCENT),
    "start_speed": ("", PERCENT),
    "unnamed": ("", PERCENT),
    "isotropy": ("", (0.1, "10 %")),
    "marker_mass": ("kg", (MOST_EACH, f"{short(1e3 * MOST_EACH)} g each")),
}
"""Unit ("" where it is relative) and step, as in `told.GROUPS`."""
SIZE, FARTHER, WEIGHTS = "size of gravity", "size of driven motion", "mass of each marker"
LOADS, SPEED = "size of the loads", "speed at the start"
UNNAMED = {
    "mass": "masses without a name",
    "drag_linear": "linear drag without a name",
    "drag_quadratic": "quadratic drag without a name",
    "air_normal": "air_normal without a name",
    "air_tangential": "air_tangential without a name",
    "pressure": "pressures without a name",
}
"""Plain numbers of input arrays, by array, and what they are called."""
Says = Callable[[float], str]


@dataclass(frozen=True)
class ToldInput:
    """One such number.

    Attributes:
        name, label, unit, step: as of `told.Told`.
        added: what one unit of it adds to inputs; to gravity (3,) m/s^2.
        says: what a size of it says; None where `told_words` does.
    """

    name: str
    label: str
    unit: str
    step: tuple[float, str]
    added: Array | Input | list[Input]
    says: Says | None = None


def told_inputs(e: Experiment, theta: Array) -> list[ToldInput]:
    """All of one experiment.

    Args:
        theta: (quantities,) of its scene.
    """
    inputs = e.scene.compiled.inputs(theta)
    return [
        one
        for found in (
            _gravity(e),
            _colliders(e),
            _path(e, inputs),
            _grips(e, inputs),
            _loads(e, theta),
            _speed(e),
            _unnamed(e),
            (_made("isotropy", one.label, one.added, one.says) for one in alike(e.scene, inputs)),
            _weights(e, inputs),
        )
        for one in found
    ]


def gravity_turns(e: Experiment) -> dict[int, Array]:
    """Of the two axes that lie most across gravity, what a turn toward each changes of it, m/s^2 per rad."""
    g = e.scene.gravity
    size = float(np.linalg.norm(g))
    if size == 0.0:
        return {}
    down = g / size
    toward = {}
    for axis in sorted(np.argsort(np.abs(down), kind="stable")[:2].tolist()):
        across = np.eye(3)[axis] - down[axis] * down
        toward[axis] = size * across / np.linalg.norm(across)
    return toward


def _made(name: str, label: str, added: Array | Input | list[Input], says: Says | None = None) -> ToldInput:
    return ToldInput(name, label, *GROUPS[name], added, says)


def _gravity(e: Experiment) -> Iterator[ToldInput]:
    toward = gravity_turns(e)
    for axis, by in toward.items():
        yield _made("gravity", f"gravity toward {AXES[axis]}", by)
    if toward:
        yield _made("gravity_size", SIZE, e.scene.gravity)


def _colliders(e: Experiment) -> Iterator[ToldInput]:
    """What turns each collider about an axis through its place, at all knots of its motion."""
    first = 0
    for name, collider in e.scene.contacts.colliders.items():
        knots = first + 6 * np.arange(len(collider.poses.times))
        first += 6 * len(knots)
        for axis in range(3):
            turn: Input = "collider_pose", knots + 3 + axis, np.ones(len(knots))
            yield _made("collider_direction", f"{name} about {AXES[axis]}", turn, turned(name, AXES[axis]))


def _path(e: Experiment, inputs: Array) -> Iterator[ToldInput]:
    """What lengthens the path of what drives a scene, from where it begins. Where that follows recorded markers, its
    path is theirs."""
    if not e.scene.boundary.driven or e.scene.boundary.following:
        return
    first, size = e.scene.compiled.layout["boundary"]
    knots = inputs[first : first + size].reshape(len(e.scene.boundary.times), -1)
    moved = (knots - knots[0]).ravel()
    if moved.any():
        yield _made("drive_size", FARTHER, ("boundary", np.flatnonzero(moved), moved[moved != 0.0]))


def _grips(e: Experiment, inputs: Array) -> Iterator[ToldInput]:
    for one in held_directions(e.scene, inputs):
        way = f"{AXES[one.axis]}{' (of its axes at the start)' if one.moves else ''}"
        words = turned(f"the grip at {one.who}", way)
        yield _made("grip_direction", f"{one.who} about {AXES[one.axis]}", one.added, words)


def _loads(e: Experiment, theta: Array) -> Iterator[ToldInput]:
    """Directions of given forces, and the size of those that no quantity is."""
    scene = e.scene
    if not scene.forces.particles:
        return
    compiled = scene.compiled
    first, count = compiled.layout["force"]
    own = slice(first, first + count)
    force = compiled.inputs(theta)[own].reshape(-1, 3)
    for axis in range(3):
        turn = np.cross(np.eye(3)[axis], force).ravel()
        if turn.any():
            words = turned("the loads", AXES[axis])
            yield _made("load_direction", f"loads about {AXES[axis]}", ("force", np.arange(count), turn), words)
    named = {q for t in scene.forces.terms() for q in t.quantities if scene.quantities[q].unit == "N"}
    by = np.where([q in named for q in scene.quantities], theta, 0.0)
    size = force.ravel() - (compiled.inputs_dot(theta, by)[own] if named else 0.0)
    if (abs(size) > 1e-12 * abs(force).max(initial=0.0)).any():
        yield _made("load_size", LOADS, ("force", np.arange(count), size))


def _speed(e: Experiment) -> Iterator[ToldInput]:
    """The velocities that a motion starts with; those of bodies are quantities."""
    if e.static or e.start not in ("given", "settled"):
        return
    v = e.scene.base_arrays()["velocity"]
    v[e.scene.held] = 0.0
    v[e.scene.body_nodes.ravel()] = 0.0
    if v.any():
        yield _made("start_speed", SPEED, ("velocity", np.flatnonzero(v), v[v != 0.0]))


def _unnamed(e: Experiment) -> Iterator[ToldInput]:
    """Masses, drag, air and pressure of a scene that was built by hand, without quantities."""
    scene, base = e.scene, e.scene.base_arrays()
    free = np.zeros(scene.node_count, dtype=bool)
    free[scene.free_nodes] = True
    free[scene.particle_count :] = False
    free[scene.body_nodes.ravel()] = False
    for array, words in UNNAMED.items():
        values = base[array] * (free if len(base[array]) == len(free) else 1.0)
        at = np.flatnonzero(values)
        if len(at):
            step = OF_LOSSES if array.startswith(("drag", "air")) else PERCENT
            yield replace(_made("unnamed", words, (array, at, values[at])), step=step)


def _weights(e: Experiment, inputs: Array) -> Iterator[ToldInput]:
    """What each marker may weigh without a mass in the model, and where that hangs."""
    first, size = e.scene.compiled.layout["mass"]
    each, load = unseen_mass(e, inputs[first : first + size]), marker_load(e)
    at = np.flatnonzero(load)
    if each > 0.0:
        step = each, f"{short(1e3 * each, 2)} g each"
        yield ToldInput("marker_mass", WEIGHTS, "kg", step, ("mass", at, load[at]))


def turned(name: str, axis: str) -> Says:
    """Words for what was turned about an axis."""
    return lambda size: (
        f"{name} were turned by {short(abs(size) / DEGREE, 2)} degrees about {'' if size > 0 else '-'}{axis}"
    )
