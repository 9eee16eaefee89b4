"""Many starts of a straight rope, raced on its shortest windows: those of the bending lengths, and others drawn over
two decades about the middle one. Those that end in one minimum are a group (`minimum.race`)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..arrays.types import Array
from ..minimum.race import Course, Raced, race
from ..minimum.starts import drawn, off_bounds
from ..problem.problem import FitProblem
from ..quantities.parameters import Parameter, Parameters
from ..result.result import Start
from .descent import Descent
from .model import NAME

LENGTH = f"{NAME}_length"


def points(problem: FitProblem, firsts: Sequence[Mapping[str, float]], count: int) -> list[Array]:
    """`count` starts (free,) inside the problem's bounds: the first ones, and others from a Sobol sequence.

    Raises:
        InputError: the count is no number of starts.
    """
    own = problem.parameters
    about = firsts[len(firsts) // 2]
    wide = Parameters(_wide(p, about) for p in own.values())
    more = [wide.to_physical(u) for u in drawn(wide, count)[1:]]
    every = [*firsts, *more][:count]
    return [off_bounds(own, own.to_internal({**own.to_physical(own.initial()), **values})) for values in every]


def _wide(p: Parameter, about: Mapping[str, float]) -> Parameter:
    """Two decades about a start, whatever its prior and its bounds; the length and the roll are drawn from theirs."""
    if p.tied_to is not None or not p.log or p.name == LENGTH:
        return p
    return replace(p, initial=about.get(p.name, p.initial), prior=None, lower=-np.inf, upper=np.inf)


def raced(problem: FitProblem, firsts: Sequence[Mapping[str, float]], count: int) -> tuple[Raced, ...]:
    """`count` starts to the end of their race, in their order. Ctrl-C passes through."""
    return race(Course(problem, ()), points(problem, firsts, count))


def rows(problem: FitProblem, ended: Sequence[Raced], fits: Mapping[int, Descent]) -> tuple[Start, ...]:
    """A row of the result for each start, the group first whose fit has the lowest cost; those that led nowhere last.

    Args:
        fits: to the longest windows, by the number of the group; without those that diverge.
    """
    made, to_physical = list[Start](), problem.parameters.to_physical
    for one in ended:
        end = fits.get(one.group)
        row = Start(
            cost=None if end is None else end.cost,
            iterations=0 if end is None else end.iterations,
            converged=end is not None and end.ended,
            values=to_physical(one.u) if end is None else {k: end.values[k] for k in to_physical(one.u)},
            first=to_physical(one.first),
            raced=one.cost if np.isfinite(one.cost) else None,
            group=one.group or None,
        )
        made.append(row)

    def order(row: Start) -> tuple[float, int, float]:
        cost, reached = (np.inf if x is None else x for x in (row.cost, row.raced))
        return cost, row.group or len(made) + 1, reached

    return tuple(sorted(made, key=order))
