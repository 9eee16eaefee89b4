"""What follows from the minimum of a fit: verdicts and intervals of its parameters, and warnings of its course."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..arrays.timeseries import Array
from ..errors import SheetbendError
from ..minimum.growth import Growth
from ..minimum.optimizers import Minimum, refit
from ..minimum.problem import FitProblem
from ..quantities.parameters import Parameters
from ..quantities.wording import short
from ..result.result import UNSOUND, Estimate, Misfit
from ..statistics.gauge import RANK_TOLERANCE
from ..statistics.identifiability import Identifiability, identify
from ..statistics.intervals import open_estimate, ran_off
from ..statistics.judge import Nuisance
from .floors import solver_floors
from .roughness import rough_parameters
from .stationary import no_minimum

PROFILE_TOLERANCE = 0.02
"""Of the cost of one row: what an interval's end rises by is a hundred times that. A relative tolerance of all rows
together would waste steps on few rows, and stop too early on many."""
NOISELESS = 1e-18  # of sigma squared: data without noise, whose residuals are rounding errors
INACCURATE = 0.5  # a start whose cost exceeds the best by this share ended elsewhere


@dataclass(frozen=True)
class Elsewhere:
    """Where another search of the same minimum ended.

    Attributes:
        rise: of the cost there over that at the estimate.
        values: of all parameters.
        how: which search it was, in words.
    """

    rise: float
    values: Mapping[str, float]
    how: str


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
            short substeps. Profiles ask that problem and move along: combined runs would take three times as long.
    """
    if lost:
        return _beside(problem, u, lost, refined, systematic, refitter)
    _, r, J = problem.evaluate_exactly(u)
    rows, behind = problem.prior_rows
    asked, end = fitted or (problem, u)
    moved, (lower, upper) = u - end, asked.parameters.bounds()
    profiles = None if refitter is None or len(u) == 1 else _Profiles(asked, end, refitter)
    judged = identify(
        problem.parameters,
        u,
        r[:rows],
        J[:rows],
        layout=problem.rows_layout(),
        floors=solver_floors(problem.experiments, problem.parameters),
        discretization=refined,
        systematic=systematic,
        profile=None if profiles is None else _shifted(profiles, asked.parameters, moved),
        cost=lambda at: asked.cost(np.clip(at - moved, lower, upper)),
        nuisance=Nuisance(J[behind:], sum(map(problem.core.absorbed, range(len(problem.experiments))))),
    )
    return judged, () if profiles is None else tuple(profiles.lower)


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
        rest = FitProblem(
            [problem.experiments[i] for i in apart],
            problem.given,
            [problem.recordings[i] for i in apart],
            problem.threads,
            Parameters(p for name, p in parameters.items() if parameters.roots[name][0] not in lost),
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
    taken = len(problem.parameters.free) + sum(map(problem.core.absorbed, range(len(sigma))))
    return Misfit(
        reduced_chi_square=float(r[:rows] @ r[:rows]) / max(rows - taken, 1.0),
        smallest_sigma=float(sigma.min()),
        largest_sigma=float(sigma.max()),
        model_error=float(np.sqrt(max(beyond, 0.0))),
    )


def _shifted(
    profile: Callable[[str, float], float], parameters: Parameters, moved: Array
) -> Callable[[str, float], float]:
    """The profile around an estimate that was moved, internally."""

    def cost(name: str, value: float) -> float:
        parameter, by = parameters[name], moved[parameters.free.index(name)]
        before = value if by == 0.0 else parameter.to_physical(parameter.to_internal(value) - by)
        return profile(name, float(np.clip(before, parameter.lower, parameter.upper)))

    return cost


class _Profiles:
    """(name, value) -> cost with that parameter held and the others refitted, of the experiments that it reaches;
    infinite where these have no answer."""

    def __init__(self, problem: FitProblem, u: Array, refitter: str) -> None:
        self.problem, self.refitter = problem, refitter
        self.values = problem.parameters.to_physical(u)
        self.ends: dict[str, dict[float, Array]] = {}  # by name and value held: where the others ended, all internal
        self.here: dict[str, tuple[float, float]] = {}  # cost of the part at the estimate, and what is lower than that
        self.lower: list[Elsewhere] = []

    def __call__(self, name: str, value: float) -> float:
        part, parameter = self.problem.around(name), self.problem.parameters[name]
        if part.parameters.free == (name,):
            return part.cost(part.parameters.to_internal({name: value}))
        held = part.holding(name, value)
        mean, sd = parameter.prior or (value, 1.0)
        pull = (parameter.to_internal(value) - parameter.to_internal(mean)) / sd
        at = parameter.to_internal(value)
        start = {parameter.to_internal(self.values[name]): held.parameters.to_internal(self.values)}
        known = self.ends.setdefault(name, start)
        start_at, cost = self._nearest(held, part, name, at)
        if not np.isfinite(cost):
            return np.inf
        try:
            end = refit(held, start_at, self.refitter, 50, min(PROFILE_TOLERANCE / part.core.data_rows, 1e-5))
        except SheetbendError:
            return np.inf
        known[at] = end.u
        cost = end.cost + 0.5 * pull**2
        self._compare(name, value, part, held.parameters.to_physical(end.u), cost)
        return cost

    def _nearest(self, held: FitProblem, part: FitProblem, name: str, at: float) -> tuple[Array, float]:
        """Where to begin with a parameter held at an internal value, and the cost there: where the others ended at the
        nearest value known, or on the line through two of these (of the linear picture, where there is but one)."""
        known = self.ends[name]
        near, *others = sorted(known, key=lambda other: abs(other - at))
        if others:
            slope = (known[others[0]] - known[near]) / (others[0] - near)
        else:
            _, _, J = part.evaluate(part.parameters.to_internal(self.values))
            column = part.parameters.free.index(name)
            rest = np.delete(J, column, axis=1)
            size = np.maximum(np.linalg.norm(rest, axis=0), np.finfo(float).tiny)
            slope = -np.linalg.lstsq(rest / size, J[:, column], rcond=RANK_TOLERANCE)[0] / size
        ahead = np.clip(known[near] + (at - near) * slope, *held.parameters.limits())
        return min(((u, held.cost(u)) for u in (ahead, known[near])), key=lambda pair: pair[1])

    def _compare(self, name: str, value: float, part: FitProblem, there: Mapping[str, float], cost: float) -> None:
        """Keep an end that is lower than the estimate by more than its residual variance."""
        if name not in self.here:
            here = part.cost(part.parameters.to_internal(self.values))
            self.here[name] = (here, here / max(part.core.data_rows - len(part.parameters.free), 1))
        here, variance = self.here[name]
        if cost < here - variance and variance > NOISELESS:
            whole = {**self.values, **there, name: value}
            self.lower.append(Elsewhere(cost - here, whole, f"a fit with {name} held"))


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
    for verdict in UNSOUND:
        if names := [e.name for e in estimates if e.verdict == verdict]:
            also = (
                "" if len(names) == len(estimates) else "; what is wrong with one number may have drawn off the others"
            )
            warnings.append(f"{verdict}: {', '.join(names)} (see what contradicts this fit){also}")
    for e in estimates:
        if ran_off(problem.parameters[e.name], e.value):
            start = problem.parameters[e.name].initial
            where = f"{short(start or 0.0)} to {short(e.value)} {e.unit}".rstrip()
            warnings.append(f"{e.name} ran off from {where}, and the others were fitted with it there")
    if best.cost == 0.0:
        warnings.append("the residuals are exactly zero: intervals have no width, and nothing tells how wrong they are")
    if best.converged and best.doubt:
        warnings.append(f"the fit ended where {best.doubt}; intervals take the cost as smooth")
    if interrupted:
        warnings.append(
            "interrupted: intervals are the linear ones, without profiles and without refits on a finer discretization"
            + (f"; {ahead}" if ahead else "")
        )
    elsewhere = [m for m in ends if best.cost * (1.0 + INACCURATE) < m.cost < np.inf]
    if elsewhere:
        warnings.append(f"{len(elsewhere)} of {len(ends)} starts ended in a worse minimum: the cost has several")
    without = [m for m in ends if m.cost == np.inf]
    if without:
        warnings.append(f"{len(without)} of {len(ends)} starts led nowhere: {without[0].message}")
    if not best.converged and not best.interrupted:
        warnings.append(f"the fit did not converge: {best.message.rstrip('.')}" + (f"; {ahead}" if ahead else ""))
    return tuple(warnings)
