"""The way up the ladder: from several starts to one straight rope, then rung by rung to what the recordings support."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from ..errors import SheetbendError
from ..experiment.experiment import Experiment
from ..quantities.parameters import Parameter
from .beside import Offsets, beside, frames_of, offsets_found
from .bounds import bounded
from .descent import bearable, descend
from .first_order import first_order
from .judging import BETTER, EQUAL, Split, Verdict, errors_of, misfits, predict, verdict
from .ladder import AND, Rung, together
from .model import NAME, RopeModel
from .motion import GrippedMotion
from .pieces import experiments_of, problem_of
from .start import about, started
from .steps import Parts, Rope, Step
from .windows import Span

SETTLED = 0.05  # relative change of EI at which links are short enough
FINE = 24  # links, that hold all modes of the ladder: of two numbers that agree the smaller one is taken from here on
SEARCHED = 0.5  # of the total of long windows that the last fit sees: enough to decide on rungs
ENOUGH = 5e-3  # of the cost: what a step must promise while searching
FEW, SHORT, LONG = 3, 12, 30  # derivatives, at most: of a rung that is nearly linear, of a start, and on long windows

Say = Callable[[str], None]


class Climb:
    """A search on given recordings; `rope`, `steps` and `left_out` hold how far it has come.

    Attributes:
        split: what is fitted and judged; without what was left out.
        left_out: sentences on recordings that are neither fitted nor judged.
        beside: how far the markers sit beside the rope's axis, where the recordings were moved onto it.
        equal: ropes of rungs that predict as well as the last one that stayed.
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
        self.steps: list[Step] = []
        self.tried: list[Rope] = []
        self.rope: Rope | None = None
        self.beside: Offsets = ()
        self._recorded: dict[GrippedMotion, GrippedMotion] = {}  # by what was moved onto the axis

    def run(
        self, models: Sequence[RopeModel], ladder: Sequence[Rung], bending_lengths: Sequence[float], most_links: int
    ) -> None:
        """Climb, from the best start of any of the models; Ctrl-C passes, and leaves what is finished."""
        began = time.perf_counter()
        self._keep(ladder[0], self._straight(models, ladder[0], bending_lengths, most_links), None, began)
        stayed = [self._climbed(rung) for rung in ladder[1:]]
        last = max((k for k, stays in enumerate(stayed) if stays), default=-1)
        dropped, late = list[Rung](), list[Rung]()
        for k, (rung, stays) in enumerate(zip(ladder[1:], stayed, strict=True)):
            if not stays:  # what helped nothing before may help beside what stayed later
                (late if k < last and self._climbed(rung) else dropped).append(rung)
        dropped = [rung for rung in dropped if not rung.beside]
        if len(dropped) > 1 and not all(rung.small for rung in dropped):
            # or only beside another: stiffness that varies looks like yield, and yield like it
            late += dropped if self._climbed(together(dropped)) else []
        self._reconsider(ladder, late)
        for rung in ladder:
            if rung.beside and self.beside:
                self._climbed(rung)  # what the rope's shape had taken up of the offsets, and gave back since

    def _climbed(self, rung: Rung) -> bool:
        """Try a rung; whether it stays."""
        began = time.perf_counter()
        assert self.rope is not None
        if rung.beside:
            return self._onto_axis(rung, self.rope, began)
        if rung.small and (told := self._first(rung, self.rope)) is not None and told.ratio >= BETTER:
            return self._skip(rung, told, began)
        found = self._tried(rung, self.rope)
        self._keep(rung, found, None if found is None else verdict(found.errors, self.rope.errors), began)
        return self.steps[-1].stays

    def _onto_axis(self, rung: Rung, rope: Rope, began: float) -> bool:
        """Try the recordings, moved onto the rope's axis; whether they stay there. What is fitted next follows them."""
        given, split = self.given, self.split
        found, offsets = None, self._offsets(rope)
        if offsets is not None:
            self.given, self.split = self._moved(rope, offsets)
            found = self._judged(rope)
        told = None if found is None else verdict(found.errors, rope.errors)
        if told is not None and told.stays and offsets is not None:
            before = self.beside or ((0.0, 0.0),) * len(offsets)
            self.beside = tuple((a + c, b + d) for (a, b), (c, d) in zip(before, offsets, strict=True))
        else:
            self.given, self.split = given, split
        self._keep(rung, found, told, began)
        return self.steps[-1].stays

    def _offsets(self, rope: Rope) -> Offsets | None:
        """Of the markers, from the axis; None where a motion diverges."""
        motions = self.split.fitted
        try:
            frames = [frames_of(rope.model, m, rope.values) for m in motions]
        except SheetbendError:
            return None
        return offsets_found(motions, predict(rope.model, motions, rope.values, self.threads), frames)

    def _put_back(self) -> None:
        """What is given and its split, with the markers where they were recorded."""
        recorded = [
            tuple(self._recorded.get(m, m) for m in part) for part in (self.given, self.split.fitted, self.split.judged)
        ]
        self.given, self.beside = recorded[0], ()
        self.split = replace(self.split, fitted=recorded[1], judged=recorded[2])

    def _moved(self, rope: Rope, offsets: Offsets) -> tuple[tuple[GrippedMotion, ...], Split]:
        """What is given and its split, with the markers on the rope's axis."""
        every = {m: m.moved(-beside(rope.model, m, rope.values, offsets)) for m in (*self.whole, *self.split.motions)}
        self._recorded |= {moved: self._recorded.get(m, m) for m, moved in every.items()}
        fitted, judged = (tuple(every[m] for m in part) for part in (self.split.fitted, self.split.judged))
        return tuple(every[m] for m in self.whole), replace(self.split, fitted=fitted, judged=judged)

    def _reconsider(self, ladder: Sequence[Rung], late: Sequence[Rung]) -> None:
        """Take back offsets of grips and markers that stayed before a part of the rope itself did: they may have stood
        in for it. Each has to help beside it, and all ends as before where that predicts better."""
        before, began = self.rope, time.perf_counter()
        assert before is not None
        since = min((k for k, rung in enumerate(ladder) if rung in late and not rung.offsets), default=len(ladder))
        again = [r for r in ladder[since:] if r.offsets and (self.beside if r.beside else r.within(before.model))]
        if not again:
            return
        kept, steps = (self.given, self.split, self.beside, self.left_out), self.steps
        if self.beside:
            self._put_back()
        without, name = before, f"without {AND.join(rung.name for rung in again)}"
        for rung in again:
            without = without.without(rung, self.split.fitted[0])
        smaller = self._long(name, without)
        if smaller is not None:
            gone = {rung.name for rung in again}
            self.steps = [replace(s, stays=s.stays and s.name not in gone) for s in steps]
            self._note(name, smaller, verdict(smaller.errors, before.errors), True, began)
            self.rope = smaller
            for rung in again:
                self._climbed(rung)
            if not verdict(before.errors, self.rope.errors).stays:
                return
            self.say("all offsets together predict better: they stay as they were")
            self.steps = [*steps, *(replace(s, stays=False) for s in self.steps[len(steps) :])]
        self.rope = before
        self.given, self.split, self.beside, self.left_out = kept

    def _first(self, rung: Rung, rope: Rope) -> Verdict | None:
        """What one step with the rung would improve."""
        larger, parameters = self._with(rung, rope)
        free = bounded(parameters, larger, self.split.fitted, self.longest[0])
        return first_order(larger, free, rope.values, self.split, self.longest, self.threads)

    def _skip(self, rung: Rung, told: Verdict, began: float) -> bool:
        """Note a rung that promises nothing; it does not stay."""
        assert self.rope is not None
        fitted, others = self.rope.errors.typical
        seconds = time.perf_counter() - began
        self.steps.append(Step(rung.name, fitted, others, False, seconds, told.ratio, told.better, told.count))
        self.say(f"{rung.name}: one step promises {told.ratio:.3g} times the errors without it, does not stay")
        return False

    def _with(self, rung: Rung, rope: Rope) -> tuple[RopeModel, Parts]:
        """The rope's model and parameters, with what a rung adds."""
        return rung.added_to(rope.model), (*rope.parameters, *rung.wanted(self.split.fitted[0]))

    @property
    def whole(self) -> list[GrippedMotion]:
        """All motions that belong, uncut."""
        kept = {id(m) for m in self.split.motions}
        return [m for m in self.given if self.split.cut or id(m) in kept]

    def equal(self) -> list[Rope]:
        """What was tried and predicts as well as the rope that was found."""
        assert self.rope is not None
        here = self._judged(self.rope).errors
        others = [self._judged(rope) for rope in self.tried if rope.values is not self.rope.values]
        return [rope for rope in others if abs(verdict(rope.errors, here).ratio - 1.0) <= EQUAL]

    def _keep(self, rung: Rung, found: Rope | None, told: Verdict | None, began: float) -> None:
        """Note a rung that was tried, and take it where it stays."""
        first = self.rope is None
        stays = found is not None and (first or (told is not None and told.stays))
        if found is not None:
            self.tried.append(found)
            if stays:
                self.rope = found
        self._note(rung.name, found, told, stays, began)
        if stays and not first and self.rope is not None and self._leave_out(self.rope.errors.whole):
            # the better the model, the clearer what does not belong; the next rung has to beat a fit without it
            self.rope = self._judged(self._on(self.rope, self.longest))

    def _note(self, name: str, found: Rope | None, told: Verdict | None, stays: bool, began: float) -> None:
        """Add a step, once it counts: who is told of it may stop there."""
        fitted, others = (np.inf, np.inf) if found is None else found.errors.typical
        judged = {} if told is None else {"ratio": told.ratio, "better": told.better, "count": told.count}
        EI = None if found is None else found.values[f"{NAME}_EI"]
        step = Step(name, fitted, others, stays, time.perf_counter() - began, EI=EI, **judged)  # type: ignore[arg-type]
        self.steps.append(step)
        self._tell(step)

    def _tell(self, step: Step) -> None:
        if not np.isfinite(step.others):
            self.say(f"{step.name}: diverges, does not stay")
            return
        errors = f"{1e3 * step.fitted:.3g} mm, {1e3 * step.others:.3g} mm on others"
        if step.ratio is not None:
            errors += f", {step.ratio:.3g} times without it, better on {step.better} of {step.count}"
        self.say(f"{step.name}: {errors}{'' if step.stays else ', does not stay'}")

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

    def _tried(self, rung: Rung, rope: Rope) -> Rope | None:
        """A rung fitted to middle windows from each of its starts, and the best of these to long ones; a small one to
        long ones at once. None where all diverge."""
        larger, parameters = self._with(rung, rope)
        if rung.small:
            return self._long(rung.name, Rope(larger, parameters, rope.values), FEW)
        ends = []
        for start in ({}, *rung.starts):
            shifted = {f"{NAME}_{k}": v for k, v in start.items() if k != "EI"}
            shifted[f"{NAME}_EI"] = rope.values[f"{NAME}_EI"] * start.get("EI", 1.0)
            found = self._descended(Rope(larger, parameters, {**rope.values, **shifted}), self.middle, SHORT)
            if found is not None:
                ends.append(found)
        if not ends:
            return None
        return self._long(rung.name, min(ends, key=lambda end: end[1])[0])

    def _long(self, name: str, rope: Rope, most: int = LONG) -> Rope | None:
        """Fitted to long windows, and judged; None where it diverges."""
        try:
            return self._judged(self._on(rope, self.longest, most))
        except SheetbendError as error:
            self.say(f"{name}: {error}")
            return None

    def _on(self, rope: Rope, window: Span, most: int = LONG) -> Rope:
        """The rope fitted to such windows.

        Raises:
            SheetbendError: the motion diverges.
        """
        found = self._descended(rope, window, most)
        if found is None:
            raise SheetbendError(f"the motion diverges on windows of {window[0]:g} s")
        return found[0]

    def _descended(self, rope: Rope, window: Span, most: int = LONG) -> tuple[Rope, float] | None:
        """A rope and its cost after a descent on the windows that do not diverge at first; None where most do."""
        experiments = experiments_of(rope.model, self.split.fitted, window, rope.values)
        free = bounded(rope.parameters, rope.model, self.split.fitted, window[0])
        end = descend(experiments, free, rope.values, most, self.threads, ENOUGH)
        if not end.finite:
            sound = self._sound(experiments, free, rope.values)
            if 2 * len(sound) <= len(experiments):
                return None
            end = descend(sound, free, rope.values, most, self.threads, ENOUGH)
        return (Rope(rope.model.at(end.values), rope.parameters, end.values), end.cost) if end.finite else None

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
            self.left_out.append(f"{self.split.motions[k].recording.name} is left out of the fit: {why}")
            self.say(self.left_out[-1])
        self.split = smaller
        return True
