"""Fitting physical parameters of scenes to recordings."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from .discretization import Refinement, refined_estimates
from .errors import InputError
from .experiment import Experiment
from .floors import solver_floors
from .identifiability import Identifiability, identify
from .optimizers import Minimum, Observer, minimize
from .parameters import Parameter, Parameters
from .prediction import Comparison, compare
from .problem import FitProblem, ParameterLike, as_parameters
from .recording import Recording
from .result import Estimate, FitResult, Given, Start
from .scene import Scene

INACCURATE = 0.5  # a start whose cost exceeds the best by this share ended elsewhere


@dataclass(frozen=True)
class Fit:
    """A finished fit: the result (estimates, verdicts, errors) and what it was made from.

    Attributes:
        result: see `FitResult`; `result.report()` is the text.
        comparisons: measured against simulated, per experiment.
        parameters: as given, private ones not expanded.
    """

    result: FitResult
    comparisons: tuple[Comparison, ...]
    parameters: Parameters

    def __getitem__(self, name: str) -> Estimate:
        return self.result[name]

    @property
    def values(self) -> dict[str, float]:
        """All parameters' values by (expanded) name."""
        return self.result.values

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
    refine: Refinement | None = None,
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
        refine: also refit on a finer discretization, and count what that moves as a part of the intervals (see `discretization`).
        max_iterations: per start.
        threads: over experiments and Jacobian columns; the result does not depend on it.
        progress: called after every iteration.

    Returns:
        Fit. On Ctrl-C it holds the best point so far, marked `interrupted`.

    Raises:
        InputError: anything inconsistent, named, before work starts.
        SheetbendError: the start itself diverges or has no equilibrium.
    """
    experiments = _experiments(scene, recording, experiment)
    wanted = as_parameters(parameters, experiments)
    began = time.perf_counter()
    fitted = [e for e in experiments if e.predict is None]
    if not fitted:
        raise InputError("experiments", "leave nothing to fit: all are only predicted", len(experiments), "set predict to None for at least one")
    problem = FitProblem(fitted, wanted, threads=threads)
    ends, name = _minimize_all(problem, optimizer, starts, max_iterations, progress)
    best = ends[0]
    refined = {} if refine is None or best.interrupted else refined_estimates(refine, experiments, wanted, problem, best.u, name, threads)
    judged = _judge(problem, best.u, refined, name)
    values = problem.parameters.to_physical(best.u)
    every, all_values, extra = _predicted(experiments, wanted, values, name, threads)
    comparisons = compare(every, wanted, all_values, threads)
    rows = problem.core.first_rows
    count = {e.name: rows[i + 1] - rows[i] for i, e in enumerate(fitted)}
    result = FitResult(
        estimates=judged.estimates,
        recordings=tuple(c.errors(count.get(c.experiment.name, 0)) for c in comparisons),
        cost=best.cost,
        rows=problem.core.data_rows,
        optimizer=name,
        iterations=best.iterations,
        seconds=time.perf_counter() - began,
        converged=best.converged,
        interrupted=best.interrupted,
        message=best.message,
        given=_given(problem.parameters, values) + extra,
        correlations=judged.correlations,
        gauges=tuple(g.words for g in judged.gauges),
        baseline="; ".join(dict.fromkeys(c.baseline_words for c in comparisons if c.baseline_words)),
        autocorrelation_time=judged.autocorrelation_time,
        starts=tuple(Start(cost=m.cost, iterations=m.iterations, converged=m.converged, values=problem.parameters.to_physical(m.u)) for m in ends),
        warnings=_warnings(ends, best),
    )
    return Fit(result, tuple(comparisons), wanted)


def _experiments(scene: Scene | Experiment | Sequence[Experiment], recording: Recording | None, fields: Mapping[str, Any]) -> list[Experiment]:
    if isinstance(scene, Scene):
        if recording is None:
            raise InputError("recording", "is missing", None, "give the recording that the scene is to explain")
        return [Experiment(scene=scene, recording=recording, **fields)]
    if recording is not None or fields:
        raise InputError("recording", "goes with a single scene", sorted(fields) or "recording", "put everything into the experiments")
    experiments = [scene] if isinstance(scene, Experiment) else list(scene)
    if not experiments:
        raise InputError("experiments", "are empty", 0, "give at least one")
    return experiments


def _minimize_all(
    problem: FitProblem, optimizer: str, starts: Sequence[Mapping[str, float]], max_iterations: int, progress: Observer | None
) -> tuple[list[Minimum], str]:
    """Ends of all starts, best first."""
    first = problem.parameters.to_physical(problem.parameters.initial())
    points = [problem.parameters.initial()]
    for changes in starts:
        unknown = set(changes) - set(problem.parameters.free)
        if unknown:
            raise InputError("starts", "name no free parameter", sorted(unknown), f"use: {', '.join(problem.parameters.free)}")
        points.append(problem.parameters.to_internal(first | dict(changes)))
    ends = []
    for u in points:
        end, name = minimize(problem, u, optimizer, max_iterations, observe=progress)
        ends.append(end)
        if end.interrupted:
            break
    return sorted(ends, key=lambda m: m.cost), name


def _judge(problem: FitProblem, u: np.ndarray, refined: Mapping[str, float], optimizer: str) -> Identifiability:
    _, r, J = problem.evaluate(u)
    rows = problem.core.data_rows

    def profile(name: str, value: float) -> float:
        """Cost with one parameter held and the others refitted."""
        held = problem.holding(name, value)
        end, _ = minimize(held, held.parameters.to_internal(problem.parameters.to_physical(u)), optimizer, 50)
        return end.cost

    return identify(
        problem.parameters,
        u,
        r[:rows],
        J[:rows],
        layout=problem.rows_layout(),
        floors=solver_floors(problem.experiments, problem.parameters),
        discretization=refined,
        profile=profile if len(problem.parameters.free) > 1 else None,
    )


def _predicted(
    experiments: Sequence[Experiment], wanted: Parameters, values: Mapping[str, float], optimizer: str, threads: int
) -> tuple[list[Experiment], dict[str, float], tuple[Given, ...]]:
    """Private parameters of the experiments that are only predicted, fitted to their own windows or taken as the others' mean."""
    complete = dict(values)
    given: list[Given] = []
    for e in experiments:
        if e.predict is None:
            continue
        private = [p for p in wanted.values() if p.private and p.tied_to is None and p.name in e.scene.quantities]
        if e.predict == "mean":
            for p in private:
                others = [v for key, v in values.items() if key.partition("[")[0] == p.name]
                own = e.scene.quantities[p.name].value if p.initial is None else p.initial
                complete[f"{p.name}[{e.name}]"] = float(np.mean(others)) if others else own
        elif private:
            shared = [replace(p, fixed=True, prior=None, initial=values[p.name]) for p in wanted.values() if not p.private and p.tied_to is None]
            own = FitProblem([e], Parameters([*shared, *private]), threads=threads)
            end, _ = minimize(own, own.parameters.initial(), optimizer)
            complete |= own.parameters.to_physical(end.u)
        words = "mean of the fitted recordings" if e.predict == "mean" else "fitted to the recording's own first window"
        given += [Given(name=f"{p.name}[{e.name}]", value=complete[f"{p.name}[{e.name}]"], unit=p.unit, words=words) for p in private]
    return list(experiments), complete, tuple(given)


def _given(parameters: Parameters, values: Mapping[str, float]) -> tuple[Given, ...]:
    rows = []
    for name, p in parameters.items():
        if not p.free:
            words = "fixed" if p.tied_to is None else f"{p.factor:g} times {p.tied_to}" if p.factor != 1.0 else f"equal to {p.tied_to}"
            rows.append(Given(name=name, value=values[name], unit=p.unit, words=words))
    return tuple(rows)


def _warnings(ends: Sequence[Minimum], best: Minimum) -> tuple[str, ...]:
    warnings = []
    elsewhere = [m for m in ends if m.cost > best.cost * (1.0 + INACCURATE)]
    if elsewhere:
        warnings.append(f"{len(elsewhere)} of {len(ends)} starts ended in a worse minimum: the cost has several")
    if not best.converged and not best.interrupted:
        warnings.append(f"the fit did not converge: {best.message}")
    return tuple(warnings)

