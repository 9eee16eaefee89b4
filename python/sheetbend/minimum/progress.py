"""What a search for a minimum reports on its way, and where it ended."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from .conditioning import Condition


@dataclass(frozen=True)
class Progress:
    """One iteration: its number, the cost (half the sum of squares), the internal point, and the length [s] of the
    window that is fitted first, if one is. Before the first step it has the number 0 and the condition there; while
    many starts are raced it is the end of one of them, (its number, of how many)."""

    iteration: int
    cost: float
    u: np.ndarray
    window: float | None = None
    condition: Condition | None = None
    start: tuple[int, int] | None = None


@dataclass(frozen=True)
class Minimum:
    """Where an optimizer ended; `interrupted` by Ctrl-C, with its best so far. `first` is the cost where it began,
    `doubt` says what speaks against its being a minimum. `evaluations` simulated all experiments, `jacobians` of these
    with derivatives; `windows` [s] were fitted before. `group` is the number of the raced starts that it speaks for."""

    u: np.ndarray
    cost: float
    iterations: int
    evaluations: int
    converged: bool
    interrupted: bool
    message: str
    first: float | None = None
    doubt: str = ""
    jacobians: int = 0
    windows: tuple[float, ...] = ()
    group: int = 0


Observer = Callable[[Progress], None]


class Latest:
    """Keeps the point that was reached last and passes progress on."""

    def __init__(self, observe: Observer | None, u: np.ndarray) -> None:
        self.observe, self.u = observe, u

    def __call__(self, progress: Progress) -> None:
        self.u = progress.u
        if self.observe is not None:
            self.observe(progress)


class Best:
    """Keeps the best point seen and passes progress on."""

    def __init__(self, observe: Observer | None, u: np.ndarray, cost: float) -> None:
        self.observe, self.u, self.cost = observe, np.array(u, dtype=float), cost

    def __call__(self, iteration: int, cost: float, u: Sequence[float] | np.ndarray) -> None:
        if cost <= self.cost:
            self.u, self.cost = np.array(u, dtype=float), cost
        if self.observe is not None:
            self.observe(Progress(iteration, cost, np.array(u, dtype=float)))
