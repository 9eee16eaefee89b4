"""What a fit found, all together, and how its search went.

Everything is plain data, so that `save` and `load` are exact and any JSON reader understands the file.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from .bootstrap import Bootstrap
from .estimate import UNSOUND, Correlation, Estimate, Given, Premise, ProfileCurve, estimate_of
from .field import FieldFit
from .motions import ContactFit, ForceFit, Kinks, MotionGrowth, RecordingFit
from .over_time import OverTimeFit
from .shot import ShotMotion


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
        prediction: how well recordings that are not among `recordings` are predicted, in words.
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
            all starts and windows, up to the minimum. They vary between equal fits, because a Jacobian is computed
            with the residuals if it takes less than three times as long. The estimates do not depend on that.
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
        over_time: of every unknown force or wind over time, in each recording, its values and their intervals.
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
    prediction: str = ""
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
    over_time: tuple[OverTimeFit, ...] = ()
    bootstrap: Bootstrap | None = None

    def __getitem__(self, name: str) -> Estimate:
        """The estimate of that name; KeyError names the ones there are."""
        return estimate_of(self.estimates, name)

    @property
    def sound(self) -> bool:
        """Whether no verdict is one of `UNSOUND`."""
        return not any(estimate.verdict in UNSOUND for estimate in self.estimates)

    @property
    def values(self) -> dict[str, float]:
        """Physical values of all parameters, fitted and given."""
        fitted = {estimate.name: estimate.value for estimate in self.estimates}
        return fitted | {given.name: given.value for given in self.given}
