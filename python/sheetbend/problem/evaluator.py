"""Evaluates a compiled problem, through the journal where one is open."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Protocol

import numpy as np

from .. import _core
from . import digests
from .coordinates import Coordinates
from .journal import Evaluation, Timed, current


class Evaluated(Protocol):
    """What can be evaluated: a compiled problem, or one that workers evaluate."""

    @property
    def rows(self) -> int: ...

    @property
    def parameters(self) -> int: ...

    def evaluate(self, u: np.ndarray, jacobian: bool) -> Evaluation: ...

    def state(self) -> np.ndarray: ...

    def restore(self, state: np.ndarray) -> None: ...


class Evaluator:
    """Evaluates a problem, through the journal that was open when it was made, if one was."""

    def __init__(self, core: Evaluated, made_from: Callable[[], Mapping[str, str]]) -> None:
        """With the digests of what the problem is made from, which are asked for when the journal first needs them."""
        self._core, self._journal = core, current()
        self._made_from: Callable[[], Mapping[str, str]] | None = None if self._journal is None else made_from
        self._key = b""

    def digests(self) -> Mapping[str, str]:
        """Of what the problem is made from; none where no journal was open, or once it has the problem."""
        return {} if self._made_from is None else self._made_from()

    def __call__(self, u: np.ndarray, jacobian: bool) -> Timed:
        """(ok, residuals, Jacobian), and the seconds that it took when it was made, where they are known."""
        if self._journal is None:
            began = time.perf_counter()
            found = self._core.evaluate(u, jacobian)
            return found, time.perf_counter() - began
        if self._made_from is not None:
            self._key, self._made_from = self._journal.problem(self._made_from()), None
        key, state = self._key, self._state()
        if state:
            key += digests.digest([state, jacobian]).encode()  # a Jacobian too changes the state
        found, seconds, behind = self._journal.evaluate(
            key, u, jacobian, lambda: self._core.evaluate(u, jacobian), self._state
        )
        if behind:
            self._core.restore(np.frombuffer(behind))
        return found, seconds

    def _state(self) -> bytes:
        return self._core.state().tobytes()

    def capsule(self, coordinates: Coordinates, known: tuple[np.ndarray, Timed] | None = None) -> object:
        """The journaled problem for Ceres, in the coordinates of a search; the problem must outlive it.

        Args:
            known: a point w and the evaluation there with a Jacobian, which is not made again.
        """
        if known is None and self._journal is None and not coordinates.charts and isinstance(self._core, _core.Problem):
            return self._core.evaluation()

        def evaluated(w: np.ndarray, jacobian: bool) -> Timed:
            if known is not None and np.array_equal(w, known[0]):
                return known[1]
            (ok, r, J), seconds = self(coordinates.out(w), jacobian)
            return (ok, r, coordinates.jacobian(J, w) if jacobian and ok else J), seconds

        return _core.evaluation_of(self._core.rows, self._core.parameters, evaluated, bool(self._state()))
