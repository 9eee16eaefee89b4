"""A cause that explains much of large residuals to first order, but not nearly all: it is fitted along.

First order tells a pin of a cloth that stands 4 mm elsewhere as 3.5 mm, and that it explains 68 % of what is left.
Fitted beside the parameters it is 4 mm, and nothing is left. Another cause leaves much also then.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ..arrays.types import Array
from ..errors import SheetbendError
from ..minimum.optimizers import refit
from ..problem.problem import FitProblem
from ..quantities.parameters import Parameter
from ..quantities.quantities import Quantity, Term
from .causes import MOST, Wrong
from .directions import rows_of
from .more_parameters import with_parameter
from .tangents import inputs_of
from .told import Told
from .told_words import words_of

NAME = "[error]"
MOST_FITTED = 2  # causes
ITERATIONS, TOLERANCE = 15, 1e-4  # at most, and of the cost where a search ends


def followed(problem: FitProblem, u: Array, one: Wrong) -> Wrong:
    """The first of the likeliest causes that explains nearly all where it is fitted along, or what was found without.

    Takes a search of at most `ITERATIONS` for each of `MOST_FITTED` causes.
    """
    if len(one.motions) > 1 or problem.estimates_corrections:
        return one
    mine = rows_of(problem, list(one.motions))
    _, r, _ = problem.evaluate(u, jacobian=False)
    left = float(r[mine] @ r[mine])
    beyond = left * one.times / (1.0 + one.times)
    for cause in one.causes[:MOST_FITTED]:  # of one error each, where nothing explains nearly all
        ((told, size, _),) = cause.parts
        try:
            free = _with_error(problem, one.motions[0], told, size)
            if free is None:
                continue
            end = refit(free, np.append(u, size), "auto", ITERATIONS, TOLERANCE)
            ok, after, _ = free.evaluate(end.u, jacobian=False)
        except SheetbendError:  # also of an error that no scene can have, such as a drag below zero
            continue
        explained = (left - float(after[mine] @ after[mine])) / beyond
        if ok and explained > MOST:
            words = words_of(told, float(end.u[-1]), problem, list(one.motions))
            return replace(one, words=(words,), steps=(end.u[:-1] - u,), explained=explained, sure=True, fitted=True)
    return one


def _with_error(problem: FitProblem, i: int, told: Told, size: float) -> FitProblem | None:
    """The problem with one more parameter at the end, the size of an error of the i-th experiment; None of an error
    that is no input of its scene."""
    e = problem.experiments[i]
    layout, inputs = e.scene.compiled.layout, inputs_of(told.added)
    if not inputs or any(np.max(where) >= layout[array][1] for array, where, _ in inputs):
        return None
    scene = e.scene.shallow()
    scene.quantities = {**scene.quantities, NAME: Quantity(NAME, size, told.unit, positive=False, scale=abs(size))}
    scene.terms = [*scene.terms, *(Term(array, where, by, ((NAME, "identity"),)) for array, where, by in inputs)]
    made = [replace(e, scene=scene) if k == i else other for k, other in enumerate(problem.experiments)]
    lower = 0.0 if told.missing is not None and not told.signed else -math.inf
    return with_parameter(problem.of(made), Parameter(name=NAME, initial=size, lower=lower, scale=abs(size)))
