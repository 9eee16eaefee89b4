"""Whether the readings of a force sensor stop at the end of its range, with noise that comes after.

Readings that repeat one number exactly are found before a fit. Where noise is added after the limit none repeats, and
the fit takes forces that are too small. So the readings near the largest and the smallest of each channel are left out,
and one linear step tells what all others ask for. Where the model then reads more than the limit, what it reads beyond
the limit is a direction of the residuals.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from ..arrays.types import Array
from ..errors import SheetbendError
from ..optional import require
from ..problem.problem import FitProblem
from ..quantities.wording import short
from ..statistics.least_squares import solved
from ..statistics.white_noise import white_variance
from .force_comparison import UNITS
from .told import Told

FEWEST = 8  # readings at a limit
NEAR = 3.0  # standard deviations of the noise


@dataclass(frozen=True)
class _End:
    """An end of what one channel reads: a limit, N or N m, above it (side 1) or below it (-1), the readings near it, as
    their samples and the rows of their residuals, and what a residual of 1 is."""

    channel: int
    side: float
    limit: float
    samples: Array
    rows: Array
    sigma: float


def clipped(problem: FitProblem, u: Array, i: int) -> list[Told]:
    """Directions of readings of the i-th experiment's sensors at u (free,) that stop at a limit, one for forces and one
    for torques of each; none where the model reads no more than what was read most."""
    ok, r, J = problem.evaluate(u)
    ends = [list(_ends(problem, i, k)) for k in range(len(problem.experiments[i].forces))]
    kept = np.ones(len(r), dtype=bool)
    for end in (end for each in ends for end in each):
        kept[end.rows] = False
    if not ok or kept.all():
        return []
    try:
        readings = problem.readings(i, u)
    except SheetbendError:
        return []
    step = -J @ solved(J[kept], r[kept])
    rows, told = problem.core.first_rows[i : i + 2], []
    for sensor, found, read in zip(problem.experiments[i].forces, ends, readings, strict=True):
        for kind, (unit, columns) in zip(("forces", "torques"), UNITS, strict=True):
            column, limits = np.zeros(len(r)), []
            for end in found:
                more = (read[end.samples, end.channel] - end.limit) / end.sigma + step[end.rows]
                beyond = np.maximum(end.side * more, 0.0)
                if end.channel in range(*columns.indices(6)) and np.count_nonzero(beyond > NEAR) >= FEWEST:
                    column[end.rows] = -end.side * beyond
                    limits.append(abs(end.limit))
            if limits:
                says, label = _says(sensor.name, kind, max(limits), unit), f"range of the {kind} of {sensor.name}"
                told.append(Told(i, "", label, "", (0.0, ""), column[slice(*rows)], missing=says))
    return told


def _ends(problem: FitProblem, i: int, k: int) -> Iterator[_End]:
    """The ends of each channel of the i-th experiment's k-th sensor where several readings are as good as alike, and
    several are not: a force that never changes shows no limit."""
    layout, sensor, special = problem.rows_layout(), problem.experiments[i].forces[k], require("scipy.special", "fit")
    measured = np.asarray(problem.sensed[i][k]["measured"])
    number = np.full(measured.shape, -1)
    number[~np.isnan(measured)] = np.flatnonzero((layout.recording == i) & (layout.clocks == k + 1))
    for channel, (y, own) in enumerate(zip(measured.T, number.T, strict=True)):
        seen = np.flatnonzero(own >= 0)
        if len(seen) < FEWEST:
            continue
        sigma = float(sensor.sigma if channel < 3 else sensor.torque_sigma or 0.0)
        noise = max(sigma, white_variance(y[seen]) ** 0.5)
        for side in (1.0, -1.0):
            to = side * y[seen]
            most = special.ndtri(1.0 - 0.5 / np.count_nonzero(to > to.max() - 2 * NEAR * noise))
            limit = float(to.max() - most * noise)  # of so many readings at a limit, noise lifts one so far
            at = seen[to > limit - NEAR * noise]
            if FEWEST <= len(at) <= len(seen) - FEWEST and limit > 0.0:
                yield _End(channel, side, side * limit, at, own[at], sigma)


def _says(sensor: str, kind: str, limit: float, unit: str) -> Callable[[float], str]:
    return lambda _: f"{sensor} read {kind} of {short(limit, 2)} {unit} at most (the end of its range)"
