"""Fitting physical parameters of scenes to recordings."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from .conclude import Elsewhere, judged_parameters, misfit, warnings_of, without_verdict
from .contradictions import between_parts, doubtful, elsewhere, held_out_motion
from .discretization import Refinement, refined_estimates, to_the_limit
from .driven_noise import doubts
from .errors import InputError
from .experiment import Experiment
from .identifiability import Identifiability
from .leave_one_out import MEANING, companions, each_left_out
from .optimizers import Observer
from .parameters import Parameter, Parameters
from .prediction import Comparison, compare, predicted_values
from .problem import FitProblem, ParameterLike, as_parameters
from .recording import Recording
from .result import Estimate, FitResult, Given, RecordingFit, Refit, Start
from .scene import Scene
from .search import Search

Systematic = Callable[[FitProblem, np.ndarray], Mapping[str, float]]


@dataclass(frozen=True)
class Fit:
    """A finished fit: the result (estimates, verdicts, errors) and what it was made from.

    Attributes:
        result: see `FitResult`; `result.report()` is the text.
        comparisons: measured against simulated, per experiment.
        parameters: as given, private ones not expanded.
        corrections: by experiment with a `driven_sigma`, (knots, markers, 3) m, what the fit added to the markers that
            the scene follows, up to the end of the fitted part.
    """

    result: FitResult
    comparisons: tuple[Comparison, ...]
    parameters: Parameters
    corrections: Mapping[str, np.ndarray] = field(default_factory=dict)

    def __getitem__(self, name: str) -> Estimate:
        return self.result[name]

    @property
    def values(self) -> dict[str, float]:
        """All parameters' values by (expanded) name."""
        return self.result.values

    def values_of(self, experiment: Experiment) -> dict[str, float]:
        """Every quantity of an experiment's scene: as fitted, the private ones its own; else as the scene has it."""
        return {
            name: self.values.get(f"{name}[{experiment.name}]", self.values.get(name, quantity.value))
            for name, quantity in experiment.scene.quantities.items()
        }

    def report(self) -> str:
        """The report as plain text."""
        return self.result.report()

    def save(self, path: str | Path) -> None:
        """Write the result as JSON."""
        self.result.save(path)


def fit(
    scene: Scene | Experiment | Sequence[Experiment],
    recording: Recording | None = None,
    parameters: Mapping[str, ParameterLike] | Iterable[str | Parameter] = (),
    *,
    optimizer: str = "auto",
    starts: Sequence[Mapping[str, float]] = (),
    windows: Sequence[float] = (),
    tolerance: float = 1e-10,
    refine: Refinement | None = None,
    systematic: Systematic | None = None,
    leave_one_out: bool = False,
    profiles: bool = True,
    max_iterations: int = 200,
    threads: int = 1,
    progress: Observer | None = None,
    **experiment: Any,
) -> Fit:
    """Fit quantities of scenes to recordings.

    Args:
        scene: a scene with its `recording` (and any field of `Experiment` as keyword), or one or several experiments.
        parameters: what to fit: names of quantities, `Parameter`s, or a mapping from name to fields of `Parameter`.
        optimizer: "ceres", "scipy", or "auto" (Ceres where it was built).
        starts: further starting values by name; the best end wins, all are reported.
        windows: s, increasing: so much of every motion from its scene's start on is fitted first, one after another,
            each from where the one before ended; for a start far off, from which the whole motion diverges or misleads.
        tolerance: relative change of the cost that counts as none.
        refine: also refit on a finer discretization, and count what that moves as a part of the intervals (see
            `discretization`).
        systematic: (problem, internal minimum) -> half-widths of what else the intervals are to count, by parameter, in
            its unit.
        leave_one_out: also predict every recording that holds nothing out by a fit to the others.
        profiles: refit the others along the worst parameters for their intervals; without, intervals are the linear
            ones, which cost nothing beside the fit.
        max_iterations: per start and window.
        threads: over experiments and Jacobian columns; the result does not depend on it.
        progress: called after every iteration.

    Returns:
        Fit. On Ctrl-C it holds the best point so far, marked `interrupted`, with linear intervals: whatever needs a
        refit is left out.

    Raises:
        InputError: anything inconsistent, named, before work starts.
        SheetbendError: the start itself diverges or has no equilibrium.
    """
    experiments = _experiments(scene, recording, experiment)
    wanted = as_parameters(parameters, experiments)
    if threads < 1:
        raise InputError("threads", "must be positive", threads, "give at least 1")
    search = Search(optimizer, starts, windows, max_iterations, tolerance, progress)
    began = time.perf_counter()
    fitted = [e for e in experiments if e.predict is None]
    if not fitted:
        raise InputError(
            "experiments",
            "leave nothing to fit: all are only predicted",
            len(experiments),
            "set predict to None for at least one",
        )
    if leave_one_out:
        for e in fitted:
            companions(e, fitted, wanted)
    problem = FitProblem(fitted, wanted, threads=threads)
    ends, name, interrupted = search.run(problem)
    best = ends[0]
    values = problem.parameters.to_physical(best.u)

    lost = without_verdict(problem, best)
    if len(lost) == len(problem.parameters.free):  # then no refit tells anything
        refine, systematic = None, None

    def conclude(refitter: str | None) -> _Conclusion:
        refits = (
            ()
            if refine is None or refitter is None
            else refined_estimates(refine, experiments, wanted, problem, best.u, refitter, threads)
        )
        more = {} if systematic is None else systematic(problem, best.u)
        refined = to_the_limit(refits, problem.parameters, values)
        judged, lower = judged_parameters(problem, best.u, refined, more, refitter if profiles else None, lost)
        found = predicted_values(experiments, wanted, values, refitter, threads)
        doubted = () if refitter is None or lost else doubts(problem, best.u, judged)
        parts = {} if refitter is None else between_parts(problem, best.u, judged, refine)
        return _Conclusion(refits, judged, lower, *found, doubted, parts)

    left_out: dict[str, Comparison] = {}
    try:
        end = conclude(None if interrupted else name)
        if leave_one_out and not interrupted:
            left_out = each_left_out(fitted, wanted, values, name, threads)
    except KeyboardInterrupt:
        interrupted = True
        end = conclude(None)
    judged, corrected = end.judged, problem.corrections(best.u) | end.corrected
    comparisons = compare(experiments, wanted, end.values, threads, corrected)
    rows = problem.core.first_rows
    count = {e.name: rows[i + 1] - rows[i] for i, e in enumerate(fitted)}
    errors = tuple(_errors(c, count, left_out, corrected) for c in comparisons)
    starts_elsewhere = [
        Elsewhere(m.cost - best.cost, problem.parameters.to_physical(m.u), "another start") for m in ends[1:]
    ]
    contradicted = (
        held_out_motion(problem, comparisons, errors)
        | elsewhere(problem, judged, best.cost, [*starts_elsewhere, *end.lower])
        | end.parts
    )
    estimates = doubtful(judged.estimates, contradicted)
    result = FitResult(
        estimates=estimates,
        recordings=errors,
        cost=best.cost,
        first_cost=best.first,
        jacobian_seconds=problem.seconds.get(True),
        rows=problem.core.data_rows,
        optimizer=name,
        iterations=best.iterations,
        seconds=time.perf_counter() - began,
        converged=best.converged,
        interrupted=interrupted,
        message=best.message,
        given=_given(problem.parameters, values) + end.given,
        correlations=judged.correlations,
        gauges=tuple(g.words for g in judged.gauges),
        baseline="; ".join(
            dict.fromkeys(c.baseline_words for c in (*comparisons, *left_out.values()) if c.baseline_words)
        ),
        held_out_is=MEANING if left_out else "",
        autocorrelation_time=judged.autocorrelation_time,
        starts=tuple(
            Start(
                cost=m.cost, iterations=m.iterations, converged=m.converged, values=problem.parameters.to_physical(m.u)
            )
            for m in ends
        ),
        refits=end.refits,
        misfit=misfit(problem, best.u),
        warnings=warnings_of(ends, interrupted, problem, estimates) + end.doubts,
    )
    return Fit(result, tuple(comparisons), wanted, corrected)


