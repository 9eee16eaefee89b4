"""How much of a direction in which a loss moves the residuals is in what a fit leaves.

Such a direction, beside those of the parameters, is asked for where it explains a large part of what the fit leaves
beyond noise, and more than chance explains.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays.types import Array
from ..optional import require
from ..problem.problem import FitProblem
from ..statistics.blocks import short_of_frames
from ..statistics.covariance import covariance
from ..statistics.gauge import RANK_TOLERANCE
from ..statistics.layout import Layout
from ..statistics.least_squares import left_by, spanned
from ..statistics.white_noise import white_noise
from .driven_errors import FEW, driven_errors

EXPLAINS = 1 / 3
"""Of what a fit leaves beyond noise: the part that a loss must explain. It is 50 to 78 % for ropes without the damping
of their recordings (0.3 to 30 ms); a finer mesh looks like a loss by up to 21 %, a turned clamp by 16 %, a wrong length
by 4 %, and noise by any part of next to nothing, which is why chance is asked too (measured)."""
LEVEL = 1e-3  # chance that a right model is contradicted


@dataclass(frozen=True)
class Asked:
    """What the residuals of some motions ask for of a direction.

    Attributes:
        more: of the direction; negative where its opposite would fit better.
        explained: share of what the fit leaves beyond noise; may exceed 1 by chance.
        chance: that a right model asks for so much.
    """

    more: float
    explained: float
    chance: float


@dataclass(frozen=True)
class Score:
    """How much of a direction some residuals hold beside others.

    Attributes:
        more: of the direction, so that they would shrink the most.
        gain: by how much their sum of squares would then be less.
        chance: that a right model asks for so much, of either sign.
    """

    more: float
    gain: float
    chance: float


def clearly(
    problem: FitProblem, u: Array, column: Array, mine: Array, tests: int, shifts: Callable[[], list[Array]]
) -> Asked | None:
    """`asked_for` at a minimum u (free,), if it explains a third of what some rows leave and chance does not, of so
    many tests. What noise of what drives the scenes does to the residuals counts as chance.

    Args:
        shifts: makes what a finer mesh changes of the residuals of the data, (data rows,) each. This is taken out: on a
            coarse mesh, right models asked for a damping.
    """
    _, r, J = problem.evaluate(u)
    J = problem.parameters.inside(u) * J
    layout, taken = problem.rows_layout(), problem.absorbed
    column = np.where(mine, column, 0.0)

    def clear(J: Array) -> Asked | None:
        asked = asked_for(r, J, column, mine, layout, taken)
        return asked if asked is not None and asked.explained > EXPLAINS and asked.chance < LEVEL / tests else None

    if (asked := clear(J)) is None:
        return None
    if (changed := shifts()) and (asked := clear(with_changes(J, np.column_stack(changed)))) is None:
        return None
    errors = driven_errors(problem, u, FEW)
    if errors.size:
        asked = asked_for(r, J, column, mine, layout, taken, errors)
    return asked if asked is not None and asked.chance < LEVEL / tests else None


def with_changes(J: Array, changes: Array) -> Array:
    """A Jacobian (rows + others, p) with changes of the data's residuals (rows, n) as further columns."""
    return np.hstack([J, np.vstack([changes, np.zeros((len(J) - len(changes), changes.shape[1]))])])


def asked_for(
    r: Array,
    J: Array,
    column: Array,
    mine: Array,
    layout: Layout,
    taken: float = 0.0,
    errors: Array | None = None,
) -> Asked | None:
    """How much of a column residuals ask for beside the parameters; None where these replace it, or leave but noise.

    Args:
        r: (rows + others,) residuals of the data, then those of priors, as those of corrections.
        J: (rows + others, p) their derivative.
        column: (rows + others,) what a loss changes.
        mine: (rows + others,) bool, those of the motions in question.
        layout: of the data's rows.
        taken: degrees of freedom of the data's residuals that corrections took.
        errors: (rows, draws) random draws of errors that are alike in all of the data.
    """
    rows = len(layout.frame)
    left = float(r[mine] @ r[mine]) - noise_in(r[:rows], layout, mine[:rows])
    found = score(r, J, column, layout, taken, errors) if left > 0.0 else None
    return None if found is None else Asked(found.more, found.gain / left, found.chance)


