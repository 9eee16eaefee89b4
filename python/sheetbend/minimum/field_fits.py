"""The stiffness of each place of a field, and its interval, at the end of a fit.

In the linear picture ln E of a place has a normal distribution under a prior of a given size and length. Where these
were found from the recordings, it is a mixture over all sizes and lengths that are possible, weighted by their marginal
likelihood. The interval about the estimate holds 95 % of the mixture.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..arrays.timeseries import Array
from ..result.field import FieldFit
from .problem import FitProblem
from .smooth import Field, Picture

LEVEL = 0.95
HALVINGS = 40  # of the range of half-widths
FINEST = 0.1  # of the modes


def field_fits(problem: FitProblem, u: Array, fields: Sequence[Field]) -> tuple[FieldFit, ...]:
    """What a fit that ended at u (free,) found of its fields."""
    picture = Picture.at(problem, u, fields) if fields else None
    if picture is None:
        return ()
    columns, values = list(problem.parameters.free), problem.parameters.to_physical(u)
    found = []
    for i, field in enumerate(fields):
        modes = field.modes
        mean = values.get(modes.stiffness, _given(problem, modes.stiffness))
        E = mean * np.exp(modes.shapes @ u[picture.columns[i]])
        level = columns.index(modes.stiffness) if modes.stiffness in columns else None
        half, left, of_modes = spread(picture, fields, i, level)
        finest = float(np.mean(of_modes[-math.ceil(FINEST * len(of_modes)) :]))
        found.append(
            FieldFit(
                name=modes.name,
                size=field.size,
                size_lower=field.size_ends[0],
                size_upper=field.size_ends[1],
                length=field.length,
                length_lower=field.length_ends[0],
                length_upper=field.length_ends[1],
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


def spread(picture: Picture, fields: Sequence[Field], i: int, level: int | None) -> tuple[Array, Array, Array]:
    """Half-widths of ln E (places,) of one field, the shares of the prior's variance that the data leave of each, and
    those of each mode (modes,).

    The priors of other fields are taken as exact.

    Args:
        level: column of the mean stiffness; None = it is not fitted.
    """
    modes, own = fields[i].modes, picture.columns[i]
    at_minimum, _ = picture.solved(fields)
    each, weights = picture.possible(fields, i)
    shifts, variances, left, of_modes = [], [], np.zeros(len(modes.centers)), np.zeros(len(own))
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
