"""The beginning of a climb: from several starts to one straight rope that is fitted to whole recordings."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from ..errors import SheetbendError
from ..experiment.experiment import Experiment
from ..minimum.problem import FitProblem
from ..quantities.parameters import Parameter
from .bounds import bounded
from .descent import bearable, descend
from .judging import Split, errors_of, misfits
from .ladder import Rung
from .model import NAME, RopeModel
from .motion import GrippedMotion
from .pieces import experiments_of, problem_of
from .start import about, started
from .steps import Rope
from .windows import Span

SETTLED = 0.05  # relative change of EI at which links are short enough
FINE = 24  # links, that hold all modes of the ladder: of two numbers that agree the smaller one is taken from here on
SEARCHED = 0.5  # of the total of long windows that the last fit sees: enough to decide on rungs
ENOUGH = 5e-3  # of the cost: what a step must promise while searching
SHORT, LONG = 12, 30  # derivatives, at most: of a start, and on long windows

Say = Callable[[str], None]


class Straight:
    """A search for the first rung on given recordings.

    Attributes:
        given: all motions.
        split: what is fitted and judged; without what was left out.
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

    def _straight(
        self, models: Sequence[RopeModel], rung: Rung, bending_lengths: Sequence[float], most_links: int
    ) -> Rope:
        """The first rung, from the best start that gets to its end.

        Raises:
            SheetbendError: none does.
        """
        for start in self._started(models, rung, bending_lengths):
            try:
                return self._refined(start, most_links)
            except SheetbendError as error:
                self.say(f"from EI {start.values[f'{NAME}_EI']:.3g}: {error}; on to the next start")
        raise SheetbendError("no start of a straight rope gives a motion that does not diverge")

    def _started(self, models: Sequence[RopeModel], rung: Rung, bending_lengths: Sequence[float]) -> list[Rope]:
        """Starts fitted to short windows, best first: by the median error of predictions, then by the cost."""
        ends = []
        for model, length in product(models, bending_lengths):
            candidate = started(model, self.split.motions, length)
            own = about(rung.wanted(self.split.fitted[0]), candidate)
            found = self._descended(Rope(candidate, own, {}), self.windows[0], SHORT)
            if found is None:
                self.say(f"start at a bending length of {length:g} m: diverges")
                continue
            rope, cost = found
            errors = errors_of(rope.model, rope.values, self.split, self.threads)
            EI, middle = rope.values[f"{NAME}_EI"], float(np.median(errors.fitted))
            self.say(f"start at a bending length of {length:g} m: EI {EI:.3g}, error {1e3 * middle:.3g} mm")
            ends.append((middle, cost, replace(rope, errors=errors)))
        ends.sort(key=lambda end: end[:2])
        ropes = [rope for _, _, rope in ends]
        if ropes:
            least = np.min([rope.errors.whole for rope in ropes], axis=0)
            self._leave_out(least)
        return ropes

    def _refined(self, rope: Rope, most_links: int) -> Rope:
        """On longer windows, with the links doubled until EI moves by less than 5 %, and fitted to the longest; then
        once more without recordings that do not belong to the others.

        Raises:
            SheetbendError: the motion diverges.
        """
        for window in [*self.windows[1:-1], self.middle]:
            rope = self._on(rope, window)
        moved = np.inf
        while moved >= SETTLED and 2 * rope.model.segments <= most_links:
            finer = self._on(replace(rope, model=replace(rope.model, segments=2 * rope.model.segments)), self.middle)
            moved = abs(finer.values[f"{NAME}_EI"] / rope.values[f"{NAME}_EI"] - 1.0)
            self.say(f"{rope.model.segments} to {finer.model.segments} links move EI by {100 * moved:.2g} %")
            if moved < SETTLED and rope.model.segments >= FINE:
                break  # the intervals count what the finer ones would move
            rope = finer
        rope = self._judged(self._on(rope, self.longest))
        if self._leave_out(rope.errors.whole):
            rope = self._judged(self._on(rope, self.longest))
        if not np.isfinite(rope.errors.typical).all():
            raise SheetbendError("most predictions diverge")
        return rope

    def _on(self, rope: Rope, window: Span, most: int = LONG, problem: FitProblem | None = None) -> Rope:
        """The rope fitted to such windows.

        Raises:
            SheetbendError: the motion diverges.
        """
        found = self._descended(rope, window, most, problem)
        if found is None:
            raise SheetbendError(f"the motion diverges on windows of {window[0]:g} s")
        return found[0]

    def _descended(
        self, rope: Rope, window: Span, most: int = LONG, problem: FitProblem | None = None
    ) -> tuple[Rope, float] | None:
        """A rope and its cost after a descent on the windows that do not diverge at first; None where most do."""
        problem = problem or self._problem(rope, window)
        end = descend(problem, most, ENOUGH)
        if not end.finite:
            free = list(problem.given.values())
            sound = self._sound(problem.experiments, free, rope.values)
            if 2 * len(sound) <= len(problem.experiments):
                return None
            end = descend(problem_of(sound, free, rope.values, self.threads), most, ENOUGH)
        return (Rope(rope.model.at(end.values), rope.parameters, end.values), end.cost) if end.finite else None

    def _problem(self, rope: Rope, window: Span) -> FitProblem:
        """The least-squares problem of windows of what is fitted, which starts at the rope's values."""
        experiments = experiments_of(rope.model, self.split.fitted, window, rope.values)
        free = bounded(rope.parameters, rope.model, self.split.fitted, window[0])
        return problem_of(experiments, free, rope.values, self.threads)

    def _sound(
        self, experiments: Sequence[Experiment], parameters: Sequence[Parameter], values: Mapping[str, float]
    ) -> list[Experiment]:
        """Those that do not diverge at these values."""
        problems = (problem_of([e], parameters, values) for e in experiments)
        sound = [bearable(p, p.cost(p.parameters.initial())) for p in problems]
        return [e for e, ok in zip(experiments, sound, strict=True) if ok]

    def _judged(self, rope: Rope) -> Rope:
        return replace(rope, errors=errors_of(rope.model, rope.values, self.split, self.threads))

    def _leave_out(self, errors: np.ndarray) -> bool:
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

    def _without(self, motion: GrippedMotion, why: str) -> None:
        """Tell that a recording is left out."""
        self.left_out.append(f"{motion.recording.name} is left out of the fit: {why}")
        self.say(self.left_out[-1])

    def _admit(self, rope: Rope) -> None:
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
