"""How well a fitted model explains recorded forces, beside the prediction that they are constant."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays.types import Array
from ..experiment.experiment import Experiment
from ..experiment.force_sensor import CHANNELS
from ..problem.problem import FitProblem
from ..result.motions import ForceFit

UNITS = (("N", slice(0, 3)), ("N m", slice(3, CHANNELS)))


@dataclass(frozen=True)
class ForceComparison:
    """Measured and simulated readings of one sensor over the fitted and the held-out part.

    Attributes:
        experiment, sensor: names.
        times: (samples,) s of the recording.
        measured: (samples, 6) N and N m in the sensor's axes; NaN where nothing counts.
        simulated: the same, without gaps, biases included.
        fitted, held_out: (samples,) bool; samples between the two parts belong to neither.
    """

    experiment: str
    sensor: str
    times: Array
    measured: Array
    simulated: Array
    fitted: Array
    held_out: Array

    def fits(self) -> list[ForceFit]:
        """Rows of the report: one for forces, and one for torques where they are compared."""
        return [self._row(unit, part) for unit, part in UNITS if np.isfinite(self.measured[:, part]).any()]

    def _row(self, unit: str, part: slice) -> ForceFit:
        counts = np.isfinite(self.measured[:, part]).any(axis=0)
        measured, simulated = self.measured[:, part][:, counts], self.simulated[:, part][:, counts]
        source = self.fitted if np.isfinite(measured[self.fitted]).any(axis=0).all() else np.ones_like(self.fitted)
        constant = np.nanmean(measured[source], axis=0)
        shown = self.held_out if self.held_out.any() else self.fitted

        def rms(predicted: Array, where: Array) -> float | None:
            off = (predicted - measured)[where]
            return float(np.sqrt(np.nanmean(off**2))) if np.isfinite(off).any() else None

        return ForceFit(
            recording=self.experiment,
            sensor=self.sensor,
            rows=int(np.isfinite(measured[self.fitted]).sum()),
            rms=rms(simulated, self.fitted),
            held_out=rms(simulated, self.held_out),
            baseline=rms(np.broadcast_to(constant, measured.shape), shown),
            unit=unit,
        )


def force_comparisons(problem: FitProblem, i: int, u: Array) -> tuple[ForceComparison, ...]:
    """Comparisons of the sensors of one experiment, whose recording in the problem is the fitted and the held-out part
    together."""
    e = problem.experiments[i]
    if not e.forces:
        return ()
    r, found = problem.recordings[i], []
    for sensor, core, read in zip(e.forces, problem.sensed[i], problem.readings(i, u), strict=True):
        times = sensor.recording.times[sensor.kept(e.t0, (float(r.times[0]), float(r.times[-1])))]
        fitted, held = _parts(e, times)
        found.append(ForceComparison(e.name, sensor.name, times, core["measured"], read, fitted, held))
    return tuple(found)


def _parts(e: Experiment, times: Array) -> tuple[Array, Array]:
    """Which samples the fit sees, and which are only predicted."""

    def within(part: Array) -> Array:
        return np.asarray((times >= part[0] - 1e-9) & (times <= part[-1] + 1e-9))

    fitted, held = within(e.fitted().times), e.held()
    if held is not None:
        return fitted, within(held.times) & ~fitted
    return (np.zeros_like(fitted), fitted) if e.predict == "mean" else (fitted, np.zeros_like(fitted))
