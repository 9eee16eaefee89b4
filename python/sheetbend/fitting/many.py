"""One model for many recordings: shared parameters, and a few of each recording's own."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path

import numpy as np

from ..arrays.checks import MOST_WHOLE, check_count
from ..arrays.types import Array
from ..errors import InputError, SheetbendError
from ..experiment.experiment import Experiment
from ..experiment.wanted import ParameterLike, as_parameters
from ..minimum.arrow import Arrow, reduced
from ..minimum.many import ManyApproach, ManyProblem
from ..minimum.progress import Progress
from ..optional import require
from ..problem.counts import counted
from ..problem.journal import journaled
from ..problem.linear_algebra import one_blas_thread
from ..problem.workers import shared_out
from ..quantities.parameters import Parameter, Parameters
from ..report.many import ManyFit, OwnParameter
from ..result.estimate import Estimate
from ..statistics.gauge import RANK_TOLERANCE, NullSpace, null_space
from ..statistics.intervals import at_far_limit, clipped, closed_estimate, critical_t, linear_ends, open_estimate
from .experiments import listed, within

FEWEST = 20  # recordings
RESTS = 1e-6  # of a parameter's size: so near a bound it rests there


@shared_out
@journaled
@one_blas_thread()
def fit_many(
    experiments: Sequence[Experiment],
    parameters: Mapping[str, ParameterLike] | Iterable[str],
    *,
    max_iterations: int = 100,
    progress: Callable[[Progress], None] | None = None,
    journal: str | Path | None = None,
    executor: Executor | None = None,
) -> ManyFit:
    """Fit shared parameters, and private ones of every recording, to many recordings.

    `sheetbend.fit` stores one Jacobian of all recordings and parameters. `fit_many` stores a triangular matrix of a few
    numbers for each recording, and eliminates its private parameters: time and memory grow in proportion to the number
    of recordings. It searches for the minimum near the start, by the steps of `minimum.approach`.

    Intervals of shared parameters treat each recording as one draw (the sandwich of Liang and Zeger 1986, Biometrika
    73, 13): residuals may be correlated within a recording in any way, and recordings may differ by more than their
    noise. The intervals are at least as wide as those of independent residuals of the same size. `fit_many` has no
    windows, starts, extrapolation in substep and mesh, premises, profiles or doubts. To get these, fit a few of the
    recordings with `sheetbend.fit`.

    Args:
        experiments: at least `FEWEST`, each with a name of its own; those with `predict` are refused.
        parameters: as `sheetbend.fit` takes them.
        max_iterations: largest number of steps.
        progress: function that is called after every step.
        journal: a file that keeps every evaluation. To continue a fit that was killed or interrupted, call it again
            with the same journal; it ends with the same bits. The file is removed at the end.
        executor: its workers divide the recordings among themselves; the result has the same bits. Each worker stores
            all recordings, with one scene for all whose scenes have the same content.

    Returns:
        ManyFit: the shared parameters with intervals, the private ones as a distribution, and a row for each recording.

    Raises:
        InputError: inputs are inconsistent; the message names them. Raised before work starts.
        SheetbendError: a motion diverges with the initial values.
    """
    check_count("max_iterations", max_iterations, 1, MOST_WHOLE, InputError)
    if progress is not None and not callable(progress):
        raise InputError("progress", "is not a function", progress, "give one, or leave it out")
    every = within(listed(experiments))
    if len(every) < FEWEST:
        raise InputError("experiments", "are few", len(every), f"give at least {FEWEST}, or use sheetbend.fit")
    if ahead := [e.name for e in every if e.predict is not None]:
        raise InputError("experiments", "are only predicted", ahead[:5], "leave them out")
    require("scipy.special", "fit")
    wanted = as_parameters(parameters, every)
    began, before = time.perf_counter(), counted()
    problem = ManyProblem(every, wanted)
    if not len(problem.shared):
        raise InputError("parameters", "are all private", list(wanted), "fit the recordings one by one")
    walk = ManyApproach(problem, problem.parameters.initial())
    if not math.isfinite(walk.cost):
        raise SheetbendError(f"the fit cannot start: {problem.failure}")
    first, interrupted = walk.cost, False
    try:
        while walk.iterations < max_iterations and walk.step():
            if progress is not None:
                progress(Progress(walk.iterations, walk.cost, walk.u.copy()))
    except KeyboardInterrupt:
        interrupted = True
    arrow, told = walk.arrow, problem.told(walk.u)
    estimates, scatter, spread = _shared(problem, walk.u, arrow, told.squares, told.rows)
    made = counted()
    return ManyFit(
        estimates=estimates,
        scatter=scatter,
        own=_own(problem, wanted, walk.u, arrow, told.covariances, spread),
        recordings=tuple(e.name for e in every),
        misfit=tuple(float(x) for x in np.sqrt(told.squares / told.rows)),
        cost=walk.cost,
        first_cost=first,
        rows=int(told.rows.sum()),
        iterations=walk.iterations,
        converged=not interrupted and walk.promised < walk.least,
        interrupted=interrupted,
        seconds=time.perf_counter() - began,
        evaluations=made[0] - before[0],
        jacobians=made[1] - before[1],
        jacobian_bytes=arrow.nbytes,
    )


def _shared(
    problem: ManyProblem, u: Array, arrow: Arrow, squares: Array, rows: Array
) -> tuple[tuple[Estimate, ...], dict[str, float], Array]:
    """Estimates of the shared parameters, by how much recordings scatter more than independent residuals would, and the
    (shared, shared) covariance; zero for what the data do not determine."""
    small = [reduced(*arrow.parts(i)) for i in range(len(arrow.own))]
    names = [problem.parameters.free[column] for column in problem.shared]
    parameters = [problem.parameters[name] for name in names]
    J = np.concatenate([*(part.shared for part in small), arrow.prior[0]])
    triangle = np.asarray(np.linalg.qr(J, mode="r"))
    space = null_space(triangle, names, [p.log for p in parameters], RANK_TOLERANCE)
    limits = problem.parameters.bounds()
    at = u[problem.shared]
    near = RESTS * np.maximum(np.abs(at), 1e-3)
    bounded = [np.abs(at - limit[problem.shared]) <= near for limit in limits]
    columns = [k for k in space.determined if not bounded[0][k] and not bounded[1][k]]
    count = len(small)
    root = np.linalg.inv(np.linalg.qr(J[:, columns], mode="r"))
    bread = root @ root.T
    taken = sum(map(len, arrow.own)) + len(columns)
    variance = float(squares.sum()) / max(float(rows.sum()) - taken, 1.0)
    scores = np.array([part.shared[:, columns].T @ part.left for part in small])
    scores -= scores.mean(axis=0)  # zero but for what priors pull
    prior = arrow.prior[0][:, columns]
    from_prior = bread @ prior.T @ prior @ bread
    clustered = bread @ (scores.T @ scores) @ bread * count / max(count - len(columns), 1) + from_prior
    data = np.concatenate([part.shared[:, columns] for part in small])
    white = variance * bread @ data.T @ data @ bread + from_prior
    ratio = np.sqrt(np.diag(clustered) / np.diag(white))
    stretch = np.maximum(1.0 / ratio, 1.0)
    matrix = np.zeros((len(names), len(names)))
    matrix[np.ix_(columns, columns)] = clustered * np.outer(stretch, stretch)
    t = critical_t(count - 1)
    estimates = [
        _estimate(p, float(at[k]), t * math.sqrt(matrix[k, k]), space, k, columns) for k, p in enumerate(parameters)
    ]
    return tuple(estimates), {names[k]: float(x) for k, x in zip(columns, ratio, strict=True)}, matrix


def _estimate(
    parameter: Parameter, at: float, reach: float, space: NullSpace, k: int, columns: Sequence[int]
) -> Estimate:
    """The estimate of the shared parameter number k at the internal value `at`; `columns` have a covariance."""
    value = parameter.to_physical(at)
    if k not in space.determined:
        gauges = [gauge.words for gauge in space.gauges if parameter.name in gauge.members]
        return open_estimate(parameter, value, "; ".join(gauges) or "moves no residual: the data do not contain it")
    if k not in columns:
        words = "stopped at its bound: widen it, or doubt the model"
        return open_estimate(parameter, value, words, verdict="at a bound")
    if at_far_limit(parameter, value):
        return open_estimate(parameter, value, "ran as far as a search looks", verdict="at a bound")
    lower, upper = clipped(parameter, linear_ends(parameter, at, reach))
    if lower is None or upper is None:
        return open_estimate(parameter, value, "the data hardly depend on it")
    return closed_estimate(parameter, value, lower, upper)


def _own(
    problem: ManyProblem, wanted: Parameters, u: Array, arrow: Arrow, known: Sequence[Array], spread: Array
) -> tuple[OwnParameter, ...]:
    """The values and standard deviations of each private parameter in all recordings; those of logarithms on a log
    scale."""
    names = [name for name in wanted.free if wanted[name].private]
    place = {name: k for k, name in enumerate(problem.parameters.free)}
    values = np.full((len(names), len(arrow.own)), np.nan)
    sds = np.full((len(names), len(arrow.own)), np.nan)
    for i, (e, known_shared) in enumerate(zip(problem.experiments, known, strict=True)):
        part = reduced(*arrow.parts(i))
        along = np.linalg.lstsq(part.own, part.cross, rcond=RANK_TOLERANCE)[0]
        variances = np.diag(known_shared) + np.diag(along @ spread @ along.T)
        mine = {column: k for k, column in enumerate(arrow.own[i])}
        for row, name in enumerate(names):
            column = place.get(f"{name}[{e.name}]")
            if column is not None:
                values[row, i] = problem.parameters[f"{name}[{e.name}]"].to_physical(float(u[column]))
                sds[row, i] = math.sqrt(variances[mine[column]])
    return tuple(
        OwnParameter(name, wanted[name].unit, wanted[name].log, tuple(found.tolist()), tuple(sd.tolist()))
        for name, found, sd in zip(names, values, sds, strict=True)
    )
