"""Whether separate parts of the data agree about the parameters.

A model that lacks something fits its parameters to what is missing, and the parts of a recording that show it most then
ask for other values than the rest. What each part asks for follows to first order from the residuals and the Jacobian
of the fit, without a simulation: parameters u + d_k in part k, with sum d_k = 0, have the columns [J, J s_1, ...], and
their least-squares step gives all d_k at once. With a right model d is zero but for noise, so d' V^-1 d is compared
with an F distribution (Hotelling); V is the covariance of all estimates (`covariance`), which knows that residuals are
alike over time and between channels. A joint test sees what no single parameter shows: where several of them trade,
each one's own interval is wide. So it is made in directions at right angles in the rows: the covariance allows for
residuals that are alike by a factor for each column, which tilts what columns that look the same know together.

Priors hold for u, and tell nothing of d. Rows of no part, such as a static experiment's where times are compared, do
not count: they would hold the mean of the parts at their own value, and what contradicts that would look like a
difference between parts. Parameters that a single recording has are solved for within it, not compared.
What is known to be wrong with the residuals (their change on a finer mesh or step) takes columns of its own.
Errors of known size that all parts share, such as the noise of what drives a scene, add to V what they move in d.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..arrays.types import Array
from ..optional import require
from .covariance import Covariance, Sandwich
from .gauge import null_space
from .intervals import critical_t
from .layout import Integers
from .least_squares import solved
from .linearized import Linearized
from .shared_errors import variance_of

LEVEL = 0.01
"""Chance that a right model is contradicted, whatever the number of splits."""
FEWEST = 8  # rows of each part, for each parameter: fewer tell nothing
MOST_COLUMNS = 64  # of parameters times parts
_SHORT = 3.0  # of the share of frames that are alike: by so much standard deviations come out too small (measured)
_FLAT = 1e-8  # of the largest: variances of directions that parts do not tell


@dataclass(frozen=True)
class Split:
    """Parts of the data.

    Attributes:
        part: (rows,) number of the part that a row belongs to, -1 for none.
        names: of the parts, in words.
        apart: whether the parts share no errors, as separate recordings do.
        others: (others,) likewise, of the rows that are no data; None = all belong to none.
    """

    part: Integers
    names: tuple[str, ...]
    apart: bool = False
    others: Integers | None = None

    def of_others(self, count: int) -> Integers:
        """(count,) numbers of the parts of the rows that are no data."""
        return np.full(count, -1) if self.others is None else self.others


@dataclass(frozen=True)
class Difference:
    """What one part asks for, of one parameter.

    Attributes:
        column: of the parameter.
        name: of the part that differs most from the others, against its standard deviation.
        steps: internal, by which that part alone and the others together would move the parameter.
        reaches: 95 % half-widths of these.
        reach: 95 % half-width of the difference of the two.
        shift: by which the known errors of the residuals would move the first step.
    """

    column: int
    name: str
    steps: tuple[float, float]
    reaches: tuple[float, float]
    reach: float
    shift: float


@dataclass(frozen=True)
class Contradiction:
    """Parts of the data that ask for different parameters.

    Attributes:
        chance: that a right model shows such a difference, before counting the splits that were tried.
        split: the data into these parts.
        differences: of each parameter that was compared.
    """

    chance: float
    split: Split
    differences: tuple[Difference, ...]


def contradiction(fitted: Linearized, splits: Sequence[Split]) -> Contradiction | None:
    """The least likely disagreement between parts of the data, if it is less likely than `LEVEL`.

    Args:
        fitted: at the minimum.
        splits: of the rows into parts; those whose parts are too small are left out.

    Raises:
        MissingExtraError: scipy is not installed.
    """
    compared = [found for split in splits if (found := _compared(fitted, split))]
    least = min(compared, key=lambda found: found.chance, default=None)
    return least if least is not None and least.chance < LEVEL / len(compared) else None


def _compared(fitted: Linearized, split: Split) -> Contradiction | None:
    """Compare the parts of a split; None where a part is too small, or where there is nothing to compare."""
    if (split.part < 0).any():
        mine = split.part >= 0
        found = _compared(fitted.of(mine), replace(split, part=split.part[mine]))
        return found and replace(found, split=split)
    rows, parts, shared = fitted.rows, len(split.names), fitted.shared
    count = len(shared)
    sizes = np.bincount(split.part[split.part >= 0], minlength=parts)
    if count == 0 or count * parts > MOST_COLUMNS or sizes.min() < FEWEST * count:
        return None
    every, left, drawn, known = fitted.beside_private(_opposed(fitted, split))
    seen = [[fitted.jacobian[:rows][split.part == k, column].any() for column in shared] for k in range(parts)]
    everywhere = np.tile(np.all(seen, axis=0), parts)  # what a part does not show, it asks for no other value of
    every[:, count : count * parts][:, ~everywhere[count:]] = 0.0
    used = independent(every)
    compared = [c for c in used if count <= c < count * parts]
    if not compared:
        return None
    used = [*(c for c in used if c not in set(compared)), *compared]
    behind = slice(len(used) - len(compared), None)
    step = -solved(every[:, used], left, rcond=None)
    after = left + every[:, used] @ step
    taken = fitted.taken + len(fitted.private)
    spread = Sandwich(after[:rows], every[:rows, used], fitted.layout, every[rows:, used], taken)
    told, apart = spread.of_estimate(), spread.at_right_angles()
    short = short_of_frames(told, fitted.frames)
    V, across = short * told.matrix, short * apart.matrix
    degrees = max(float(np.median((told.degrees / (2 - 1 / told.inflation))[behind])), 1.0)
    if drawn.any():
        V, degrees = V + variance_of(every[:, used], drawn), min(degrees, float(drawn.shape[1]))
        across = across + variance_of(spread.Q, drawn)
    # correlations of +/-0.9999 do not survive factors of each column's own: so the test has columns at right angles
    scores = _scores((spread.Q.T @ left)[behind], across[behind, behind])
    chance = float(require("scipy.special", "fit").fdtrc(len(scores), degrees, scores @ scores / len(scores)))
    physical = [c for c in used if c < count * parts]
    moved = np.zeros((every.shape[1], known.shape[1]))
    moved[physical] = solved(every[:, physical], known, rcond=None)
    full, whole = np.zeros(every.shape[1]), np.zeros((every.shape[1], every.shape[1]))
    full[used], whole[np.ix_(used, used)] = step, V
    return _by_parameter(chance, split, shared, full, whole, moved, critical_t(degrees))


def _opposed(fitted: Linearized, split: Split) -> Array:
    """(rows + others, count parts) columns of what all parts share, and of what sets each but the last apart."""
    parts, columns = len(split.names), fitted.jacobian[:, fitted.shared]
    signs = np.vstack([np.eye(parts - 1), -np.ones(parts - 1), np.zeros(parts - 1)])  # -1, the last, is of none
    coding = signs[np.append(split.part, split.of_others(fitted.others))]
    return np.hstack([columns, *(columns * coding[:, [k]] for k in range(parts - 1))])


def _scores(values: Array, spread: Array) -> Array:
    """Independent ones of unit variance, from values with that covariance."""
    sd = np.sqrt(np.diag(spread))
    sizes, turn = np.linalg.eigh(spread / np.outer(sd, sd))
    told = sizes > _FLAT * sizes[-1]
    return np.asarray((turn.T @ (values / sd))[told] / np.sqrt(sizes[told]))


def short_of_frames(spread: Covariance, frames: int) -> float:
    """Factor of variances that few frames, many of them alike, make too small."""
    return float((1 + _SHORT * (spread.autocorrelation_time - 1) / frames) ** 2)


def independent(every: Array) -> list[int]:
    """Columns that have a unique answer once the others are held."""
    names = [str(i) for i in range(every.shape[1])]
    pivots = null_space(every, names, [False] * len(names)).pivots
    return [c for c in range(len(names)) if c not in pivots]


def _by_parameter(
    chance: float, split: Split, shared: list[int], step: Array, V: Array, moved: Array, t: float
) -> Contradiction:
    """The contradiction in terms of single parameters: for each, the part that differs most from the others."""
    count, parts = len(shared), len(split.names)
    coding = np.vstack([np.eye(parts - 1), -np.ones(parts - 1)])

    def difference(j: int, k: int) -> Difference:
        """The difference between u + d_k and the mean of the others, u - d_k/(parts - 1)."""
        common, d = np.zeros(len(step)), np.zeros(len(step))
        common[j] = 1.0
        d[[count * (m + 1) + j for m in range(parts - 1)]] = coding[k]
        rows = (common + d, common - d / (parts - 1), d * parts / (parts - 1))
        reaches = [t * math.sqrt(max(float(row @ V @ row), 0.0)) for row in rows]
        steps = (float(rows[0] @ step), float(rows[1] @ step))
        shift = float(np.abs(rows[0] @ moved).sum())
        return Difference(shared[j], split.names[k], steps, (reaches[0], reaches[1]), reaches[2], shift)

    def clear(found: Difference) -> float:
        return abs(found.steps[0] - found.steps[1]) / found.reach if found.reach > 0 else 0.0

    most = tuple(max((difference(j, k) for k in range(parts)), key=clear) for j in range(count))
    return Contradiction(chance, split, most)
