"""Fitting physical parameters of scenes to recordings."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..doubts.beginnings import Beginning, checked, of_beginnings
from ..doubts.conclude import judged_parameters, misfit, warnings_of, without_verdict
from ..doubts.contradictions import between_parts, doubtful, elsewhere, held_out_motion, together
from ..doubts.floors import at_floor_of_sweeps
from ..doubts.given import check_given, half_widths, premises
from ..doubts.implausible import implausible
from ..doubts.leave_one_out import MEANING, companions, each_left_out
from ..doubts.losses import loss_doubts
from ..doubts.missing_force import missing_force
from ..doubts.missing_loss import missing_loss
from ..doubts.prediction import Comparison, compare, predicted_values
from ..doubts.profiles import Elsewhere
from ..doubts.spin import spins_otherwise
from ..doubts.stationary import from_start, unfinished
from ..doubts.stuck import bounded_by_sticking
from ..doubts.touching import kinks, what_touches
from ..doubts.unexplained import unexplained
from ..doubts.wrong_given import doubts_of, explained_by, wrong_in_either
from ..doubts.wrong_given import warnings_of as wrong_given_warnings
from ..errors import InputError
from ..experiment.clock import outside, told_clocks
from ..experiment.experiment import Experiment
from ..minimum.continuity import joined, shot_motions
from ..minimum.counts import counted
from ..minimum.discretization import Refinement, settled, to_the_limit, wanted_refinement
from ..minimum.fine_meshes import at_the_limit
from ..minimum.growth import growths
from ..minimum.journal import journaled
from ..minimum.optimizers import Observer, ceres_trouble
from ..minimum.problem import FitProblem, ParameterLike, as_parameters
from ..minimum.search import Search
from ..minimum.time_step import Settled
from ..minimum.workers import shared_out
from ..optional import require
from ..quantities.parameters import Parameter, Parameters
from ..recording.recording import Recording
from ..report.fit_result import FitResult
from ..result.result import Estimate, Given, Premise
from ..scene.scene import Scene
from ..statistics.identifiability import Identifiability
from .clouds import driven_beside_clouds, misread_beside_clouds, told_beside_clouds
from .experiments import experiments_of
from .rows import curves, every_end, given_rows, growth_rows, recording_fit, start_rows

IGNORED = ", and their standard deviations do not count"
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
        on_mesh: values that explain the recordings on the mesh of the experiments, of which `comparisons` tells;
            `values` are those at the limit of fine meshes, where these were counted.
    """

    result: FitResult
    comparisons: tuple[Comparison, ...]
    parameters: Parameters
    corrections: Mapping[str, np.ndarray] = field(default_factory=dict)
    on_mesh: Mapping[str, float] = field(default_factory=dict)

    def __getitem__(self, name: str) -> Estimate:
        return self.result[name]

    @property
    def interrupted(self) -> bool:
        """Whether Ctrl-C ended it."""
        return self.result.interrupted

    @property
    def values(self) -> dict[str, float]:
        """All parameters' values by (expanded) name."""
        return self.result.values

    def values_of(self, experiment: Experiment) -> dict[str, float]:
        """Every quantity of an experiment's scene, to simulate it with: as fitted on its mesh, the private ones its
        own; else as the scene has it."""
        values = {**self.values, **self.on_mesh}
        return {
            name: values.get(f"{name}[{experiment.name}]", values.get(name, quantity.value))
            for name, quantity in experiment.scene.quantities.items()
        }

    def report(self) -> str:
        """The report as plain text."""
        return self.result.report()

    def save(self, path: str | Path) -> None:
        """Write the result as JSON."""
        self.result.save(path)


