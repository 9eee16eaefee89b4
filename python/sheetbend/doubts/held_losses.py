"""Whether a loss that the model was given has another size.

A fit takes a damping or a drag as given that is too large or too small, and makes up for it with other parameters. The
derivative of the residuals with respect to the logarithm of that loss is the direction in which they would move: where
what the fit leaves lies along it, the loss is wrong (a score test; Rao 1948, Mathematical Proceedings of the Cambridge
Philosophical Society 44, 50).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ..arrays.types import Array
from ..experiment.wanted import quantities_of
from ..problem.problem import FitProblem
from ..quantities.parameters import Parameter, Parameters
from ..quantities.wording import short
from .directions import Asked, clearly, rows_of, tied
from .losses import LOSSES
from .more_parameters import with_parameter

HELD: dict[str, Any] = {"fixed": True, "log": False, "prior": None, "lower": -math.inf, "upper": math.inf}


def held_losses(
    problem: FitProblem,
    u: Array,
    known: Mapping[str, float] | None = None,
    shifts: Callable[[], list[Array]] = list,
) -> dict[str, str]:
    """By free parameter, the loss that the model was given and that the residuals ask in another size. Takes one
    Jacobian.

    Args:
        u: (free,) the minimum.
        known: by parameter, the share of what the fit leaves that has another cause. A loss must explain more.
        shifts: see `clearly`.
    """
    ok, _, J = problem.evaluate(u)
    names = held_names(problem)
    if not names or not ok or not np.isfinite(J).all():
        return {}
    columns = _columns(problem, u, names)
    groups = tied(problem)
    found: dict[str, str] = {}
    for group in groups:
        mine = rows_of(problem, group)
        asked = {name: clearly(problem, u, g, mine, len(groups) * len(names), shifts) for name, g in columns.items()}
        told = {name: one for name, one in asked.items() if one is not None}
        if told:
            name = max(told, key=lambda name: told[name].explained)
            words, rival = _words(name, told[name]), known or {}
            others = [other for i in group for other in problem.acting_on(problem.experiments[i])]
            found |= {other: words for other in others if told[name].explained > rival.get(other, 0.0)}
    return found


def held_names(problem: FitProblem) -> list[str]:
    """Losses of its scenes that a problem takes as given."""
    free = {problem.parameters.roots[name][0] for name in problem.parameters}
    return [
        name
        for name, q in quantities_of(problem.experiments).items()
        if name.endswith(LOSSES) and name not in free and not problem.given.keys() & {name} and q.value > 0.0
    ]


def of_size(problem: FitProblem, name: str, times: float) -> FitProblem:
    """The problem with so many times a loss that it takes as given, in each experiment that has it."""
    sized = [
        Parameter(name=f"{name}[{e.name}]", initial=times * e.scene.quantities[name].value, fixed=True)
        for e in problem.experiments
        if name in e.scene.quantities
    ]
    return with_parameter(problem, Parameter(name=name, private=True), sized)


def _columns(problem: FitProblem, u: Array, names: Sequence[str]) -> dict[str, Array]:
    """By name of a loss, the derivative (rows,) of the residuals with respect to its logarithm, in all experiments that
    have it."""
    values = problem.parameters.to_physical(u)
    held = [
        p if p.tied_to is not None else replace(p, initial=values[name], **HELD)
        for name, p in problem.parameters.items()
    ]
    units = {name: q.unit for name, q in quantities_of(problem.experiments).items()}
    freed = [
        Parameter(name=f"{name}[{e.name}]", initial=e.scene.quantities[name].value, log=True, unit=units[name])
        for name in names
        for e in problem.experiments
        if name in e.scene.quantities and e.scene.quantities[name].value > 0.0
    ]
    private = [Parameter(name=name, private=True, log=True, unit=units[name]) for name in names]
    with_losses = problem.replaced(
        parameters=Parameters([*problem.given.values(), *private]), expanded=Parameters([*held, *freed])
    ).follow(problem)
    _, _, J = with_losses.evaluate(with_losses.parameters.initial())
    columns = dict(zip(with_losses.parameters.free, J.T, strict=True))
    rows = problem.core.rows
    data = problem.core.data_rows
    found = {}
    for name in names:
        own = sum(c for key, c in columns.items() if key.startswith(f"{name}["))
        full = np.zeros(rows)
        full[:data] = own[:data]
        full[rows - (len(own) - data) :] = own[data:]  # of corrections; the held parameters' priors have no rows
        found[name] = full
    return found


def _words(name: str, asked: Asked) -> str:
    part = f"{short(100 * min(asked.explained, 1.0), 2)} % of what the fit leaves"
    return (
        f"the given {name} is too {'small' if asked.more > 0.0 else 'large'}: "
        f"{'more' if asked.more > 0.0 else 'less'} of it would explain {part}. Free it, or measure it"
    )
