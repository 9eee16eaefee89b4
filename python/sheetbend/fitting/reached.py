"""The minimum that a fit reached: by a search from every start, and by further ones where its end is above its own
start or where the beginnings of the motions contradict it.

Of a motion with many unknowns, a first search ends as soon as its steps take little off, and the beginnings are asked
there: in a wrong minimum many such steps may follow, all for nothing (measured: more than 40). The lower end is then
followed to its minimum, and no other search follows.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from ..doubts.beginnings import Beginning, checked, many
from ..doubts.conclude import without_verdict
from ..doubts.stationary import from_start
from ..minimum.growth import Growth, growths
from ..minimum.progress import Minimum
from ..minimum.search import Found, Search
from ..minimum.way import NEAR_TOLERANCE
from ..problem.problem import FitProblem
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
    def left_its_end(self) -> bool:
        """Whether another search led lower than the first."""
        return len(self.ends) > len(self.found.ends)

    @property
    def all_lost(self) -> bool:
        """Whether nothing is derived of any parameter; no refit tells anything then."""
        return len(self.lost) == len(self.problem.parameters.free)


def reach(search: Search, problem: FitProblem, beginnings: bool, undone: str = "") -> Reached:
    """Search, and search on.

    Args:
        beginnings: whether the beginnings of the motions are fitted by themselves, too.
        undone: what Ctrl-C left undone before.

    Raises:
        SheetbendError: no start has an answer.
    """
    rough = _rough(search, problem) if beginnings else search
    found = rough.stopped(problem, undone) if undone else rough.run(problem)
    ends, interrupted, begun = found.ends, found.interrupted, tuple[Beginning, ...]()
    if not interrupted:
        try:
            ends = from_start(rough, problem, ends)
        except KeyboardInterrupt:
            interrupted = True
    first, grown = ends[0], growths(problem, ends[0].u)
    if beginnings and not interrupted:
        try:
            ends, begun = checked(rough, problem, ends, grown)
            if rough is not search:
                ends = (_followed(search, problem, ends[0]), *ends[1:])
                interrupted = ends[0].interrupted
        except KeyboardInterrupt:
            interrupted = True
    if rough is not search and interrupted:
        ends = (replace(ends[0], converged=False, interrupted=True), *ends[1:])
    if ends[0] is not first:
        grown = growths(problem, ends[0].u)
    lost = without_verdict(problem, ends[0], grown)
    return Reached(problem, found, ends, begun, grown, lost, interrupted)


def _rough(search: Search, problem: FitProblem) -> Search:
    """The search that goes first: where beginnings are asked whatever its end is, one that ends near its minimum. Ends
    of several starts are compared with each other, and so each is followed to its minimum at once."""
    if search.starts or problem.estimates_corrections or not many(problem):
        return search
    return replace(search, tolerance=max(search.tolerance, NEAR_TOLERANCE))


def _followed(search: Search, problem: FitProblem, end: Minimum) -> Minimum:
    """The minimum that an end is near, with what both searches took; where no iteration is left, the end itself, as
    one that did not converge."""
    left = search.max_iterations - end.iterations
    if left < 1:
        return replace(end, converged=False, message="the number of iterations was reached") if end.converged else end
    on = replace(search, max_iterations=left).onward(problem, end.u)
    return replace(
        on,
        first=end.first,
        windows=end.windows,
        group=end.group,
        iterations=end.iterations + on.iterations,
        evaluations=end.evaluations + on.evaluations,
        jacobians=end.jacobians + on.jacobians,
    )
