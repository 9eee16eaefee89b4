"""The beginning of a climb: from several starts to one straight rope that is fitted to whole recordings."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from ..errors import SheetbendError
from ..minimum.problem import FitProblem
from ..minimum.race import groups_of
from ..result.result import Start
from .bounds import bounded
from .descent import Descent, bearable, descend
from .judging import Split, errors_of, misfits
from .ladder import Rung
from .model import NAME, RopeModel
from .motion import GrippedMotion
from .pieces import experiments_of, problem_of
from .raced import raced, rows
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
        raced: the starts of the first rung, where they were raced.
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
        self.raced: tuple[Start, ...] = ()

    def _straight(
        self,
        models: Sequence[RopeModel],
        rung: Rung,
        bending_lengths: Sequence[float],
        most_links: int,
        count: int | None = None,
    ) -> Rope:
        """The first rung, from the best start that gets to its end.

        Args:
            count: of starts that are raced; None = those of the bending lengths, one after the other.

        Raises:
            SheetbendError: none does.
        """
        if count is None:
            starts = self._started(models, rung, bending_lengths)
        else:
            starts = self._of_groups(models, rung, bending_lengths, count)
        for start in starts:
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
            rope, end = found
            rope, middle = self._scored(rope, f"start at a bending length of {length:g} m")
            ends.append((middle, end.cost, rope))
        ends.sort(key=lambda end: end[:2])
        return self._of_others([rope for _, _, rope in ends])

    def _of_groups(
        self, models: Sequence[RopeModel], rung: Rung, bending_lengths: Sequence[float], count: int
    ) -> list[Rope]:
        """Raced starts, one for each of their groups, fitted to the longest windows: best first, as `_started`."""
        ends = []
        for model in models:
            firsts = [started(model, self.split.motions, length) for length in bending_lengths]
            first = Rope(firsts[0], about(rung.wanted(self.split.fitted[0]), firsts[0]), {})
            problem = self._problem(first, self.windows[0])
            if not bearable(problem, problem.cost(problem.parameters.initial())):
                problem = self._of_sound(problem, first.values) or problem
            ended = raced(problem, [candidate.quantities for candidate in firsts], count)
            fits, mine = dict[int, Descent](), []
            for number, group in enumerate(groups_of(ended), 1):
                values = problem.parameters.to_physical(min(group, key=lambda end: end.cost).u)
                found = self._through(replace(first, model=first.model.at(values), values=values))
                name = f"{len(group)} of {count} starts end alike"
                if found is None:
                    self.say(f"{name}: diverges on longer windows")
                    continue
                fits[number] = found[1]
                rope, middle = self._scored(found[0], name)
                mine.append((middle, found[1].cost, rope))
            lost = sum(not one.group for one in ended)
            if lost:
                self.say(f"{lost} of {count} starts lead nowhere: the motion diverges from there")
            ends += [(*end, rows(problem, ended, fits)) for end in mine]
        ends.sort(key=lambda end: end[:2])
        if ends:
            self.raced = ends[0][-1]
        return self._of_others([rope for _, _, rope, _ in ends])

    def _through(self, rope: Rope) -> tuple[Rope, Descent] | None:
        """Fitted to middle windows, then to the longest; None where most of these diverge."""
        found = self._descended(rope, self.middle)
        return None if found is None else self._descended(found[0], self.longest)

    def _scored(self, rope: Rope, name: str) -> tuple[Rope, float]:
        """The rope with its errors, told by a name, and their median."""
        rope = self._judged(rope)
        EI, middle = rope.values[f"{NAME}_EI"], float(np.median(rope.errors.fitted))
        self.say(f"{name}: EI {EI:.3g}, error {1e3 * middle:.3g} mm")
        return rope, middle

    def _of_others(self, ropes: list[Rope]) -> list[Rope]:
        """The same, once recordings are left out that none of these ropes predicts as it does the others."""
        if ropes:
            self._leave_out(np.min([rope.errors.whole for rope in ropes], axis=0))
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
    ) -> tuple[Rope, Descent] | None:
        """A rope and its descent on the windows that do not diverge at first; None where most do."""
        problem = problem or self._problem(rope, window)
        end = descend(problem, most, ENOUGH)
        if not end.finite:
            sound = self._of_sound(problem, rope.values)
            if sound is None:
                return None
            end = descend(sound, most, ENOUGH)
        return (Rope(rope.model.at(end.values), rope.parameters, end.values), end) if end.finite else None

    def _problem(self, rope: Rope, window: Span) -> FitProblem:
        """The least-squares problem of windows of what is fitted, which starts at the rope's values."""
        experiments = experiments_of(rope.model, self.split.fitted, window, rope.values)
        free = bounded(rope.parameters, rope.model, self.split.fitted, window[0])
        return problem_of(experiments, free, rope.values, self.threads)

    def _of_sound(self, problem: FitProblem, values: Mapping[str, float]) -> FitProblem | None:
        """The problem of those windows that do not diverge at these values; None where most do."""
        free = list(problem.given.values())
        each = [problem_of([e], free, values) for e in problem.experiments]
        sound = [
            e for e, p in zip(problem.experiments, each, strict=True) if bearable(p, p.cost(p.parameters.initial()))
        ]
        return problem_of(sound, free, values, self.threads) if 2 * len(sound) > len(each) else None

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
