"""Where the windows of a motion begin before anything is fitted: states that explain the first frames of each."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from ..arrays.types import Array
from ..experiment.cut import borders, shot, start_quantities
from ..experiment.experiment import Experiment
from ..optional import require
from ..problem.lifted import of_one
from ..problem.lifted_window import LiftedWindow, Rows
from ..problem.parts import expanded_to
from ..problem.problem import FitProblem
from ..quantities.parameters import Parameters
from ..scene.scene import Scene

FIRST, MORE = 3, 3  # frames of a window that its start is fitted to at first, and how many times as many next


def begun(experiments: Sequence[Experiment], wanted: Parameters, u: Array) -> tuple[list[Experiment], str]:
    """The experiments with a state at every border: by least squares on the frames behind it, from the state at the
    border before. A window that shows too little of its start begins where the one before ends. Also what Ctrl-C left
    undone: borders that were not reached have the state of the one before.

    Args:
        u: (free,) internal point of the parameters.
    """
    plain = FitProblem([replace(e, shooting=None) for e in experiments], wanted)
    assert plain.parameters.free == expanded_to(wanted, experiments).free
    found, missing, interrupted = list(experiments), 0, False
    for i, e in enumerate(experiments):
        own = shot(e)
        if own is None or own.states:
            continue
        states = list[tuple[float, ...]]()
        try:
            for state in () if interrupted else _states(plain, i, e, u):
                states.append(state)
        except KeyboardInterrupt:
            interrupted = True
        left = len(borders(e)) - 2 - len(states)
        missing += left
        states += left * states[-1:]
        found[i] = replace(e, shooting=replace(own, states=tuple(states)))
    return found, f"states at {missing} borders of windows were not sought" if interrupted else ""


def _states(plain: FitProblem, i: int, e: Experiment, u: Array) -> Iterator[tuple[float, ...]]:
    """At one border after the other."""
    own = shot(e)
    behind = 0.0 if own is None else own.behind or 0.0
    edges, recording, names = borders(e), e.fitted(), start_quantities(e.scene)
    quantities, free = of_one(e, plain.places, i)
    state = np.array([quantities[name] for name in names])
    first = [int(n) for n in np.searchsorted(recording.times, edges + behind - 1e-9)]
    before, placing = np.zeros(0), [name in _placing(e.scene) for name in names]
    for k in range(1, len(edges) - 1):

        def window(frames: int, k: int = k) -> LiftedWindow:
            part = recording.frames(slice(0, first[k] + frames))
            return LiftedWindow(e, part, edges[: k + 2], k, quantities, free)

        count, parts = first[k + 1] - first[k], list[LiftedWindow]()
        while not parts or len(parts) < 1 + math.ceil(math.log(count / FIRST, MORE)):
            parts.append(window(min(count, FIRST * MORE ** len(parts))))
        if any(part.rows > len(names) for part in parts[:-1]):
            # Places first: from places far off, those that are seen move velocities the wrong way, and by any amount.
            state = _nearest(partial(window(1).data, u), state, placing)
            for part in parts:
                if part.rows >= len(names):
                    state = _nearest(partial(part.data, u), state)
        else:
            ahead = LiftedWindow(e, recording, edges, k - 1, quantities, free).at(u, before)
            if ahead is not None:
                state = _nearest(partial(_missed, parts[0], u, ahead.end.value), state)
        before = state
        yield tuple(state.tolist())


def _placing(scene: Scene) -> set[str]:
    """Names of the quantities that set places at the start."""
    return {name for term in scene.every_term if term.array == "position" for name in term.quantities}


def _missed(window: LiftedWindow, u: Array, end: Array, state: Array) -> Rows | None:
    """Residuals by which the start of a window misses the end of the one before."""
    rows = window.start(u, state)
    return None if rows is None else replace(rows, value=rows.value - end)


def _nearest(rows: Callable[[Array], Rows | None], state: Array, free: Sequence[bool] | None = None) -> Array:
    """The state with the least squares, from one beside it, of which perhaps only some numbers are free."""
    if free is not None:
        moving = np.flatnonzero(free)

        def some(part: Array) -> Rows | None:
            whole = state.copy()
            whole[moving] = part
            found = rows(whole)
            return None if found is None else replace(found, state=found.state[:, moving])

        found = state.copy()
        found[moving] = _nearest(some, state[moving])
        return found
    known: dict[bytes, Rows | None] = {}

    def at(s: Array) -> Rows | None:
        if s.tobytes() not in known:
            known[s.tobytes()] = rows(s)
        return known[s.tobytes()]

    first = at(state)
    if first is None:
        return state
    count = len(first.value)

    def value(s: Array) -> Array:
        found = at(s)
        return np.full(count, 1e6) if found is None else found.value

    def slope(s: Array) -> Array:
        found = at(s)
        return np.zeros((count, len(s))) if found is None else found.state

    least_squares = require("scipy.optimize", "fit").least_squares
    return np.asarray(least_squares(value, state, jac=slope, x_scale="jac", max_nfev=60).x)
