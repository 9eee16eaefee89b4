"""What follows from the minimum of a fit: verdicts and intervals of its parameters, and warnings of its course."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..arrays.types import Array
from ..experiment.wanted import quantities_of
from ..minimum.growth import Growth
from ..minimum.linear_step import gauss_newton
from ..minimum.progress import Minimum
from ..problem.problem import FitProblem
from ..problem.smooth import modes_over_time
from ..quantities.parameters import Parameters
from ..quantities.wording import several, short
from ..result.estimate import UNSOUND, Estimate
from ..result.result import Misfit
from ..statistics.identifiability import Identifiability, identify
from ..statistics.intervals import open_estimate, ran_off
from ..statistics.judge import Nuisance
from .driven_errors import FEW, driven_errors
from .fitted_bodies import bodies_of
from .floors import solver_floors
from .profiles import Elsewhere, Profiles
from .roughness import rough_parameters
from .stationary import no_minimum

INACCURATE = 0.5  # a start whose cost exceeds the best by this share ended elsewhere


def without_verdict(problem: FitProblem, end: Minimum, growth: Sequence[Growth] = ()) -> dict[str, Estimate]:
    """Estimates of the parameters of which nothing is derived at the end of a search: those that depend on a motion
    that explodes are "rough", and all others have "no minimum" where the end is none.

    Args:
        growth: of the motions there, where it was measured.
    """
    _, _, J = problem.evaluate(end.u)
    parameters, values = problem.parameters, problem.parameters.to_physical(end.u)
    rough = rough_parameters(problem, end.u, J[: problem.core.data_rows], growth)
    ended = "" if len(rough) == len(parameters.free) else no_minimum(problem, end)
    why = {name: (rough[name], "rough") for name in rough}
    if ended:
        why |= {name: (ended, "no minimum") for name in parameters.free if name not in rough}
    return {
        name: open_estimate(parameters[name], values[name], words, verdict=verdict)
        for name, (words, verdict) in why.items()
    }


def judged_parameters(
    problem: FitProblem,
    u: Array,
    refined: Mapping[str, float],
    systematic: Mapping[str, float],
    refitter: str | None,
    lost: Mapping[str, Estimate] | None = None,
    fitted: tuple[FitProblem, Array] | None = None,
) -> tuple[Identifiability, tuple[Elsewhere, ...]]:
    """Verdicts and intervals at a minimum, and where profiles ended lower than it.

    Args:
        refined: what refits on a finer discretization move, by parameter, in its unit.
        systematic: half-widths of what else the intervals count.
        refitter: optimizer of profiles; without one the intervals are the linear ones.
        lost: `without_verdict`; what is fitted apart from these is judged without them.
        fitted: the problem as it was fitted and its minimum, where the estimate was moved from there to the limit of
            short substeps. Profiles ask that problem and move along: combined runs would take three times as long. They
            are asked themselves where they were searched (`Settled.searched`).
    """
    if lost:
        return _beside(problem, u, lost, refined, systematic, refitter)
    _, r, J = problem.evaluate_exactly(u)
    rows, behind = problem.prior_rows
    asked, end = fitted or (problem, u)
    profiles = None if refitter is None else Profiles(asked, end, refitter, u - end)
    judged = identify(
        problem.parameters,
        u,
        r[:rows],
        J[:rows],
        layout=problem.rows_layout(),
        floors=solver_floors(problem.experiments, problem.parameters),
        discretization=refined,
        systematic=systematic,
        profiler=None if profiles is None else profiles.each,
        nuisance=Nuisance(J[behind:], problem.absorbed),
        errors=driven_errors(problem, u, FEW),
        limits=impossible_ahead(problem, u, r, J),
        fixes=_beyond_scenes(problem),
        bodies=bodies_of(problem, u),
        linear_ones=of_inputs(problem),
    )
    return judged, () if profiles is None else tuple(profiles.lower)


def impossible_ahead(problem: FitProblem, u: Array, r: Array, J: Array) -> dict[str, str]:
    """Parameters that stopped at a limit of their sums at the end u of a search (`Coordinates.beyond`): the next step
    in the parameters themselves goes beyond it. At a minimum inside there is no such step."""
    coordinates = problem.coordinates
    return coordinates.beyond(gauss_newton(problem.parameters, u, J, r)) if coordinates.charts else {}


def of_inputs(problem: FitProblem) -> set[str]:
    """The parameters that make up unknown inputs over time, on which motions depend almost linearly."""
    modes = modes_over_time(problem.experiments)
    return {name for name in problem.parameters.free if name.partition("[")[0] in modes}


def _beyond_scenes(problem: FitProblem) -> dict[tuple[str, str], str]:
    """By parameter and side ("lower", "upper") whose bound is the scene's own limit: what to change where it stops."""
    known = quantities_of(problem.experiments)
    found: dict[tuple[str, str], str] = {}
    for name in problem.parameters.free:
        parameter, q = problem.parameters[name], known.get(name.partition("[")[0])  # of a private one: name[recording]
        if q is not None and q.limits is not None:
            bounds = {"lower": parameter.lower, "upper": parameter.upper}
            own = dict(zip(bounds, q.limits, strict=True))
            found |= {(name, side): q.beyond for side, bound in bounds.items() if bound == own[side]}
    return found


