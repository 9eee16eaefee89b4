"""Ropes fitted to windows of recordings, and judged by what they predict of the others."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..errors import SheetbendError
from ..problem.problem import FitProblem
from .bounds import bounded
from .carried import slopes_of
from .descent import Descent, bearable, descend
from .judging import Split, errors_of, misfits
from .motion import GrippedMotion
from .pieces import experiments_of, problem_of
from .steps import Rope
from .windows import Span

SEARCHED = 0.5  # of the total of long windows that the last fit sees: enough to decide on rungs
ENOUGH = 5e-3  # of the cost: what a step must promise while searching
LONG = 30  # derivatives, at most

Say = Callable[[str], None]


class Search:
    """Recordings, which of them fit and which judge, and on what windows.

    Attributes:
        given: all motions.
        split: what is fitted and judged; without what was left out.
        windows: from short ones to those of the last fit.
        middle, longest: windows on which starts are compared, and the longest ones of a search.
        left_out: sentences on recordings that are neither fitted nor judged.
    """

    def __init__(
        self, motions: Sequence[GrippedMotion], share: float, windows: Sequence[Span], threads: int, say: Say
    ) -> None:
        self.given = tuple(motions)
        self.split = Split.of(motions, share)
        self.windows, self.threads, self.say = windows, threads, say
        length, total = windows[-1]
        self.middle, self.longest = windows[min(1, len(windows) - 1)], (length, max(length, SEARCHED * total))
        self.left_out: list[str] = []

    @property
    def whole(self) -> list[GrippedMotion]:
        """All motions that belong, uncut."""
        kept = {id(m) for m in (*self.split.motions, *self.split.waiting)}
        return [m for m in self.given if self.split.cut or id(m) in kept]

    def fitted(self, rope: Rope, window: Span, most: int = LONG, problem: FitProblem | None = None) -> Rope:
        """The rope fitted to such windows.

        Raises:
            SheetbendError: the motion diverges.
        """
        found = self.descended(rope, window, most, problem)
        if found is None:
            raise SheetbendError(f"the motion diverges on windows of {window[0]:g} s")
        return found[0]

    def descended(
        self, rope: Rope, window: Span, most: int = LONG, problem: FitProblem | None = None
    ) -> tuple[Rope, Descent] | None:
        """A rope and its descent on the windows that do not diverge at first; None where most do."""
        problem = problem or self.problem(rope, window)
        end = descend(problem, most, ENOUGH)
        if not end.finite:
            sound = self.sound(problem, rope.values)
            if sound is None:
                return None
            problem, end = sound, descend(sound, most, ENOUGH)
        if not end.finite:
            return None
        slopes = slopes_of(problem, end.jacobian)
        return Rope(rope.model.at(end.values), rope.parameters, end.values, slopes=slopes), end

    def problem(self, rope: Rope, window: Span) -> FitProblem:
        """The least-squares problem of windows of what is fitted, which starts at the rope's values."""
        experiments = experiments_of(rope.model, self.split.fitted, window, rope.values)
        free = bounded(rope.parameters, rope.model, self.split.fitted, window[0])
        return problem_of(experiments, free, rope.values, self.threads)

    def sound(self, problem: FitProblem, values: Mapping[str, float]) -> FitProblem | None:
        """The problem of those windows that do not diverge at these values; None where most do."""
        free = list(problem.given.values())
        each = [problem_of([e], free, values) for e in problem.experiments]
        sound = [
            e for e, p in zip(problem.experiments, each, strict=True) if bearable(p, p.cost(p.parameters.initial()))
        ]
        return problem_of(sound, free, values, self.threads) if 2 * len(sound) > len(each) else None

    def judged(self, rope: Rope) -> Rope:
        return replace(rope, errors=errors_of(rope.model, rope.values, self.split, self.threads))

    def leave_out(self, errors: np.ndarray) -> bool:
        """Leave recordings out of fitting and judging that do not belong to the others; whether there were any."""
        found = misfits(errors)
        if len(found) == 0 or self.split.cut:
            return False
        smaller = self.split.without(found)
        if not smaller.fitted or (self.split.judged and not smaller.judged):
            return False
        for k, why in found.items():
            self._without(self.split.motions[k], why)
        self.split = smaller
        return True

    def admit(self, rope: Rope) -> None:
        """Predict the recordings that waited, and leave out those that do not belong to the others."""
        waiting = self.split.waiting
        if not waiting:
            return
        split = replace(self.split, fitted=waiting, judged=(), since=())
        errors = errors_of(rope.model, rope.values, split, self.threads).fitted
        found = misfits(np.concatenate([errors, rope.errors.whole]))
        for k, motion in enumerate(waiting):
            if k in found:
                self._without(motion, found[k])
        kept = tuple(motion for k, motion in enumerate(waiting) if k not in found)
        self.split = replace(self.split, waiting=kept)

    def _without(self, motion: GrippedMotion, why: str) -> None:
        """Note and print that a recording is left out."""
        sentence = f"{motion.recording.name} is left out of the fit: {why}"
        self.left_out = [*self.left_out, sentence]  # a new list: a climb that goes back restores the one before
        self.say(sentence)
