"""How well a fitted model explains what it saw and predicts what it did not, beside a no-physics baseline."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..arrays.timeseries import mean_position
from ..errors import RecordingError
from ..experiment.carried import carried_baselines
from ..experiment.driven_motion import continued
from ..experiment.experiment import Experiment
from ..minimum.optimizers import refit
from ..problem.problem import FitProblem
from ..problem.smooth import modes_over_time
from ..quantities.parameters import Parameters
from ..recording.baseline import baseline
from ..recording.oscillation import along, dominant_direction, first_frequency
from ..recording.recording import Recording
from ..result.estimate import Given
from ..result.motions import RecordingFit
from .force_comparison import ForceComparison, force_comparisons


@dataclass(frozen=True)
class Comparison:
    """Measured and simulated markers of one experiment over its fitted and held-out part.

    Attributes:
        experiment: whose markers these are.
        recording: the measured part, compared markers only.
        simulated: (frames, markers, 3) m.
        held_out: (frames,) which frames the fit did not see.
        baseline: (frames, markers, 3) of the no-physics prediction on the held-out frames, NaN elsewhere; None without
            one.
        baseline_words: what that prediction is.
        without_physics: m, of a scene that is driven, the error of every such prediction by kind: on the held-out
            frames, or where there are none on the fitted ones.
        forces: the same of every force sensor.
    """

    experiment: Experiment
    recording: Recording
    simulated: np.ndarray
    held_out: np.ndarray
    baseline: np.ndarray | None = None
    baseline_words: str = ""
    without_physics: Mapping[str, float] = field(default_factory=dict)
    forces: tuple[ForceComparison, ...] = ()

    def rms(self, frames: np.ndarray, predicted: np.ndarray | None = None) -> float | None:
        """Root mean square distance [m] over seen markers in some frames, along the experiment's axes."""
        axes = ["xyz".index(a) for a in self.experiment.axes]
        predicted = self.simulated if predicted is None else predicted
        seen = self.recording.mask[frames]
        d2 = ((predicted - self.recording.positions)[frames][..., axes] ** 2).sum(axis=-1)
        return float(np.sqrt(d2[seen].mean())) if seen.any() else None

    def motion(self) -> float | None:
        """Root mean square distance [m] of the held-out measured markers from their mean there: what a prediction has
        to explain."""
        mean = mean_position(self.recording.positions[self.held_out])
        return self.rms(self.held_out, np.broadcast_to(mean, self.recording.positions.shape))

    def frequencies(self) -> tuple[float | None, float | None]:
        """First frequency [Hz] of the held-out part, measured and simulated, along the direction in which the measured
        markers move most."""
        axes = ["xyz".index(a) for a in self.experiment.axes]
        times = self.recording.times[self.held_out]
        measured, simulated = (x[self.held_out][..., axes] for x in (self.recording.positions, self.simulated))
        direction = dominant_direction(measured)
        first, second = (first_frequency(times, along(x, direction)) for x in (measured, simulated))
        return first, second

    def errors(self, rows: int) -> RecordingFit:
        """The row of the report: distances in m, or angles in rad where the experiment has a radius."""
        radius = self.experiment.radius

        def error(distance: float | None) -> float | None:
            return distance if distance is None or radius is None else distance / radius

        moves = self.held_out.any() and not self.experiment.static
        measured, simulated = self.frequencies() if moves else (None, None)
        return RecordingFit(
            name=self.experiment.name,
            rows=rows,
            rms=error(self.rms(~self.held_out)) if rows else None,
            held_out=error(self.rms(self.held_out)),
            baseline=None if self.baseline is None else error(self.rms(self.held_out, self.baseline)),
            without_physics={kind: error(e) or 0.0 for kind, e in self.without_physics.items()},
            motion=error(self.motion()) if moves else None,
            measured_frequency=measured,
            simulated_frequency=simulated,
            unit="m" if radius is None else "rad",
            seen=self._seen() if rows else {},
        )

    def _seen(self) -> dict[str, float]:
        """By marker, in what share of the fitted frames it was seen; none of a cloud."""
        if self.experiment.is_cloud:
            return {}
        shares = self.recording.mask[~self.held_out].mean(axis=0)
        return dict(zip(self.recording.markers, map(float, shares), strict=True))