def _beside(
    problem: FitProblem,
    u: Array,
    lost: Mapping[str, Estimate],
    refined: Mapping[str, float],
    systematic: Mapping[str, float],
    refitter: str | None,
) -> tuple[Identifiability, tuple[Elsewhere, ...]]:
    parameters, first = problem.parameters, problem.core.first_rows
    found = Identifiability((), (), 0, np.zeros(0), (), 1.0)
    elsewhere: tuple[Elsewhere, ...] = ()
    left = [name for name in parameters.free if name not in lost]
    if left:
        _, _, J = problem.evaluate(u)
        columns = [parameters.free.index(name) for name in lost]
        apart = [i for i in range(len(problem.experiments)) if not J[first[i] : first[i + 1], columns].any()]
        rest = problem.replaced(
            experiments=[problem.experiments[i] for i in apart],
            recordings=[problem.recordings[i] for i in apart],
            expanded=Parameters(p for name, p in parameters.items() if parameters.roots[name][0] not in lost),
        )
        at = rest.parameters.to_internal(parameters.to_physical(u))
        mine = [{name: part for name, part in parts.items() if name not in lost} for parts in (refined, systematic)]
        found, elsewhere = judged_parameters(rest, at, mine[0], mine[1], refitter)
    estimates = {e.name: e for e in found.estimates} | dict(lost)
    return replace(found, estimates=tuple(estimates[name] for name in parameters.free)), elsewhere


def misfit(problem: FitProblem, u: Array) -> Misfit:
    """How large the residuals are against the sigma that was told."""
    _, r, _ = problem.evaluate(u)
    rows = problem.core.data_rows
    sigma = np.array([e.sigma for e in problem.experiments])
    layout = problem.rows_layout()
    seen = layout.clocks == 0
    beyond = float(np.mean(sigma[layout.recording[seen]] ** 2 * (r[:rows][seen] ** 2 - 1.0)))
    taken = len(problem.parameters.free) + problem.absorbed
    return Misfit(
        reduced_chi_square=float(r[:rows] @ r[:rows]) / max(rows - taken, 1.0),
        smallest_sigma=float(sigma.min()),
        largest_sigma=float(sigma.max()),
        model_error=float(np.sqrt(max(beyond, 0.0))),
    )


def warnings_of(
    ends: Sequence[Minimum], interrupted: bool, problem: FitProblem, estimates: Sequence[Estimate], ahead: str = ""
) -> tuple[str, ...]:
    """What a reader must know before using the numbers.

    Args:
        ends: of all starts, best first.
        interrupted: by Ctrl-C, then or later.
        estimates: as concluded.
        ahead: what a step that was not taken would move (`stationary.unfinished`).
    """
    warnings, best = [], ends[0]
    inputs = {mode: own.name for e in problem.experiments for own in e.scene.over_time.values() for mode in own.modes}
    for verdict in UNSOUND:
        if such := [e.name for e in estimates if e.verdict == verdict]:
            names = ", ".join(dict.fromkeys(inputs.get(name.partition("[")[0], name) for name in such))
            also = "" if len(such) == len(estimates) else "; an error in one value may have shifted the others"
            warnings.append(f"{verdict}: {names} (see what contradicts this fit){also}")
    for e in estimates:
        if ran_off(problem.parameters[e.name], e.value):
            start = problem.parameters[e.name].initial
            where = f"{short(start or 0.0)} to {short(e.value)} {e.unit}".rstrip()
            warnings.append(f"{e.name} ran off from {where}, and the others were fitted with it there")
    mends: dict[str, list[str]] = {}
    for experiment in problem.experiments:
        for words in experiment.recording.mends:
            mends.setdefault(words, []).append(experiment.name)
    warnings += [f"{several(names)}: {words}" for words, names in mends.items()]
    if best.cost == 0.0:
        warnings.append("the residuals are exactly zero, so the intervals have no width and say nothing about errors")
    if best.converged and best.doubt:
        warnings.append(f"the fit ended where {best.doubt}; the intervals assume a smooth cost")
    if interrupted:
        warnings.append(
            "interrupted: intervals are the linear ones, without profiles and without refits on a finer discretization"
            + (f"; {ahead}" if ahead else "")
        )
    elsewhere = [m for m in ends if best.cost * (1.0 + INACCURATE) < m.cost < np.inf]
    if elsewhere:
        warnings.append(f"{len(elsewhere)} of {len(ends)} starts ended in a worse minimum: the cost has several minima")
    without = [m for m in ends if m.cost == np.inf]
    if without:
        warnings.append(f"{len(without)} of {len(ends)} starts failed: {without[0].message}")
    if not best.converged and not best.interrupted:
        warnings.append(f"the fit did not converge: {best.message.rstrip('.')}" + (f"; {ahead}" if ahead else ""))
    return tuple(warnings)
