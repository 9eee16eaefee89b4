"""What a fit says of its clouds, in place of the doubts that follow markers over time."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..doubts.driven_noise import driven_doubts
from ..doubts.misread import SEEN, misread
from ..doubts.told import Told, told_numbers
from ..minimum.problem import FitProblem
from ..quantities.wording import short
from ..statistics.identifiability import Identifiability

UNTOLD = "the points of a cloud have no places of their own, and where they would go instead is not computed"


def has_clouds(problem: FitProblem) -> bool:
    """Whether any of its recordings is a cloud."""
    return any(e.is_cloud for e in problem.experiments)


def told_beside_clouds(problem: FitProblem, u: np.ndarray) -> tuple[list[Told], str]:
    """`told_numbers`; with a cloud none, and why."""
    return ([], UNTOLD) if has_clouds(problem) else told_numbers(problem, u)


def driven_beside_clouds(
    problem: FitProblem, u: np.ndarray, judged: Identifiability
) -> tuple[tuple[str, ...], dict[str, str]]:
    """`driven_doubts`, which ask the recorded markers how noisy the driven ones are; none with a cloud, which has no
    such markers."""
    return ((), {}) if has_clouds(problem) else driven_doubts(problem, u, judged)


def misread_beside_clouds(problem: FitProblem, u: np.ndarray) -> tuple[str, ...]:
    """`misread`; with a cloud a warning for every recording whose residuals are no noise."""
    return tuple(_far_off(problem, u)) if has_clouds(problem) else misread(problem, u)


def _far_off(problem: FitProblem, u: np.ndarray) -> Iterator[str]:
    ok, r, _ = problem.evaluate(u)
    if not ok:
        return
    layout = problem.rows_layout()
    for i, e in enumerate(problem.experiments):
        mine = (layout.recording == i) & (layout.clocks == 0)
        left = float(np.sqrt(np.mean(r[: len(mine)][mine] ** 2)))
        if left > SEEN:
            what = "the points of the cloud lie" if e.is_cloud else "the markers lie"
            yield (
                f"{e.name}: {what} {short(1e3 * left * e.sigma, 2)} mm rms off the fitted motion, {short(left, 2)} "
                "times their sigma, and the intervals take that for noise. Check sigma, gravity, lengths, densities, "
                "clamps and clocks, and whether points of other things than the cloth were cut off"
            )
