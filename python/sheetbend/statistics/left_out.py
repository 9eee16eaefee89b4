"""What an estimate would be without one part of the data.

A part that hardly tells a parameter by itself may still decide it. Example: windows of a pendulum's swing each know one
combination of dry friction and drag. Only together do they tell the two apart, so that a slow error of one window moves
both by far more than the residuals suggest.

Parameters u in all data but part k, and others there, have the columns [J, J s_k], with s_k = 1 in the rows of part k
and 0 elsewhere. The least-squares step of the first ones leads to the estimate without part k, and their covariance
(`covariance`) is that of this estimate. Priors and rows of no part belong to the rest.

The scatter of these estimates tells the variance of the whole one (the jackknife: Tukey 1958, Annals of Mathematical
Statistics 29, 614), whatever the errors within a part are like. Example: twelve windows with a slow error of its own in
each. None moves the estimate by much, all together do.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ..arrays.types import Array
from ..optional import require
from .blocks import Split, independent, short_of_frames
from .covariance import covariance
from .intervals import NORMAL, critical_t
from .least_squares import solved
from .linearized import Linearized
from .shared_errors import variance_of

SURE = 0.05  # chance of a scatter as large


@dataclass(frozen=True)
class LeftOut:
    """The estimate of one parameter without one part of the data.

    Attributes:
        column: of the parameter.
        name: of the part.
        step: internal, by which the estimate moves without it.
        reach: 95 % half-width of the estimate without it.
        shift: by which the known errors of the residuals would move it.
        scatter: 95 % half-width of the estimate from all data, as the estimates without each part scatter; 0 where one
            of these leaves the parameter open.
        surely: the least half-width of which so much scatter is likelier than 5 %.
    """

    column: int
    name: str
    step: float
    reach: float
    shift: float
    scatter: float = 0.0
    surely: float = 0.0


def left_out(fitted: Linearized, split: Split) -> tuple[LeftOut, ...]:
    """For each parameter that recordings share, the part of the data that moves it most, against its reach.

    Parameters that the rest of the data leaves open are not in it, and parts of which the rest has too few rows.

    Raises:
        MissingExtraError: scipy is not installed.
    """
    rows, shared, taken = fitted.rows, fitted.shared, fitted.taken + len(fitted.private)
    own_columns = fitted.jacobian[:, shared]
    most: dict[int, LeftOut] = {}
    steps: dict[int, list[float]] = {}
    for k, name in enumerate(split.names):
        inside = np.append(split.part, split.of_others(fitted.others)) == k
        every, left, noise, known = fitted.beside_private(np.hstack([own_columns, own_columns * inside[:, None]]))
        used = independent(every)
        elsewhere = own_columns[~inside].any(axis=0)  # whether the rest shows it
        if rows <= len(used) + len(fitted.private):
            continue
        step = -solved(every[:, used], left, rcond=None)
        left = left + every[:, used] @ step
        spread = covariance(left[:rows], every[:rows, used], fitted.layout, every[rows:, used], taken)
        V = short_of_frames(spread, fitted.frames) * spread.matrix
        if noise.any():
            V = V + variance_of(every[:, used], noise)
        own = [c for c in used if c < 2 * len(shared)]
        moved = solved(every[:, own], known, rcond=None)
        for i, c in enumerate(used):
            if c >= len(shared):
                break
            if not elsewhere[c]:
                continue
            degrees = max(float(spread.degrees[i] / (2 - 1 / spread.inflation[i])), 1.0)
            reach = critical_t(degrees) * math.sqrt(max(float(V[i, i]), 0.0))
            steps.setdefault(c, []).append(float(step[i]))
            found = LeftOut(shared[c], name, float(step[i]), reach, float(np.abs(moved[i]).sum()))
            if c not in most or abs(found.step) * most[c].reach > abs(most[c].step) * found.reach:
                most[c] = found
    for c, each in steps.items():
        if len(each) == len(split.names):
            scatter, surely = _scattered(np.array(each))
            most[c] = replace(most[c], scatter=scatter, surely=surely)
    return tuple(most[c] for c in sorted(most))


def _scattered(steps: Array) -> tuple[float, float]:
    """Half-width of the estimate from all parts, from the steps to those without one (parts,), and the least one."""
    special, degrees = require("scipy.special", "fit"), len(steps) - 1
    sd = math.sqrt(degrees / len(steps) * float(((steps - steps.mean()) ** 2).sum()))
    least = sd * math.sqrt(degrees / float(special.chdtri(degrees, SURE)))
    return critical_t(degrees) * sd, NORMAL * least
