"""Readings of force sensors that stand at the end of their range.

A sensor that is pushed beyond its range repeats the largest reading that it has. Noise never does: where neighboring
readings differ by noise, equal ones in a row at the very end of all readings are a limit.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from ..arrays.types import Array
from ..experiment.experiment import Experiment
from ..experiment.force_sensor import AXES
from ..quantities.wording import short
from ..statistics.white_noise import white_variance

LEAST = 3  # equal readings in a row
LONGER = 2.0  # times as long as any other row of equal readings: a log may repeat each reading
CHANCE = 1e-6  # of such a row by noise, where readings are rounded
NOISY = 0.1  # of sigma: with less noise readings may rest at one value, as those of a simulation do


def at_limits(e: Experiment) -> Iterator[str]:
    """A sentence for every channel of an experiment's sensors that counts and whose readings reach a limit."""
    for sensor in e.forces:
        channels = (
            ("force along", "N", sensor.recording.forces, sensor.sigma, sensor.axes),
            ("torque about", "N m", sensor.recording.torques, sensor.torque_sigma, sensor.torque_axes),
        )
        for kind, unit, readings, sigma, counted in channels:
            if readings is None or sigma is None:
                continue
            for axis in counted:
                column = readings[:, AXES.index(axis)]
                x = column[np.isfinite(column)]
                for side, limit, count in _limits(x, sigma):
                    yield (
                        f"{count} of {len(x)} readings of the {kind} {axis} of {sensor.name} are exactly "
                        f"{short(limit)} {unit}, the {side} of all, several of them in a row: in {e.name} the sensor "
                        "seems to have reached the end of its range. Set these readings to NaN, which leaves them out"
                    )


def _limits(x: Array, sigma: float) -> Iterator[tuple[str, float, int]]:
    """The ends of a channel's readings (n,) that are limits: which, the reading, and how often it stands there."""
    values = np.unique(x)
    if len(values) < LEAST:
        return
    starts = np.flatnonzero(np.append(True, x[1:] != x[:-1]))
    rows = np.diff(np.append(starts, len(x)))  # how often each reading stands in a row
    for side, limit in (("smallest", values[0]), ("largest", values[-1])):
        if limit == 0.0:  # a log that is set to zero where nothing touches
            continue
        at, there = x == limit, x[starts] == limit
        noise = math.sqrt(white_variance(x, ~(at[:-2] | at[1:-1] | at[2:])))
        if noise <= NOISY * sigma:
            continue
        step = float(np.diff(values).min())
        own = math.sqrt(max(noise**2 - step**2 / 6.0, 1e-6 * noise**2))  # without what a ramp that is rounded adds
        alike = math.erf(step / (2.0 * math.sqrt(2.0) * own))  # chance that a force at rest reads the same again
        longest, other = int(rows[there].max()), int(rows[~there].max())
        if longest >= LEAST and longest > LONGER * other and alike ** (longest - 1) < CHANCE:
            yield side, float(limit), int(np.count_nonzero(at))
