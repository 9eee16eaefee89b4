"""What a fit may claim: intervals, correlations, gauges, and one verdict for each parameter.

The statistics are linear at the minimum, in internal coordinates, so that an interval on a log scale is
asymmetric in physical units and never crosses zero. Where an interval is wide and the cost at its ends is not
what the linear picture says, the profile of the cost decides: the interval then holds the values at which a
refit of all other parameters costs little more.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from .covariance import Layout, covariance
from .errors import InputError
from .gauge import RANK_TOLERANCE, Gauge, null_space
from .optional import require
from .parameters import Parameter, Parameters
from .profile import FARTHEST, Ends, profile_interval
from .result import Correlation, Estimate
from .timeseries import Array
from .wording import figures, floor_words, quantity, side_words, width_words

IDENTIFIED = 0.2
"""Largest 95 % half-width of an identified parameter, as a part of its value (or of its scale)."""

_LEVEL = 0.95
_AT_BOUND = 1e-6
_LARGEST = 700.0  # exponent of a number that a computer can hold
_OPEN = 30.0  # natural scales: data that leave more of a parameter open, all others known, do not contain it
_LINEAR = 0.2  # a rise of the cost that differs by less from the linear picture's confirms it


@dataclass(frozen=True)
class Floor:
    """A value that the solver itself makes up: at or beyond it, a fit shows no property of the material.

    Attributes:
        value: in the unit of the parameter.
        reason: what makes it, such as "BDF1 damps by omega h/2".
        ceiling: the limit is from above (unconverged sweeps hide any larger stiffness) instead of from below.
    """

    value: float
    reason: str
    ceiling: bool = False


@dataclass(frozen=True)
class Nuisance:
    """What unknowns that are solved for at every point of a fit, such as corrections of driven markers, leave in it.

    Attributes:
        jacobian: (unknowns, free) derivative of their priors' residuals in internal coordinates.
        taken: degrees of freedom of the data's residuals that they took.
    """

    jacobian: Array
    taken: float


@dataclass(frozen=True)
class Identifiability:
    """What the data tell about the free parameters, in their order.

    Attributes:
        estimates: value, interval and verdict of each.
        correlations: of every pair that has an interval.
        rank: directions in parameter space that data and priors determine.
        singular_values: of the column-scaled Jacobian, descending.
        gauges: combinations that stay free, in words.
        autocorrelation_time: frames of residual that count as one.
    """

    estimates: tuple[Estimate, ...]
    correlations: tuple[Correlation, ...]
    rank: int
    singular_values: Array
    gauges: tuple[Gauge, ...]
    autocorrelation_time: float


def identify(
    parameters: Parameters,
    internal: Array,
    residuals: Array,
    jacobian: Array,
    *,
    layout: Layout | None = None,
    floors: Mapping[str, Floor] | None = None,
    discretization: Mapping[str, float] | None = None,
    systematic: Mapping[str, float] | None = None,
    profile: Callable[[str, float], float] | None = None,
    cost: Callable[[Array], float] | None = None,
    nuisance: Nuisance | None = None,
    rank_tolerance: float = RANK_TOLERANCE,
) -> Identifiability:
    """Judge every free parameter of a finished fit.

    Args:
        parameters: with private ones expanded.
        internal: (free,) minimum in internal coordinates.
        residuals: (rows,) data residuals there, weighted as in the cost.
        jacobian: (rows, free) their derivative in internal coordinates.
        layout: where each row comes from; one series by default.
        floors: what the solver makes up, by parameter.
        discretization: what refits at half the step and twice the nodes move, by parameter, in its unit.
        systematic: half-widths of what else the intervals count, by parameter, in its unit.
        profile: (name, physical value) -> cost (half the sum of squares with priors) with all others
            refitted; it is asked about weak parameters only.
        cost: (internal point) -> cost there, infinite where it has none; where it rises towards both linear
            ends of a parameter as the linear picture says, no profile is needed.
        nuisance: what unknowns left that were solved for at every point.
        rank_tolerance: see `gauge.RANK_TOLERANCE`.

    Raises:
        InputError: shapes disagree, numbers are not finite, or a name is unknown.
        MissingExtraError: scipy is not installed.
    """
    floors, discretization, systematic = floors or {}, discretization or {}, systematic or {}
    _check(parameters, internal, residuals, jacobian, {*floors, *discretization, *systematic})
    nuisance = nuisance or Nuisance(np.zeros((0, len(parameters.free))), 0.0)
    judge = _Judge(parameters, internal, residuals, jacobian, layout, rank_tolerance, profile, cost, nuisance)
    estimates = tuple(
        judge.estimate(column, floors.get(name), (discretization.get(name, 0.0), systematic.get(name, 0.0)))
        for column, name in enumerate(parameters.free)
    )
    space = judge.space
    return Identifiability(
        estimates,
        judge.correlations(),
        space.rank,
        space.singular_values,
        space.gauges,
        judge.spread.autocorrelation_time,
    )


def _check(parameters: Parameters, internal: Array, residuals: Array, jacobian: Array, named: set[str]) -> None:
    count = len(parameters.free)
    if jacobian.shape != (len(residuals), count) or internal.shape != (count,):
        shapes = (residuals.shape, jacobian.shape, internal.shape)
        fix = f"give (rows,), (rows, {count}) and ({count},)"
        raise InputError("jacobian", "disagrees with the residuals or the free parameters", shapes, fix)
    for label, array in (("internal", internal), ("residuals", residuals), ("jacobian", jacobian)):
        if not np.all(np.isfinite(array)):
            bad = int((~np.isfinite(array)).sum())
            raise InputError(label, "must be finite", f"{bad} that are not", "leave gaps out of the residual rows")
    unknown = sorted(named - set(parameters.free))
    if unknown:
        raise InputError("floors", "name no free parameter", unknown, f"use names of: {', '.join(parameters.free)}")


class _Judge:
    """The shared facts behind the estimates of one fit."""

    def __init__(
        self,
        parameters: Parameters,
        internal: Array,
        residuals: Array,
        jacobian: Array,
        layout: Layout | None,
        tolerance: float,
        profile: Callable[[str, float], float] | None,
        cost: Callable[[Array], float] | None,
        nuisance: Nuisance,
    ) -> None:
        self.parameters, self.internal, self.profile, self.cost = parameters, internal, profile, cost
        self.quantile = require("scipy.special", "fit").stdtrit
        names, log = parameters.free, [parameters[name].log for name in parameters.free]
        data = np.vstack([jacobian, nuisance.jacobian])
        self.rows = np.vstack([data, parameters.prior_jacobian()])
        self.space = null_space(self.rows, names, log, tolerance)
        seen_by_data = null_space(data, names, log, tolerance).determined
        prior = self.rows[len(jacobian) :]
        self.by_prior = set(self.space.determined) - set(seen_by_data)
        lower, upper = parameters.bounds()
        near = _AT_BOUND * np.maximum(np.abs(internal), 1e-3)
        self.at_lower, self.at_upper = internal - lower <= near, upper - internal <= near
        bounded = self.at_lower | self.at_upper
        unique = [column for column in range(len(names)) if column not in self.space.pivots]
        # A parameter at its bound stays there for the others; its own interval lets all of them move.
        self.columns = [column for column in unique if not bounded[column]]
        self.spread = covariance(residuals, jacobian[:, self.columns], layout, prior[:, self.columns], nuisance.taken)
        # Half-widths that the data would leave with all other parameters known and without priors.
        size = np.maximum(np.linalg.norm(data, axis=0), np.finfo(float).tiny)
        with np.errstate(over="ignore"):  # infinite where the data do not depend on it
            self.alone = 2 * math.sqrt(self.spread.residual_variance) / size
        self.wide_columns, self.wide = self.columns, self.spread
        if len(self.columns) < len(unique):
            self.wide_columns = unique
            self.wide = covariance(residuals, jacobian[:, unique], layout, prior[:, unique], nuisance.taken)
        self.space = replace(self.space, gauges=tuple(self._measured(gauge) for gauge in self.space.gauges))

    def estimate(self, column: int, floor: Floor | None, more: tuple[float, float]) -> Estimate:
        """Value, interval and verdict of the parameter in that column; `more`: discretization and systematic parts."""
        parameter = self.parameters[self.parameters.free[column]]
        value = parameter.to_physical(self.internal[column])
        if column not in self.space.determined:
            return open_estimate(parameter, value, self._undetermined(parameter.name), more)
        alone = float(self.alone[column])
        if not parameter.log and parameter.scale is not None and alone > _OPEN * parameter.scale:
            left = quantity(alone, parameter)
            words = f"the data hardly depend on it: they would leave it open to {left} if all others were known"
            return open_estimate(parameter, value, words, more)
        columns, spread = (self.columns, self.spread) if column in self.columns else (self.wide_columns, self.wide)
        index = columns.index(column)
        t = float(self.quantile(spread.degrees[index], 0.5 + _LEVEL / 2))
        reach = t * math.sqrt(spread.matrix[index, index])
        ends = _ends(parameter, self.internal[column], reach)
        if self._limit(column) is not None:
            ends = _clipped(parameter, ends)
        elif self.profile is not None and not _precise(parameter, value, ends, sum(more)):
            rise = t**2 * spread.residual_variance * float(spread.inflation[index]) / 2
            if rise > 0 and not self._confirmed(column, reach):
                step = min(reach, 1.0) if parameter.log else reach
                ends = profile_interval(
                    partial(self.profile, parameter.name),
                    value,
                    rise,
                    step=step,
                    lower=parameter.lower,
                    upper=parameter.upper,
                    log=parameter.log,
                )
        return self._judged(column, parameter, value, ends, more, floor)

    def _judged(
        self,
        column: int,
        parameter: Parameter,
        value: float,
        ends: Ends,
        more: tuple[float, float],
        floor: Floor | None,
    ) -> Estimate:
        if ends == (None, None):
            words = "the cost stays level on both sides: the data hardly depend on it"
            return open_estimate(parameter, value, words, more)
        lower, upper = _widened(parameter, value, ends, sum(more))
        half_width = _half((lower, upper))
        if floor is not None and (value >= floor.value if floor.ceiling else value <= floor.value):
            verdict, words = "at its floor", floor_words(parameter, floor.value, floor.ceiling, floor.reason)
        elif (limit := self._limit(column)) is not None:
            verdict, words = "at a bound", f"stopped at its {limit}: widen it, or doubt the model"
        elif lower is None or upper is None:
            verdict, words = "one-sided", side_words(parameter, lower, upper)
        else:
            verdict, words = known(parameter, value, lower, upper)
        if column in self.by_prior:
            words += "; through its prior, not through the data"
        return Estimate(
            name=parameter.name,
            value=value,
            unit=parameter.unit,
            lower=lower,
            upper=upper,
            half_width=half_width,
            statistical=_half(ends),
            discretization=float(more[0]),
            systematic=float(more[1]),
            verdict=verdict,
            words=words,
        )

    def _confirmed(self, column: int, reach: float) -> bool:
        """Whether the cost at both ends, the others moved along as the linear picture has it, is what it predicts."""
        if self.cost is None or column not in self.columns:
            return False
        index = self.columns.index(column)
        size = np.linalg.norm(self.rows[:, self.columns], axis=0)
        _, R = np.linalg.qr(self.rows[:, self.columns] / size)
        inverse = np.linalg.solve(R, np.linalg.solve(R.T, np.eye(len(size))[index])) / (size * size[index])
        direction = np.zeros(len(self.internal))
        direction[self.columns] = inverse / inverse[index]
        expected = reach**2 / (2 * inverse[index])
        lower, upper = self.parameters.bounds()
        here = self.cost(self.internal)
        for end in (self.internal - reach * direction, self.internal + reach * direction):
            if (end < lower).any() or (end > upper).any():
                return False
            if not abs(self.cost(end) - here - expected) <= _LINEAR * expected:
                return False
        return True

    def correlations(self) -> tuple[Correlation, ...]:
        """Of every pair of parameters that has an interval."""
        names = [self.parameters.free[column] for column in self.columns]
        sd = np.sqrt(np.diag(self.spread.matrix))
        pairs = [
            (i, j)
            for i, first in enumerate(self.columns)
            for j, second in enumerate(self.columns[:i])
            if {first, second} <= set(self.space.determined) and sd[i] * sd[j] > 0
        ]
        return tuple(
            Correlation(first=names[j], second=names[i], value=float(self.spread.matrix[i, j] / (sd[i] * sd[j])))
            for i, j in pairs
        )

    def _undetermined(self, name: str) -> str:
        if name in self.space.flat:
            return "moves no residual: the data do not contain it; fix it or give it a prior"
        words = "; ".join(gauge.words for gauge in self.space.gauges if name in gauge.members)
        return f"{words}; fix one of them or give it a prior"

    def _measured(self, gauge: Gauge) -> Gauge:
        """The gauge with the values of what is known all the same, where they follow from its parameters alone.

        Those are monomials, so all of them must be on a log scale; none may take part in another gauge or sit at a
        bound.
        """
        free = self.parameters.free
        columns = [free.index(name) for name in gauge.members]
        others = {name for other in self.space.gauges if other is not gauge for name in other.members}
        varied = [column for column in columns if column not in self.space.pivots]
        monomials = all(self.parameters[name].log for name in gauge.members)
        if not monomials or others & set(gauge.members) or not set(varied) <= set(self.columns):
            return gauge
        values = []
        for column, power in zip(columns[1:], gauge.powers, strict=True):
            row = np.zeros(len(self.columns))  # the pivot is held, which moves no combination
            for member, weight in ((column, 1.0), (columns[0], -power)):
                if member in varied:
                    row[self.columns.index(member)] = weight
            exponent = self.internal[column] - power * self.internal[columns[0]]
            degrees = min(self.spread.degrees[self.columns.index(member)] for member in varied)
            reach = float(self.quantile(degrees, 0.5 + _LEVEL / 2)) * math.sqrt(row @ self.spread.matrix @ row)
            if reach > FARTHEST or abs(exponent) > _LARGEST:
                return gauge
            value = math.exp(exponent)
            values.append(" +/- ".join(figures((value, value * math.sinh(reach)), value * math.sinh(reach))))
        return replace(gauge, words=f"{gauge.words}: {', '.join(values)}")

    def _limit(self, column: int) -> str | None:
        parameter = self.parameters[self.parameters.free[column]]
        if self.at_lower[column]:
            return f"lower bound {quantity(parameter.lower, parameter)}"
        return f"upper bound {quantity(parameter.upper, parameter)}" if self.at_upper[column] else None


def known(parameter: Parameter, value: float, lower: float, upper: float) -> tuple[str, str]:
    """Verdict and words of a closed interval."""
    width = width_words(parameter, value, lower, upper)
    precise = _precise(parameter, value, (lower, upper))
    return ("identified", f"known {width}") if precise else ("weak", f"known only {width}")


def open_estimate(parameter: Parameter, value: float, words: str, more: tuple[float, float] = (0.0, 0.0)) -> Estimate:
    """Of a parameter that is not determined, in words why; `more`: discretization and systematic parts."""
    return Estimate(
        name=parameter.name,
        value=value,
        unit=parameter.unit,
        lower=None,
        upper=None,
        half_width=None,
        statistical=None,
        discretization=float(more[0]),
        systematic=float(more[1]),
        verdict="not identifiable",
        words=words,
    )


def _ends(parameter: Parameter, internal: float, reach: float) -> Ends:
    """The linear interval in physical units; open where a log scale leaves a factor of a million."""
    if parameter.log and reach > FARTHEST:
        return None, None
    return parameter.to_physical(internal - reach), parameter.to_physical(internal + reach)


def _clipped(parameter: Parameter, ends: Ends) -> Ends:
    lower, upper = ends
    lower = parameter.lower if lower is None else max(lower, parameter.lower)
    upper = parameter.upper if upper is None else min(upper, parameter.upper)
    return (lower if math.isfinite(lower) else None), (upper if math.isfinite(upper) else None)


def _widened(parameter: Parameter, value: float, ends: Ends, more: float) -> Ends:
    """Both ends moved out by the other parts; a factor on a log scale keeps them positive."""
    lower, upper = ends
    factor, shift = (1 + more / value, 0.0) if parameter.log else (1.0, more)
    return (
        None if lower is None else lower / factor - shift,
        None if upper is None else upper * factor + shift,
    )


def _half(ends: Ends) -> float | None:
    lower, upper = ends
    return None if lower is None or upper is None else (upper - lower) / 2


def _precise(parameter: Parameter, value: float, ends: Ends, more: float = 0.0) -> bool:
    half_width = _half(ends)
    return half_width is not None and half_width + more <= IDENTIFIED * (parameter.scale or abs(value))
