"""The fit that counts: the rope that was found, fitted to all recordings, with what its intervals rest on.

How stiff a rope reads depends on what else its model has. So the intervals also count by how much the parameters of
the straight rope differ between models that predict what they were not fitted to equally well.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..arrays.types import Array
from ..errors import SheetbendError
from ..experiment.experiment import Experiment
from ..fitting.fit import Fit, fit
from ..minimum.discretization import Refinement
from ..problem.problem import FitProblem
from ..quantities.parameters import Parameter
from ..quantities.wording import short
from .bounds import bounded
from .climb import Climb
from .descent import bearable, descend, negligible
from .ladder import TWIST, Rung
from .model import NAME, RopeModel
from .motion import GrippedMotion
from .offsets import offset_reach
from .over_density import as_quantities
from .own_rest import OwnRest, own_rest
from .pieces import experiments_of, problem_of, starting
from .start import whole
from .steps import Rope
from .straight import FINE
from .windows import Span, counted, places

MOST = 30  # iterations, at most
MANY = 12  # windows: of more the time of the last fit is told
EVALUATIONS = 25  # with derivatives, of such a fit and its intervals, for an estimate of its time


def conclude(
    climb: Climb,
    motions: Sequence[GrippedMotion],
    window: Span,
    given: Mapping[str, float],
    interrupted: bool,
) -> tuple[Fit, dict[str, float], OwnRest | None]:
    """The fit to windows of these motions, the model term of its intervals, by parameter in its unit, and what rest
    shapes that differ make of it; after Ctrl-C one iteration of it, which the intervals need.

    Raises:
        SheetbendError: the motion diverges.
    """
    rope, say, threads = climb.rope, climb.search.say, climb.search.threads
    assert rope is not None
    experiments = experiments_of(rope.model, motions, window, rope.values)
    parameters = bounded(rope.parameters, rope.model, motions, window[0])
    say(f"the last fit, to {counted(motions, window)}")
    if len(experiments) > MANY:
        say(f"which takes about {short(_seconds(rope, motions, window, threads), 1)} s")
    values, spread = rope.values, dict[str, float]()
    if not interrupted:
        try:
            spread = model_spread(rope, climb.equal())
            few = climb.search.windows[-1]
            if len(places(motions, few)) < len(experiments):  # most of the way at a part of the price
                values = _at_the_end(climb, values, experiments_of(rope.model, motions, few, values), parameters)
            values = _at_the_end(climb, values, experiments, parameters, sure=False)  # `fit` goes on from there
        except KeyboardInterrupt:
            interrupted = True
            say("interrupted: the last fit did not get to its end")

    def finer() -> list[Experiment]:
        model = replace(rope.model, segments=2 * rope.model.segments)
        return checked(experiments_of(model, motions, window, values), parameters, values, threads)

    differing: OwnRest | None = None

    def systematic(problem: FitProblem, u: Array) -> dict[str, float]:
        nonlocal differing
        differing = own_rest(problem, u)
        return _together(offset_reach(problem, u, climb.beside), spread)

    last = fit(
        experiments,
        parameters=starting(parameters, values),
        refine=None if interrupted else Refinement(finer=finer, linear=True),
        systematic=systematic,
        windows=(),
        given=given,
        threads=threads,
        profiles=False,
        beginnings=False,  # the climb went from short windows to long ones
        max_iterations=1 if interrupted else MOST,
        tolerance=negligible(problem_of(experiments, parameters, values, threads)),
    )
    for refit in last.result.refits:
        moved = refit.moved[f"{NAME}_EI"] / last.values[f"{NAME}_EI"]
        say(f"{refit.name} would move EI by {100 * moved:+.2g} %")
    if not interrupted:
        return last, spread, differing
    warning = "interrupted: later rungs were not tried, and the last fit did not get to its end"
    cut = replace(last, result=replace(last.result, interrupted=True, converged=False, warnings=(warning,)))
    return cut, spread, differing


def _at_the_end(
    climb: Climb,
    values: Mapping[str, float],
    experiments: Sequence[Experiment],
    parameters: Sequence[Parameter],
    sure: bool = True,
) -> dict[str, float]:
    """Values at the minimum.

    Raises:
        SheetbendError: the motion diverges.
    """
    found = descend(problem_of(experiments, parameters, values, climb.search.threads), MOST, sure=sure)
    if not found.finite:
        raise SheetbendError("the last fit diverges where the last rung ended")
    climb.search.say(f"{'ended' if found.ended else 'not ended'} after {found.iterations} steps")
    return found.values


def checked(
    experiments: list[Experiment], parameters: Sequence[Parameter], values: Mapping[str, float], threads: int
) -> list[Experiment]:
    """The experiments, whose motions at these values stay near the rope.

    Raises:
        SheetbendError: they do not, so that no step from there tells anything.
    """
    problem = problem_of(experiments, parameters, values, threads)
    if not bearable(problem, problem.cost(problem.parameters.initial())):
        raise SheetbendError("the motion diverges")
    return experiments


def model_spread(rope: Rope, equal: Sequence[Rope]) -> dict[str, float]:
    """By how much parameters of the straight rope differ at most in models that predict equally well, in their unit."""
    names = [p.name for p in TWIST.parameters if p.log and p.name != f"{NAME}_length"]
    free = {p.name for p in rope.parameters if p.tied_to is None}
    return {
        name: max(abs(other.values[name] - rope.values[name]) for other in equal)
        for name in names
        if equal and name in free
    }


def spread_words(spread: Mapping[str, float], values: Mapping[str, float]) -> str:
    """The model term in words; empty where there is none."""
    EI = f"{NAME}_EI"
    if EI not in spread:
        return ""
    part = short(100 * spread[EI] / as_quantities(values)[EI], 2)
    return f"what else the model has (models that predict equally well differ in EI by up to {part} %)"


def _together(offsets: Mapping[str, float], spread: Mapping[str, float]) -> dict[str, float]:
    return {name: float(np.hypot(reach, spread.get(name, 0.0))) for name, reach in offsets.items()}


def announced(
    model: RopeModel, ladder: Sequence[Rung], motions: Sequence[GrippedMotion], window: Span, threads: int
) -> str:
    """A sentence on what the fit that counts will see and about how long it takes, before any fit.

    The time is measured with one window of a rope with everything on the ladder and `FINE` links. A rope that keeps
    less takes less, one with twice the links about twice as long.

    Args:
        model: with starting values.
    """
    e, parameters = whole(replace(model, segments=FINE), ladder, motions[0], window[0])
    seconds = _of_windows(FitProblem([e], parameters), len(places(motions, window)), threads)
    return (
        f"the last fit will see {counted(motions, window)}: about {short(seconds, 1)} s with {FINE} links and "
        "everything that is tried, beside what comes before it"
    )


def _seconds(rope: Rope, motions: Sequence[GrippedMotion], window: Span, threads: int) -> float:
    one = experiments_of(rope.model, motions[:1], (window[0], window[0]), rope.values)
    return _of_windows(problem_of(one, rope.parameters, rope.values), len(places(motions, window)), threads)


def _of_windows(one: FitProblem, count: int, threads: int) -> float:
    """Time, s, of the last fit and its intervals, from one derivative of a problem with one window."""
    one.evaluate(one.parameters.initial())
    return EVALUATIONS * one.seconds.get(True, 0.0) * count / threads
