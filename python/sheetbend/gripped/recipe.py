"""Fitting a rope held by two grips, step by step: from a straight rod with twist to what the recordings support.

Long open-loop predictions have a rugged cost, short ones a smooth one; stiff and damped is the safe side of a start.
So a fit begins with a few short windows and several stiffnesses, goes on to longer windows, and then adds one thing
after another to the model (`ladder`). A step stays only if it predicts most recordings better that it was not fitted
to, and those that it was fitted to no worse (`judging`, `climb`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

from numpy.typing import ArrayLike

from ..arrays.checks import is_list, is_number
from ..arrays.types import Array
from ..errors import InputError
from ..fitting.fit import Fit
from ..minimum.starts import check_count
from ..objects.chain import unit_vector
from ..problem.journal import journaled
from ..problem.linear_algebra import one_blas_thread
from ..recording.recording import Recording
from .bounds import at_bounds
from .climb import Climb
from .conclusion import announced, conclude
from .judging import predict
from .ladder import LADDER, Rung
from .model import NAME, RopeModel, nominal_directions
from .motion import GrippedMotion, motions_of
from .over_density import UNIT, as_quantities, named_over_density, over_density, said_over_density
from .plausible import doubts
from .read import Read, read
from .rolls import rolls_said
from .said import found_gravity, found_late, short_links
from .search import Say, Search
from .start import started
from .steps import Step
from .windows import SPANS, Span, everything

BENDING_LENGTHS = (0.45, 0.25, 0.12)  # m, of the starts: (EI/(density g))^(1/3), stiff first
DENSITY, MARKERS = f"{NAME}_density", "marker_mass"
MARKERS_UNKNOWN = 0.08  # of the rope's mass, standard deviation of that of markers of which nothing is known


@dataclass(frozen=True)
class RopeFit:
    """A fitted rope.

    Attributes:
        model: with the fitted values; `predict` simulates it.
        values: fitted quantities.
        steps: what was tried, in order.
        fit: the last fit with intervals and verdicts.
        warnings: what a reader must know before using the numbers.
        weighed: whether the density is known. Otherwise the model has 1 kg/m, and names in `values` and in the fit's
            result say what is over the density, such as `rope_EI/density`.
        spread: by how much models that predict equally well differ at most, by parameter in its unit; the intervals
            count it.
    """

    model: RopeModel
    values: Mapping[str, float]
    steps: tuple[Step, ...]
    fit: Fit
    warnings: tuple[str, ...]
    weighed: bool = True
    spread: Mapping[str, float] = field(default_factory=dict)

    @property
    def interrupted(self) -> bool:
        """Whether Ctrl-C ended it."""
        return self.fit.interrupted

    def predict(self, recording: Recording | GrippedMotion) -> Array:
        """(frames, markers, 3) m: open loop from the first frame, gripped markers as recorded."""
        (motion,) = motions_of([recording], self.model.smoothing)
        return predict(self.model, [motion], as_quantities(self.values))[0]


@journaled
@one_blas_thread()
def fit_rope(
    recordings: Sequence[Recording | GrippedMotion],
    *,
    density: float | None = None,
    marker_mass: float | None = None,
    nominal: tuple[ArrayLike, ArrayLike] | None = None,
    ladder: Sequence[Rung] = LADDER,
    validate: float = 0.25,
    bending_lengths: Sequence[float] = BENDING_LENGTHS,
    starts: int | None = None,
    windows: Sequence[Span] | Literal["all"] = SPANS,
    segments: int = 12,
    max_segments: int = 48,
    substeps: int = 2,
    smoothing: float = 0.08,
    sigma: float = 5e-3,
    gravity: tuple[float, float, float] | None = None,
    given: Mapping[str, float] | None = None,
    threads: int = 1,
    say: Say = lambda text: None,
    journal: str | Path | None = None,
) -> RopeFit:
    """Fit a rope's parameters to recordings between two grips.

    Args:
        recordings: with two or more clamped markers at each end; or their motions, smoothed already. Faults of single
            recordings are repaired, or they are left out; the warnings list them (`gripped.screened`).
        density: kg/m of the rope without its markers, weighed. None = unknown: stiffness and drag over the density are
            fitted and reported, such as EI/density in m^4/s^2.
        marker_mass: kg of each free marker that was not weighed with the rope; 0 if all were. None = unknown: the
            intervals then allow for 8 % of the density.
        nominal: directions (3,) of the start and the end grip from which their frames are carried; the mean recorded
            ones by default.
        ladder: the effects (rungs) that are tried, in order; the first one is always kept.
        validate: share of the recordings that judge each rung and that no rung is fitted to. If that is less than one
            recording, the end of each recording judges, with this share of its time. The last fit uses all recordings.
            At 0 the fitted recordings judge.
        bending_lengths: m, of the starts.
        starts: number of starts: those of `bending_lengths`, and others drawn over two decades about the middle one.
            All are fitted to the shortest windows. The best of each group that ends in the same minimum is fitted to
            whole recordings, and the recipe continues from the one that predicts best; all are in the result. None =
            those of `bending_lengths` alone, one after the other.
        windows: (length, total) in s: each fit uses windows of this length, of about this total; the last fit uses the
            last entry (half as many judge rungs). "all" = the default ones, but the last fit uses every window of all
            recordings; its expected time is printed before work starts.
        segments, max_segments: links at the start, and at most; they are doubled until EI changes by less than 5 %. Of
            two numbers from 24 on that agree, the smaller one is used.
        substeps: per frame.
        smoothing: s, of the starts; grips are smoothed over this time or more, depending on their noise. 0 = as
            recorded. These frames also show what had slid inside a rope that yields, with which each window starts.
        sigma: m, expected error of a marker.
        gravity: m/s^2, if the recordings do not contain it. None = 9.81 along -z, or along the axis of the rope's sag
            if that is another one and starts with it predict better; a warning then names the axis.
        given: standard deviations of what the fit takes as given, such as {"rope_density": 0.02}; see `sheetbend.fit`.
        threads: the result does not depend on it.
        say: called with a line on each step.
        journal: file that keeps every evaluation until the rope is fitted, as that of `sheetbend.fit`.

    Returns:
        RopeFit. After Ctrl-C that of the last finished rung, with its fit marked `interrupted`.

    Raises:
        InputError, RecordingError: anything inconsistent, named, before work starts.
        SheetbendError: every start diverges.
        KeyboardInterrupt: before the first rung was finished.
    """
    _check(recordings, density, marker_mass, starts, validate)
    if density is None:
        say = said_over_density(say)
    seen = read(recordings, smoothing, gravity)
    for words in seen.said:
        say(words)
    model = RopeModel(
        density=UNIT if density is None else density,
        nominal=nominal_directions(seen.motions)
        if nominal is None
        else (unit_vector("nominal", nominal[0]), unit_vector("nominal", nominal[1])),
        values={},
        marker_mass=marker_mass or 0.0,
        segments=segments,
        substeps=substeps,
        smoothing=smoothing,
        sigma=sigma,
        gravity=seen.gravities[0],
    )
    spans: Sequence[Span] = SPANS if isinstance(windows, str) else windows
    if isinstance(windows, str):
        begun = started(model, seen.motions, bending_lengths[0])
        say(announced(begun, ladder, seen.motions, everything(seen.motions, spans[-1][0]), threads))
    climb = Climb(Search(seen.motions, validate, spans, threads, say))
    models = [replace(model, gravity=g) for g in seen.gravities]
    interrupted = _climb(climb, models, ladder, bending_lengths, max_segments, starts)
    last = everything(climb.search.whole, spans[-1][0]) if isinstance(windows, str) else spans[-1]
    found, spread, own = conclude(climb, climb.search.whole, last, _given(given, marker_mass), interrupted)
    fitted = _fitted(climb, found, spread, seen, last, [own.words] if own else [])
    return fitted if density is not None else _over_density(fitted)


def _check(
    recordings: Sequence[Recording | GrippedMotion],
    density: float | None,
    marker_mass: float | None,
    starts: int | None,
    validate: float,
) -> None:
    """Raises InputError where a number is out of its range, or there is no recording."""
    if density is not None and not (is_number(density) and density > 0):
        fix = "weigh the rope and give kg/m, or leave it out: then EI/density is fitted"
        raise InputError("density", "must be positive", density, fix)
    if marker_mass is not None and not (is_number(marker_mass) and marker_mass >= 0):
        raise InputError("marker_mass", "must be zero or more", marker_mass, "weigh a marker and give kg")
    if marker_mass and density is None:
        fix = "weigh the rope too and give its density, or leave it out"
        raise InputError("marker_mass", "needs the rope's density", marker_mass, fix)
    if not is_list(recordings) or not len(recordings):
        raise InputError("recordings", "must be at least one", recordings, "give a list of recordings")
    if starts is not None:
        check_count(starts)
    if not (is_number(validate) and 0 <= validate < 1):
        raise InputError("validate", "must be a share below 1", validate, "give such as 0.25")


def _climb(
    climb: Climb,
    models: Sequence[RopeModel],
    ladder: Sequence[Rung],
    bending_lengths: Sequence[float],
    max_segments: int,
    starts: int | None,
) -> bool:
    """Go up the ladder; returns whether Ctrl-C ended it, after the first rung."""
    try:
        climb.run(models, ladder, bending_lengths, max_segments, starts)
    except KeyboardInterrupt:
        if climb.rope is None:
            raise
        climb.gather()
        climb.search.say(f"interrupted: going back to {next(s.name for s in reversed(climb.steps) if s.stays)}")
        return True
    return False


def _given(given: Mapping[str, float] | None, marker_mass: float | None) -> dict[str, float]:
    """Standard deviations of what is given: of markers, whose mass the model has or the density, and of the density."""
    sds = {MARKERS: 0.0, **(given or {})}
    if marker_mass is None:
        sds[DENSITY] = math.hypot(sds.get(DENSITY, 0.0), MARKERS_UNKNOWN)
    return sds


def _fitted(
    climb: Climb, found: Fit, spread: Mapping[str, float], seen: Read, last: Span, said: Sequence[str]
) -> RopeFit:
    """The rope where the climb ended, with what a reader must know of it, and what was said of the last fit."""
    assert climb.rope is not None
    if climb.raced:
        found = replace(found, result=replace(found.result, starts=climb.raced))
    rope, values = climb.rope, {**found.values, **found.on_mesh}  # of the model's own mesh
    model, kept = rope.model, climb.search.whole
    warnings = (
        *seen.notes,
        *doubts(seen.motions, model.gravity),
        *found_gravity(model, seen.gravities),
        *found_late(climb.late),
        *([rolls_said(NAME, kept, model.nominal, values)] if model.rolls else []),
        *climb.search.left_out,
        *at_bounds(rope.parameters, values, model, kept, last[0]),
        *short_links(model, values),
        *said,
    )
    model = replace(model.at(values), beside=climb.beside, late=climb.late)
    return RopeFit(model, values, tuple(climb.steps), found, warnings, spread=spread)


def _over_density(fitted: RopeFit) -> RopeFit:
    """A fit at 1 kg/m of a rope that was not weighed, with the names of what it tells."""
    result = over_density(fitted.fit.result)
    return replace(
        fitted,
        fit=replace(fitted.fit, result=result),
        values=named_over_density(fitted.values, result),
        spread=named_over_density(fitted.spread, result),
        weighed=False,
    )
