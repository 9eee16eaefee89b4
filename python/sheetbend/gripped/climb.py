"""The way up the ladder: from one straight rope rung by rung to what the recordings support."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..errors import SheetbendError
from ..problem.problem import FitProblem
from ..result.result import Start
from .beside import Offsets, beside, frames_of, offsets_found
from .carried import carry
from .clock import LEAST, LEFT, lateness
from .first_order import first_order
from .judging import BETTER, EQUAL, Verdict, predict, verdict
from .ladder import AND, Rung, together
from .model import NAME, RopeModel
from .motion import GrippedMotion
from .search import LONG, Search
from .steps import Parts, Rope, Step
from .straight import SHORT, straight

NEAR = 1.5  # of the median error: models that were farther off cannot predict equally well
FEW = 3  # derivatives, at most, of a rung that is nearly linear


class Climb:
    """A climb on the recordings of a search; `rope` and `steps` hold how far it has come.

    Attributes:
        raced: the starts of the first rung, where they were raced.
        tried: ropes of all rungs that did not diverge.
        beside: how far the markers sit beside the rope's axis, where the recordings were moved onto it.
        late: by how many s the markers of the grips come after the others, where the grips are taken as earlier.
    """

    def __init__(self, search: Search) -> None:
        self.search = search
        self.raced: tuple[Start, ...] = ()
        self.steps: list[Step] = []
        self.tried: list[Rope] = []
        self.rope: Rope | None = None
        self.beside: Offsets = ()
        self.late = 0.0
        self._recorded: dict[GrippedMotion, GrippedMotion] = {}  # by what was moved onto the axis

    def run(
        self,
        models: Sequence[RopeModel],
        ladder: Sequence[Rung],
        bending_lengths: Sequence[float],
        most_links: int,
        starts: int | None = None,
    ) -> None:
        """Climb, from the best start of any of the models; Ctrl-C passes, and leaves what is finished.

        Args:
            starts: how many are raced; None = those of the bending lengths, one after the other.
        """
        began = time.perf_counter()
        first, self.raced = straight(self.search, models, ladder[0], bending_lengths, most_links, starts)
        self._keep(ladder[0], first, None, began)
        stayed = [self._climbed(rung) for rung in ladder[1:]]
        last = max((k for k, stays in enumerate(stayed) if stays), default=-1)
        dropped, late = list[Rung](), list[Rung]()
        for k, (rung, stays) in enumerate(zip(ladder[1:], stayed, strict=True)):
            if not (stays or rung.late):  # what helped nothing before may help beside what stayed later
                (late if k < last and self._climbed(rung) else dropped).append(rung)
        dropped = [rung for rung in dropped if not rung.beside]
        if len(dropped) > 1 and not all(rung.small for rung in dropped):
            # or only beside another: stiffness that varies looks like yield, and yield like it
            late += dropped if self._climbed(together(dropped)) else []
        self._reconsider(ladder, late)
        for rung in ladder:
            if (rung.beside and self.beside) or (rung.late and self.late):
                self._climbed(rung)  # what the rope's shape had taken up of it, and gave back since
        assert self.rope is not None
        self.gather()
        self.search.admit(self.rope)

    def gather(self) -> None:
        """Move the recordings that wait onto the rope's axis, where the others were."""
        assert self.rope is not None
        if self.beside:
            self._onto(self.rope, self.beside, [m for m in self.search.split.waiting if m not in self._recorded])

    def _climbed(self, rung: Rung) -> bool:
        """Try a rung; whether it stays."""
        began = time.perf_counter()
        assert self.rope is not None
        if rung.late:
            return self._on_clock(rung, self.rope, began)
        if rung.beside:
            return self._onto_axis(rung, self.rope, began)
        larger, parameters = self._with(rung, self.rope)
        start = Rope(larger, parameters, self.rope.values)
        if rung.small:
            problem = self.search.problem(start, self.search.longest)
            carry(problem, self.rope.slopes, rung.wanted(self.search.split.fitted[0]), start.values)
            told = first_order(problem, larger, start.values, self.search.split, self.search.threads)
            if told is not None and told.ratio >= BETTER:
                return self._skip(rung, told, began)
            found = self._long(rung.name, start, FEW, problem)
        else:
            found = self._tried(rung, start)
        self._keep(rung, found, None if found is None else verdict(found.errors, self.rope.errors), began)
        return self.steps[-1].stays

    def _on_clock(self, rung: Rung, rope: Rope, began: float) -> bool:
        """Try the grips as so much earlier as their markers come late; whether that stays."""
        search = self.search
        given, split = search.given, search.split
        by = lateness(rope.model, split.fitted, rope.values, search.threads)
        if by is None or abs(by) < (LEFT if self.late else LEAST):
            why = "no delay is found" if by is None else f"a delay of {1e3 * by:.2g} ms is too small to be detected"
            return self._skip(rung, verdict(rope.errors, rope.errors), began, why)
        found: Rope | None = None
        told: Verdict | None = None
        try:
            self._replace({m: m.later(by) for m in (*search.whole, *split.motions)})
            found = self._long(rung.name, rope)
            told = None if found is None else verdict(found.errors, rope.errors)
        finally:  # Ctrl-C in the fit leaves the grips as they were
            if told is None or not told.stays:
                search.given, search.split = given, split
        if told is not None and told.stays:
            self.late += by
            when = "after" if self.late > 0 else "before"
            search.say(f"the markers of the grips come {1e3 * abs(self.late):.3g} ms {when} the others")
        self._keep(rung, found, told, began)
        return self.steps[-1].stays

    def _replace(self, every: Mapping[GrippedMotion, GrippedMotion]) -> None:
        """Take other motions in place of what is given and its split."""

        def moved(motion: GrippedMotion) -> GrippedMotion:
            return every.get(motion, motion)

        self.search.given = tuple(moved(m) for m in self.search.whole)
        self.search.split = self.search.split.each(moved)

    def _onto_axis(self, rung: Rung, rope: Rope, began: float) -> bool:
        """Try the recordings, moved onto the rope's axis; whether they stay there. What is fitted next follows them."""
        given, split = self.search.given, self.search.split
        offsets = self._offsets(rope)
        found: Rope | None = None
        told: Verdict | None = None
        try:
            if offsets is not None:
                self._move(rope, offsets)
                found = self.search.judged(rope)
                told = verdict(found.errors, rope.errors)
        finally:  # Ctrl-C leaves the markers where they were
            if told is None or not told.stays:
                self.search.given, self.search.split = given, split
        if told is not None and told.stays and offsets is not None:
            before = self.beside or ((0.0, 0.0),) * len(offsets)
            self.beside = tuple((a + c, b + d) for (a, b), (c, d) in zip(before, offsets, strict=True))
        self._keep(rung, found, told, began)
        return self.steps[-1].stays

    def _offsets(self, rope: Rope) -> Offsets | None:
        """Of the markers, from the axis; None where a motion diverges."""
        motions = self.search.split.fitted
        try:
            frames = [frames_of(rope.model, m, rope.values) for m in motions]
        except SheetbendError:
            return None
        return offsets_found(motions, predict(rope.model, motions, rope.values, self.search.threads), frames)

    def _put_back(self) -> None:
        """What is given and its split, with the markers where they were recorded."""

        def recorded(motion: GrippedMotion) -> GrippedMotion:
            return self._recorded.get(motion, motion)

        self.search.given, self.beside = tuple(recorded(m) for m in self.search.given), ()
        self.search.split = self.search.split.each(recorded)

    def _move(self, rope: Rope, offsets: Offsets) -> None:
        """Take the motions with their markers on the rope's axis, those that wait at last (`gather`)."""
        split = self.search.split
        self._onto(rope, offsets, (*split.motions, *(self.search.whole if split.cut else ())))

    def _onto(self, rope: Rope, offsets: Offsets, motions: Iterable[GrippedMotion]) -> None:
        """Take these motions with their markers on the rope's axis."""
        every = {m: m.moved(-beside(rope.model, m, rope.values, offsets)) for m in motions}
        self._recorded |= {moved: self._recorded.get(m, m) for m, moved in every.items()}
        self._replace(every)

    def _reconsider(self, ladder: Sequence[Rung], late: Sequence[Rung]) -> None:
        """Take back offsets of grips and markers that stayed before a part of the rope itself did: they may have stood
        in for it. Each has to help beside it, and all ends as before where that predicts better."""
        before, began = self.rope, time.perf_counter()
        assert before is not None
        since = min((k for k, rung in enumerate(ladder) if rung in late and not rung.offsets), default=len(ladder))
        again = [r for r in ladder[since:] if r.offsets and (self.beside if r.beside else r.within(before.model))]
        if not again:
            return
        kept, steps = (self.search.given, self.search.split, self.beside, self.search.left_out), self.steps
        if self.beside:
            self._put_back()
        without, name = before, f"without {AND.join(rung.name for rung in again)}"
        for rung in again:
            without = without.without(rung, self.search.split.fitted[0])
        try:
            smaller = self._long(name, without)
        except KeyboardInterrupt:
            self.search.given, self.search.split, self.beside, self.search.left_out = kept
            raise
        if smaller is not None:
            gone = {rung.name for rung in again}
            self.steps = [replace(s, stays=s.stays and s.name not in gone) for s in steps]
            self._note(name, smaller, verdict(smaller.errors, before.errors), True, began)
            self.rope = smaller
            for rung in again:
                self._climbed(rung)
            if not verdict(before.errors, self.rope.errors).stays:
                return
            self.search.say("all offsets together predict better: they stay as they were")
            self.steps = [*steps, *(replace(s, stays=False) for s in self.steps[len(steps) :])]
        self.rope = before
        self.search.given, self.search.split, self.beside, self.search.left_out = kept

    def _skip(self, rung: Rung, told: Verdict, began: float, why: str | None = None) -> bool:
        """Note a rung that promises nothing; it does not stay.

        Args:
            why: in words; None = by what one step promises.
        """
        assert self.rope is not None
        fitted, others = self.rope.errors.typical
        seconds = time.perf_counter() - began
        self.steps.append(Step(rung.name, fitted, others, False, seconds, told.ratio, told.better, told.count))
        why = why or f"one step predicts {told.ratio:.3g} times the errors without it"
        self.search.say(f"{rung.name}: {why}, is not kept")
        return False

    def _with(self, rung: Rung, rope: Rope) -> tuple[RopeModel, Parts]:
        """The rope's model and parameters, with what a rung adds."""
        return rung.added_to(rope.model), (*rope.parameters, *rung.wanted(self.search.split.fitted[0]))

    def equal(self) -> list[Rope]:
        """What was tried and predicts as well as the rope that was found."""
        assert self.rope is not None
        here = self.rope.errors
        near = [rope for rope in self.tried if rope.values is not self.rope.values and _near(rope, self.rope)]
        others = [self.search.judged(rope) for rope in near]
        return [rope for rope in others if abs(verdict(rope.errors, here).ratio - 1.0) <= EQUAL]

    def _keep(self, rung: Rung, found: Rope | None, told: Verdict | None, began: float) -> None:
        """Note a rung that was tried, and take it where it stays."""
        first = self.rope is None
        stays = found is not None and (first or (told is not None and told.stays))
        if found is not None:
            self.tried.append(replace(found, slopes=None))  # which are large
            if stays:
                self.rope = found
        self._note(rung.name, found, told, stays, began)
        if stays and not first and self.rope is not None and self.search.leave_out(self.rope.errors.whole):
            # the better the model, the clearer what does not belong; the next rung has to beat a fit without it
            self.rope = self.search.judged(self.search.fitted(self.rope, self.search.longest))

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
            self.search.say(f"{step.name}: diverges, is not kept")
            return
        errors = f"{1e3 * step.fitted:.3g} mm, {1e3 * step.others:.3g} mm on others"
        if step.ratio is not None:
            errors += f", {step.ratio:.3g} times without it, better on {step.better} of {step.count}"
        self.search.say(f"{step.name}: {errors}{'' if step.stays else ', is not kept'}")

    def _tried(self, rung: Rung, rope: Rope) -> Rope | None:
        """A rope with a rung, fitted to middle windows from each of the rung's starts, and the best of these to long
        ones; None where all diverge."""
        ends = []
        for start in ({}, *rung.starts):
            shifted = {f"{NAME}_{k}": v for k, v in start.items() if k != "EI"}
            shifted[f"{NAME}_EI"] = rope.values[f"{NAME}_EI"] * start.get("EI", 1.0)
            found = self.search.descended(replace(rope, values={**rope.values, **shifted}), self.search.middle, SHORT)
            if found is not None:
                ends.append(found)
        if not ends:
            return None
        return self._long(rung.name, min(ends, key=lambda end: end[1].cost)[0])

    def _long(self, name: str, rope: Rope, most: int = LONG, problem: FitProblem | None = None) -> Rope | None:
        """Fitted to long windows, and judged; None where it diverges.

        Args:
            problem: of these windows, where it was made (`_problem`) and has a derivative already.
        """
        try:
            return self.search.judged(self.search.fitted(rope, self.search.longest, most, problem))
        except SheetbendError as error:
            self.search.say(f"{name}: {error}")
            return None


def _near(one: Rope, other: Rope) -> bool:
    """Whether a rope was off by about as little as another when each was judged."""
    return one.errors.typical[1] <= NEAR * other.errors.typical[1]