@shared_out
@journaled
def fit(
    scene: Scene | Experiment | Sequence[Experiment],
    recording: Recording | None = None,
    parameters: Mapping[str, ParameterLike] | Iterable[str | Parameter] = (),
    *,
    optimizer: str = "auto",
    starts: Sequence[Mapping[str, float]] | int = (),
    windows: Sequence[float] | str = "auto",
    tolerance: float = 1e-10,
    refine: Refinement | str | bool | None = "auto",
    systematic: Systematic | None = None,
    given: Mapping[str, float] | None = None,
    leave_one_out: bool = False,
    profiles: bool = True,
    beginnings: bool = True,
    max_iterations: int = 200,
    threads: int = 1,
    progress: Observer | None = None,
    journal: str | Path | None = None,
    executor: Executor | None = None,
    **experiment: Any,
) -> Fit:
    """Fit quantities of scenes to recordings.

    Args:
        scene: a scene with its `recording` (and any field of `Experiment` as keyword), or one or several experiments.
        parameters: what to fit: names of quantities, `Parameter`s, or a mapping from name to fields of `Parameter`.
        optimizer: "ceres", "scipy", or "auto" (Ceres where it was built).
        starts: further starting values by name; the best end wins, all are reported. Or a number of starts: the initial
            one and others from a Sobol sequence, over the priors, between bounds, or two decades about the initial
            value. They are raced through the windows with a loose tolerance, and the best of each group that ends in
            the same minimum is fitted (`sheetbend.minimum.race`). A start at a bound is moved off it by 5 % of the
            range.
        windows: s, increasing: so much of every motion from its scene's start on is fitted first, one after another,
            each from where the one before ended. "auto" chooses the lengths, and none where the first step on the whole
            motion keeps what it promises; () for none.
        tolerance: relative change of the cost that counts as none.
        refine: "auto" moves the estimates to the limit of short substeps and counts what that leaves open in the
            intervals, at the cost of some three evaluations with tangents. A `Refinement` says more, above all how to
            make the same experiments on a finer mesh, to whose limit the estimates are moved as well; "auto" does not
            know how, and "mesh not counted" stands in the table then. Where the data speak against a limit, as those
            of a recording do that was simulated at the same substep, the estimate stays, and all that it would move
            counts. False (or None) counts nothing.
        systematic: (problem, internal minimum) -> half-widths of what else the intervals are to count, by parameter, in
            its unit.
        given: standard deviations of numbers that the fit takes as given, by name; they then count in the intervals. Of
            quantities that must be positive it is relative (`{"rope_density": 0.02}` is 2 %), of others in their unit;
            "gravity" (its direction), "clamp_direction" and "collider_direction" (of each about each axis) are in rad,
            "clamps" and "markers" (their places) in m. What each of these numbers moves is in `FitResult.premises` in
            any case.
        leave_one_out: also predict every recording that holds nothing out by a fit to the others.
        profiles: follow the cost to the ends of every interval, all other parameters fitted again; of more than 60
            parameters only for weak ones. Without, intervals are the linear ones, which cost nothing beside the fit.
        beginnings: also fit the beginnings of the motions by themselves, to doubt what they contradict and to search on
            from there (`sheetbend.doubts.beginnings`). That costs about as much as the fit itself.
        max_iterations: per start and window.
        threads: over experiments and Jacobian columns; the result does not depend on it.
        progress: called after every iteration.
        journal: file that keeps every evaluation until the fit is done (see `sheetbend.minimum.journal`). After a kill,
            the same call with the same file goes on from there and gives the same bits; with another recording, scene
            or version it is refused.
        executor: shares out evaluations of several experiments, raced starts, profiles and leave-one-out to its
            workers, such as those of `concurrent.futures.ProcessPoolExecutor(2)`; the result has the same bits. Only
            this process writes the journal.

    Returns:
        Fit. On Ctrl-C it holds the best point so far, marked `interrupted`, with linear intervals: whatever needs a
        refit is left out.

    Raises:
        InputError: anything inconsistent, named, before work starts.
        SheetbendError: the start itself diverges or has no equilibrium.
    """
    experiments = experiments_of(scene, recording, experiment)
    wanted = as_parameters(parameters, experiments)
    if threads < 1:
        raise InputError("threads", "must be positive", threads, "give at least 1")
    require("scipy.special", "fit")  # of intervals, behind all the work
    refinement = wanted_refinement(refine)
    search = Search(optimizer, starts, windows, max_iterations, tolerance, progress)
    began, before = time.perf_counter(), counted()
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
    experiments, found_at = joined(experiments, wanted, threads, progress)
    fitted = [e for e in experiments if e.predict is None]
    problem = FitProblem(fitted, wanted, threads=threads, expanded=found_at)
    problem.check_start()
    check_given(given or {}, problem)
    found = search.run(problem)
    ends, name, interrupted = found.ends, found.optimizer, found.interrupted
    trouble = ceres_trouble() if optimizer == "auto" else ""
    fallback = (f"SciPy stands in for Ceres, which does not load: {trouble}",) if trouble else ()
    begun = tuple[Beginning, ...]()
    if not interrupted:
        try:
            ends = from_start(search, problem, ends)
        except KeyboardInterrupt:
            interrupted = True
    grown, first = growths(problem, ends[0].u), ends[0]
    if beginnings and not interrupted:
        try:
            ends, begun = checked(search, problem, ends, grown)
        except KeyboardInterrupt:
            interrupted = True
    if ends[0] is not first:
        grown = growths(problem, ends[0].u)
    best = ends[0]
    lost = without_verdict(problem, best, grown)
    if len(lost) == len(problem.parameters.free):  # then no refit tells anything
        refinement, systematic = wanted_refinement(False), None

    def conclude(refitter: str | None) -> _Conclusion:
        at, every = settled(refinement, experiments, problem, best, refitter)
        values = problem.parameters.to_physical(at.u)
        told, silent = ([], "") if refitter is None or lost else told_beside_clouds(at.problem, at.u)
        uncounted = f"what errors of the given values would move is not known{IGNORED if given else ''}: {silent}"
        unknown = (uncounted,) if silent else ()
        rests_on = premises(at.problem, at.u, given or {}, told)
        more = dict(half_widths(rests_on, problem.parameters.free))
        for parameter, reach in ({} if systematic is None else systematic(at.problem, at.u)).items():
            more[parameter] = more.get(parameter, 0.0) + reach
        refined = to_the_limit(at.refits, problem.parameters, values)
        judged, lower = judged_parameters(
            at.problem, at.u, refined, more, refitter if profiles else None, lost, (problem, best.u)
        )
        judged = at_floor_of_sweeps(_moved(judged, at.moved), at.refits)
        if refitter is not None and profiles and not lost:
            judged = bounded_by_sticking(at.problem, at.u, judged, refitter)
        predicted = predicted_values(every, wanted, values, refitter, threads)
        doubted: tuple[str, ...] = ()
        parts: dict[str, str] = {}
        if refitter is not None:
            parts = of_beginnings(problem, best.u, judged, begun, refinement)
            parts |= between_parts(at.problem, at.u, judged, refinement)
            if not lost:
                doubted, drawn_off = driven_beside_clouds(at.problem, at.u, judged)
                doubted += loss_doubts(at.problem, at.u, judged)
                wrong = wrong_in_either((at.problem, at.u), (problem, best.u), told, refinement)
                doubted += wrong_given_warnings(at.problem, wrong)
                spin, undecided = spins_otherwise(problem, best.u, judged)
                doubted += undecided
                lacking = (
                    doubts_of(at.problem, at.u, judged, wrong),
                    missing_loss(at.problem, at.u, (problem, best.u), explained_by(at.problem, wrong)),
                    missing_force(at.problem, at.u, judged),
                    spin,
                )
                parts = together(*lacking, drawn_off, parts)
        return _Conclusion(at, tuple(every), judged, lower, *predicted, doubted + unknown, rests_on, parts)

    left_out: dict[str, Comparison] = {}
    try:
        end = conclude(None if interrupted else name)
        if leave_one_out and not interrupted:
            left_out = each_left_out(fitted, wanted, end.values, name, threads)
    except KeyboardInterrupt:
        interrupted = True
        end = conclude(None)
    at, judged = end.at, end.judged
    corrected = at.problem.corrections(at.u) | end.corrected
    comparisons = compare(end.experiments, wanted, end.values, threads, corrected)
    rows = problem.core.first_rows
    count = {e.name: rows[i + 1] - rows[i] for i, e in enumerate(fitted)}
    errors = tuple(recording_fit(c, count, left_out, corrected) for c in comparisons)
    starts_elsewhere = [
        Elsewhere(m.cost - best.cost, problem.parameters.to_physical(m.u), "another start") for m in ends[1:]
    ]
    stopped, ahead = unfinished(problem, best, judged)
    missed = unexplained(problem, comparisons, judged.autocorrelation_time, at.u)
    contradicted = (
        held_out_motion(problem, comparisons, errors)
        | elsewhere(problem, judged, best.cost, [*starts_elsewhere, *end.lower])
        | end.parts
        | missed
        | stopped
    )
    estimates, limit = at_the_limit(
        doubtful(judged.estimates, contradicted, missed), at.refits, problem.parameters, at.u
    )
    values = end.values | problem.parameters.to_physical(limit)
    errors = told_clocks(errors, end.experiments, end.values, estimates)
    shifted = tuple(outside(end.experiments, end.values))
    each = every_end(ends, found.raced)
    evaluations, jacobians = sum(m.evaluations for m in ends), sum(m.jacobians for m in ends)
    result = FitResult(
        estimates=estimates,
        recordings=errors,
        cost=best.cost if at.problem is problem else at.cost,
        first_cost=best.first,
        jacobian_seconds=problem.seconds.get(True),
        rows=problem.core.data_rows,
        optimizer=name,
        iterations=best.iterations,
        seconds=time.perf_counter() - began,
        converged=best.converged,
        interrupted=interrupted,
        message=best.message,
        given=given_rows(problem.parameters, values) + end.given,
        correlations=judged.correlations,
        gauges=tuple(g.words for g in judged.gauges),
        baseline="; ".join(
            dict.fromkeys(c.baseline_words for c in (*comparisons, *left_out.values()) if c.baseline_words)
        ),
        held_out_is=MEANING if left_out else "",
        autocorrelation_time=judged.autocorrelation_time,
        starts=start_rows(each, problem.parameters),
        condition=None if found.condition is None else found.condition.words,
        profiles=curves(judged.profiles, problem.parameters, limit),
        refits=at.refits,
        not_counted=at.not_counted,
        premises=end.premises,
        misfit=misfit(at.problem, at.u),
        forces=tuple(row for c in comparisons for one in c.forces for row in one.fits()),
        growth=growth_rows(found.growths, grown),
        contacts=what_touches(at.problem, at.u),
        shot=shot_motions(problem, best.u),
        kinks=() if interrupted else kinks(at.problem, at.u, estimates),
        windows=best.windows,
        evaluations=evaluations,
        jacobians=jacobians,
        judging=(counted()[0] - before[0] - evaluations, counted()[1] - before[1] - jacobians),
        warnings=warnings_of([m for m, _ in each], interrupted, problem, estimates, ahead)
        + end.doubts
        + at.warnings
        + shifted
        + fallback
        + (() if interrupted else misread_beside_clouds(problem, best.u) + implausible(problem)),
    )
    return Fit(result, tuple(comparisons), wanted, corrected, end.values)


@dataclass(frozen=True)
class _Conclusion:
    """What follows from a minimum."""

    at: Settled
    experiments: tuple[Experiment, ...]  # as they are compared
    judged: Identifiability
    lower: tuple[Elsewhere, ...]  # where profiles ended
    values: dict[str, float]  # of all experiments
    given: tuple[Given, ...]
    corrected: dict[str, np.ndarray]  # of experiments that are only predicted
    doubts: tuple[str, ...]
    premises: tuple[Premise, ...]
    parts: dict[str, str]  # by parameter, of which parts of the data ask for different values


def _moved(judged: Identifiability, by: Mapping[str, float]) -> Identifiability:
    """With how far each estimate was moved to the limit of short substeps."""
    return replace(judged, estimates=tuple(replace(e, moved=by.get(e.name, 0.0)) for e in judged.estimates))
