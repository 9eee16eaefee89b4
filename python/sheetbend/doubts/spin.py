"""Whether a rod spins about its own axis at an end that turns in every direction, and what a fit would find otherwise.

A marker in a hand, or a pin, does not show it, and damping depends on it: a bend that goes round in space bends every
section of a rod back and forth, unless the rod spins with it. So the fit is made once more, in a few steps, with the
other choice. Where that explains the motion clearly better, the parameters are doubtful that it moves out of their
intervals. Where the data cannot tell the two apart, they are if nobody said that the rod is held (`hold_roll`), and a
warning names them if that was said.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ..arrays.types import Array
from ..errors import SheetbendError
from ..experiment.experiment import Experiment
from ..objects.rod import Rod
from ..problem.problem import FitProblem
from ..quantities.wording import short
from ..statistics.identifiability import Identifiability
from ..statistics.intervals import reach_of
from .contradictions import value_words
from .directions import LEVEL, chance_of_drop, rows_of, tied
from .other_losses import limited_step

STEPS, SETTLED = 3, 0.99  # Gauss-Newton steps with the other choice, and the share of the cost that ends them


@dataclass(frozen=True)
class TurningEnd:
    """An end of a rod that is held in its place alone.

    Attributes:
        rod: its name.
        end: "start" or "end".
        director: the node of the frame there.
        spins: whether the rod may spin there.
    """

    rod: str
    end: str
    director: int
    spins: bool


def turning_ends(e: Experiment) -> Iterator[TurningEnd]:
    """The ends of an experiment's rods that are held and turn in every direction."""
    scene, held = e.scene, set(e.scene.held)
    for rod in scene.ropes.values():
        if not isinstance(rod, Rod):
            continue
        for end, ghost, k in (("start", rod.start_ghost, 0), ("end", rod.end_ghost, -1)):
            director = int(rod.directors[k])
            if ghost is None and int(rod.particles[k]) in held and director not in scene.boundary.driven:
                yield TurningEnd(rod.name, end, director, director not in scene.pinned)


def spins_otherwise(problem: FitProblem, u: Array, judged: Identifiability) -> tuple[dict[str, str], tuple[str, ...]]:
    """By free parameter, why it is doubtful whether the rods of its motion spin where they are held, and warnings of
    the same. Takes up to five simulations, four of them with a Jacobian, for motions that have such an end. Where
    driven markers are corrected (`driven_sigma`), it is not asked, and a warning says so.

    Args:
        problem: as it was fitted.
        u: (free,) the minimum.
        judged: the parameters there, or in the limit of short substeps.
    """
    ends = {i: list(turning_ends(e)) for i, e in enumerate(problem.experiments) if not e.static}
    ends = {i: found for i, found in ends.items() if found}
    if problem.estimates_corrections:
        return {}, tuple(dict.fromkeys(_not_asked(end) for known in ends.values() for end in known))
    if not ends:
        return {}, ()
    other = problem.of([_otherwise(e, ends.get(i, [])) for i, e in enumerate(problem.experiments)])
    ok, r, J = problem.evaluate(u)
    reached = _reached(other, u, J) if ok and np.isfinite(J).all() else None
    if reached is None:
        return {}, ()
    there, after = reached
    estimates = {e.name: e for e in judged.estimates}
    found: dict[str, str] = {}
    warnings: list[str] = []
    for group in tied(problem):
        mine = rows_of(problem, group)
        drop = float(r[mine] @ r[mine] - after[mine] @ after[mine])
        known = [end for i in group for end in ends.get(i, [])]
        better = drop > 0.0 and chance_of_drop(problem, u, after, mine, drop) < LEVEL
        if not known or (drop < 0.0 and chance_of_drop(other, there, r, mine, -drop) < LEVEL):
            continue
        for name in dict.fromkeys(name for i in group for name in problem.acting_on(problem.experiments[i])):
            p, k = problem.parameters[name], problem.parameters.free.index(name)
            if name in estimates and abs(there[k] - u[k]) > reach_of(p, estimates[name]):
                less = drop / float(r[mine] @ r[mine]) if better else 0.0
                words = _words(known[0], name, value_words(p, there[k], 0.0, reach_of(p, estimates[name])), less)
                if better or known[0].spins:
                    found[name] = words
                else:
                    warnings.append(words)
    return found, tuple(warnings)


def _otherwise(e: Experiment, ends: list[TurningEnd]) -> Experiment:
    """The experiment with rods that spin where they did not, and the other way round."""
    if not ends:
        return e
    scene = e.scene.shallow()
    scene.pinned = e.scene.pinned ^ {end.director for end in ends}
    return replace(e, scene=scene)


def _reached(other: FitProblem, u: Array, J: Array) -> tuple[Array, Array] | None:
    """The end of a few Gauss-Newton steps from u, the first with the Jacobian J of another problem, and the residuals
    (rows,) there; None where there is no answer."""
    try:
        ok, r, _ = other.evaluate(u, jacobian=False)
        if not ok:
            return None
        at = limited_step(other, u, r, J)
        ok, r, J = other.evaluate(at)
        for _ in range(STEPS):
            if not ok or not np.isfinite(J).all():
                return None
            tried = limited_step(other, at, r, J)
            ok, after, J = other.evaluate(tried)
            if not ok or not float(after @ after) < float(r @ r):
                break
            settled = float(after @ after) > SETTLED * float(r @ r)
            at, r = tried, after
            if settled:
                break
    except SheetbendError:
        return None
    return at, r


def _not_asked(end: TurningEnd) -> str:
    held = "may spin" if end.spins else "does not spin (hold_roll)"
    return (
        f"{end.rod} {held} about its own axis at its {end.end} in this model. With driven_sigma the fit does not "
        "examine what the other choice would change, most of all in a damping: look at what holds it"
    )


def _words(end: TurningEnd, name: str, value: str, less: float) -> str:
    spins = "does not spin" if end.spins else "spins"
    change = f'give it hold_roll = ["{end.end}"]' if end.spins else "remove it from hold_roll"
    if less > 0.0:
        return (
            f"{end.rod} seems to be held otherwise at its {end.end}: if it {spins} about its own axis there, the fit "
            f"leaves {short(100 * less, 2)} % less of the sum of squares, and {name} would be {value}. Look at what "
            f"holds it, and {change}"
        )
    return (
        f"the data do not show whether {end.rod} spins about its own axis at its {end.end}: if it {spins} there, "
        f"{name} would be {value}. Look at what holds it: if it {spins}, {change}; otherwise the value stands"
    )
