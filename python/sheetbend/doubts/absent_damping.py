"""Whether damping would explain what a fit leaves, where the model has none.

The other integrator tells what a little more loss changes (`missing_loss`). A large one that is missing, 30 ms in a
rope that swings once a second, changes the motion in another way: what a little of it would damp is long gone. So the
elements of a motion that have a stiffness and no damping are given one, of a third of a frame interval, of a whole one
and of three. Where the change of the residuals is asked for, one Gauss-Newton step shows whether the fit with that
damping does leave less.
"""

from __future__ import annotations

import copy
from dataclasses import replace

import numpy as np

from ..arrays.timeseries import Array
from ..errors import SheetbendError
from ..experiment.experiment import Experiment
from ..minimum.problem import FitProblem
from ..quantities.wording import short
from ..scene.scene import Scene
from ..statistics.gauge import RANK_TOLERANCE
from .directions import EXPLAINS, clearly, noise_in, rows_of, tied

FRAMES = (1 / 3, 1.0, 3.0)  # intervals between frames: the time constants that are tried
LEAVES = 0.2  # of the noise: a fit that leaves less beyond it lacks nothing that could be told
STEP = 1.0  # internal: the largest step that is tried


def absent_damping(problem: FitProblem, u: Array) -> dict[str, str]:
    """By free parameter, the motion that a damping would explain which its model does not have.

    Takes three simulations, and two more with a Jacobian where one of them shows something. A damping with which the
    motion has no answer tells nothing.

    Args:
        u: (free,) the minimum.
    """
    ok, r, J = problem.evaluate(u)
    if not ok or not np.isfinite(J).all():
        return {}
    layout, data = problem.rows_layout(), problem.core.data_rows
    groups = []
    for group in tied(problem):
        mine = rows_of(problem, group)
        noise = noise_in(r[:data], layout, mine[:data])
        if float(r[mine] @ r[mine]) > (1.0 + LEAVES) * noise and any(
            _undamped(problem.experiments[i].scene) for i in group
        ):
            groups.append((group, mine, noise))
    found: dict[str, str] = {}
    for frames in FRAMES if groups else ():
        more = _with_damping(problem, u, frames)
        ok, there, _ = more.evaluate(u, jacobian=False)
        for group, mine, noise in groups if ok else ():
            asked = clearly(problem, u, there - r, mine, len(groups) * len(FRAMES))
            if asked is None or asked.more < 0.0:
                continue
            left = _left_with(more, u, mine)
            share = 1.0 - (left - noise) / (float(r[mine] @ r[mine]) - noise)
            if share > EXPLAINS:
                words = _words([problem.experiments[i].name for i in group], share)
                found |= {name: words for i in group for name in problem.acting_on(problem.experiments[i])}
        if found:
            break
    return found


def _undamped(scene: Scene) -> list[int]:
    """Places of the groups that have a stiffness and no damping."""
    at, size = scene.compiled.layout["compliance"]
    compliance = scene.compiled.inputs()[at : at + size]
    ends = np.cumsum([len(g.particles) for g in scene.groups])
    return [
        k
        for k, (g, end) in enumerate(zip(scene.groups, ends, strict=True))
        if not g.damped and (compliance[end - len(g.particles) : end] > 0.0).any()
    ]


def _with_damping(problem: FitProblem, u: Array, frames: float) -> FitProblem:
    """The problem with a damping of so many frame intervals in all undamped groups of its motions."""
    theta, slots, _ = problem.known(u)
    return problem.of(
        [
            e if e.static else _damped(e, theta[own], frames * float(np.median(np.diff(recording.times))))
            for e, own, recording in zip(problem.experiments, slots, problem.recordings, strict=True)
        ]
    )


def _damped(e: Experiment, theta: Array, time: float) -> Experiment:
    """With Kelvin-Voigt damping of a time constant [s] in its undamped groups: the force per rate is that time over the
    compliance."""
    undamped = _undamped(e.scene)
    at, _ = e.scene.compiled.layout["compliance"]
    compliance = e.scene.compiled.inputs(theta)[at:]
    scene = copy.copy(e.scene)
    scene.__dict__.pop("compiled", None)
    scene.groups = list(scene.groups)
    first = 0
    for k, g in enumerate(e.scene.groups):
        own = compliance[first : first + len(g.particles)]
        first += len(g.particles)
        if k in undamped:
            damping = np.divide(time, own, out=np.zeros(len(own)), where=own > 0.0)
            scene.groups[k] = replace(g, damped=True, damping=damping)
    return replace(e, scene=scene)


def _left_with(problem: FitProblem, u: Array, mine: Array) -> float:
    """Sum of squares that one step from u leaves of some rows; infinite where it has no answer."""
    try:
        ok, r, J = problem.evaluate(u)
        if not ok or not np.isfinite(J).all():
            return np.inf
        size = np.maximum(np.linalg.norm(J, axis=0), np.finfo(float).tiny)
        step = -np.linalg.lstsq(J / size, r, rcond=RANK_TOLERANCE)[0] / size
        lower, upper = problem.parameters.bounds()
        there = np.clip(u + np.clip(step, -STEP, STEP), lower, upper)
        ok, r, _ = problem.evaluate(there, jacobian=False)
    except SheetbendError:
        return np.inf
    return float(r[mine] @ r[mine]) if ok else np.inf


def _words(names: list[str], share: float) -> str:
    one = names[0] if len(names) == 1 else ""
    return (
        f"{f'{one} loses' if one else 'the recordings lose'} energy that the model does not: with damping the fit "
        f"would leave {short(100 * min(share, 1.0), 2)} % less beyond noise. Give the model the loss that it lacks "
        "(such as bend_damping or membrane_damping)"
    )
