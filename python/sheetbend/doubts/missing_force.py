"""Whether values found from flights rest on there being no other force: a steady pull that each has of its own.

Air that stands in one corner of a room moves in another, a table leans, a camera's frame is a little off: then every
recording shows an acceleration that its model does not have. If it draws off each of them in much the same way,
comparisons of recordings, of times and of markers find them in agreement, on a wrong value and a narrow interval. But
the fit tells to first order what it would leave, and where it would be, if every recording had an acceleration of its
own, constant over time. Where these explain a large part of what is left beyond noise, and more than chance, each
parameter is doubtful whose interval would be another: the specification without the force is the narrower one, and
it is refuted (Hausman 1978, Econometrica 46, 1251).

Only motions that nothing holds are asked, such as flights. A clamp or a hinge takes up most of a steady force, and what
a lean of gravity does there is among what the result rests on (`premises`); what is left of it looks like many another
error (the wrong friction of a double pendulum, by 61 % of what its fit leaves).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays.types import Array
from ..errors import SheetbendError
from ..experiment.experiment import Experiment
from ..optional import require
from ..problem.problem import FitProblem
from ..quantities.wording import short
from ..result.estimate import UNSOUND
from ..statistics.blocks import short_of_frames
from ..statistics.covariance import covariance
from ..statistics.gauge import RANK_TOLERANCE, null_space
from ..statistics.identifiability import Identifiability
from ..statistics.intervals import critical_t, reach_of
from ..statistics.least_squares import left_by, spanned
from .contradictions import value_words
from .directions import EXPLAINS, LEVEL, noise_in
from .tangents import tangents

PULLS = {f"pull along {a}": v for a, v in zip("xyz", np.eye(3), strict=True)}  # m/s^2, of everything that has weight
WIDER = 2.0  # times the interval: a value or its uncertainty beyond that is another


@dataclass(frozen=True)
class Freed:
    """A minimum to first order where every recording has an acceleration of its own.

    Attributes:
        steps: by column of the parameters that recordings share, the internal step there from the minimum and its
            95 % half-width; None where the accelerations can be told from it no more.
        explained: share of what the fit leaves beyond noise that the accelerations take up.
        chance: that a right model leaves so much to them.
        size: m/s^2, of the accelerations in the median.
    """

    steps: dict[int, tuple[float, float] | None]
    explained: float
    chance: float
    size: float


def missing_force(problem: FitProblem, u: Array, judged: Identifiability) -> dict[str, str]:
    """By free parameter that recordings share, how it changes if each recording has a steady force of its own.

    Costs three tangents of every motion that nothing holds; others are not asked.

    Args:
        problem: whose residuals count.
        u: (free,) its minimum.
        judged: the verdicts there.
    """
    if problem.estimates_corrections or not any(map(_flies, problem.experiments)):
        return {}
    found = freed(problem, u)
    if found is None or not (found.explained > EXPLAINS and found.chance < LEVEL):
        return {}
    estimates, words = {e.name: e for e in judged.estimates}, {}
    part = f"{short(100 * min(found.explained, 1.0), 2)} % of what the fit leaves"
    for column, there in found.steps.items():
        name = problem.parameters.free[column]
        p, e = problem.parameters[name], estimates[name]
        if e.verdict in UNSOUND or (there is not None and abs(there[0]) + there[1] <= WIDER * reach_of(p, e)):
            continue
        be = "could not be determined" if there is None else f"would be {value_words(p, u[column], *there)}"
        words[name] = (
            f"assumes that no other force acts. An unknown acceleration in each recording ({short(found.size, 2)} "
            f"m/s^2 in the median) would explain {part}, and with it the value {be} (to first order). The model lacks "
            "a force, such as that of moving air, or recordings drift or lean"
        )
    return words


def freed(problem: FitProblem, u: Array) -> Freed | None:
    """The minimum with the accelerations; None where nothing is left to explain, or a motion has no answer."""
    ok, r, J = problem.evaluate(u)
    layout, first, rows = problem.rows_layout(), problem.core.first_rows, problem.core.data_rows
    left = float(r[:rows] @ r[:rows]) - noise_in(r[:rows], layout, np.ones(rows, dtype=bool))
    if not ok or not np.isfinite(J).all() or not left > 0.0:
        return None
    count, flying = len(problem.experiments), [_flies(e) for e in problem.experiments]
    blocks = [slice(first[i], first[i + 1]) for i in range(count)]
    has = np.array([J[block].any(axis=0) for block in blocks])
    single = has.sum(axis=0) == 1 if count > 1 else np.zeros(len(u), dtype=bool)
    shared = np.flatnonzero(has.any(axis=0) & ~single & problem.parameters.inside(u))
    columns, after, solved, own = J[:, shared] / np.linalg.norm(J[:, shared], axis=0), r.copy(), [], 0
    for i, block in enumerate(blocks):
        private = J[block][:, has[i] & single]
        try:
            made = np.hstack([private, *([tangents(problem, u, i, PULLS)] if flying[i] else [])])
        except SheetbendError:
            return None
        if not np.isfinite(made).all():
            return None
        basis = spanned(made)
        solved.append(made)
        own += basis.shape[1]
        columns[block], after[block] = left_by(basis, columns[block]), left_by(basis, after[block])
    told = np.linalg.norm(columns, axis=0) > RANK_TOLERANCE
    null = null_space(columns[:, told], [""] * int(told.sum()), [False] * int(told.sum()))
    kept = np.flatnonzero(told)[[c for c in range(int(told.sum())) if c not in null.pivots]]
    unique = np.flatnonzero(told)[list(null.determined)]
    X, freedom = columns[:, kept], rows - own - len(kept)
    added = own + len(kept) - int(np.linalg.matrix_rank(J / np.maximum(np.linalg.norm(J, axis=0), 1e-300)))
    if not (freedom > 1 and len(kept) and added > 0):
        return None
    step = -np.linalg.lstsq(X, after, rcond=None)[0]
    final = after + X @ step
    spread = covariance(final[:rows], X[:rows], layout, X[rows:], float(own))
    alike = max(spread.autocorrelation_time, 1.0)
    statistics = require("scipy.special", "fit")
    ratio = (float(r @ r) - float(final @ final)) / added / (float(final @ final) / freedom)
    chance = float(statistics.fdtrc(added, max(freedom / alike, 1.0), ratio / alike))
    variance = short_of_frames(spread, int(np.ptp(layout.frame)) + 1) * np.diag(spread.matrix)
    reach = critical_t(np.maximum(spread.degrees, 1.0)) * np.sqrt(variance)
    size = np.linalg.norm(J[:, shared], axis=0)
    steps: dict[int, tuple[float, float] | None] = {int(c): None for c in shared}
    for k, c in enumerate(kept):
        if c in unique:
            steps[int(shared[c])] = float(step[k] / size[c]), float(reach[k] / size[c])
    moved = r + J[:, shared[kept]] @ (step / size[kept])
    pulls = [
        np.linalg.lstsq(made, -moved[block], rcond=RANK_TOLERANCE)[0][-len(PULLS) :]
        for flies, block, made in zip(flying, blocks, solved, strict=True)
        if flies
    ]
    explained = (float(r @ r) - float(final @ final)) / left
    return Freed(steps, explained, chance, float(np.median(np.linalg.norm(pulls, axis=1))))


def _flies(e: Experiment) -> bool:
    """Whether an experiment is a motion that nothing holds."""
    return not (e.static or e.scene.pinned or e.scene.boundary.driven)
