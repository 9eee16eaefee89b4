"""Fitting physical parameters of scenes to recordings."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..doubts.bootstrap import check_bootstrap
from ..doubts.given import check_given
from ..doubts.leave_one_out import companions, each_left_out
from ..doubts.prediction import Comparison, compare
from ..errors import InputError
from ..experiment.experiment import Experiment
from ..experiment.wanted import ParameterLike, as_parameters
from ..minimum.continuity import joined
from ..minimum.discretization import Refinement, wanted_refinement
from ..minimum.journal import journaled
from ..minimum.linear_algebra import one_blas_thread
from ..minimum.optimizers import Observer, ceres_trouble
from ..minimum.problem import FitProblem
from ..minimum.search import Search
from ..minimum.smooth import Smooth, settled, with_fields
from ..minimum.workers import shared_out
from ..optional import require
from ..quantities.parameters import Parameter, Parameters
from ..recording.recording import Recording
from ..report.fit_result import FitResult
from ..result.estimate import Estimate
from ..scene.scene import Scene
from .conclusion import Asked, Systematic, conclude
from .experiments import experiments_of
from .reached import reach
from .result_of import Clock, result_of


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
@one_blas_thread()
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
    smooth: Mapping[str, Smooth] | None = None,
    leave_one_out: bool = False,
    profiles: bool = True,
    bootstrap: int = 0,
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
            "clamps", "markers", "marker_offset" (from a rope's axis) and "drive_place" in m, "recording_delay" in s,
            "marker_mass" (of each, which the model does not have) in kg, "draft" (velocity of the air along each axis)
            in m/s; relative are "gravity_size", "recording_clock" (its frame rate), "recording_size" and "drive_size"
            (how far what drives the scene moves). Of force sensors there are "force_size" (relative), "force_zero" in
            N, "torque_zero" in N m, "force_direction" in rad and "force_delay" in s. What is exact has 0. What each of
            these numbers moves is in `FitResult.premises`.
        smooth: fields of stiffness (`stiffness_modes` of a cloth or a solid of clusters) that are fitted with a
            smoothness prior, by name, such as {"toy_stiffness": sb.Smooth()}. The size and the length of the prior are
            found from the recordings where `Smooth` does not give them (`FitResult.fields`).
        leave_one_out: also predict every recording that holds nothing out by a fit to the others.
        profiles: follow the cost to the ends of every interval, all other parameters fitted again; of more than 60
            parameters only for weak ones. Without, intervals are the linear ones, which cost nothing beside the fit.
        bootstrap: number of fits to data that are drawn from these with replacement, 0 for none: whole recordings where
            there are eight or more, else stretches of each that are four autocorrelation times long. Each costs some
            two Jacobians. Their scatter gives intervals that assume nothing of the noise (`FitResult.bootstrap`).
        beginnings: also fit the beginnings of the motions by themselves, to doubt what they contradict and to search on
            from there (`sheetbend.doubts.beginnings`). That costs about as much as the fit itself.
        max_iterations: per start and window.
        threads: over experiments and Jacobian columns; the result does not depend on it.
        progress: called after every iteration.
        journal: file that keeps every evaluation until the fit is done (see `sheetbend.minimum.journal`). After a kill,
            the same call with the same file goes on from there and gives the same bits; with another recording, scene
            or version it is refused.
        executor: shares out evaluations of several experiments, raced starts, profiles, bootstraps and leave-one-out to
            its workers, such as those of `concurrent.futures.ProcessPoolExecutor(2)`; the result has the same bits.
            Only this process writes the journal.

    Returns:
        Fit. On Ctrl-C it holds the best point so far, marked `interrupted`, with linear intervals: whatever needs a
        refit is left out.

    Raises:
        InputError: anything inconsistent, named, before work starts.
        SheetbendError: the start itself diverges or has no equilibrium.
    """
    experiments = experiments_of(scene, recording, experiment)
    wanted, fields = with_fields(as_parameters(parameters, experiments), experiments, smooth or {})
    if threads < 1:
        raise InputError("threads", "must be positive", threads, "give at least 1")
    require("scipy.special", "fit")  # of intervals, behind all the work
    asked = Asked(wanted_refinement(refine), systematic, given or {}, profiles, bootstrap, threads)
    search = Search(optimizer, starts, windows, max_iterations, tolerance, progress)
    clock = Clock.started()
    fitted = _fitted(experiments)
    if leave_one_out:
        for e in fitted:
            companions(e, fitted, wanted)
    experiments, found_at = joined(experiments, wanted, threads, progress)
    fitted = _fitted(experiments)
    wanted, found_at, fields = settled(fitted, wanted, found_at, fields, threads, progress)
    problem = FitProblem(fitted, wanted, threads=threads, expanded=found_at)
    problem.check_start()
    check_given(asked.given, problem)
    check_bootstrap(bootstrap, problem)
    reached = reach(search, problem, beginnings)
    if reached.all_lost:
        asked = asked.without_refits()
    refitter, interrupted = reached.found.optimizer, reached.interrupted
    left_out: dict[str, Comparison] = {}
    try:
        conclusion = conclude(reached, experiments, wanted, asked, None if interrupted else refitter)
        if leave_one_out and not interrupted:
            left_out = each_left_out(fitted, wanted, conclusion.values, refitter, threads)
    except KeyboardInterrupt:
        interrupted = True
        conclusion = conclude(reached, experiments, wanted, asked, None)
    corrected = conclusion.at.problem.corrections(conclusion.at.u) | conclusion.corrected
    comparisons = compare(conclusion.experiments, wanted, conclusion.values, threads, corrected)
    result = result_of(reached, conclusion, comparisons, left_out, corrected, fields, interrupted, clock)
    if optimizer == "auto" and (trouble := ceres_trouble()):
        result = replace(
            result, warnings=(*result.warnings, f"SciPy stands in for Ceres, which does not load: {trouble}")
        )
    return Fit(result, tuple(comparisons), wanted, corrected, conclusion.values)


def _fitted(experiments: Sequence[Experiment]) -> list[Experiment]:
    """Those that are not only predicted."""
    fitted = [e for e in experiments if e.predict is None]
    if not fitted:
        raise InputError(
            "experiments",
            "leave nothing to fit: all are only predicted",
            len(experiments),
            "set predict to None for at least one",
        )
    return fitted
