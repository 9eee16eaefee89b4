"""The verdict and the interval of each parameter, from residuals and Jacobian at a minimum."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..arrays.types import Array
from ..quantities.parameters import Parameter, Parameters
from ..quantities.wording import figures, floor_words, quantity, ran_off_words, side_words
from ..result.estimate import Correlation, Estimate
from .body_numbers import BodyNumbers, in_ten_numbers
from .covariance import Covariance, covariance
from .gauge import RANK_TOLERANCE, Gauge, null_space
from .intervals import (
    at_far_limit,
    clipped,
    critical_t,
    half_width,
    has_answer,
    is_precise,
    known,
    linear_ends,
    open_estimate,
    ran_off,
    widened,
)
from .layout import Layout
from .profile import FARTHEST, NOISELESS, Ends, Profile, Wanted
from .shared_errors import variance_of, with_shared

MANY = 60  # parameters: of more, such as the private ones of many recordings, only weak ones are profiled
_AT_BOUND = 1e-6
_ROUNDING = 1e-14
_LARGEST = 700.0  # exponent of a number that a computer can hold
_OPEN = 30.0  # natural scales: data that leave more of a parameter open, all others known, do not contain it


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
class Linear:
    """The linear interval of one parameter.

    Attributes:
        column: among the free parameters.
        parameter, value: physical.
        reach: its internal half-width.
        ends: physical.
        more: discretization and systematic parts.
        note: for the words of the verdict.
        shaken: part of the variance that noise of what drives the scenes makes.
    """

    column: int
    parameter: Parameter
    value: float
    reach: float
    ends: Ends
    more: tuple[float, float]
    note: str
    shaken: float


class Judge:
    """The shared facts behind the estimates of one fit."""

    def __init__(
        self,
        parameters: Parameters,
        internal: Array,
        residuals: Array,
        jacobian: Array,
        layout: Layout | None,
        nuisance: Nuisance,
        errors: Array,
        limits: Mapping[str, str],
        fixes: Mapping[tuple[str, str], str],
        bodies: Sequence[BodyNumbers],
    ) -> None:
        self.parameters, self.internal, self.limits, self.fixes = parameters, internal, limits, fixes
        names, log = parameters.free, [parameters[name].log for name in parameters.free]
        data = np.vstack([jacobian, nuisance.jacobian])
        self.rows = np.vstack([data, parameters.prior_jacobian()])
        self.space = null_space(self.rows, names, log, RANK_TOLERANCE)
        seen_by_data = null_space(data, names, log, RANK_TOLERANCE).determined
        prior = self.rows[len(jacobian) :]
        self.by_prior = set(self.space.determined) - set(seen_by_data)
        lower, upper = parameters.bounds()
        near = _AT_BOUND * np.maximum(np.abs(internal), 1e-3)
        self.at_lower, self.at_upper = internal - lower <= near, upper - internal <= near
        bounded = self.at_lower | self.at_upper | np.isin(names, list(limits))
        unique = [column for column in range(len(names)) if column not in self.space.pivots]
        # A parameter at its bound stays there for the others; its own interval lets all of them move.
        self.columns = [column for column in unique if not bounded[column]]

        def spread_of(columns: list[int]) -> tuple[Covariance, Array]:
            """The covariance of some parameters, and the part of it that known errors make."""
            own = covariance(residuals, jacobian[:, columns], layout, prior[:, columns], nuisance.taken)
            more = variance_of(self.rows[:, columns], errors)
            return with_shared(own, more, errors.shape[1]), more

        self.spread, self.driven = spread_of(self.columns)
        # Half-widths that the data would leave with all other parameters known and without priors.
        size = np.maximum(np.linalg.norm(data, axis=0), np.finfo(float).tiny)
        with np.errstate(over="ignore"):  # infinite where the data do not depend on it
            self.alone = 2 * math.sqrt(self.spread.residual_variance) / size
        self.wide_columns, self.wide, self.wide_driven = self.columns, self.spread, self.driven
        if len(self.columns) < len(unique):
            self.wide_columns = unique
            self.wide, self.wide_driven = spread_of(unique)
        self.space = replace(self.space, gauges=tuple(self._measured(gauge) for gauge in self.space.gauges))
        left = math.sqrt(self.spread.residual_variance) or 1.0
        self.space = in_ten_numbers(self.space, self.rows / left, names, internal, log, bodies)

    def linear(self, column: int, more: tuple[float, float]) -> Estimate | Linear:
        """The linear interval of the parameter in that column, or its estimate where it has none; `more`:
        discretization and systematic parts."""
        parameter = self.parameters[self.parameters.free[column]]
        value = parameter.to_physical(self.internal[column])
        counted = tuple(part if has_answer(parameter, value, part) else 0.0 for part in more)
        note = "" if counted == more else "; a refit that ran off or diverged is not counted in the interval"
        more = (counted[0], counted[1])
        if column not in self.space.determined:
            return open_estimate(parameter, value, self._undetermined(parameter.name), more)
        alone = float(self.alone[column])
        if not parameter.log and parameter.scale is not None and alone > _OPEN * parameter.scale:
            left = quantity(alone, parameter)
            words = f"the data hardly depend on it: they would leave it open to {left} if all others were known"
            return open_estimate(parameter, value, words, more)
        near = column in self.columns
        columns, spread = (self.columns, self.spread) if near else (self.wide_columns, self.wide)
        index = columns.index(column)
        known_part, whole = (self.driven if near else self.wide_driven)[index, index], spread.matrix[index, index]
        shaken = min(float(known_part / whole), 1.0) if whole > 0 else 0.0  # of the variance
        t = critical_t(float(spread.degrees[index]))
        reach = t * math.sqrt(spread.matrix[index, index])
        if reach <= _ROUNDING * max(abs(self.internal[column]), 1.0) and spread.residual_variance > 1:
            words = "its interval would be narrower than rounding: no motion determines a parameter so well"
            return open_estimate(parameter, value, words, more, "rough")
        ends = linear_ends(parameter, self.internal[column], reach)
        if spread.residual_variance == 0 and reach == 0:
            note += "; the residuals are exactly zero, so nothing shows how wrong it may be"
        if self._limit(column) is not None:
            ends = clipped(parameter, ends)
        return Linear(column, parameter, value, reach, ends, more, note, shaken)

    def wanted(self, linear: Linear) -> Wanted | None:
        """The profile that is to check a linear interval; None where that stays as it is."""
        if self._limit(linear.column) is not None or self.spread.residual_variance <= NOISELESS:
            return None
        precise = is_precise(linear.parameter, linear.value, linear.ends, sum(linear.more))
        return None if precise and len(self.parameters.free) > MANY else Wanted(linear.parameter.name, linear.reach)

    def concluded(self, linear: Linear, floor: Floor | None, profile: Profile | None) -> Estimate:
        """Value, interval and verdict."""
        parameter, value, more, note = linear.parameter, linear.value, linear.more, linear.note
        ends = linear.ends
        if profile is not None:
            ends, diverged = _with_answers(profile.ends, ends)
            note += diverged
        if ends == (None, None):
            words = "the cost stays level on both sides: the data hardly depend on it"
            words = ran_off_words(parameter, value) if ran_off(parameter, value) else words
            return open_estimate(parameter, value, words + note, more)
        lower, upper = widened(parameter, value, ends, sum(more))
        half, own = half_width((lower, upper)), half_width(ends)
        if floor is not None and (value >= floor.value if floor.ceiling else value <= floor.value):
            verdict, words = "at its floor", floor_words(parameter, floor.value, floor.ceiling, floor.reason)
        elif at_far_limit(parameter, value):
            verdict, words = "at a bound", f"{ran_off_words(parameter, value)} (as far as a search looks)"
        elif (limit := self._limit(linear.column)) is not None:
            verdict, words = "at a bound", limit
        elif lower is None or upper is None:
            verdict, words = "one-sided", side_words(parameter, lower, upper)
        else:
            verdict, words = known(parameter, value, lower, upper)
        if linear.column in self.by_prior:
            words += "; through its prior, not through the data"
        words += note
        return Estimate(
            name=parameter.name,
            value=value,
            unit=parameter.unit,
            lower=lower,
            upper=upper,
            half_width=half,
            statistical=None if own is None else own * math.sqrt(1.0 - linear.shaken),
            discretization=float(more[0]),
            systematic=float(more[1]),
            driven=0.0 if own is None else own * math.sqrt(linear.shaken),
            verdict=verdict,
            words=words,
        )

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
        parameter = self.parameters[name]
        value = parameter.to_physical(self.internal[self.parameters.free.index(name)])
        if ran_off(parameter, value):
            return ran_off_words(parameter, value)
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
            reach = critical_t(float(degrees)) * math.sqrt(row @ self.spread.matrix @ row)
            if reach > FARTHEST or abs(exponent) > _LARGEST:
                return gauge
            value = math.exp(exponent)
            values.append(" +/- ".join(figures((value, value * math.sinh(reach)), value * math.sinh(reach))))
        return replace(gauge, words=f"{gauge.words}: {', '.join(values)}")

    def _limit(self, column: int) -> str | None:
        parameter = self.parameters[self.parameters.free[column]]
        if parameter.name in self.limits:
            where = f"stopped where {self.limits[parameter.name]}, as in a body without thickness"
            return f"{where}: no body lies beyond; doubt the model"
        if not (self.at_lower[column] or self.at_upper[column]):
            return None
        side, bound = ("lower", parameter.lower) if self.at_lower[column] else ("upper", parameter.upper)
        fix = self.fixes.get((parameter.name, side), "widen it, or doubt the model")
        return f"stopped at its {side} bound {quantity(bound, parameter)}: {fix}"


def _with_answers(found: Ends, linear: Ends) -> tuple[Ends, str]:
    """Ends of a profile, the linear one wherever the profile has no answer, and a note that says so."""
    sides = [side for side, end in zip(("below", "above"), found, strict=True) if end is not None and math.isnan(end)]
    if not sides:
        return found, ""
    kept = [end if end is None or not math.isnan(end) else other for end, other in zip(found, linear, strict=True)]
    note = f"; the fits with it held {' and '.join(sides)} diverged: there the interval is the linear one"
    return (kept[0], kept[1]), note
