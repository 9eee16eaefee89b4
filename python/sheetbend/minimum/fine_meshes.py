"""Moves estimates to the limit of fine meshes, where the mesh is fine enough for that.

Meshes of ropes and sheets err by c l^2 + d l^4, with l the length of an edge, as far as the motion is smooth in space.
A finer mesh of half the edges thus tells the first term, which is taken out, and the second is about the square of the
first. What is left open is a twelfth of the shift (the limit's factor of 4/3 is 1.23 to 1.44 for orders of 2.4 to 1.7),
its square, and what further Gauss-Newton steps would move. Where the shift is a large part of the value, the mesh is
not in the range where this holds: the estimate stays, and all of it counts, with its square.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from ..arrays.types import Array
from ..problem.problem import FitProblem
from ..quantities.parameters import Parameters
from ..result.estimate import Estimate
from ..result.result import Refit
from ..statistics.profile import FARTHEST
from .linear_step import gauss_newton, moves, one_step

ORDER = 1 / 12  # of the shift: what an order between 1.7 and 2.4 leaves open
COARSE = 0.3  # of a value, or of its scale: a shift as large as this is no small correction
SLOW = 0.5  # of the first step: a second one as long as this tells no limit
CARRIED = ("identified", "weak", "doubtful")  # verdicts beside a value that the shift holds for


def two_steps(problem: FitProblem, finer: FitProblem, u: Array) -> tuple[Array, Array]:
    """The minimum of a finer problem after two Gauss-Newton steps with the Jacobian of the fit, and how far further
    steps would go, both (free,) and internal.

    Raises:
        SheetbendError: see `one_step`.
    """
    first = one_step(problem, finer, u)
    _, r, J = problem.evaluate(u)
    ok, there, _ = finer.evaluate(first, jacobian=False)
    if not ok:
        return first, np.abs(first - u)
    second = gauss_newton(problem.parameters, first, J, there - r)
    ratio = float(np.linalg.norm(J @ (second - first))) / max(float(np.linalg.norm(J @ (first - u))), 1e-300)
    if not ratio < SLOW:
        return first, np.abs(first - u)
    return second, ratio / (1.0 - ratio) * np.abs(second - first)


def left_open(parameters: Parameters, u: Array, shift: Array, rest: Array | float) -> dict[str, float]:
    """By parameter, the half-width of what the mesh leaves open, in its unit: much less than the shift where the
    estimate can be moved to the limit, otherwise more.

    Args:
        u, shift: (free,) internal estimate, and how far it is from the limit.
        rest: (free,) what further steps would move.
    """
    size = np.array([parameters[name].scale or 1.0 for name in parameters.free])
    log = np.array([parameters[name].log for name in parameters.free], dtype=bool)
    size = np.where(log, 1.0, np.maximum(size, np.abs(u)))
    part = np.abs(shift) / size
    left = np.abs(shift) * (np.where(part < COARSE, ORDER, 1.0) + np.minimum(part, 1.0)) + rest
    return {name: abs(width) for name, width in moves(parameters, u, u + np.minimum(left, FARTHEST * size)).items()}


def at_the_limit(
    estimates: Sequence[Estimate], refits: Iterable[Refit], parameters: Parameters, u: Array
) -> tuple[tuple[Estimate, ...], Array]:
    """The estimates moved to the limit of what was refined, with their intervals; and (free,) where they are then.

    Args:
        u: (free,) internal estimates.
    """
    lower, upper = parameters.bounds()
    values, limit = parameters.to_physical(u), np.array(u, dtype=float)
    of = {e.name: e for e in estimates}
    for made in refits:
        near = {name for name, left in made.left.items() if left < abs(made.to_limit * made.moved[name])}
        there = parameters.to_internal(values | {name: values[name] + made.moved[name] for name in near})
        for column, name in enumerate(parameters.free):
            if name in near and of[name].verdict in CARRIED and of[name].half_width is not None:
                limit[column] += made.to_limit * (there[column] - u[column])
    limit = np.where(limit == u, u, np.clip(limit, lower, upper))
    return tuple(_shifted(parameters, e, u, limit) for e in estimates), limit


def _shifted(parameters: Parameters, e: Estimate, start: Array, end: Array) -> Estimate:
    column, p = parameters.free.index(e.name), parameters[e.name]
    by = float(end[column] - start[column])
    if by == 0.0 or e.lower is None or e.upper is None or e.half_width is None:
        return e
    factor = float(np.exp(by)) if p.log else 1.0
    more = 0.0 if p.log else by
    lower, upper = max(e.lower * factor + more, p.lower), min(e.upper * factor + more, p.upper)
    value = e.value * factor + more
    return replace(
        e,
        value=value,
        lower=lower,
        upper=upper,
        half_width=(upper - lower) / 2,
        statistical=None if e.statistical is None else e.statistical * factor,
        discretization=e.discretization * factor,
        systematic=e.systematic * factor,
        driven=e.driven * factor,
        moved=e.moved + value - e.value,
    )
