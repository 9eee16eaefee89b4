"""Fitting a rope held by two grips, step by step: from a straight rod with twist to what the recordings support.

Long open-loop predictions have a rugged cost, short ones a smooth one; stiff and damped is the safe side of a start.
So a fit begins with a few short windows and several stiffnesses, goes on to longer windows, and then adds one thing
after another to the model: tilts of the grips, a rest curvature, yield, a stiffness that varies. A step stays only if
it predicts recordings better that it was not fitted to, and no worse those that it was.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from ..chain import unit_vector
from ..discretization import Refinement
from ..errors import InputError, SheetbendError
from ..experiment import Experiment
from ..fit import Fit, fit
from ..journal import journaled
from ..optimizers import minimize
from ..parameters import Parameter, Parameters
from ..problem import FitProblem
from ..recording import Recording
from ..scores import coordinate_error
from .ladder import LADDER, TWIST, Rung
from .model import GRAVITY, NAME, RopeModel, nominal_directions, shared_gravity
from .motion import Array, GrippedMotion, motions_of
from .offsets import offset_reach
from .plausible import doubts
from .start import started

BENDING_LENGTHS = (0.45, 0.25, 0.12)  # m, of the starts: (EI/(density g))^(1/3), stiff first
LINKS_PER_BENDING_LENGTH = 3.0  # below this EI reads too high and GJ too low
SETTLED = 0.05  # relative change of EI at which links are short enough
BETTER = 0.99  # error of a step that stays, over that without it
TOLERANCE = 1e-4  # relative, of the cost, while searching
LAST_TOLERANCE = 1e-7  # of the fit that counts: its numbers are then within a few hundredths of their intervals
LOOK, SHORT, LONG = 6, 12, 30  # iterations, at most, of a first look at a rung, of a start, and of a fit that counts

Say = Callable[[str], None]


@dataclass(frozen=True)
class Step:
    """How a rung did: errors (mean absolute coordinate error of whole recordings, m) on the recordings that it was
    fitted to and on the others, whether it stayed, and its time."""

    name: str
    fitted: float
    others: float
    stays: bool
    seconds: float


@dataclass(frozen=True)
class RopeFit:
    """A fitted rope.

    Attributes:
        model: with the fitted values; `predict` simulates it.
        values: fitted quantities.
        steps: what was tried, in order.
        fit: the last fit with intervals and verdicts.
        warnings: what a reader must know before using the numbers.
    """

    model: RopeModel
    values: Mapping[str, float]
    steps: tuple[Step, ...]
    fit: Fit
    warnings: tuple[str, ...]

    @property
    def interrupted(self) -> bool:
        """Whether Ctrl-C ended it."""
        return self.fit.interrupted

    def predict(self, recording: Recording | GrippedMotion) -> Array:
        """(frames, markers, 3) m: open loop from the first frame, gripped markers as recorded."""
        (motion,) = motions_of([recording], self.model.smoothing)
        return predict(self.model, [motion], self.values)[0]


def predict(
    model: RopeModel, motions: Sequence[GrippedMotion], values: Mapping[str, float], threads: int = 1
) -> list[Array]:
    """Whole recordings, open loop from their first frames; NaN where a motion diverges."""
    experiments = [replace(model.experiment(m), fit=None) for m in motions]
    problem = _problem(experiments, (TWIST.parameters[0],), values)
    u = problem.parameters.initial()

    def one(k: int) -> Array:
        out, free = motions[k].recording.filled().positions.copy(), list(motions[k].free)
        try:
            out[:, free] = problem.simulate_one(k, u)
        except SheetbendError:
            out[:, free] = np.nan
        return out

    with ThreadPoolExecutor(threads) as pool:
        return list(pool.map(one, range(len(motions))))


@journaled
def fit_rope(
    recordings: Sequence[Recording | GrippedMotion],
    *,
    density: float,
    nominal: tuple[ArrayLike, ArrayLike] | None = None,
    ladder: Sequence[Rung] = LADDER,
    validate: float = 0.25,
    bending_lengths: Sequence[float] = BENDING_LENGTHS,
    windows: Sequence[tuple[float, float]] = ((0.5, 8.0), (1.5, 15.0), (5.0, 60.0)),
    segments: int = 12,
    max_segments: int = 48,
    substeps: int = 2,
    smoothing: float = 0.08,
    sigma: float = 5e-3,
    gravity: tuple[float, float, float] = GRAVITY,
    given: Mapping[str, float] | None = None,
    threads: int = 1,
    say: Say = lambda text: None,
    journal: str | Path | None = None,
) -> RopeFit:
    """Fit a rope's parameters to recordings between two grips.

    Args:
        recordings: with two or more clamped markers at each end; or their motions, smoothed already.
        density: kg/m, weighed.
        nominal: directions (3,) of the start and the end grip from which their frames are carried; the mean recorded
            ones by default.
        ladder: the rungs, in order; the first one always stays.
        validate: share of the recordings that decide whether a rung stays, and that no rung is fitted to; the last fit
            sees all.
        bending_lengths: m, of the starts.
        windows: (length, total) in s: each fit sees windows of this length, of about this total.
        segments, max_segments: links at the start, and at most; they are doubled until EI moves by less than 5 %.
        substeps: per frame.
        smoothing: s, of the recorded grips and starts.
        sigma: m, expected error of a marker.
        gravity: m/s^2, where the recordings do not tell.
        given: standard deviations of what the fit takes as given, such as {"rope_density": 0.02}; see `sheetbend.fit`.
        threads: the result does not depend on it.
        say: called with a line on each step.
        journal: file that keeps every evaluation until the rope is fitted, as that of `sheetbend.fit`.

    Returns:
        RopeFit. After Ctrl-C the one of the last finished rung, its fit marked `interrupted`.

    Raises:
        InputError, RecordingError: anything inconsistent, named, before work starts.
        KeyboardInterrupt: before the first rung was finished.
    """
    if not (np.isfinite(density) and density > 0):
        raise InputError("density", "must be positive", density, "weigh the rope and give kg/m")
    if not recordings:
        raise InputError("recordings", "are empty", 0, "give at least one")
    if not 0 <= validate < 1:
        raise InputError("validate", "must be a share below 1", validate, "give such as 0.25")
    motions = motions_of(recordings, smoothing)
    shared_gravity([m.recording for m in motions])
    doubtful = doubts(motions, gravity)
    for doubt in doubtful:
        say(f"doubtful: {doubt}")
    model = RopeModel(
        density=density,
        nominal=nominal_directions(motions)
        if nominal is None
        else (unit_vector("nominal", nominal[0]), unit_vector("nominal", nominal[1])),
        values={},
        segments=segments,
        substeps=substeps,
        smoothing=smoothing,
        sigma=sigma,
        gravity=gravity,
    )
    search = _Search(motions, validate, windows, given or {}, threads, say)
    found = search.run(model, ladder, bending_lengths, max_segments)
    return replace(found, warnings=(*doubtful, *found.warnings))


class _Search:
    def __init__(
        self,
        motions: Sequence[GrippedMotion],
        validate: float,
        windows: Sequence[tuple[float, float]],
        given: Mapping[str, float],
        threads: int,
        say: Say,
    ) -> None:
        count = len(motions)
        others = set(np.linspace(0, count - 1, round(validate * count), dtype=int).tolist()) if count > 1 else set()
        self.all = list(motions)
        self.fitted = [m for i, m in enumerate(motions) if i not in others]
        self.others = [m for i, m in enumerate(motions) if i in others]
        self.windows, self.given, self.threads, self.say = windows, given, threads, say
        self.middle, self.longest = windows[min(1, len(windows) - 1)], windows[-1]

    def run(
        self, model: RopeModel, ladder: Sequence[Rung], bending_lengths: Sequence[float], max_segments: int
    ) -> RopeFit:
        parameters: tuple[Parameter, ...] = ladder[0].parameters
        began, interrupted = time.perf_counter(), False
        steps: list[Step] = []
        try:
            model, values = self._first(model, ladder[0], bending_lengths)
            model, values = self._refined(model, parameters, values, max_segments)
            steps.append(self._step(ladder[0].name, model, values, steps, began))
            self._tell(steps[-1])  # once it counts: who is told of a step may stop there
            for rung in ladder[1:]:
                began = time.perf_counter()
                larger = replace(model, **dict(rung.options), values={**model.values, **rung.values})  # type: ignore[arg-type]
                wanted = (*parameters, *rung.parameters)
                found, step = self._tried(rung, larger, wanted, values, steps, began)
                steps.append(step)
                if step.stays:
                    model, parameters, values = larger.at(found), wanted, found
                self._tell(step)
        except KeyboardInterrupt:
            if not steps:
                raise
            interrupted = True
            self.say(f"interrupted: going back to {next(s.name for s in reversed(steps) if s.stays)}")
        last = self._conclude(model, parameters, values, interrupted)
        values = {**last.values, **last.on_mesh}  # of the model's own mesh
        return RopeFit(model.at(values), values, tuple(steps), last, tuple(_warnings(model, values)))

    def _first(
        self, model: RopeModel, rung: Rung, bending_lengths: Sequence[float]
    ) -> tuple[RopeModel, dict[str, float]]:
        """The best of several stiffnesses on short windows, then on longer ones."""
        ends = []
        for length in bending_lengths:
            candidate = started(model, self.all, length)
            values = self._minimum(candidate, rung.parameters, {}, self.windows[0], SHORT)
            cost = self._cost(candidate, values, self.middle)
            self.say(f"start at a bending length of {length:g} m: EI {values[f'{NAME}_EI']:.3g}, cost {cost:.4g}")
            ends.append((cost, candidate.at(values), values))
        _, model, values = min(ends, key=lambda end: end[0])
        for window in self.windows[1:-1]:
            values = self._minimum(model, rung.parameters, values, window)
            model = model.at(values)
        return model, values

    def _refined(
        self, model: RopeModel, parameters: tuple[Parameter, ...], values: dict[str, float], max_segments: int
    ) -> tuple[RopeModel, dict[str, float]]:
        """Doubles the links until EI moves by less than 5 %, and stays with the finer ones."""
        moved = np.inf
        before = self._minimum(model, parameters, values, self.middle)
        while moved >= SETTLED and 2 * model.segments <= max_segments:
            finer = replace(model, segments=2 * model.segments)
            found = self._minimum(finer, parameters, before, self.middle)
            moved = abs(found[f"{NAME}_EI"] / before[f"{NAME}_EI"] - 1.0)
            self.say(f"{model.segments} to {finer.segments} links move EI by {100 * moved:.2g} %")
            model, before = finer.at(found), found
        values = self._minimum(model, parameters, before, self.longest)
        return model.at(values), values

    def _tried(
        self,
        rung: Rung,
        model: RopeModel,
        parameters: tuple[Parameter, ...],
        values: Mapping[str, float],
        before: Sequence[Step],
        began: float,
    ) -> tuple[dict[str, float], Step]:
        """A rung fitted to long windows; a costly one only where a look at shorter ones already predicts better."""
        if rung.look_first:
            values = self._minimum(model, parameters, values, self.middle, LOOK)
            step = self._step(rung.name, model, values, before, began)
            if not step.stays:
                return dict(values), step
        found = self._minimum(model, parameters, values, self.longest)
        return found, self._step(rung.name, model, found, before, began)

    def _minimum(
        self,
        model: RopeModel,
        parameters: Sequence[Parameter],
        values: Mapping[str, float],
        window: tuple[float, float],
        iterations: int = LONG,
    ) -> dict[str, float]:
        problem = _problem(_experiments(model, self.fitted, window), parameters, values, self.threads)
        u = problem.parameters.initial()
        end, _ = minimize(problem, u, max_iterations=iterations, tolerance=TOLERANCE)
        if end.interrupted:
            raise KeyboardInterrupt
        return problem.parameters.to_physical(end.u)

    def _cost(self, model: RopeModel, values: Mapping[str, float], window: tuple[float, float]) -> float:
        problem = _problem(_experiments(model, self.fitted, window), (TWIST.parameters[0],), values, self.threads)
        return problem.cost(problem.parameters.initial())

    def _step(
        self, name: str, model: RopeModel, values: Mapping[str, float], before: Sequence[Step], began: float
    ) -> Step:
        fitted = self._error(model, values, self.fitted)
        others = self._error(model, values, self.others) if self.others else fitted
        kept = [s for s in before if s.stays]
        # one that fits worse than the smaller model ended elsewhere than in its minimum: better on others by chance
        stays = not kept or (others < BETTER * min(s.others for s in kept) and fitted <= min(s.fitted for s in kept))
        return Step(name, fitted, others, stays, time.perf_counter() - began)

    def _tell(self, step: Step) -> None:
        errors = f"{1e3 * step.fitted:.3g} mm, {1e3 * step.others:.3g} mm on others"
        self.say(f"{step.name}: {errors}{'' if step.stays else ', does not stay'}")

    def _error(self, model: RopeModel, values: Mapping[str, float], motions: Sequence[GrippedMotion]) -> float:
        predicted = predict(model, motions, values, self.threads)
        errors = [
            coordinate_error(m.recording, x) if np.isfinite(x).all() else np.inf
            for m, x in zip(motions, predicted, strict=True)
        ]
        return float(np.mean(errors))

    def _conclude(
        self, model: RopeModel, parameters: Sequence[Parameter], values: Mapping[str, float], interrupted: bool
    ) -> Fit:
        """The fit to all recordings, and what half the step and twice the links would move; after Ctrl-C one iteration
        of it, which the intervals need."""
        self.say(f"the fit that counts, to all {len(self.all)} recordings")
        finer = replace(model, segments=2 * model.segments)
        refine = Refinement(finer=lambda: _experiments(finer, self.all, self.longest), linear=True)
        last = fit(
            _experiments(model, self.all, self.longest),
            parameters=_starting(parameters, values),
            refine=None if interrupted else refine,
            systematic=offset_reach,
            windows=(),
            given=self.given,
            threads=self.threads,
            profiles=False,
            max_iterations=1 if interrupted else LONG,
            tolerance=LAST_TOLERANCE,
        )
        for refit in last.result.refits:
            moved = refit.moved[f"{NAME}_EI"] / last.values[f"{NAME}_EI"]
            self.say(f"{refit.name} would move EI by {100 * moved:+.2g} %")
        if not interrupted:
            return last
        warning = "interrupted: later rungs were not tried, and the last fit did not get to its end"
        return replace(last, result=replace(last.result, interrupted=True, converged=False, warnings=(warning,)))


def _experiments(model: RopeModel, motions: Sequence[GrippedMotion], window: tuple[float, float]) -> list[Experiment]:
    """Windows of one length, spread over all recordings, of about the total time."""
    length, total = window
    whole = [float(m.recording.times[-1] - m.recording.times[0]) for m in motions]
    places = [
        (m, start)
        for m, duration in zip(motions, whole, strict=True)
        for start in (m.recording.times[0] + length * np.arange(max(1, int(duration / length + 1e-9)))).tolist()
        if m.shown(int(np.searchsorted(m.recording.times, start - 1e-9)))
    ]
    count = max(1, min(len(places), round(total / length)))
    chosen = [places[i] for i in np.unique(np.linspace(0, len(places) - 1, count).astype(int))]
    return [model.experiment(m, (start, start + length)) for m, start in chosen]


def _starting(parameters: Sequence[Parameter], values: Mapping[str, float]) -> list[Parameter]:
    return [
        replace(p, initial=float(np.clip(values[p.name], p.lower, p.upper)))
        if p.tied_to is None and p.name in values
        else p
        for p in parameters
    ]


def _problem(
    experiments: Sequence[Experiment],
    parameters: Sequence[Parameter],
    values: Mapping[str, float],
    threads: int = 1,
) -> FitProblem:
    """Free parameters start at `values`; other quantities keep them."""
    free = {p.name for p in parameters}
    known = experiments[0].scene.quantities
    start = {name: q.value for name, q in known.items()} | dict(values)
    held = [
        Parameter(name=name, initial=start[name], fixed=True) for name in known if name in values and name not in free
    ]
    return FitProblem(experiments, Parameters([*_starting(parameters, start), *held]), threads=threads)


def _warnings(model: RopeModel, values: Mapping[str, float]) -> list[str]:
    """Links that are long beside the bending length."""
    EI, length = values[f"{NAME}_EI"], values[f"{NAME}_length"]
    bending = (EI / (model.density * 9.81)) ** (1 / 3)
    links = bending / (length / model.segments)
    if links >= LINKS_PER_BENDING_LENGTH:
        return []
    return [
        f"a bending length ({1e3 * bending:.3g} mm) holds only {links:.2g} links: EI may read up to two times too high "
        "and GJ too low; raise max_segments"
    ]