def score(
    r: Array, J: Array, column: Array, layout: Layout, taken: float = 0.0, errors: Array | None = None
) -> Score | None:
    """How much of a column residuals hold beside the columns of J; None where these replace it. Arguments are those of
    `asked_for`. What the residuals hold of the columns of J is no noise, and does not count as chance."""
    taken_up = spanned(J)
    rank = taken_up.shape[1]
    beside, r = (left_by(taken_up, each) for each in (column, r))
    inner = float(beside @ beside)
    if not inner > RANK_TOLERANCE * float(column @ column) or len(layout.frame) - taken <= rank + 1:
        return None
    more = -float(beside @ r) / inner
    chance = _chance(abs(more), beside, r + more * beside, layout, taken + rank, errors)
    return Score(more, more**2 * inner, chance)


def chance_of_drop(problem: FitProblem, u: Array, after: Array, mine: Array, drop: float) -> float:
    """Chance that a right model leaves more by so much, in the sum of squares of some rows, than another one does.

    Args:
        u: (free,) the minimum of the first.
        after: (rows,) what the other leaves. Errors are taken to be like these.
        mine: (rows,) bool, the rows in question.
        drop: positive.
    """
    _, r, J = problem.evaluate(u)
    layout, taken = problem.rows_layout(), problem.absorbed
    taken_up, column = spanned(J), np.where(mine, after - r, 0.0)
    beside, rank = left_by(taken_up, column), taken_up.shape[1]
    inner = float(beside @ beside)
    if not inner > 0.0 or len(layout.frame) - taken <= rank + 1:
        return 1.0
    errors = driven_errors(problem, u, FEW)
    told = errors if errors.size else None
    return _chance(math.sqrt(drop / inner), beside, after, layout, taken + rank, told)


def _chance(size: float, beside: Array, after: Array, layout: Layout, taken: float, errors: Array | None) -> float:
    """Chance that errors like residuals `after` hold so much of a direction, of either sign."""
    rows, inner = len(layout.frame), float(beside @ beside)
    spread = covariance(after[:rows], beside[:rows, None], layout, beside[rows:, None], taken)
    variance = short_of_frames(spread, int(np.ptp(layout.frame)) + 1) * float(spread.matrix[0, 0])
    degrees = max(float(spread.degrees[0]), 1.0)
    if errors is not None:
        variance += float(np.mean((beside[:rows] @ errors / inner) ** 2))
        degrees = min(degrees, float(errors.shape[1]))
    score = size / math.sqrt(max(variance, np.finfo(float).tiny))
    return 2.0 * float(require("scipy.special", "fit").stdtr(degrees, -score))


def rows_of(problem: FitProblem, experiments: Sequence[int]) -> Array:
    """(rows,) bool, the data of some experiments, and what their corrections leave."""
    first, corrections = problem.core.first_rows, problem.correction_rows
    mine = np.zeros(problem.core.rows, dtype=bool)
    for i in experiments:
        mine[first[i] : first[i + 1]] = True
        mine[corrections.get(i, slice(0))] = True
    return mine


def tied(problem: FitProblem, still: bool = False) -> list[list[int]]:
    """The motions, by their places, in groups that share no parameter. A loss that is missing is missing in all of a
    group: where one motion asks for more and another for less, none is.

    Args:
        still: count static experiments too.
    """
    groups: list[tuple[list[int], set[str]]] = []
    for i, e in enumerate(problem.experiments):
        if e.static and not still:
            continue
        mine, names = [i], set(problem.acting_on(e))
        tied = [g for g in groups if g[1] & names]
        groups = [g for g in groups if not g[1] & names]
        for others, theirs in tied:
            mine, names = others + mine, names | theirs
        groups.append((sorted(mine), names))
    return [group for group, _ in groups]


def noise_in(r: Array, layout: Layout, mine: Array) -> float:
    """Sum of squares of the white noise in some residuals, each recording's apart."""
    counts = np.bincount(layout.recording[mine])
    return sum(float(counts[i]) * white_noise(r, layout, i) for i in np.flatnonzero(counts).tolist())
