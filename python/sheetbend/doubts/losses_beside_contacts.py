"""Whether motions with contacts ask for a loss that their model does not have, or has in another size.

Where nothing touches, a simulation with another integrator shows what more loss changes (`missing_loss`). With another
integrator, contacts begin and slide at other times, which is no loss. So each loss is asked for by itself: its
derivative, at zero where the model has none of it, beside those of the parameters and beside what half the substep
changes (a score test). That is as sharp as the intervals are: a drag that moves friction out of its interval leaves
residuals that differ from noise by 5 % of their variance, too little for what asks how much of them is explained.

What noise of a hand changes is a few directions of many. So a loss counts beside all motions of what drives the scenes,
of any size (`driven_span`). Where these have too many numbers, draws of that noise count as chance.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..arrays.types import Array
from ..minimum.discretization import Refinement
from ..problem.problem import FitProblem
from ..statistics.least_squares import solved, unexplained
from .causes import ALIKE, BY_CHANCE, MOST, MOST_NAMED, Wrong
from .contradictions import residual_shifts
from .directions import Score, noise_in, rows_of, score, with_changes
from .driven_errors import FEW, driven_errors, driven_span
from .told import Told
from .told_words import words_of

LEVEL = 0.01  # chance that a right model is contradicted, over all losses that are asked for
DEVIATIONS = 2.0  # standard ones of a sum of squares of white noise: chance explains what else is left
FELT = 1e-3  # of draws of what drives the scenes: what is left of them beside its motions


def lost_beside_contacts(
    problem: FitProblem,
    u: Array,
    group: Sequence[int],
    losses: Sequence[tuple[Told, Array]],
    tests: int = 1,
    refinement: Refinement | None = None,
) -> Wrong | None:
    """The losses that residuals of a group of motions ask for, the most clearly first; None where chance explains them.

    Args:
        u: (free,) the minimum.
        losses: each with what it changes (rows,).
        tests: how many groups are asked.
        refinement: of the discretization, for a finer mesh. Half the substep is taken in any case.
    """
    _, r, J = problem.evaluate(u)
    level = LEVEL / max(tests * len(losses), 1)
    layout, data = problem.rows_layout(), problem.core.data_rows

    def clear(
        losses: Sequence[tuple[Told, Array]], beside: Array, errors: Array | None = None
    ) -> list[tuple[Told, Array, Score]]:
        each = ((one, column, score(r, beside, column, layout, errors=errors)) for one, column in losses)
        return [(one, by, asked) for one, by, asked in each if asked is not None and _chance(one, asked) < level]

    alone = {one.label: asked for one, _, asked in clear(losses, J)}
    if not alone:
        return None
    shifts = residual_shifts(problem, u, Refinement(finer=None if refinement is None else refinement.finer))
    known = np.column_stack([*shifts, driven_span(problem, u)])
    beside = with_changes(J, known)
    asked_again = [each for each in losses if each[0].label in alone]
    found = sorted(clear(asked_again, beside, _errors_beside(problem, u, known)), key=lambda each: -each[2].gain)
    if not found:
        return None
    least = (1.0 - ALIKE) * found[0][2].gain - BY_CHANCE
    alike = [each for each in found if each[2].gain > least][:MOST_NAMED]
    gain, mine = alone[alike[0][0].label].gain, rows_of(problem, group)
    noise, count = noise_in(r[:data], layout, mine[:data]), float(np.count_nonzero(mine))
    left = max(float(r[mine] @ r[mine]) - noise, gain)
    return Wrong(
        motions=tuple(group),
        words=tuple(words_of(one, asked.more, problem, group) for one, _, asked in alike),
        steps=tuple(-asked.more * solved(J, by) for _, by, asked in alike),
        explained=gain / left,
        times=left / max(noise, count),
        sure=left - gain < max((1.0 - MOST) * left, DEVIATIONS * math.sqrt(2.0 * count)),
    )


def _chance(one: Told, asked: Score) -> float:
    """That a right model asks for so much; of what is missing there is only more."""
    if one.missing is None:
        return asked.chance
    return 0.5 * asked.chance if asked.more > 0.0 else 1.0


def _errors_beside(problem: FitProblem, u: Array, known: Array) -> Array | None:
    """(data rows, draws) what noise of driven particles does beside known changes; None where that is nothing."""
    errors = driven_errors(problem, u, FEW)
    if not errors.size or not known.size:
        return errors if errors.size else None
    rest = unexplained(known, errors)
    return rest if np.linalg.norm(rest) > FELT * np.linalg.norm(errors) else None
