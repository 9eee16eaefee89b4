"""Whether a motion loses energy in another way than its model does.

A model without one of the losses that its motion has is fitted by values that are right for no part of the motion. What
is left then oscillates like the motion itself, so the comparison of its parts finds no clear contradiction. But what
more loss would change is known to first order: backward Euler with a substep h damps an oscillation of angular
frequency omega by omega h/2, as a Kelvin-Voigt material with the time constant h does, and the second-order formula
hardly damps it. The difference of one simulation with each is a direction in which residuals move where the model loses
more. Where this direction, beside the parameters, explains a large part of what a fit leaves beyond noise, and more
than chance does, the model lacks a loss; where it does so backward, the model loses too much.

Where driven markers are corrected, both simulations solve for their corrections. The difference, of the corrections'
prior rows too, is then what a loss leaves that corrections do not take up, as a column of the reduced Jacobian is.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from ..arrays.timeseries import Array
from ..minimum.problem import FitProblem
from ..optional import require
from ..quantities.wording import short
from ..statistics.blocks import short_of_frames
from ..statistics.covariance import Layout, covariance
from ..statistics.gauge import RANK_TOLERANCE
from ..statistics.white_noise import white_noise

EXPLAINS = 1 / 3
"""Of what a fit leaves beyond noise: the part that a loss must explain. It is 50 to 78 % for ropes without the damping
of their recordings (0.3 to 30 ms); a finer mesh looks like a loss by up to 21 %, a turned clamp by 16 %, a wrong length
by 4 %, and noise by any part of next to nothing, which is why chance is asked too (measured)."""
LEVEL = 1e-3  # chance that a right model is contradicted
OTHER: dict[str, Literal["bdf1", "bdf2"]] = {"bdf1": "bdf2", "bdf2": "bdf1"}


@dataclass(frozen=True)
class Asked:
    """What the residuals of some motions ask for of more loss.

    Attributes:
        more: of the loss, times the substep's, 1/s: negative where less would fit better.
        explained: share of what the fit leaves beyond noise; may exceed 1 by chance.
        chance: that a right model asks for so much.
    """

    more: float
    explained: float
    chance: float


def missing_loss(problem: FitProblem, u: Array, fitted: tuple[FitProblem, Array]) -> dict[str, str]:
    """By free parameter, the motion whose losses the model does not have, or does not have so large.

    Takes one simulation with the other integrator. Where that has no answer, nothing is told, nor of motions with
    contacts (another integrator or substep moves when they begin and slide, which is no loss).

    Args:
        problem: whose residuals count.
        u: (free,) its minimum.
        fitted: the problem as it was fitted, whose rows are the same, and its minimum.
    """
    if all(e.static for e in problem.experiments) or any(e.scene.compiled.contacts for e in problem.experiments):
        return {}
    ok, r, J = problem.evaluate(u)
    change = of_more_loss(*fitted)
    if not ok or not np.isfinite(J).all() or change is None:
        return {}
    layout, groups = problem.rows_layout(), _tied(problem)
    taken = sum(map(problem.core.absorbed, range(len(problem.experiments))))
    found: dict[str, str] = {}
    for group in groups:
        mine = _rows_of(problem, group)
        asked = asked_for(r, J, np.where(mine, change, 0.0), mine, layout, taken)
        if asked is not None and asked.explained > EXPLAINS and asked.chance < LEVEL / len(groups):
            words = _words([problem.experiments[i].name for i in group], asked)
            found |= {name: words for i in group for name in problem.acting_on(problem.experiments[i])}
    return found


def asked_for(r: Array, J: Array, column: Array, mine: Array, layout: Layout, taken: float = 0.0) -> Asked | None:
    """How much of a column residuals ask for beside the parameters; None where these replace it, or leave but noise.

    Args:
        r: (rows + others,) residuals of the data, then those of priors, as those of corrections.
        J: (rows + others, p) their derivative.
        column: (rows + others,) what a loss changes.
        mine: (rows + others,) bool, those of the motions in question.
        layout: of the data's rows.
        taken: degrees of freedom of the data's residuals that corrections took.
    """
    rows = len(layout.frame)
    q, sizes, _ = np.linalg.svd(J / np.maximum(np.linalg.norm(J, axis=0), np.finfo(float).tiny), full_matrices=False)
    q = q[:, sizes > RANK_TOLERANCE * sizes.max(initial=0.0)]
    beside = column - q @ (q.T @ column)
    inner = float(beside @ beside)
    left = float(r[mine] @ r[mine]) - _noise(r[:rows], layout, mine[:rows])
    if not inner > RANK_TOLERANCE * float(column @ column) or not left > 0.0 or rows - taken <= q.shape[1] + 1:
        return None
    more = -float(beside @ r) / inner
    after = r + more * beside
    spread = covariance(after[:rows], beside[:rows, None], layout, beside[rows:, None], taken + q.shape[1])
    variance = short_of_frames(spread, int(np.ptp(layout.frame)) + 1) * float(spread.matrix[0, 0])
    score = abs(more) / math.sqrt(max(variance, np.finfo(float).tiny))
    degrees = max(float(spread.degrees[0]), 1.0)
    chance = 2.0 * float(require("scipy.special", "fit").stdtr(degrees, -score))
    return Asked(more, more**2 * inner / left, chance)


def of_more_loss(problem: FitProblem, u: Array) -> Array | None:
    """(rows,) what the residuals change with backward Euler instead of the second-order formula, divided by the
    substep, 1/s; None where it has no answer."""
    ok, r, _ = problem.evaluate(u)
    made = [
        e if e.static else replace(e, solver=replace(e.solver, integrator=OTHER[e.solver.integrator]))
        for e in problem.experiments
    ]
    ok_there, there, _ = problem.of(made).evaluate(u, jacobian=False)
    if not (ok and ok_there):
        return None
    change = np.zeros(len(r))
    for i, e in enumerate(problem.experiments):
        per = (1.0 if e.solver.integrator == "bdf2" else -1.0) / e.solver.h
        mine = _rows_of(problem, [i])
        change[mine] = per * (there - r)[mine]
    return change


def _rows_of(problem: FitProblem, experiments: Sequence[int]) -> Array:
    """(rows,) bool, the data of some experiments, and what their corrections leave."""
    first, corrections = problem.core.first_rows, problem.correction_rows
    mine = np.zeros(problem.core.rows, dtype=bool)
    for i in experiments:
        mine[first[i] : first[i + 1]] = True
        mine[corrections.get(i, slice(0))] = True
    return mine


def _tied(problem: FitProblem) -> list[list[int]]:
    """The motions, by their places, in groups that share no parameter. A loss that is missing is missing in all of a
    group: where one motion asks for more and another for less, none is."""
    groups: list[tuple[list[int], set[str]]] = []
    for i, e in enumerate(problem.experiments):
        if e.static:
            continue
        mine, names = [i], set(problem.acting_on(e))
        tied = [g for g in groups if g[1] & names]
        groups = [g for g in groups if not g[1] & names]
        for others, theirs in tied:
            mine, names = others + mine, names | theirs
        groups.append((sorted(mine), names))
    return [group for group, _ in groups]


def _noise(r: Array, layout: Layout, mine: Array) -> float:
    """Sum of squares of the white noise in some residuals, each recording's apart."""
    counts = np.bincount(layout.recording[mine])
    return sum(float(counts[i]) * white_noise(r, layout, i) for i in np.flatnonzero(counts).tolist())


def _words(names: list[str], asked: Asked) -> str:
    part = f"{short(100 * min(asked.explained, 1.0), 2)} % of what the fit leaves"
    one = names[0] if len(names) == 1 else ""
    if asked.more > 0.0:
        return (
            f"{f'{one} loses' if one else 'the recordings lose'} energy that the model does not: a damping would "
            f"explain {part}. Give the model the loss that it lacks (such as bend_damping, membrane_damping or drag), "
            "or free one that is held"
        )
    return (
        f"the model loses more energy than {one or 'the recordings'}: less damping would explain {part}. Free the "
        "losses that are held, or take a shorter substep, which damps less"
    )
