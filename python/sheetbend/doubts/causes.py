"""Which error, or which two, explain what a fit leaves in its residuals, and whether chance does."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays.types import Array
from ..optional import require
from ..statistics.gauge import RANK_TOLERANCE
from ..statistics.layout import Layout
from ..statistics.least_squares import left_by
from .directions import LEVEL
from .told import Told
from .two_directions import chance_of, two_directions

MOST = 0.85
"""Of what a fit leaves beyond noise: the part that one error must explain. The one that was made explains 0.88 to 1.1
on small ropes (gravity, lengths, clamps, places, clocks, drag, masses, stretch), and 0.87 where the motion changes by
more than first order (a table turned by 1.7 degrees, a cloth 0.6 % larger). Others explain at most 0.83, but for those
that look the same, such as the size of gravity and a clock; a mesh four times finer at most 0.28, and two knots of
0.1 g that the model lacks 0.76 (measured)."""
MOST_OF_TWO = 0.97
"""The same for two errors at once. The two that were made explain 0.99 to 1.0 (a length and gravity); of 138 fits whose
given numbers were right two others explain 0.94 in one, beside a gust of wind (measured)."""
LEVEL_OF_DRIVEN = 0.01
"""Chance that noise of driven particles looks so, above which nothing is named. It is asked of the causes that explain
`MOST` and that no other noise explains at `LEVEL` and the number of tests. At that level a table turned by 1.1 degrees
under a drawn rope passed for noise of the hand: chance 8e-5 to 1e-3, 30 tests, friction 37 % off and identified to
5 % (measured)."""
ALIKE = 0.05  # by so much less explained, another number is named beside
BY_CHANCE = 4.0
"""Of the residuals' sum of squares, in the noise's variance: by so much, chance tells two numbers apart. The other one
is named beside."""
MOST_NAMED = 3
FARTHEST = {"rad": 0.3, "m": 0.1, "s": 0.1, "m/s": 2.0, "": 0.7}
"""Largest errors that are told, by unit; "" for relative ones. First order says nothing of larger ones."""


@dataclass(frozen=True)
class Cause:
    """One error or two that explain what a fit leaves: each with its size and what one unit of it changes (rows,)."""

    explained: float
    parts: tuple[tuple[Told, float, Array], ...]


@dataclass(frozen=True)
class Wrong:
    """What motions that share parameters ask of a told number.

    Attributes:
        motions: places of their experiments.
        words: by how much a number is off, the likeliest first where several explain about as much.
        steps: (free,) of each, internal, what the parameters would move with that number as asked for.
        explained: share of what the fit leaves beyond noise.
        times: what they leave beyond noise, as a multiple of the noise, or of what sigma allows where that is more.
        sure: explains nearly all; else a third or more of what is much more than noise.
        driven: with all taken out that another driven motion would explain.
        fitted: with the number fitted along, not to first order.
        unbroken: of motions that were shot in windows, as one run of each shows it.
        causes: what explains so much of it, where it is not sure.
    """

    motions: tuple[int, ...]
    words: tuple[str, ...]
    steps: tuple[Array, ...]
    explained: float
    times: float
    sure: bool = True
    driven: bool = False
    fitted: bool = False
    unbroken: bool = False
    causes: tuple[Cause, ...] = ()


def seen_beside(q: Array, tried: Sequence[tuple[Told, Array]]) -> list[tuple[Told, Array, Array]]:
    """The directions that parameters do not take up, each with what is left of it beside theirs, q."""
    beside = ((one, column, left_by(q, column)) for one, column in tried)
    return [(one, column, b) for one, column, b in beside if float(b @ b) > RANK_TOLERANCE * float(column @ column)]


def causes(
    r: Array, seen: Sequence[tuple[Told, Array, Array]], left: float, least: float, two: bool = False
) -> list[Cause]:
    """The errors that explain a share `least` of what residuals r, orthogonal to the parameters' directions, hold
    beyond noise: the likeliest first, and of those that explain `MOST` those about as much. Chance is not asked yet.

    Args:
        two: ask for two at once that explain nearly all, where none alone does.
    """
    found, most = [], 0.0
    for one, column, beside in seen:
        inner, along = float(beside @ beside), float(beside @ r)
        if _possible(one, -along / inner):
            explained = along**2 / inner / left
            most = max(most, explained)
            if explained > least:
                found.append(Cause(explained, ((one, -along / inner, column),)))
    if two:
        found = []
    if two and most < MOST_OF_TWO:
        shared = [each for each in seen if not each[0].marker]
        pairs = []
        if len(shared) > 1:
            beside = np.column_stack([b for *_, b in shared])
            for pair in two_directions(r, beside, left, most, MOST_OF_TWO):
                both = [(*shared[k][:2], more) for k, more in zip(pair.places, pair.more, strict=True)]
                if all(_possible(one, more) for one, _, more in both):
                    pairs.append(Cause(pair.explained, tuple((one, more, column) for one, column, more in both)))
        found = pairs
    found.sort(key=lambda cause: -cause.explained)
    alike = max(ALIKE, BY_CHANCE / left) if least == MOST else np.inf
    return [cause for cause in found if cause.explained > found[0].explained - alike][:MOST_NAMED]


def beyond_chance(chance: Callable[[Array | None], float], tests: int, errors: Callable[[], Array]) -> bool:
    """Whether neither noise alone nor with draws of what drives the scene (data rows, draws) asks for a cause."""
    if not chance(None) < LEVEL / tests:
        return False
    return not errors().size or chance(errors()) < LEVEL_OF_DRIVEN


def of_what_is_left(
    r: Array, J: Array, mine: Array, layout: Layout, taken: float, cause: Cause, errors: Array | None
) -> float:
    """Chance of a cause where all that a fit leaves, and how alike it is, counts as noise (`chance_of`)."""
    return chance_of(r, J, [column for *_, column in cause.parts], mine, layout, errors, taken)


def of_noise(q: Array, white: float, cause: Cause, errors: Array | None) -> float:
    """Chance that white noise of this variance and draws of errors (data rows, draws) ask for so much of one direction.
    What else a fit leaves does not count as chance here."""
    ((_, more, column),) = cause.parts
    beside = left_by(q, column)
    inner = float(beside @ beside)
    variance = white / inner
    if errors is not None:
        variance += float(np.mean((beside[: len(errors)] @ errors / inner) ** 2))
    score = abs(more) / math.sqrt(max(variance, np.finfo(float).tiny))
    special = require("scipy.special", "fit")
    return 2.0 * float(special.ndtr(-score) if errors is None else special.stdtr(errors.shape[1], -score))


def _possible(one: Told, more: float) -> bool:
    """Whether an error of this size can be: small enough for first order, and of what is missing no less than none."""
    if one.missing is not None and not one.relative and not (one.unit and one.signed):
        return more > 0.0 or one.signed
    return abs(more) < FARTHEST.get("" if one.relative else one.unit, np.inf)
