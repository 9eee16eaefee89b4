"""Whether a motion loses energy in another way than its model does.

A model without one of the losses that its motion has is fitted by values that are right for no part of the motion. What
is left then oscillates like the motion itself, so the comparison of its parts finds no clear contradiction. But what
more loss would change is known to first order: backward Euler with a substep h damps an oscillation of angular
frequency omega by omega h/2, as a Kelvin-Voigt material with the time constant h does, and the second-order formula
hardly damps it. The difference of one simulation with each is a direction in which residuals move where the model loses
more. Where this direction, beside the parameters, explains a large part of what a fit leaves beyond noise, and more
than chance does, the model lacks a loss; where it does so backward, the model loses too much.

Where driven markers are corrected, both simulations have the corrections of the fit. What other corrections would take
of the difference is taken off to first order, as from a column of the reduced Jacobian. To solve for the corrections of
the second simulation would ask another question: on a flag they lead to another minimum, which depends on where they
start, at a hundred times the cost. States of motions in windows follow by one Gauss-Newton step, which is their first
order.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache
from typing import Literal

import numpy as np

from ..arrays.types import Array
from ..experiment.cut import in_steps
from ..minimum.discretization import Refinement
from ..problem.problem import FitProblem
from ..quantities.wording import short
from .contradictions import residual_shifts
from .directions import Asked, clearly, rows_of, tied
from .held_losses import held_losses
from .other_losses import other_losses

OTHER: dict[str, Literal["bdf1", "bdf2"]] = {"bdf1": "bdf2", "bdf2": "bdf1"}


def missing_loss(
    problem: FitProblem,
    u: Array,
    fitted: tuple[FitProblem, Array],
    known: Mapping[str, float] | None = None,
    refinement: Refinement | None = None,
) -> dict[str, str]:
    """By free parameter, the motion that loses energy in a way that the model lacks, or has too small.

    Losses that are given are tested first (`held_losses`), then all losses by one simulation with the other integrator.
    Where that has no answer, it tells nothing, nor of motions with contacts, where another integrator or substep moves
    when they begin and slide, which is no loss: these are asked for each loss by itself (`losses_beside_contacts`).
    Last, where neither shows anything, come fits with losses of quite another size (`other_losses`).

    Args:
        problem: whose residuals count.
        u: (free,) its minimum.
        fitted: the problem as it was fitted, whose rows are the same, and its minimum.
        known: by parameter, the share of what the fit leaves that has another cause. A loss must explain more.
        refinement: of the discretization; where a loss is asked for, a simulation tells what a finer mesh explains. (A
            shorter step changes losses, too: it is not asked.)
    """

    @cache
    def shifts() -> list[Array]:
        return [] if refinement is None else residual_shifts(problem, u, replace(refinement, halve_step=False))

    if all(e.static for e in problem.experiments):
        return {}
    found = held_losses(problem, u, known or {}, shifts)
    found |= {
        name: words
        for name, words in _by_other_integrator(problem, u, fitted, known or {}, shifts).items()
        if name not in found
    }
    return found or ({} if known else other_losses(*fitted))


def _by_other_integrator(
    problem: FitProblem,
    u: Array,
    fitted: tuple[FitProblem, Array],
    known: Mapping[str, float],
    shifts: Callable[[], list[Array]],
) -> dict[str, str]:
    if any(e.scene.compiled.contacts or e.scene.compiled.touches_itself for e in problem.experiments):
        return {}
    ok, _, J = problem.evaluate(u)
    change = of_more_loss(*fitted)
    if not ok or not np.isfinite(J).all() or change is None:
        return {}
    groups = tied(problem)
    found: dict[str, str] = {}
    for group in groups:
        mine = rows_of(problem, group)
        asked = clearly(problem, u, change, mine, len(groups), shifts)
        if asked is not None:
            words = _words([problem.experiments[i].name for i in group], asked)
            names = [name for i in group for name in problem.acting_on(problem.experiments[i])]
            found |= {name: words for name in names if asked.explained > known.get(name, 0.0)}
    return found


def of_more_loss(problem: FitProblem, u: Array) -> Array | None:
    """(rows,) what the residuals change with backward Euler instead of the second-order formula, divided by the
    substep, 1/s; None where it has no answer."""
    ok, r, _ = problem.evaluate(u)
    made = [
        e if e.static else replace(e, solver=replace(e.solver, integrator=OTHER[e.solver.integrator]))
        for e in problem.experiments
    ]
    other, rows = problem.of([in_steps(e, 1) for e in made]), problem.core.data_rows
    corrected = problem.corrections(u)
    if corrected:
        other = other.moved({name: x.ravel() for name, x in corrected.items()})
    ok_there, there, _ = other.evaluate(u, jacobian=False)
    if not (ok and ok_there):
        return None
    left = problem.core.reduced(there[:rows] - r[:rows]) if corrected else there - r
    change = np.zeros(len(r))
    for i, e in enumerate(problem.experiments):
        per = (1.0 if e.solver.integrator == "bdf2" else -1.0) / e.solver.h
        mine = rows_of(problem, [i])
        change[mine] = per * left[mine]
    return change


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
