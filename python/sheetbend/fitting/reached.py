"""The minimum that a fit reached: by a search from every start, and by further ones where its end is above its own
start or where the beginnings of the motions contradict it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ..doubts.beginnings import Beginning, checked
from ..doubts.conclude import without_verdict
from ..doubts.stationary import from_start
from ..minimum.growth import Growth, growths
from ..minimum.problem import FitProblem
from ..minimum.progress import Minimum
from ..minimum.search import Found, Search
from ..result.estimate import Estimate


@dataclass(frozen=True)
class Reached:
    """The minimum at which a search ended.

    Attributes:
        problem: what was searched.
        found: what the search itself found.
        ends: of all starts and of what was searched further, best first.
        begun: the beginnings of the motions that were fitted by themselves.
        growths: of the motions at the best end.
        lost: estimates of the parameters of which nothing is derived there (`without_verdict`).
        interrupted: whether Ctrl-C ended it.
    """

    problem: FitProblem
    found: Found
    ends: tuple[Minimum, ...]
    begun: tuple[Beginning, ...]
    growths: tuple[Growth, ...]
    lost: Mapping[str, Estimate]
    interrupted: bool

    @property
    def best(self) -> Minimum:
        """The lowest end."""
        return self.ends[0]

    @property
    def all_lost(self) -> bool:
        """Whether nothing is derived of any parameter; no refit tells anything then."""
        return len(self.lost) == len(self.problem.parameters.free)


def reach(search: Search, problem: FitProblem, beginnings: bool) -> Reached:
    """Search, and search on.

    Args:
        beginnings: whether the beginnings of the motions are fitted by themselves, too.

    Raises:
        SheetbendError: no start has an answer.
    """
    found = search.run(problem)
    ends, interrupted, begun = found.ends, found.interrupted, tuple[Beginning, ...]()
    if not interrupted:
        try:
            ends = from_start(search, problem, ends)
        except KeyboardInterrupt:
            interrupted = True
    first, grown = ends[0], growths(problem, ends[0].u)
    if beginnings and not interrupted:
        try:
            ends, begun = checked(search, problem, ends, grown)
        except KeyboardInterrupt:
            interrupted = True
    if ends[0] is not first:
        grown = growths(problem, ends[0].u)
    lost = without_verdict(problem, ends[0], grown)
    return Reached(problem, found, ends, begun, grown, lost, interrupted)