def predicted_values(
    experiments: Sequence[Experiment],
    wanted: Parameters,
    values: Mapping[str, float],
    refitter: str | None,
    threads: int,
) -> tuple[dict[str, float], tuple[Given, ...], dict[str, np.ndarray]]:
    """All values, with the private parameters of the experiments that are only predicted: fitted to their own windows
    or the others' mean, and zero for unknown inputs over time, which no other recording tells; and the corrections
    of driven markers (`FitProblem.corrections`) that the former found."""
    complete = dict(values)
    given: list[Given] = []
    corrected: dict[str, np.ndarray] = {}
    for e in experiments:
        if e.predict is None:
            continue
        private = [p for p in wanted.values() if p.private and p.tied_to is None and p.name in e.scene.quantities]
        unknown = modes_over_time([e])
        if e.predict == "mean" or refitter is None:
            words = "mean of the fitted recordings"
            for p in private:
                if p.name in unknown:
                    complete[f"{p.name}[{e.name}]"] = 0.0
                    continue
                others = [v for key, v in values.items() if key.partition("[")[0] == p.name]
                own = e.scene.quantities[p.name].value if p.initial is None else p.initial
                complete[f"{p.name}[{e.name}]"] = float(np.mean(others)) if others else own
        elif private:
            words = "fitted to the beginning of its own recording"
            shared = [
                replace(p, fixed=True, prior=None, initial=values[p.name])
                for p in wanted.values()
                if not p.private and p.tied_to is None
            ]
            problem = FitProblem([e], Parameters([*shared, *private]), threads=threads)
            end = refit(problem, problem.parameters.initial(), refitter)
            complete |= problem.parameters.to_physical(end.u)
            corrected |= problem.corrections(end.u)
        given += [
            Given(name=f"{p.name}[{e.name}]", value=complete[f"{p.name}[{e.name}]"], unit=p.unit, words=words)
            for p in private
            if p.name not in unknown
        ]
    return complete, tuple(given), corrected


def compare(
    experiments: Sequence[Experiment],
    parameters: Parameters,
    values: Mapping[str, float],
    threads: int = 1,
    corrected: Mapping[str, np.ndarray] | None = None,
) -> list[Comparison]:
    """Simulate each experiment once over its fitted and held-out parts at the fitted values.

    Args:
        parameters: as given to the fit (private ones not expanded).
        values: by expanded name.
        corrected: by experiment, what the fit added to driven markers (`FitProblem.corrections`). Behind the fitted
            part they move as recorded, but smoothed (`estimated_motion`).
    """
    parts = [_whole(e) for e in experiments]
    found = corrected or {}
    moved = {e.name: continued(e, found[e.name]) for e in experiments if e.name in found}
    problem = FitProblem(experiments, parameters, [part for part, _ in parts], threads, corrected=moved)
    u = problem.parameters.to_internal(values)
    known = {e.name: problem.values_of(e, u) for e in experiments}
    comparisons = []
    for i, (e, (part, held), simulated) in enumerate(zip(experiments, parts, problem.simulate(u), strict=True)):
        plain = Comparison(e, part, simulated, held, forces=force_comparisons(problem, i, u))
        comparisons.append(_with_baseline(plain, experiments, known))
    return comparisons


def _whole(e: Experiment) -> tuple[Recording, np.ndarray]:
    """The fitted and the held-out part as one recording, and which frames are held out."""
    fitted, held = e.fitted(), e.held()
    if held is None:
        # A recording that is only predicted from the others' parameters is held out altogether.
        return fitted, np.full(len(fitted.times), e.predict == "mean")
    times = np.concatenate([fitted.times, held.times])
    order = np.argsort(times, kind="stable")
    if (np.diff(times[order]) <= 0).any():
        raise RecordingError(
            f"{e.name}.held_out", "overlaps the fitted part", e.held_out, "hold out frames that the fit does not see"
        )
    positions = np.concatenate([fitted.positions, held.positions])[order]
    flags = np.concatenate([np.zeros(len(fitted.times), bool), np.ones(len(held.times), bool)])[order]
    return replace(fitted, positions=positions, times=times[order]), flags


def _with_baseline(
    c: Comparison, experiments: Sequence[Experiment], values: Mapping[str, Mapping[str, float]]
) -> Comparison:
    """The no-physics prediction: from the recording's own fitted part, or for a whole recording from the fitted ones
    with its markers."""
    e, held = c.experiment, c.held_out
    if e.held_out is not None:
        sources = [(e, e.fitted())]
        target = e.held()
    elif held.any():
        sources = [(o, o.fitted()) for o in experiments if o.predict is None and _alike(o, e)]
        target = c.recording
    elif e.scene.boundary.driven and not e.static:
        sources, target = [(e, c.recording)], c.recording
    else:
        return c
    if not sources or target is None:
        return c
    guess = baseline([r for _, r in sources], target, carried_baselines(e, sources, target, values))
    if e.scene.boundary.driven:
        # in the row of the report what a prediction is given counts as no error
        share = np.sqrt(guess.scored.sum() / target.mask.sum())
        c = replace(c, without_physics={kind: float(share * error) for kind, error in guess.errors.items()})
    if not held.any():
        return c
    predicted = np.full(c.simulated.shape, np.nan)
    predicted[held] = np.where(guess.scored[..., None], guess.positions, target.positions)
    return replace(c, baseline=predicted, baseline_words=guess.words)


def _alike(one: Experiment, other: Experiment) -> bool:
    """Whether two recordings show the same thing, so that one predicts the other without physics."""
    return (
        one.names == other.names
        and one.static == other.static
        and set(one.scene.quantities) == set(other.scene.quantities)
    )
