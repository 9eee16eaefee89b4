"""Whether the rope's rest shape differs from recording to recording.

A rope that was stored on a drum, or that creeps between recordings, has a rest curvature of its own in each. The fit
has one for all. What is left of the residuals then has, in each recording, a part that a change of the rest curvature
explains. So each window is given a change of its own, to first order, from the first half of its time, and the second
half is predicted with it. Changes found from other windows say how much better that would be by chance: the windows'
own ones are compared with permuted ones.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays.types import Array
from ..problem.problem import FitProblem
from ..quantities.wording import short
from .model import NAME

FEWEST = 6  # windows
ALIKE = 10.0  # neighboring residuals that count as one
SIZE = 0.1  # rms of a mode's share, in rms of the residuals: the prior of a window's own change
BETTER, CHANCE = 0.95, 0.01  # rms of second halves over that without, at most; probability by chance, at most
DRAWS = 2000


@dataclass(frozen=True)
class OwnRest:
    """What rest shapes of their own make of the windows.

    Attributes:
        ratio: median of the rms of second halves over that without.
        better, count: windows in which it is below 1, and all.
        moves: m, rms by which the changes move a coordinate of a marker, at least: few rows draw them to zero.
    """

    ratio: float
    better: int
    count: int
    moves: float

    @property
    def words(self) -> str:
        """A sentence on it."""
        return (
            f"the rope's rest shape, or what had slid inside, seems to differ from recording to recording: a rest "
            "curvature of its own, found from the first half of each window, moves markers by "
            f"{short(1e3 * self.moves, 2)} mm or more, and takes what is left of the second half to "
            f"{short(self.ratio, 2)} times (better in {self.better} of {self.count} windows). Estimates and "
            "predictions are for their mean; the intervals count it as part of the residuals"
        )


def own_rest(problem: FitProblem, u: Array) -> OwnRest | None:
    """None where rest shapes do not seem to differ, or nothing tells.

    Args:
        problem: of windows of a `RopeModel`.
        u: (free,) its minimum.
    """
    free = problem.parameters.free
    modes = [k for k, name in enumerate(free) if name.startswith((f"{NAME}_curvature_1_", f"{NAME}_curvature_2_"))]
    if not modes or len(problem.experiments) < FEWEST:
        return None
    _, r, J = problem.evaluate(u)
    layout = problem.rows_layout()
    rows = len(layout.frame)
    return differing(r[:rows], J[:rows, modes], layout.recording, layout.frame, problem.experiments[0].sigma)


def differing(r: Array, J: Array, window: Array, frame: Array, sigma: float) -> OwnRest | None:
    """The same from residuals (rows,) in units of sigma, their derivatives (rows, modes), and the window and the frame
    of each row."""
    size = np.linalg.norm(J, axis=0) / np.sqrt(len(r))
    J = J[:, size > 0] / size[size > 0] * np.sqrt(np.mean(r**2))  # of rms that the residuals have
    own, later = [], []
    for k in range(int(window.max()) + 1):
        mine = np.flatnonzero(window == k)
        first = frame[mine] < 0.5 * (frame[mine].min() + frame[mine].max())
        a, b = mine[first], mine[~first]
        if not (len(a) and len(b)):
            return None
        weight = 1.0 / (ALIKE * max(float(np.mean(r[a] ** 2)), np.finfo(float).tiny))
        ridge = np.eye(J.shape[1]) / SIZE**2
        own.append(-np.linalg.solve(weight * J[a].T @ J[a] + ridge, weight * J[a].T @ r[a]))
        later.append(b)
    left = np.array([[np.mean((r[b] + J[b] @ change) ** 2) / np.mean(r[b] ** 2) for change in own] for b in later])
    ratios = np.sqrt(np.diag(left))
    rng, count = np.random.default_rng(0), len(left)
    logs = np.log(left)
    drawn = [float(logs[np.arange(count), rng.permutation(count)].mean()) for _ in range(DRAWS)]
    chance = (1 + sum(d <= np.diag(logs).mean() for d in drawn)) / (1 + DRAWS)
    ratio, better = float(np.median(ratios)), int((ratios < 1.0).sum())
    if not (ratio < BETTER and chance < CHANCE and 2 * better > count):
        return None
    mean = np.mean(own, axis=0)
    moved = [J[b] @ (change - mean) for b, change in zip(later, own, strict=True)]
    return OwnRest(ratio, better, count, sigma * float(np.sqrt(np.mean(np.concatenate(moved) ** 2))))
