"""What a fit rests on: numbers that were given and not fitted, and what an error in each of them moves.

A fit takes densities, lengths, the direction of gravity, the places of clamps and markers as they are told. With
residuals r, their Jacobian J in the fitted parameters and the derivative g = dr/dgiven of one told number, an error of
that number moves the minimum by -(J'J)^-1 J'g (Gauss-Newton).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ..arrays.checks import check_kind, is_number
from ..arrays.types import Array
from ..errors import InputError
from ..problem.problem import FitProblem
from ..result.estimate import Premise
from ..statistics.gauge import RANK_TOLERANCE
from ..statistics.intervals import NORMAL
from .told import GROUPS, Told, told_quantities

NOTHING_FELT = 1e-9  # of a half-width: a told number that moves less has no part in the fit


@dataclass
class _Errors:
    """The independent errors of one told number: J'g and g'g of each by label, over all experiments, and its step."""

    told: Told
    columns: dict[str, Array] = field(default_factory=dict)
    squares: dict[str, float] = field(default_factory=dict)
    steps: dict[str, tuple[float, str]] = field(default_factory=dict)

    def add(self, one: Told, column: Array) -> None:
        self.columns[one.label] = self.columns.get(one.label, 0.0) + column
        self.squares[one.label] = self.squares.get(one.label, 0.0) + float(one.column @ one.column)
        self.steps[one.label] = max(self.steps.get(one.label, one.step), one.step)


def check_given(given: Mapping[str, float], problem: FitProblem) -> None:
    """Refuse standard deviations that are none, or of what the fit does not take as given.

    Raises:
        InputError: names the key.
    """
    check_kind("given", given, Mapping, "give standard deviations by name")
    u = problem.parameters.initial()
    known = [
        *dict.fromkeys(name for i in range(len(problem.experiments)) for name, *_ in told_quantities(problem, u, i)),
        *GROUPS,
    ]
    for name, sd in given.items():
        if name not in known:
            fix = f"name some of: {', '.join(known)}"
            raise InputError(f"given.{name}", "is nothing that this fit takes as given", name, fix)
        if not (is_number(sd) and sd >= 0):
            fix = "give a standard deviation: relative where positive (0.02 is 2 %), else in SI units; 0 is exact"
            raise InputError(f"given.{name}", "must not be negative", sd, fix)


def premises(problem: FitProblem, u: Array, given: Mapping[str, float], told: Sequence[Told]) -> tuple[Premise, ...]:
    """What the told numbers would move in the fitted parameters, those without any effect left out.

    Args:
        u: (free,) the minimum in internal coordinates.
        given: standard deviations by name: of quantities that must be positive relative to the value, of others in
            their unit; "gravity" (each of two directions), "clamp_direction" and "collider_direction" (each
            axis) in rad, "clamps" (each axis), "markers" (each marker) and "drive_place" (each axis) in m; others of
            `told.GROUPS`. What is exact (0) is left out.
        told: `told_numbers` there.
    """
    errors: dict[str, _Errors] = {}
    _, _, J = problem.evaluate_exactly(u)
    rows = problem.core.first_rows
    for one in told:
        if one.name and given.get(one.name) != 0.0:
            mine = J[rows[one.experiment] : rows[one.experiment + 1]][one.rows]
            errors.setdefault(one.name, _Errors(one)).add(one, mine.T @ one.column)
    solve, tested = _Response(problem, u, J), not problem.estimates_corrections
    return tuple(
        premise
        for name, each in errors.items()
        for premise in _premises(name, each, solve, given, tested)
        if any(abs(moved) > NOTHING_FELT * abs(solve.size[parameter]) for parameter, moved in premise.moved.items())
    )


def half_widths(found: tuple[Premise, ...], names: tuple[str, ...]) -> dict[str, float]:
    """Half of the 95 % interval of each parameter, in its unit, from the told standard deviations."""
    return {
        name: NORMAL
        * math.sqrt(sum((p.moved.get(name, 0.0) * p.sd / p.off_by) ** 2 for p in found if p.sd is not None))
        for name in names
    }


class _Response:
    """-(J'J)^-1 on the parameters that the data determine and no bound holds, in physical units."""

    def __init__(self, problem: FitProblem, u: Array, J: Array) -> None:
        size = np.linalg.norm(J, axis=0)
        self.columns = np.flatnonzero(problem.parameters.inside(u) & (size > 0))
        self.names = [problem.parameters.free[k] for k in self.columns]
        scaled = J[:, self.columns] / size[self.columns]
        _, s, Vt = np.linalg.svd(np.linalg.qr(scaled, mode="r"))
        good = s > RANK_TOLERANCE * s.max(initial=0.0)
        self.known = (np.abs(Vt[~good]) < 1e-3).all(axis=0)
        half = Vt[good] / s[good, None]
        self._inverse = half.T @ half / np.outer(size[self.columns], size[self.columns])
        self._diagonal = problem.parameters.diagonal(u)[self.columns]
        deviation = self._diagonal * np.sqrt(np.diag(self._inverse))
        self.size = dict(zip(self.names, deviation.tolist(), strict=True))

    def __call__(self, column: Array) -> Array:
        """What one unit of a told number moves, for J'g (free,)."""
        return np.asarray(-self._diagonal * (self._inverse @ column[self.columns]))

    def leaves(self, column: Array, square: float) -> float:
        """What the parameters leave of one unit of it in the residuals, for J'g (free,) and g'g."""
        mine = column[self.columns]
        return math.sqrt(max(square - float(mine @ self._inverse @ mine), 0.0))


def _premises(
    name: str, errors: _Errors, solve: _Response, given: Mapping[str, float], tested: bool
) -> Iterator[Premise]:
    told = errors.told
    steps = {name: told.step} | errors.steps
    moved = {label: steps[label][0] * solve(column) for label, column in errors.columns.items()}
    if name == "markers" and moved:  # independent of each other
        moved = {name: np.sqrt(np.square(list(moved.values())).sum(axis=0))}
        tested = False  # of many errors at once no single one is named
    sd = given.get(name)
    for label, by in moved.items():
        off_by, words = steps[label]
        if told.relative and told.value is not None:
            off_by *= abs(told.value)
        yield Premise(
            name=label,
            value=told.value,
            unit=told.unit,
            off_by=off_by,
            words=words,
            moved={n: float(m) for n, m, k in zip(solve.names, by, solve.known, strict=True) if k},
            leaves=steps[label][0] * solve.leaves(errors.columns[label], errors.squares[label]) if tested else 0.0,
            sd=None if sd is None else sd * abs(told.value) if told.relative and told.value is not None else sd,
        )
