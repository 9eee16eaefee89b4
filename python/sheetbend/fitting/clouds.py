"""What a fit says of its clouds, in place of the doubts that follow markers over time."""

from __future__ import annotations

import numpy as np

from ..doubts.driven_noise import driven_doubts
from ..doubts.told import Told, told_numbers
from ..minimum.problem import FitProblem
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
