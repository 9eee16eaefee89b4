"""What a fit may claim: intervals, correlations, gauges, and one verdict for each parameter.

The statistics are linear at the minimum, in internal coordinates, so that an interval on a log scale is
asymmetric in physical units and never crosses zero. Where the cost at its ends is not what the linear picture
says, the profile of the cost decides: the interval then holds the values at which a refit of all other
parameters costs little more.
"""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ..arrays.types import Array
from ..errors import InputError
from ..quantities.parameters import Parameters
from ..result.estimate import Correlation, Estimate
from .body_numbers import BodyNumbers
from .gauge import Gauge
from .judge import Floor, Judge, Linear, Nuisance
from .layout import Layout
from .profile import Profile, Profiler


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
        profiles: by parameter, of those that were profiled.
    """

    estimates: tuple[Estimate, ...]
    correlations: tuple[Correlation, ...]
    rank: int
    singular_values: Array
    gauges: tuple[Gauge, ...]
    autocorrelation_time: float
    profiles: Mapping[str, Profile] = field(default_factory=dict)


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
    profiler: Profiler | None = None,
    nuisance: Nuisance | None = None,
    errors: Array | None = None,
    limits: Mapping[str, str] | None = None,
    fixes: Mapping[tuple[str, str], str] | None = None,
    bodies: Sequence[BodyNumbers] = (),
    linear_ones: Container[str] = (),
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
        profiler: finds the profiles of several parameters. It is asked about all that have an interval and rest at no
            bound; of more than `judge.MANY` parameters about the weak ones alone. Without one intervals are linear.
        nuisance: what unknowns left that were solved for at every point.
        errors: (rows, draws) random draws of errors of the residuals that are alike in all of the data, such as noise
            of what drives a scene makes.
        limits: where parameters stopped because a body beyond is impossible, in words, by parameter.
        fixes: what to change where a parameter stops at a bound that is no user's, by parameter and side ("lower",
            "upper").
        bodies: rigid bodies of which numbers are fitted.
        linear_ones: parameters whose profiles are not asked for.

    Raises:
        InputError: shapes disagree, numbers are not finite, or a name is unknown.
        MissingExtraError: scipy is not installed.
    """
    floors, discretization, systematic = floors or {}, discretization or {}, systematic or {}
    _check(parameters, internal, residuals, jacobian, {*floors, *discretization, *systematic})
    nuisance = nuisance or Nuisance(np.zeros((0, len(parameters.free))), 0.0)
    errors = np.zeros((len(residuals), 0)) if errors is None else errors
    limits, fixes = limits or {}, fixes or {}
    judge = Judge(parameters, internal, residuals, jacobian, layout, nuisance, errors, limits, fixes, bodies)
    linear = [
        judge.linear(column, (discretization.get(name, 0.0), systematic.get(name, 0.0)))
        for column, name in enumerate(parameters.free)
    ]
    asked = (p for p in linear if isinstance(p, Linear) and p.parameter.name not in linear_ones)
    wanted = [w for part in asked if (w := judge.wanted(part)) is not None]
    found = {} if profiler is None or not wanted else dict(zip((w.name for w in wanted), profiler(wanted), strict=True))
    estimates = tuple(
        judge.concluded(part, floors.get(part.parameter.name), found.get(part.parameter.name))
        if isinstance(part, Linear)
        else part
        for part in linear
    )
    space = judge.space
    return Identifiability(
        estimates,
        judge.correlations(),
        space.rank,
        space.singular_values,
        space.gauges,
        judge.spread.autocorrelation_time,
        found,
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
