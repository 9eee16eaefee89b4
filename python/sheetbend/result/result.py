"""What a fit gives back: estimates with verdicts, errors on data it did not see, and how it went.

Everything is plain data, so that `save` and `load` are exact and any JSON reader understands the file.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from ..errors import InputError
from .bootstrap import Bootstrap
from .field import FieldFit
from .shot import ShotMotion

UNSOUND = ("rough", "no minimum", "doubtful")
"""Verdicts of an estimate that nothing should rest on; a command that fits exits with 4 for each of them."""

VERDICTS = ("identified", "weak", "one-sided", "at a bound", "at its floor", "not identifiable", *UNSOUND)
"""identified: 95 % half-width at most 20 % of the value; weak: above; one-sided: bounded from one side only;
at a bound: of the user; at its floor: the solver's own stiffness or damping; not identifiable: gauge or flat;
rough: derivatives of the motion grow so fast that nothing follows from them; no minimum: the optimizer ended where the
cost still falls; doubtful: a minimum that separate parts of the data, another start or held-out motion contradict.
Rough and no minimum have no interval."""


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """One fitted parameter.

    Attributes:
        name, value, unit: physical value in SI units.
        lower, upper: 95 % interval, all parts together; None where it is open.
        half_width: half of it, None where it is open.
        statistical: half-width from the residuals alone, None where it is open.
        driven: half-width from noise of what drives the scenes, to first order; its square and that of `statistical`
            add up. 0 without such noise.
        discretization: half-width of what the time step, the mesh and sweeps leave open, see `FitResult.refits`; 0 when
            that was not measured.
        systematic: half-width of what else the interval counts; 0 when nothing.
        verdict, words: one of `VERDICTS`, and as a sentence.
        moved: how far the value was moved to the limit of short substeps and fine meshes, in `unit`; it is contained in
            `value`.
    """

    name: str
    value: float
    unit: str
    lower: float | None
    upper: float | None
    half_width: float | None
    statistical: float | None
    discretization: float
    verdict: str
    words: str
    systematic: float = 0.0
    moved: float = 0.0
    driven: float = 0.0

    def __post_init__(self) -> None:
        if self.verdict not in VERDICTS:
            raise InputError(f"{self.name}.verdict", "is unknown", self.verdict, f"use one of: {', '.join(VERDICTS)}")


@dataclass(frozen=True, kw_only=True)
class Given:
    """A parameter that was not fitted: fixed, or tied to another; `words` says which."""

    name: str
    value: float
    unit: str
    words: str


@dataclass(frozen=True, kw_only=True)
class Premise:
    """A number that the fit took as given, and what an error in it moves.

    Attributes:
        name: of a quantity, or such as "gravity toward x", "clamps along z", "markers".
        value: in `unit`; None for what is a place or a direction.
        off_by: the error, in `unit`, whose effect is told; `words` says it, such as "1 %".
        moved: of each determined parameter, in its unit, by that error (of several, the root of the sum of squares).
        leaves: root of the sum of squares that it leaves in the residuals, in sigma; 0 where they are not asked for it.
        sd: its standard deviation in `unit`, which then counts in the intervals; None where none was given.
    """

    name: str
    value: float | None
    unit: str
    off_by: float
    words: str
    moved: Mapping[str, float]
    sd: float | None = None
    leaves: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Correlation:
    """Correlation of two estimates in internal coordinates."""

    first: str
    second: str
    value: float


@dataclass(frozen=True, kw_only=True)
class ProfileCurve:
    """How the cost rises with one parameter held beside its estimate and all others fitted again.

    Attributes:
        name: of the parameter.
        values: in its unit, ascending; the estimate is among them.
        rises: of the cost over that at the estimate, at each value; 1 is that at the ends of the interval from the
            residuals, driven noise included. Between the ends it is interpolated between the points that were computed.
        parabola: the rises at the same values in the linear picture.
    """

    name: str
    values: tuple[float, ...]
    rises: tuple[float, ...]
    parabola: tuple[float, ...]


@dataclass(frozen=True, kw_only=True)
class RecordingFit:
    """How well one recording is explained: rms distance over markers and frames, in `unit`.

    Attributes:
        rows: number of residuals that took part in the fit.
        rms: over the fitted part; None where all of it was held out.
        held_out: over the part that the fit did not see; None when there is none.
        baseline: over the same part, of a prediction without physics.
        motion: over the same part, of the measured markers about their mean; None for an equilibrium.
        without_physics: of a driven scene, the error of every prediction without physics by kind (`baseline.IN_WORDS`),
            over the held-out part, or where there is none over the fitted one.
        late: s, by which the recording's clock is late, from its `time_offset`: a frame stamped t shows the scene at
            t - late. None without one.
        late_half_width: s, of the 95 % interval of that; None where it is open or the clock was not fitted.
        driven_sigma: prior of the correction of its driven markers, m; None without one.
        corrected_by: root mean square of one coordinate of that correction, m.
        measured_frequency, simulated_frequency: first frequency there, Hz; None where the part shows fewer than three
            periods.
    """

    name: str
    rows: int
    rms: float | None = None
    held_out: float | None = None
    baseline: float | None = None
    motion: float | None = None
    measured_frequency: float | None = None
    simulated_frequency: float | None = None
    unit: str = "m"
    driven_sigma: float | None = None
    corrected_by: float | None = None
    without_physics: Mapping[str, float] = field(default_factory=dict)
    late: float | None = None
    late_half_width: float | None = None


@dataclass(frozen=True, kw_only=True)
class ForceFit:
    """How well the forces of one sensor are explained: rms of one component, in `unit`.

    Attributes:
        recording, sensor: names.
        rows: number of residuals that took part in the fit.
        rms: over the fitted part; None where all of it was held out.
        held_out: over the part that the fit did not see; None when there is none.
        baseline: over the held-out part, or the fitted one where nothing is held out, of a constant: the mean of the
            fitted part.
        unit: "N", or "N m" for torques.
    """

    recording: str
    sensor: str
    rows: int
    rms: float | None
    held_out: float | None
    baseline: float | None
    unit: str


@dataclass(frozen=True, kw_only=True)
class ContactFit:
    """What one contact of one fitted motion does, over all substeps; see `ContactCounts`.

    Attributes:
        recording, contact: names.
        particles: that may touch; of ropes and cloths that touch themselves with friction, pairs, here and below.
        most, began, ended: how many touch at once, and how often one begins and ends to.
        sliding, sticking: shares of all touches, particle by particle and substep by substep.
        bdf1: share of the scene's substeps that went with backward Euler, which damps vibrations.
        settled, settled_by: particles that started inside the collider, and the farthest move [m] to its surface.
        deepest: m, how far inside the collider one was at any frame; None of self-contact.
    """

    recording: str
    contact: str
    particles: int
    most: int
    began: int
    ended: int
    sliding: float
    sticking: float
    bdf1: float
    settled: int = 0
    settled_by: float = 0.0
    deepest: float | None = None


@dataclass(frozen=True, kw_only=True)
class Kinks:
    """How many contacts differ at some frame between the motions at the ends of one parameter's interval.

    Attributes:
        name: of the parameter.
        begin, end: touch at the upper end alone, or at the lower end alone.
        stick, slide: touch at both, and stick at the upper and slide at the lower end, or the reverse.
    """

    name: str
    begin: int
    end: int
    stick: int
    slide: int


@dataclass(frozen=True, kw_only=True)
class Misfit:
    """How large the residuals are against what was told of their size.

    Attributes:
        reduced_chi_square: sum of squared residuals in units of sigma, over the degrees of freedom.
        smallest_sigma, largest_sigma: expected errors of a coordinate that the experiments were given, m.
        model_error: root mean square of one coordinate's residual beyond sigma, m; 0 where it is not larger.
    """

    reduced_chi_square: float
    smallest_sigma: float
    largest_sigma: float
    model_error: float


@dataclass(frozen=True, kw_only=True)
class Start:
    """One start of a multi-start fit.

    Attributes:
        cost: at its end, None where the motion diverges; of a raced start at the end of the best of its group.
        iterations, converged: on the way there.
        values: physical values there.
        first: of a raced start, those where it began; empty for others.
        raced: cost of the last window where its race ended; None for others, and where the motion diverged.
        group: number of the minimum that its race ended in, from 1; None for others, and where it diverged.
    """

    cost: float | None
    iterations: int
    converged: bool
    values: Mapping[str, float]
    first: Mapping[str, float] = field(default_factory=dict)
    raced: float | None = None
    group: int | None = None


@dataclass(frozen=True, kw_only=True)
class Refit:
    """What one finer discretization moves.

    Attributes:
        name: what was refined.
        to_limit: factor from what it moves to the limit of ever finer ones.
        moved: of each fitted parameter, finer minus fitted, in its unit.
        left: half-width of what is open all the same, of each parameter, in its unit. Where it is smaller than what is
            moved, the estimate was moved to the limit. Empty where all that it moves, up to the limit, is counted.
    """

    name: str
    to_limit: float
    moved: Mapping[str, float]
    left: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class MotionGrowth:
    """How far small displacements grow along one fitted motion, see `growth.Growth`: each as (at the start, at the end
    of the fit).

    Attributes:
        name: of the experiment.
        largest: growth; None where it overflows or the motion diverges.
        rate: 1/s, of its logarithm.
        until: s from the scene's start, up to which it stays below `growth.ROUGH`; None where it always does.
    """

    name: str
    largest: tuple[float | None, float | None]
    rate: tuple[float, float]
    until: tuple[float | None, float | None]


@dataclass(frozen=True, kw_only=True)
class FitData:
    """What a fit found; `sheetbend.FitResult` saves, loads and reports it.

    Attributes:
        estimates: one per free parameter, in the order of the parameters.
        given: the parameters that were not fitted.
        correlations: of every pair of determined estimates.
        gauges: combinations of parameters that the data leave free, in words.
        recordings: errors per recording.
        baseline: what the no-physics baseline predicts, in words.
        held_out_is: what was held out, in words, where it is not a part of each recording.
        cost: half the sum of squared residuals, priors included.
        first_cost: that of the best start's first point; None where the motion diverges there.
        jacobian_seconds: what one Jacobian took at the end; None where none was made from Python.
        rows: number of data residuals.
        autocorrelation_time: frames of residual that count as one, 1 when they are independent.
        starts: the ends of all starts, best first.
        refits: on finer discretizations, of which `Estimate.discretization` is made.
        not_counted: what of the discretization the intervals leave out, such as "mesh not counted", and why.
        misfit: residuals against the sigma that was told; None in files of earlier versions.
        optimizer, iterations, seconds, converged, interrupted, message: how it went.
        growth: of every fitted motion.
        windows: s, the lengths that were fitted first, as given or chosen.
        condition: of the Jacobian where the fit started, in words; None where the motion diverges there.
        evaluations, jacobians: how often all experiments were simulated, and how often of these with a Jacobian, over
            all starts and windows, up to the minimum.
        judging: how often all experiments, or some of them, were simulated besides, and how often of these with a
            Jacobian: for beginnings, limits, refits, profiles and doubts.
        forces: errors per force sensor.
        premises: numbers that the fit took as given, and what an error in each moves.
        warnings: what a reader must know before using the numbers.
        contacts: what touches in the fitted motions.
        kinks: of each parameter with an interval, what touches otherwise at its ends.
        profiles: of the parameters whose profiles were followed.
        bootstrap: intervals from data drawn at random, where they were asked for.
        shot: of every motion that was shot in windows, what its model loses.
        fields: of every stiffness field with a smoothness prior, the prior and the stiffness of each cluster.
        assumed: how the ends of ropes are held and what that assumes, in words, where a configuration says it.
    """

    estimates: tuple[Estimate, ...]
    recordings: tuple[RecordingFit, ...]
    cost: float
    rows: int
    optimizer: str
    iterations: int
    seconds: float
    converged: bool
    interrupted: bool = False
    message: str = ""
    given: tuple[Given, ...] = ()
    correlations: tuple[Correlation, ...] = ()
    gauges: tuple[str, ...] = ()
    baseline: str = ""
    held_out_is: str = ""
    autocorrelation_time: float = 1.0
    starts: tuple[Start, ...] = ()
    refits: tuple[Refit, ...] = ()
    warnings: tuple[str, ...] = ()
    first_cost: float | None = None
    growth: tuple[MotionGrowth, ...] = ()
    windows: tuple[float, ...] = ()
    evaluations: int = 0
    jacobians: int = 0
    judging: tuple[int, int] = (0, 0)
    misfit: Misfit | None = None
    jacobian_seconds: float | None = None
    premises: tuple[Premise, ...] = ()
    not_counted: tuple[str, ...] = ()
    forces: tuple[ForceFit, ...] = ()
    assumed: tuple[str, ...] = ()
    contacts: tuple[ContactFit, ...] = ()
    kinks: tuple[Kinks, ...] = ()
    condition: str | None = None
    profiles: tuple[ProfileCurve, ...] = ()
    shot: tuple[ShotMotion, ...] = ()
    fields: tuple[FieldFit, ...] = ()
    bootstrap: Bootstrap | None = None

    def __getitem__(self, name: str) -> Estimate:
        """The estimate of that name; KeyError names the ones there are."""
        for estimate in self.estimates:
            if estimate.name == name:
                return estimate
        raise KeyError(f"no estimate of {name!r}; there are: {', '.join(e.name for e in self.estimates)}")

    @property
    def sound(self) -> bool:
        """Whether no verdict is one of `UNSOUND`."""
        return not any(estimate.verdict in UNSOUND for estimate in self.estimates)

    @property
    def values(self) -> dict[str, float]:
        """Physical values of all parameters, fitted and given."""
        fitted = {estimate.name: estimate.value for estimate in self.estimates}
        return fitted | {given.name: given.value for given in self.given}
