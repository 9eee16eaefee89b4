"""The values of a field and their intervals at the end of a fit: the stiffness of each place, or an input at each knot.

In the linear picture a value (of a stiffness its logarithm) has a normal distribution under a prior of a given size and
length. Where these were found from the recordings, it is a mixture over all sizes and lengths that are possible,
weighted by their marginal likelihood. The interval about the estimate holds 95 % of the mixture.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..arrays.types import Array
from ..objects.over_time import OverTime
from ..objects.stiffness_field import StiffnessField
from ..problem.problem import FitProblem
from ..problem.smooth import Field, Modes
from ..result.field import FieldFit
from ..result.over_time import OverTimeFit
from ..statistics.intervals import LEVEL
from .field_priors import Picture

HALVINGS = 40  # of the range of half-widths
FINEST = 0.1  # of the modes


class Fields:
    """What a fit that ended at u (free,) found of its fields; nothing where its physics has no answer."""

    def __init__(self, problem: FitProblem, u: Array, fields: Sequence[Field]) -> None:
        self._problem, self._u, self._fields = problem, u, tuple(fields)
        self._picture = Picture.at(problem, u, fields) if fields else None

    def stiffness(self) -> tuple[FieldFit, ...]:
        """Of fields of stiffness."""
        if self._picture is None:
            return ()
        columns, values = list(self._problem.parameters.free), self._problem.parameters.to_physical(self._u)
        found = []
        for i, field in enumerate(self._fields):
            modes = field.modes
            if not isinstance(modes, StiffnessField):
                continue
            mean = values.get(modes.stiffness, _given(self._problem, modes.stiffness))
            E = mean * np.exp(modes.shapes @ self._u[self._picture.columns[i]])
            level = columns.index(modes.stiffness) if modes.stiffness in columns else None
            half, left, of_modes = spread(self._picture, self._fields, i, level)
            finest = float(np.mean(of_modes[-math.ceil(FINEST * len(of_modes)) :]))
            found.append(
                FieldFit(
                    name=modes.name,
                    **_prior(field),
                    centers=tuple((float(x), float(y), float(z)) for x, y, z in modes.centers),
                    stiffness=tuple(E.tolist()),
                    half_widths=tuple(half.tolist()),
                    left=tuple(left.tolist()),
                    finest=finest if modes.finer.shape[1] else None,
                    unit=modes.unit,
                    place=modes.place,
                )
            )
        return tuple(found)

    def over_time(self) -> tuple[OverTimeFit, ...]:
        """Of forces and winds over time, in each recording."""
        if self._picture is None:
            return ()
        found = []
        for i, field in enumerate(self._fields):
            begin = 0
            for recording, (modes, names) in zip(self._recordings(field), field.each, strict=True):
                if not isinstance(modes, OverTime):
                    continue
                own = self._picture.columns[i][begin : begin + len(names)]
                begin += len(names)
                half, left, _ = spread(self._picture, self._fields, i, None, (modes, own))
                found.append(
                    OverTimeFit(
                        name=modes.name,
                        recording=recording,
                        kind=modes.kind,
                        unit=modes.unit,
                        **_prior(field),
                        times=tuple(modes.times.tolist()),
                        values=_by_knot(modes.shapes @ self._u[own]),
                        half_widths=_by_knot(half),
                        left=_by_knot(left),
                        modes=names,
                    )
                )
        return tuple(found)

    def _recordings(self, field: Field) -> list[str]:
        """Of each modes of a field; of those that are shared, the first that has them."""
        name = field.modes.modes[0]
        return list(field.own) or [next((e.name for e in self._problem.experiments if name in e.scene.quantities), "")]


def _prior(field: Field) -> dict[str, Any]:
    return {
        "size": field.size,
        "size_lower": field.size_ends[0],
        "size_upper": field.size_ends[1],
        "length": field.length,
        "length_lower": field.length_ends[0],
        "length_upper": field.length_ends[1],
    }


def _by_knot(values: Array) -> tuple[tuple[float, float, float], ...]:
    return tuple((float(x), float(y), float(z)) for x, y, z in values.reshape(-1, 3))


def spread(
    picture: Picture, fields: Sequence[Field], i: int, level: int | None, part: tuple[Modes, Array] | None = None
) -> tuple[Array, Array, Array]:
    """Half-widths (places,) of one field, of a stiffness those of ln E, the shares of the prior's variance that the
    data leave of each, and those of each mode (modes,).

    The priors of other fields are taken as exact.

    Args:
        level: column of the mean stiffness; None = it is not fitted.
        part: modes of one recording and their columns, where each has its own.
    """
    modes, own = (fields[i].modes, picture.columns[i]) if part is None else part
    at_minimum, _ = picture.solved(fields)
    each, weights = picture.possible(fields, i)
    shifts, variances, left, of_modes = [], [], np.zeros(len(modes.shapes)), np.zeros(len(own))
    for one, weight in zip(each, weights, strict=True):
        step, root = picture.solved([*fields[:i], one, *fields[i + 1 :]])
        shift, about = modes.shapes @ (step - at_minimum)[own], modes.shapes @ root[own]
        unknown, deviations = modes.left_out(one.size, one.length), modes.deviations(one.size, one.length)
        prior = np.sum((modes.shapes * deviations) ** 2, axis=1) + unknown
        of_modes += weight * np.sum((root[own] / deviations[:, None]) ** 2, axis=1)
        left += weight * (np.sum(about**2, axis=1) + unknown) / np.maximum(prior, 1e-300)
        if level is not None:
            shift, about = shift + (step - at_minimum)[level], about + root[level]
        shifts.append(shift)
        variances.append(np.sum(about**2, axis=1) + unknown)
    return half_widths(weights, np.array(shifts), np.sqrt(variances)), left, of_modes


def half_widths(weights: Array, shifts: Array, deviations: Array) -> Array:
    """(n,) distances from zero within which lie 95 % of mixtures of normal distributions.

    Args:
        weights: (parts,), which sum to one.
        shifts, deviations: (parts, n).
    """
    scaled = math.sqrt(2.0) * np.maximum(deviations, 1e-300)
    lower, upper = np.zeros(shifts.shape[1]), np.max(np.abs(shifts) + 1.5 * scaled, axis=0)
    for _ in range(HALVINGS):
        middle = 0.5 * (lower + upper)
        inside = 0.5 * weights @ (_erf((middle - shifts) / scaled) + _erf((middle + shifts) / scaled))
        lower, upper = np.where(inside < LEVEL, middle, lower), np.where(inside < LEVEL, upper, middle)
    return np.asarray(0.5 * (lower + upper))


def _erf(x: Array) -> Array:
    """The error function, without SciPy, which a fit does not need."""
    return np.asarray(np.frompyfunc(math.erf, 1, 1)(x), dtype=float)


def _given(problem: FitProblem, name: str) -> float:
    return next(float(e.scene.quantities[name].value) for e in problem.experiments if name in e.scene.quantities)
