"""Directions in which the residuals of a fit would move by what its model lacks, or what was done to its recording."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache, partial

from ..arrays.types import Array
from ..problem.problem import FitProblem
from .clipped import clipped
from .cloth_size import cloth_sizes
from .losses_at_zero import touches
from .missing_parts import missing_parts
from .pinned_ends import pinned_ends
from .smoothed import smoothed
from .told import Told


class Lacking:
    """The directions in which what the model lacks would move the residuals, for each motion of a problem at u (free,);
    each motion's are computed once."""

    def __init__(self, problem: FitProblem, u: Array) -> None:
        self._experiments = problem.experiments
        self._parts = cache(partial(missing_parts, problem, u))
        self._others = [cache(partial(made, problem, u)) for made in (cloth_sizes, pinned_ends, smoothed, clipped)]

    def of(self, group: Sequence[int]) -> list[Told]:
        """The directions of a group of motions, each as an error of the model."""
        return [one for i in self._moving(group) for made in (self._parts, *self._others) for one in made(i)]

    def beside_contacts(self, group: Sequence[int]) -> list[Told]:
        """The directions of missing parts in a group of motions; none where none of them has contacts."""
        moving = self._moving(group)
        touching = any(touches(self._experiments[i]) for i in moving)
        return [one for i in moving for one in self._parts(i)] if touching else []

    def _moving(self, group: Sequence[int]) -> list[int]:
        return [i for i in group if not self._experiments[i].static]
