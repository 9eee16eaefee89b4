"""What recorded forces that a model does not read look like: the opposite sign, or another unit.

A fit to forces of the opposite sign makes their cause vanish: a density runs off to nothing, and everything else with
it, as if the data did not contain it. A fit to forces in grams finds a density a hundred times too large, which leaves
residuals like noise. So measured forces are compared with those that the model reads at the values that the fit began
with, and at those where it ended.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..arrays.types import Array
from ..errors import SheetbendError
from ..experiment.force_sensor import ForceSensor
from ..problem.problem import FitProblem
from ..quantities.wording import short

KINDS = (("forces", slice(0, 3), "N"), ("torques", slice(3, 6), "N m"))
ALIKE = 0.5  # of the measured sum of squares: at least so much a multiple of the simulated readings explains
MISSED = 0.5  # of it: more than that the fit leaves
FAR = 6.0  # times: a start is seldom so far off, and a gram-force is 102 times, a pound-force 4.4 times a newton


def misread_forces(problem: FitProblem, u: Array) -> tuple[str, ...]:
    """A warning for every force sensor whose readings look like those of the model with another sign or unit, at the
    end u (free,) of a fit or where it began."""
    found = []
    for i, e in enumerate(problem.experiments):
        if not e.forces:
            continue
        try:
            begun, ended = (problem.readings(i, at) for at in (problem.parameters.initial(), u))
        except SheetbendError:
            continue
        for k, sensor in enumerate(e.forces):
            found += list(_of(sensor, np.asarray(problem.sensed[i][k]["measured"]), begun[k], ended[k]))
    return tuple(found)


def _of(sensor: ForceSensor, measured: Array, begun: Array, ended: Array) -> Iterator[str]:
    for kind, columns, unit in KINDS:
        seen = np.isfinite(measured[:, columns])
        y, first, last = (each[:, columns][seen] for each in (measured, begun, ended))
        whole = float(y @ y)
        if not whole > 0.0:
            continue
        times, explains = _multiple(first, y, whole)
        if explains <= ALIKE:
            continue
        if times < 0.0:
            if float((y - last) @ (y - last)) <= MISSED * whole:
                continue  # another start
            other = "body" if sensor.reads == "support" else "support"
            yield (
                f"the {kind} of {sensor.name} are {short(times, 2)} times what the model reads at the values that the "
                f'fit began with. A sensor that tells what acts on the other side needs reads = "{other}"'
            )
            return
        if not 1.0 / FAR < times < FAR:
            yield (
                f"the {kind} of {sensor.name} are {short(times, 2)} times what the model reads at the values that the "
                f"fit began with. Either it began far off, or they are not in {unit}"
            )


def _multiple(x: Array, y: Array, whole: float) -> tuple[float, float]:
    """The multiple of x that is nearest to y, and its share of the sum of squares of y, `whole`."""
    inner, along = float(x @ x), float(x @ y)
    return (along / inner, along**2 / inner / whole) if inner > 0.0 else (1.0, 0.0)
