"""Evaluations of a problem with many recordings, shared out to workers.

Every piece of work is a few experiments at one point, and comes back as their residuals and the columns of the Jacobian
that reach them. The pieces are the same for any number of workers, and are put together in the order of the recordings.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Protocol, Self

import numpy as np

from .. import _core
from ..arrays.types import Array
from ..experiment.experiment import Experiment
from ..quantities.parameters import Parameters
from .workers import Common, current

PIECES = 32  # at most

Piece = tuple[bool, Array, Array, str]  # ok, residuals, columns of the Jacobian, why not


class Shareable(Protocol):
    """What is asked of a problem (`problem.FitProblem`) that is shared out."""

    experiments: tuple[Experiment, ...]
    parameters: Parameters
    core: _core.Problem

    @property
    def estimates_corrections(self) -> bool: ...

    @property
    def failure(self) -> str: ...

    def acting_on(self, e: Experiment) -> tuple[str, ...]: ...

    def piece(self, chosen: Sequence[int]) -> Self: ...


class Spread:
    """A problem's residuals and Jacobian, made by workers; as the compiled problem gives them.

    Attributes:
        failure: why the last evaluation was not ok.
    """

    def __init__(self, problem: Shareable) -> None:
        count = len(problem.experiments)
        size = math.ceil(count / PIECES)
        self._pieces = [range(k, min(k + size, count)) for k in range(0, count, size)]
        self._common = Common(_Parts(problem))
        self._columns = [_columns(problem, piece) for piece in self._pieces]
        self._parameters, self.rows = problem.parameters, problem.core.rows
        self.failure = ""

    @staticmethod
    def of(problem: Shareable) -> Spread | None:
        """A problem spread over workers, where workers are in use and there are several experiments that all have
        something to fit; otherwise None. Corrections of driven markers depend on the evaluation before, so such
        problems stay in this process."""
        if current() is None or len(problem.experiments) < 2 or problem.estimates_corrections:
            return None
        return Spread(problem) if all(map(problem.acting_on, problem.experiments)) else None

    @property
    def parameters(self) -> int:
        """Number of free ones."""
        return len(self._parameters.free)

    def evaluate(self, u: Array, jacobian: bool) -> tuple[bool, Array, Array]:
        """See `FitProblem.evaluate`."""
        items = [(p, u[c], jacobian) for p, c in zip(self._pieces, self._columns, strict=True)]
        found: list[Piece] = self._common.map(_evaluated, items)
        J = np.zeros((self.rows if jacobian else 0, len(u)))
        lost = [why for ok, _, _, why in found if not ok]
        if lost:
            self.failure = lost[0]
            return False, np.zeros(self.rows), J
        r = np.concatenate([*(part for _, part, _, _ in found), self._parameters.prior_residuals(u)])
        if jacobian:
            row = 0
            for (_, part, block, _), columns in zip(found, self._columns, strict=True):
                J[row : row + len(part), columns] = block
                row += len(part)
            J[row:] = self._parameters.prior_jacobian()
        return True, r, J

    def state(self) -> Array:
        """No evaluation depends on the one before."""
        return np.zeros(0)

    def restore(self, state: Array) -> None:
        """Nothing to restore."""


class _Parts:
    """A problem in a worker, with its pieces once they are made."""

    def __init__(self, problem: Shareable) -> None:
        self.problem = problem
        self.made: dict[range, Shareable] = {}

    def __reduce__(self) -> tuple[Any, ...]:
        return _Parts, (self.problem,)

    def piece(self, which: range) -> Shareable:
        if which not in self.made:
            self.made[which] = self.problem.piece(which)
        return self.made[which]


def _columns(problem: Shareable, piece: range) -> list[int]:
    """Numbers of the free parameters that reach a piece."""
    names = set().union(*(problem.acting_on(problem.experiments[i]) for i in piece))
    return [k for k, name in enumerate(problem.parameters.free) if name in names]


def _evaluated(parts: _Parts, item: tuple[range, Array, bool]) -> Piece:
    which, u, jacobian = item
    problem = parts.piece(which)
    ok, r, J = problem.core.evaluate(u, jacobian)
    rows = problem.core.data_rows
    return ok, r[:rows], J[:rows], "" if ok else problem.failure
