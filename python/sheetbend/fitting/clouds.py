"""What a fit says of its clouds, in place of the doubts that follow markers over time."""

from __future__ import annotations

import numpy as np

from ..doubts.driven_noise import driven_doubts
from ..minimum.problem import FitProblem
from ..statistics.identifiability import Identifiability


def has_clouds(problem: FitProblem) -> bool:
    """Whether any of its recordings is a cloud."""
    return any(e.is_cloud for e in problem.experiments)


def driven_beside_clouds(
    problem: FitProblem, u: np.ndarray, judged: Identifiability
) -> tuple[tuple[str, ...], dict[str, str]]:
    """`driven_doubts`, which ask the recorded markers how noisy the driven ones are; none with a cloud, which has no
    such markers."""
    return ((), {}) if has_clouds(problem) else driven_doubts(problem, u, judged)
