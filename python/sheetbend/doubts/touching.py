"""What touches in the motions of a fit, and what touches otherwise at the ends of its intervals.

A motion with contacts has kinks where one begins, ends, sticks or slides. An interval that holds several such motions
holds kinks of the cost, of which a derivative at the estimate knows one side.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from ..arrays.types import Array
from ..errors import DivergenceError, SceneError, UnbalancedError
from ..motion.contact_counts import ContactMode
from ..motion.depth import too_deep
from ..motion.simulate import Trajectory, simulate
from ..problem.problem import FitProblem
from ..result.estimate import Estimate
from ..result.motions import ContactFit, Kinks
from ..scene.scene import Scene
from ..statistics.least_squares import solved


def what_touches(problem: FitProblem, u: Array) -> tuple[ContactFit, ...]:
    """What every contact of the fitted motions does, at u (free,).

    Takes one simulation of each experiment that has contacts; a motion that has no answer is left out.
    """
    runs = zip(problem.experiments, _runs(problem, u), strict=True)
    return tuple(row for e, run in runs if run is not None for row in touches_of(e.name, e.scene, run))


def touches_of(recording: str, scene: Scene, motion: Trajectory) -> list[ContactFit]:
    """What every contact of one motion does."""
    rows = []
    for name, size in scene.contacts.counted().items():
        counts, start = motion.contacts[name], scene.compiled.settled.get(name)
        rows.append(
            ContactFit(
                recording=recording,
                contact=name,
                particles=size,
                most=counts.most,
                began=counts.began,
                ended=counts.ended,
                sliding=counts.sliding_share,
                sticking=counts.sticking_share,
                bdf1=counts.bdf1_share,
                settled=0 if start is None else start.particles,
                settled_by=0.0 if start is None else start.farthest,
                deepest=counts.deepest,
            )
        )
    return rows


def pressed_in(problem: FitProblem, u: Array, contacts: Sequence[ContactFit]) -> tuple[str, ...]:
    """A warning for every rigid contact of `what_touches` at u (free,) that did not hold what it touches."""
    return tuple(
        f"in the motion of {e.name} {words}"
        for e in problem.experiments
        if (depths := {c.contact: c.deepest for c in contacts if c.recording == e.name})
        for words in too_deep(e.scene, problem.values_of(e, u), depths)
    )


def kinks(problem: FitProblem, u: Array, estimates: Sequence[Estimate]) -> tuple[Kinks, ...]:
    """How many contacts differ between the motions at the two ends of each interval.

    The other parameters are refitted to first order. Takes two simulations for each of these.

    Args:
        u: (free,) the minimum.
    """
    if not any(e.scene.compiled.contacts for e in problem.experiments):
        return ()
    _, _, J = problem.evaluate(u)
    found = []
    for e in estimates:
        if e.lower is None or e.upper is None or e.name not in problem.parameters.free:
            continue
        ends = [_modes(problem, _refitted(problem, u, J, e.name, value)) for value in (e.lower, e.upper)]
        counts = {"begin": 0, "end": 0, "stick": 0, "slide": 0}
        for low, high in zip(*ends, strict=True):
            for name in low.keys() & high.keys():
                a, b = low[name], high[name]
                apart, sticks, slides = ContactMode
                counts["begin"] += _contacts((a == apart) & (b != apart))
                counts["end"] += _contacts((a != apart) & (b == apart))
                counts["stick"] += _contacts((a == slides) & (b == sticks))
                counts["slide"] += _contacts((a == sticks) & (b == slides))
        found.append(Kinks(name=e.name, **counts))
    return tuple(found)


def _contacts(differs: Array) -> int:
    """Number of particles that differ at some frame."""
    return int(differs.any(axis=0).sum())


def _modes(problem: FitProblem, u: Array) -> list[Mapping[str, Array]]:
    """Contact modes (frames, particles) of each experiment, by name of the contact."""
    return [{} if motion is None else motion.contact_modes for motion in _runs(problem, u)]


def _runs(problem: FitProblem, u: Array) -> list[Trajectory | None]:
    """The motion of each experiment at the substeps nearest to its frames; None where nothing can touch, the motion
    has no answer, or a value is outside its range, as an end of an interval without bounds may be."""
    found: list[Trajectory | None] = []
    for e, recording in zip(problem.experiments, problem.recordings, strict=True):
        found.append(None)
        if e.static or not e.scene.contacts.counted():
            continue
        solver, values = replace(e.solver, extrapolate=1), problem.values_of(e, u)
        times = np.maximum(e.scene_times(recording.times, values), 0.0)
        with suppress(DivergenceError, UnbalancedError, SceneError):
            found[-1] = simulate(e.scene, np.rint(times / solver.h) * solver.h, solver, values)
    return found


def _refitted(problem: FitProblem, u: Array, J: Array, name: str, value: float) -> Array:
    """u with one parameter at a value and the others where they follow to first order, inside their bounds, and as a
    body that is possible where moments of inertia are among them."""
    column = problem.parameters.free.index(name)
    by = problem.parameters[name].to_internal(value) - u[column]
    follow = -solved(np.delete(J, column, axis=1), J[:, column] * by)
    moved = u + np.insert(follow, column, by)
    inside = np.asarray(np.clip(moved, *problem.parameters.limits()))
    return problem.coordinates.out(problem.coordinates.into(inside))
