"""How far the windows of a motion may miss each other: found from the recording before a fit searches.

The windows begin where the recording says, each fitted to its own first frames. Then gaps close step by step while the
parameters are fitted along, as far as the model loses something over a window (`window_loss`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..arrays.types import Array
from ..errors import InputError
from ..experiment.cut import LEAST_FRAMES, LEAST_STEPS, borders, cut, shot
from ..experiment.experiment import Experiment
from ..experiment.shooting import AUTO, Shooting
from ..problem.journal import leave
from ..problem.lifted import Lifted
from ..problem.parts import expanded_to
from ..problem.problem import FitProblem
from ..quantities.parameters import Parameters
from ..result.shot import ShotMotion
from .growth import over_fit
from .lifted_starts import begun
from .optimizers import walked
from .progress import Latest, Observer
from .window_loss import loss

GROWN = 10.0  # of small displacements, over a window that is chosen
PARTS = 10  # at least, of a motion whose windows are chosen
FINER = (4, 2)  # parts of a window that states are looked for in first
LOOSE = 0.1  # of the motion's size: gaps to begin with
CLOSER = 0.03  # of the gap before: the next one that parameters are fitted with, at least
ROUNDS = 12  # of gaps
SETTLED = 0.03  # of the logarithm of a gap's size


def joined(
    experiments: Sequence[Experiment], wanted: Parameters, threads: int, observe: Observer | None = None
) -> tuple[list[Experiment], Parameters | None, str]:
    """The experiments with all of their shooting known, the parameters, expanded, that they were found with, for a
    search to begin at, or None where no experiment is shot in windows, and what Ctrl-C left undone, if it came: then
    all is as it was at the point reached last.

    Raises:
        InputError: see `shooting.cut`.
    """
    every = [with_window(e) if isinstance(e.shooting, Shooting) and e.predict is None else e for e in experiments]
    places = [i for i, e in enumerate(every) if e.predict is None]
    fitted = [every[i] for i in places]
    if not any(map(shot, fitted)):
        return list(experiments), None, ""
    parameters = expanded_to(wanted, fitted)
    size = {e.name: _size(e) for e in fitted}
    given = {e.name: own.loss for e in fitted if (own := shot(e)) is not None and own.is_given}
    at = Latest(observe, parameters.initial())
    fitted, undone = _nearer(fitted, wanted, parameters, threads, at)
    fitted = [_with_gap(e, LOOSE * size[e.name]) for e in fitted]
    try:
        for _ in range(0 if undone else ROUNDS):
            problem = FitProblem(fitted, wanted, threads=threads, expanded=parameters)
            at.u = walked(problem, at.u, at)
            ok, _, _ = problem.evaluate(at.u)
            if not ok:
                break
            here = [_state(e, problem, i) for i, e in enumerate(fitted)]
            moved = 0.0
            for i, e in enumerate(here):
                own = shot(e)
                if own is None or own.loss is None:
                    continue
                told = given.get(e.name)
                wanted_loss = loss(problem, at.u, i, size[e.name]).value if told is None else told
                closer = max(wanted_loss, CLOSER * own.loss)
                moved = max(moved, abs(math.log(closer / own.loss)))
                here[i] = replace(e, shooting=replace(own, loss=closer))
            fitted = here
            if moved < SETTLED:
                break
    except KeyboardInterrupt:
        undone = "gaps between windows are as wide as where the search for their size was stopped"
    for i, e in zip(places, fitted, strict=True):
        every[i] = e
    return every, parameters.starting_at(at.u), undone


def _nearer(
    experiments: Sequence[Experiment], wanted: Parameters, expanded: Parameters, threads: int, at: Latest
) -> tuple[list[Experiment], str]:
    """The experiments with states at every border, from windows of a part of the length: far from the parameters, the
    longer a window the less its states can follow the recording. Also what Ctrl-C left undone.

    Args:
        at: the point from which, and to which this goes.
    """
    parts = [_in_parts(e) for e in experiments]
    short, undone = begun([e for e, _ in parts], wanted, at.u)
    if undone:
        leave()  # with all states known, its first problem is another
    short = [_with_gap(e, LOOSE * _size(e)) for e in short]
    problem = FitProblem(short, wanted, threads=threads, expanded=expanded)
    try:
        at.u = at.u if undone else walked(problem, at.u, at)
    except KeyboardInterrupt:
        undone = (
            f"gaps between windows are given {100 * LOOSE:g} % of the motion's size, and no smaller ones were sought"
        )
    problem.evaluate(at.u)
    found = []
    for i, (e, (_, count)) in enumerate(zip(experiments, parts, strict=True)):
        own, fine = shot(e), shot(_state(short[i], problem, i))
        if own is not None and fine is not None:
            e = replace(e, shooting=replace(own, states=own.states or fine.states[count - 1 :: count]))
        found.append(e)
    return found, undone


def _in_parts(e: Experiment) -> tuple[Experiment, int]:
    """The experiment with each of its windows divided, and into how many parts (FINER); 1 where none is possible."""
    own = shot(e)
    if own is None:
        return e, 1
    edges = borders(e)
    length = float(edges[-1] - edges[0]) / (len(edges) - 1)
    for count in FINER:
        try:
            return cut(replace(e, shooting=replace(own, window=length / count, states=()))), count
        except InputError:
            continue
    return e, 1


def with_window(e: Experiment) -> Experiment:
    """An experiment that is cut, into windows of a chosen length where none is given: so long that small displacements
    grow by `GROWN` from the scene's start on, and no longer than a part of the motion."""
    own = e.shooting
    assert isinstance(own, Shooting)
    if own.window == AUTO:
        times = e.fitted().times
        grown = over_fit(e).below(GROWN)
        interval = float(np.median(np.diff(times)))
        least = max(4 * LEAST_FRAMES * interval, 2 * LEAST_STEPS * e.solver.h)
        longest = float(times[-1] - e.t0) / PARTS
        e = replace(e, shooting=replace(own, window=max(least, min(longest, math.inf if grown is None else grown))))
    return cut(e)


