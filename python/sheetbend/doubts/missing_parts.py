"""What a model may lack: losses, stretch, masses at its markers and free ends, rest curvature, motion at its start.

None of these has a number in the model, since it has none of them. But inputs of a simulation stand at zero there, and
a little of each changes the residuals in a direction that one set of tangents tells.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from ..arrays.types import Array
from ..experiment.experiment import Experiment
from ..problem.problem import FitProblem
from ..quantities.wording import short
from ..scene.group import places_of_groups
from .losses_at_zero import losses_at_zero, with_losses
from .marker_mass import marker_load
from .tangents import Part
from .told import Told, of_parts


def missing_parts(problem: FitProblem, u: Array, i: int) -> list[Told]:
    """Directions of what the i-th experiment's model does not have; none where its motion has no answer at u (free,).
    Takes two sets of tangents."""
    e = problem.experiment_at(i, u)
    made = [with_losses(e) if k == i else other for k, other in enumerate(problem.experiments)]
    theta, slots, _ = problem.known(u)
    parts = list(_parts(e, e.scene.compiled.inputs(theta[slots[i]])))
    return of_parts(problem.of(made), u, i, parts, problem.corrections(u).get(e.name))


def _parts(e: Experiment, inputs: Array) -> Iterator[Part]:
    layout = e.scene.compiled.layout
    values = {array: inputs[first : first + size] for array, (first, size) in layout.items()}
    x, mass = values["position"].reshape(-1, 3), values["mass"]
    held = np.zeros(len(x), dtype=bool)
    held[e.scene.held] = True
    free = np.flatnonzero(~held & (mass > 0.0))
    yield from losses_at_zero(e, values, free)
    yield from _masses(e, held)
    yield from _stretch(e, x, values["compliance"])
    yield from _curvature(e, values["rest"], values["compliance"])
    if e.scene.pinned and not len(e.scene.boundary.driven) and not values["velocity"].any():
        arm = x[free] - x[e.scene.held].mean(axis=0)
        entries = (3 * free[:, None] + np.arange(3)).ravel()
        for axis, name in enumerate("xyz"):
            speed = np.cross(np.eye(3)[axis], arm).ravel()
            yield f"start about {name}", ("velocity", entries, speed), _turning(e.name, name)


def _masses(e: Experiment, held: Array) -> Iterator[Part]:
    load = marker_load(e)
    if (load > 0.0).any():
        at = np.flatnonzero(load > 0.0)
        yield "markers' mass", ("mass", at, load[at]), lambda size: f"each marker weighed {short(1e3 * size, 2)} g"
    for name, rope in e.scene.ropes.items():
        for where, end in (("start", rope.particles[0]), ("end", rope.particles[-1])):
            if not held[end]:

                def says(size: float, where: str = where, name: str = name) -> str:
                    return f"{short(1e3 * size, 2)} g more hung on the {where} of {name}"

                yield f"mass at the {where} of {name}", ("mass", np.array([end]), np.ones(1)), says


def _stretch(e: Experiment, x: Array, compliance: Array) -> Iterator[Part]:
    """Elements that keep their length; the compliance of one is its length over EA."""
    for places in places_of_groups(e.scene.groups):
        g, own = places.group, places.constraints
        if g.kind == "distance" and not compliance[own].any():
            length = np.linalg.norm(x[g.particles[:, 1]] - x[g.particles[:, 0]], axis=1)

            def says(size: float, name: str = g.name) -> str:
                return f"{name} gave way with an EA of {short(1.0 / size, 2)} N, where the model keeps its length"

            yield f"stretch of {g.name}", ("compliance", own, length), says


def _curvature(e: Experiment, rest: Array, compliance: Array) -> Iterator[Part]:
    """The rest curvature that straight rods lack, about either axis of their sections. It turns each joint by the
    curvature times the joint's share of the length, which compliances have too."""
    for places in places_of_groups(e.scene.groups):
        g, share = places.group, compliance[places.constraints]
        rod = e.scene.ropes.get(g.name.removesuffix("_bend"))
        turns = places.rest[:, -2:]  # before them stands the ratio of the two stiffnesses
        if g.kind == "material_curvature" and rod is not None and not rest[turns].any():
            share = share / np.median(share) * float(rod.arc_length[-1]) / (len(rod.arc_length) - 1)
            for axis, words in enumerate(("first", "second")):

                def says(size: float, name: str = rod.name, words: str = words) -> str:
                    return f"{name} were curved at rest by {short(size, 2)} 1/m about the {words} axis of its sections"

                yield f"curvature of {g.name} {axis}", ("rest", turns[:, axis], share), says


def _turning(motion: str, axis: str) -> Callable[[float], str]:
    return lambda size: (
        f"{motion} had begun with a turn of {short(abs(size), 2)} rad/s about {'' if size > 0 else '-'}{axis}"
    )