@dataclass(frozen=True)
class _Conclusion:
    """What follows from a minimum."""

    refits: tuple[Refit, ...]
    judged: Identifiability
    lower: tuple[Elsewhere, ...]  # where profiles ended
    values: dict[str, float]  # of all experiments
    given: tuple[Given, ...]
    corrected: dict[str, np.ndarray]  # of experiments that are only predicted
    doubts: tuple[str, ...]
    parts: dict[str, str]  # by parameter, of which parts of the data ask for different values


def _experiments(
    scene: Scene | Experiment | Sequence[Experiment], recording: Recording | None, fields: Mapping[str, Any]
) -> list[Experiment]:
    if isinstance(scene, Scene):
        if recording is None:
            raise InputError("recording", "is missing", None, "give the recording that the scene is to explain")
        return [Experiment(scene=scene, recording=recording, **fields)]
    if recording is not None or fields:
        raise InputError(
            "recording",
            "goes with a single scene",
            sorted(fields) or "recording",
            "put everything into the experiments",
        )
    experiments = [scene] if isinstance(scene, Experiment) else list(scene)
    if not experiments:
        raise InputError("experiments", "are empty", 0, "give at least one")
    return experiments


def _errors(
    c: Comparison, rows: Mapping[str, int], left_out: Mapping[str, Comparison], corrected: Mapping[str, np.ndarray]
) -> RecordingFit:
    found = c.errors(rows.get(c.experiment.name, 0))
    if c.experiment.name in corrected:
        by = float(np.sqrt(np.mean(corrected[c.experiment.name] ** 2)))
        found = replace(found, driven_sigma=c.experiment.driven_noise, corrected_by=by)
    if c.experiment.name not in left_out:
        return found
    other = left_out[c.experiment.name].errors(0)
    return replace(
        other, rows=found.rows, rms=found.rms, driven_sigma=found.driven_sigma, corrected_by=found.corrected_by
    )


def _given(parameters: Parameters, values: Mapping[str, float]) -> tuple[Given, ...]:
    rows = []
    for name, p in parameters.items():
        if not p.free:
            words = (
                "fixed"
                if p.tied_to is None
                else f"{p.factor:g} times {p.tied_to}"
                if p.factor != 1.0
                else f"equal to {p.tied_to}"
            )
            rows.append(Given(name=name, value=values[name], unit=p.unit, words=words))
    return tuple(rows)
