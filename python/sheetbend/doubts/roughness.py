"""Which parameters have no verdict because the derivatives of a motion explode.

Where small displacements grow by many orders of magnitude, every column of the Jacobian lies along the one direction
that grows, and its size says nothing of a step that anybody would take. Intervals, gauges and "not identifiable" would
be made up. The growth of displacements shows it, and so do the columns alone: a parameter's natural change must not
move a marker, to first order, by many times the size of the scene. A clean oscillation moves it by pi times the number
of its periods; exponential growth passes any such number.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..arrays.types import Array
from ..experiment.cut import start_quantities
from ..minimum.growth import Growth
from ..problem.problem import FitProblem
from ..quantities.parameters import Parameter
from ..quantities.wording import short

SENSITIVE = 1e3
"""Sizes of the scene by which a natural change of a parameter (to twice its value) may move a marker to first order."""


def rough_parameters(
    problem: FitProblem, u: Array, jacobian: Array, growth: Sequence[Growth] = ()
) -> Mapping[str, str]:
    """Why nothing follows from the Jacobian, in words, by free parameter that depends on a motion that explodes.

    Args:
        u: (free,) internal point.
        jacobian: (data rows, free) derivative of the residuals there; need not be finite.
        growth: of moving experiments, where it was measured.
    """
    first = problem.core.first_rows
    parts = [jacobian[first[i] : first[i + 1]] for i in range(len(problem.experiments))]
    grown = {g.name: g for g in growth}
    words = [_words(problem, i, u, part, grown.get(problem.experiments[i].name)) for i, part in enumerate(parts)]
    reached = [set(np.flatnonzero((part != 0).any(axis=0)).tolist()) for part in parts]
    found: dict[int, str] = {}
    spread = True
    while spread:  # what is fitted together with a parameter of a rough motion is as wrong as that
        spread = False
        for mine, cause in zip(reached, words, strict=True):
            cause = cause or next((found[column] for column in sorted(mine & set(found))), "")
            new = mine - set(found) if cause else set()
            found |= dict.fromkeys(new, cause)
            spread |= bool(new)
    return {problem.parameters.free[column]: cause for column, cause in sorted(found.items())}


def _words(problem: FitProblem, i: int, u: Array, jacobian: Array, growth: Growth | None) -> str:
    """Why nothing follows from the rows of one experiment; empty where something does."""
    e, layout = problem.experiments[i], problem.rows_layout()
    seen = layout.clocks[layout.recording == i] == 0
    jacobian = jacobian[seen]
    with np.errstate(invalid="ignore", over="ignore"):
        moved = np.abs(jacobian) * (e.sigma * _changes(problem, u) / _size(problem, i))  # sizes of the scene
    moved[np.isnan(moved)] = np.inf
    if growth is not None and growth.until is not None:
        cause, until = f"small displacements grow {_times(growth.largest)}", growth.until
    elif moved.max(initial=0.0) > SENSITIVE:
        row, column = np.unravel_index(int(np.argmax(moved)), moved.shape)
        name = problem.parameters.free[int(column)]
        change = "a factor of two" if problem.parameters[name].log else "its size"
        cause = f"to first order, {name} moved by {change} moves markers by {_sizes(float(moved[row, column]))}"
        frames = layout.frame[layout.recording == i][seen]
        late = frames[(moved > 1.0).any(axis=1)].min()
        until = float(problem.recordings[i].times[max(late - 1, 0)]) - e.t0
    else:
        return ""
    shoot = ", or fit it all with shooting = 'auto'" if start_quantities(e.scene) and e.shooting is None else ""
    fix = (
        f"up to {short(until, 2)} s it can be fitted: give windows up to there, or cut the recording{shoot}"
        if until > 0 and not e.static
        else "start from other values"
    )
    return f"nothing follows from the derivatives of the motion of {e.name}: {cause}; {fix}"


def _changes(problem: FitProblem, u: Array) -> Array:
    """(free,) natural change of each parameter in its internal coordinate."""

    def change(p: Parameter, at: float) -> float:
        return float(np.log(2.0)) if p.log else p.scale or abs(at)

    return np.array([change(problem.parameters[name], at) for name, at in zip(problem.parameters.free, u, strict=True)])


def _size(problem: FitProblem, i: int) -> float:
    """Diagonal of the box around a scene's particles and measured markers, m."""
    e, recording = problem.experiments[i], problem.recordings[i]
    places = np.concatenate([np.asarray(e.scene.positions), recording.positions[recording.mask]])
    return max(float(np.linalg.norm(np.ptp(places, axis=0))), np.finfo(float).tiny)


def _times(growth: float) -> str:
    return f"by a factor of {short(growth, 2)}" if np.isfinite(growth) else "without limit"


def _sizes(moved: float) -> str:
    return f"{short(moved, 2)} times the size of the scene" if np.isfinite(moved) else "more than a number can hold"