def shot_motions(problem: FitProblem, u: Array) -> tuple[ShotMotion, ...]:
    """What the model of each motion that is shot in windows loses, with an interval at u where the loss was not
    given."""
    found: list[ShotMotion] = []
    for i, e in enumerate(problem.experiments):
        own, core = shot(e), problem.core
        if own is None or own.loss is None or own.pace is None or not isinstance(core, Lifted):
            continue
        ok, _, _ = problem.evaluate(u)
        motion = core.motions[i]
        here = motion.solve(u) if ok else None
        if here is None:
            continue
        gaps = np.array([motion.deviation * gap.rest for gap in motion.gaps(here.seen)])
        told = None if own.is_given or not len(gaps) else loss(problem, u, i, _size(e))
        found.append(
            ShotMotion(
                name=e.name,
                windows=len(motion.windows),
                length=motion.length,
                numbers=motion.states.shape[1],
                loss=own.loss,
                lower=None if told is None else told.lower,
                upper=None if told is None else told.upper,
                gap=float(np.sqrt(np.mean(np.sum(gaps**2, axis=1)))) if len(gaps) else 0.0,
                pace=own.pace,
            )
        )
    return tuple(found)


def _size(e: Experiment) -> float:
    """Size of a motion, m: the rms distance of its markers from their mean places."""
    x = e.fitted().positions
    return float(np.sqrt(3.0 * np.nanmean((x - np.nanmean(x, axis=0)) ** 2)))


def _with_gap(e: Experiment, gap: float) -> Experiment:
    """The experiment with a loss that leaves a gap of `gap` m over a window."""
    own = shot(e)
    if own is None:
        return e
    assert isinstance(own.window, float | int)
    return replace(e, shooting=replace(own, loss=gap / own.window))


def _state(e: Experiment, problem: FitProblem, i: int) -> Experiment:
    """The experiment with the states at which the problem was evaluated last."""
    own, core = shot(e), problem.core
    if own is None:
        return e
    assert isinstance(core, Lifted)
    return replace(e, shooting=replace(own, states=tuple(map(tuple, core.motions[i].states.tolist()))))
