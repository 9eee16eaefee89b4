"""The ten numbers of each body of which something is fitted."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..arrays.types import Array
from ..problem.problem import FitProblem
from ..quantities.expression import numbers
from ..scene.bodies import names_of
from ..scene.body import AXES, GROUND, Body
from ..statistics.body_numbers import KINDS, BodyNumbers, labels_of, ten_numbers


def bodies_of(problem: FitProblem, u: Array) -> list[BodyNumbers]:
    """At internal values u (free,)."""
    found: dict[tuple[str, ...], BodyNumbers] = {}
    for e in problem.experiments:
        carried = problem.carried_by(e)
        for name, body in e.scene.bodies.items():
            if name == GROUND:
                continue
            values = {q: about.value for q, about in e.scene.quantities.items()} | problem.values_of(e, u)
            for one in _numbers(problem, u, name, body, values, carried):
                found.setdefault(one.members, one)
    return list(found.values())


def _numbers(
    problem: FitProblem,
    u: Array,
    name: str,
    body: Body,
    values: dict[str, float],
    carried: dict[str, tuple[str, float]],
) -> Iterator[BodyNumbers]:
    own = [q for kind in KINDS for q in names_of(name)[kind]]
    free = problem.parameters.free
    members = tuple(dict.fromkeys(carried[q][0] for q in own if q in carried and carried[q][0] in free))
    if len(members) < 2:
        return
    p = np.array([values[q] for q in own])
    straight = {**values, **dict.fromkeys(names_of(name)["axes_turn"], 0.0)}
    principal = numbers(body.axes, straight)
    by_own = np.stack([ten_numbers(p + 1e-30j * step, principal).imag * 1e30 for step in np.eye(len(p))], axis=1)
    per_value = problem.parameters.diagonal(u)
    slope = np.zeros((10, len(members)))
    for k, q in enumerate(own):
        root, factor = carried.get(q, ("", 0.0))
        if root in members:
            slope[:, members.index(root)] += by_own[:, k] * factor * per_value[free.index(root)]
    ten = ten_numbers(p, principal)
    length = float(np.sqrt(0.5 * ten[4:7].sum() / ten[0]))
    sizes = ten[0] * np.repeat([1.0, length, length**2], [1, len(AXES), 6])
    about = [problem.parameters[m] for m in members]
    steps = np.array([1.0 if a.log or a.scale is None else a.scale for a in about])
    yield BodyNumbers(members, steps, labels_of(name), ten, slope, sizes)
