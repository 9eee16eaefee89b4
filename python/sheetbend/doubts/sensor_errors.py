"""What errors of force sensors change of residuals: how much they read per newton, their zeros, their axes and clocks.

Readings enter the residuals as they are, so each of these changes them by what is known without derivatives. It is
told from the simulated readings: measured ones hold noise, and a sensor that read nothing would explain it. Which row
belongs to which reading is asked once, with readings that are moved by a number of their own.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..arrays.types import Array
from ..errors import SheetbendError
from ..experiment.force_sensor import ForceSensor
from ..problem.problem import FitProblem
from ..quantities.wording import short
from .told_inputs import turned

Says = Callable[[float], str]


@dataclass(frozen=True)
class SensorError:
    """One error of a sensor.

    Attributes:
        name, label: as those of `told.Told`.
        step: the error whose effect a report tells, and that in words; "" for that of all such errors.
        column: (rows of the experiment,) derivative of its residuals.
        says: what a size of it says of the sensor.
    """

    name: str
    label: str
    step: tuple[float, str]
    column: Array
    says: Says


@dataclass(frozen=True)
class _Readings:
    """Of a sensor and of one kind, (samples, 3) over sigma, and the axes that have no bias of their own."""

    sensor: ForceSensor
    values: Array
    sigma: float
    kind: str
    zeros: str


Change = Callable[[_Readings], Array]


def sensor_errors(problem: FitProblem, u: Array, i: int) -> list[SensorError]:
    """Of the sensors of the i-th experiment at u (free,); none where it has none, or where motions have corrections.
    Takes two evaluations of the residuals without derivatives.

    Raises:
        SheetbendError: a motion has no answer at u.
    """
    e = problem.experiments[i]
    if not e.forces or problem.estimates_corrections:
        return []
    measured = [each for sensor in e.forces for each in _readings(sensor)]
    ends = np.cumsum([each.values.size for each in measured])
    numbers = [end - each.values.size + np.arange(each.values.size) for end, each in zip(ends, measured, strict=True)]
    numbered = replace(e, forces=_perturbed(e.forces, measured, numbers))
    there = problem.of([numbered if k == i else other for k, other in enumerate(problem.experiments)])
    rows = slice(*problem.core.first_rows[i : i + 2])
    _, r, _ = problem.evaluate(u, jacobian=False)
    ok, more, _ = there.evaluate(u, jacobian=False)
    if not ok:
        raise SheetbendError(there.failure)
    at = np.rint(r[rows] - more[rows]).astype(np.int64) - 1  # place among all readings, -1 of what is none
    compared = at >= 0
    simulated = np.concatenate([each.values.ravel() for each in measured])
    simulated[at[compared]] += r[rows][compared]
    parts = np.split(simulated.reshape(-1, 3), ends[:-1] // 3)
    measured = [replace(each, values=values) for each, values in zip(measured, parts, strict=True)]
    found = []
    for sensor in e.forces:
        own = [(end, each) for end, each in zip(ends, measured, strict=True) if each.sensor is sensor]
        told = [(error, own) for error in _of_sensor(sensor)]
        told += [(error, [one]) for one in own for error in _zeros(one[1])]
        for (name, label, step, change, says), changed in told:
            every = np.zeros(ends[-1] + 1)
            for end, each in changed:
                every[end - each.values.size : end] = np.nan_to_num(change(each).ravel())
            found.append(SensorError(name, label, step, every[at], says))
    return found


def _readings(sensor: ForceSensor) -> Iterator[_Readings]:
    recording = sensor.recording
    yield _Readings(sensor, recording.forces / sensor.sigma, sensor.sigma, "force", "" if sensor.bias else sensor.axes)
    if sensor.torque_sigma is not None and recording.torques is not None:
        zeros = "" if sensor.torque_bias else sensor.torque_axes
        yield _Readings(sensor, recording.torques / sensor.torque_sigma, sensor.torque_sigma, "torque", zeros)


def _perturbed(
    sensors: Sequence[ForceSensor], measured: Sequence[_Readings], numbers: Sequence[Array]
) -> list[ForceSensor]:
    """The sensors with readings that are larger by so many sigma and one."""
    made = []
    for sensor in sensors:
        recording = sensor.recording
        for each, n in zip(measured, numbers, strict=True):
            if each.sensor is sensor:
                values = each.sigma * (each.values + 1.0 + n.reshape(-1, 3))
                recording = (
                    replace(recording, forces=values) if each.kind == "force" else replace(recording, torques=values)
                )
        made.append(replace(sensor, recording=recording))
    return made


def _of_sensor(sensor: ForceSensor) -> Iterator[tuple[str, str, tuple[float, str], Change, Says]]:
    """Name, label, step, what one unit of it adds to readings over sigma, and what a size of it says: of errors that
    forces and torques share."""
    name, times = sensor.name, sensor.recording.times
    yield "force_size", f"size of {name}", (0.01, "1 %"), lambda each: each.values, _reads(name)
    if sensor.delay is None and len(times) > 1:
        yield "force_delay", f"clock of {name}", (1e-3, "1 ms"), _delay(times), _late(name)
    for axis in "xyz":
        step = math.radians(1.0), "1 degree"
        yield "force_direction", f"{name} about {axis}", step, _turn(axis), turned(name, axis)


def _zeros(own: _Readings) -> Iterator[tuple[str, str, tuple[float, str], Change, Says]]:
    """The same of the zeros of forces, or of torques."""
    name, unit = own.sensor.name, "N" if own.kind == "force" else "N m"
    for axis in own.zeros:
        step = own.sigma, f"{short(own.sigma, 2)} {unit}"
        label = f"{own.kind} zero of {name} along {axis}"
        yield f"{own.kind}_zero", label, step, _shift(axis), _off(name, axis, unit)


def _delay(times: Array) -> Change:
    return lambda each: -np.gradient(each.values, times, axis=0)


def _turn(axis: str) -> Change:
    return lambda each: -np.cross(_unit(axis), each.values)


def _shift(axis: str) -> Change:
    return lambda each: np.broadcast_to(_unit(axis) / each.sigma, each.values.shape)


def _unit(axis: str) -> Array:
    return np.eye(3)["xyz".index(axis)]


def _reads(name: str) -> Says:
    return lambda size: f"{name} read {short(100 * abs(size), 2)} % too {'much' if size > 0 else 'little'}"


def _late(name: str) -> Says:
    return lambda size: f"{name} read {short(1e3 * abs(size), 2)} ms too {'late' if size > 0 else 'early'} (its clock)"


def _off(name: str, axis: str, unit: str) -> Says:
    return lambda size: (
        f"{name} read {short(abs(size), 2)} {unit} too {'much' if size > 0 else 'little'} along {axis} (its zero)"
    )
