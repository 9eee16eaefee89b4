"""Fitting physical parameters of scenes to recordings."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..arrays.checks import MOST_WHOLE, check_count
from ..doubts.bootstrap import check_bootstrap
from ..doubts.given import check_given
from ..doubts.leave_one_out import companions, each_left_out
from ..doubts.prediction import Comparison, compare
from ..errors import InputError
from ..experiment.experiment import Experiment
from ..experiment.wanted import ParameterLike, as_parameters
from ..minimum.by_ceres import ceres_trouble
from ..minimum.continuity import joined
from ..minimum.discretization import Refinement, wanted_refinement
from ..minimum.field_priors import with_likely_priors
from ..minimum.progress import Observer
from ..minimum.search import Search
from ..optional import require
from ..problem.journal import journaled
from ..problem.linear_algebra import one_blas_thread
from ..problem.smooth import Smooth, with_fields
from ..problem.sought import Sought
from ..problem.workers import shared_out
from ..quantities.parameters import Parameter, Parameters
from ..recording.recording import Recording
from ..report.fit_result import FitResult
from ..result.estimate import Estimate
from ..scene.scene import Scene
from .conclusion import Asked, Conclusion, Systematic, conclude
from .experiments import experiments_of
from .reached import Reached, reach
from .result_of import Clock, Compared, result_of


@dataclass(frozen=True)
class Fit:
    """A finished fit: the result (estimates, verdicts, errors) and what it was made from.

    `fit["rope_EI"]` is the `Estimate` of a parameter, and `print(fit.report())` shows the report.

    Attributes:
        result: the `FitResult`.
        comparisons: measured and simulated markers, one for each experiment.
        parameters: as given; private ones are not expanded.
        corrections: by experiment with a `driven_sigma`, (knots, markers, 3) m: what the fit added to the markers that
            the scene follows, up to the end of the fitted part.
        on_mesh: values on the mesh of the experiments, with which `comparisons` were simulated. `values` are
            extrapolated to the limit of fine meshes, if the fit refined the mesh.
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

    Examples:
        >>> recording = sb.Recording.load("experiments/twin/data/twin.npz")
        >>> rope = sb.rope(0.6, 20, density=0.05, EI=1e-3, bend_damping=0.01, drag_linear=0.02, clamp_start=(1, 0, 0))
        >>> fit = sb.fit(rope, recording, ["rope_EI"], solver=sb.Solver(h=1 / 480), refine=False, profiles=False)
        >>> EI = fit["rope_EI"]  # an Estimate: EI.value, EI.lower, EI.upper, EI.unit, EI.verdict
        >>> print(f"{EI.value:.1e} {EI.unit}")
        2.0e-03 N m^2

    Args:
        scene: a scene with its `recording` (and any field of `Experiment` as keyword), or one or several experiments.
        parameters: what to fit: names of quantities, `Parameter`s, or a mapping from name to fields of `Parameter`.
        optimizer: "ceres", "scipy", or "auto" (Ceres where it was built).
        starts: further starting values by name; the start with the lowest final cost wins, and the report lists all.
            Or a number of starts: the initial values and others from a Sobol sequence, drawn from the priors, between
            the bounds, or over two decades about the initial value. All of them are fitted to longer and longer
            windows with a loose tolerance. Those that end in the same minimum form a group, and the best of each group
            is fitted to the end (`sheetbend.minimum.race`). A start at a bound is moved off it by 5 % of the range.
        windows: s, increasing: the fit begins with this much of every motion, counted from its scene's start. Each
            window starts from the result of the one before. "auto" chooses the lengths; it skips the windows if the
            first step on the whole motion lowers the cost about as much as predicted. () for none.
        tolerance: the fit stops when the cost changes by less than this share.
        refine: "auto" moves the estimates to the limit of short substeps. The intervals include the error that remains.
            This costs about three evaluations with tangents. A `Refinement` can also build the same experiments on a
            finer mesh, and the estimates are then moved to the limit of fine meshes too; without one, the table says
            "mesh not counted". If the data contradict a limit (for example those of a recording that was simulated at
            the same substep), the estimate stays and the whole shift widens its interval. False or None: no limits,
            and the intervals do not include these errors.
        systematic: function of (problem, internal minimum) that returns further half-widths to include in the
            intervals, by parameter and in its unit.
        given: standard deviations of values that the fit takes as given, by name; the intervals then include them. They
            are relative for quantities that must be positive (`{"rope_density": 0.02}` is 2 %), and in the quantity's
            unit for others. The names of what is no quantity are

            - in rad: "gravity" (its direction), "clamp_direction", "grip_direction" (of each grip against its poses, or
              of each of several clamps), "collider_direction" and "load_direction" (each about each axis);
            - in m: "clamps", "lead" (free length: how far a rope sticks out of what holds it), "markers",
              "marker_offset" (from a rope's axis), "drive_place";
            - in s: "recording_delay"; in kg: "marker_mass" (of each marker that has no mass in the model);
            - in m/s: "draft" (the velocity of the air along each axis);
            - relative: "gravity_size", "recording_clock" (its frame rate), "recording_size", "drive_size" (how far the
              scene is driven), "load_size" (of forces that are no quantities), "start_speed", "unnamed" (masses, drag,
              air and pressures of a scene built by hand that are no quantities), "isotropy" (weft over warp, and other
              second stiffnesses, where only the first is given), "dry_friction" (of hinges that have viscosity alone,
              as a share of what that takes);
            - of force sensors: "force_size" (relative), "force_zero" in N, "torque_zero" in N m, "force_direction" in
              rad, "force_delay" in s.

            0 says that a value is exact. `FitResult.premises` holds the effect of each given value in any case.
        smooth: fields of stiffness (`stiffness_modes` of a cloth or a solid of clusters, `softness_modes` from 1 on of
            a rope or rod) to fit with a smoothness prior, by name, such as {"toy_stiffness": sb.Smooth()}. What
            `Smooth` leaves open, the size and the length of the prior, is found from the recordings
            (`FitResult.fields`). Unknown forces and winds of the scenes (`add_unknown_force`) are fitted in any case;
            name one to give its size or length (`FitResult.over_time`).
        leave_one_out: also predict each recording without a held-out part by a fit to the other recordings.
        profiles: follow the cost to both ends of every interval while all other parameters are fitted again; with more
            than 60 parameters only for weak ones. False: linear intervals, which need no further simulation.
        bootstrap: number of fits to data that are drawn at random from the given ones, with replacement; 0 for none.
            With eight recordings or more, whole recordings are drawn, otherwise stretches of four autocorrelation
            times. Each fit costs about two Jacobians. The spread of the results gives intervals that assume nothing
            about the noise (`FitResult.bootstrap`).
        beginnings: also fit the beginnings of the motions by themselves (`sheetbend.doubts.beginnings`). Where a
            beginning contradicts the result, the search continues from there or the parameter is doubtful. This costs
            about as much as the fit itself.
        max_iterations: largest number of iterations, for each start and window.
        threads: threads for experiments and columns of the Jacobian; the result does not depend on it.
        progress: function that is called after every iteration.
        journal: file that keeps every evaluation until the fit is done (see `sheetbend.problem.journal`). If the
            process is killed, the same call with the same file continues and gives the same bits. With another
            recording, scene or version the file is refused.
        executor: its workers compute experiments, raced starts, profiles, bootstraps and leave-one-out fits, for
            example `concurrent.futures.ProcessPoolExecutor(2)`. The result has the same bits. Only this process writes
            the journal.

    Returns:
        Fit. After Ctrl-C it holds the best point so far, marked `interrupted`, with linear intervals and without
        anything that needs another fit.

    Raises:
        InputError: inputs are inconsistent; the message names them. Raised before work starts.
        SheetbendError: the simulation with the initial values diverges or has no equilibrium.
    """
    experiments = experiments_of(scene, recording, experiment)
    smooth = {} if smooth is None else smooth
    wanted, fields = with_fields(as_parameters(parameters, experiments), experiments, smooth)
    check_count("threads", threads, 1, MOST_WHOLE, InputError)
    require("scipy.special", "fit")  # of intervals, behind all the work
    asked = Asked(wanted_refinement(refine), systematic, {} if given is None else given, profiles, bootstrap, threads)
    search = Search(optimizer, windows, max_iterations, tolerance, progress, starts)
    clock = Clock.started()
    fitted = _fitted(experiments)
    if leave_one_out:
        for e in fitted:
            companions(e, fitted, wanted)
    experiments, found_at, undone = joined(experiments, wanted, threads, progress)
    sought = Sought(_fitted(experiments), wanted, found_at, fields, undone)
    reached, sought = _minimum(search, asked, sought, beginnings)
    if reached.all_lost:
        asked = asked.without_refits()
    conclusion, left_out, interrupted = _concluded(reached, experiments, sought.wanted, asked, leave_one_out)
    compared = _compared(conclusion, left_out, sought, threads)
    result = result_of(reached, conclusion, compared, sought.fields, interrupted, clock)
    if optimizer == "auto" and (trouble := ceres_trouble()):
        result = replace(
            result, warnings=(*result.warnings, f"SciPy stands in for Ceres, which does not load: {trouble}")
        )
    return Fit(result, compared.comparisons, sought.wanted, compared.corrected, conclusion.values)


def _minimum(search: Search, asked: Asked, sought: Sought, beginnings: bool) -> tuple[Reached, Sought]:
    """The minimum, and what was sought with the priors that are most likely there."""
    threads, progress = asked.threads, search.progress
    if not sought.undone:
        sought = with_likely_priors(sought, threads, search.windows, progress)
    problem = sought.problem(threads)
    problem.check_start()
    check_given(asked.given, problem)
    check_bootstrap(asked.bootstrap, problem)
    reached = reach(search, problem, beginnings, sought.undone)
    if sought.fields and reached.left_its_end and not reached.interrupted:
        # Sizes and lengths came from the minimum that was left, so they are sought once more from the lower one.
        lower = replace(sought, expanded=problem.parameters.starting_at(reached.best.u))
        sought = with_likely_priors(lower, threads, (), progress)
        reached = reach(replace(search, windows=(), starts=()), sought.problem(threads), beginnings, sought.undone)
    return reached, sought


def _concluded(
    reached: Reached, experiments: Sequence[Experiment], wanted: Parameters, asked: Asked, leave_one_out: bool
) -> tuple[Conclusion, dict[str, Comparison], bool]:
    """What follows from the minimum, how each recording is predicted by a fit to the others, and whether Ctrl-C came:
    then nothing is refitted."""
    refitter, interrupted = reached.found.optimizer, reached.interrupted
    left_out: dict[str, Comparison] = {}
    try:
        conclusion = conclude(reached, experiments, wanted, asked, None if interrupted else refitter)
        if leave_one_out and not interrupted:
            left_out = each_left_out(_fitted(experiments), wanted, conclusion.values, refitter, asked.threads)
        return conclusion, left_out, interrupted
    except KeyboardInterrupt:
        return conclude(reached, experiments, wanted, asked, None), {}, True


def _compared(conclusion: Conclusion, left_out: Mapping[str, Comparison], sought: Sought, threads: int) -> Compared:
    """All recordings beside what the estimates predict."""
    problem, u = conclusion.at.problem, conclusion.at.u
    corrected = problem.corrections(u) | conclusion.corrected
    at = {e.name: problem.experiment_at(i, u) for i, e in enumerate(sought.experiments)}
    found = [at.get(e.name, e) for e in conclusion.experiments]
    comparisons = compare(found, sought.wanted, conclusion.values, threads, corrected)
    return Compared(tuple(comparisons), left_out, corrected)


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
