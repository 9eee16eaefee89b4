"""Extrapolation in time: rollouts at h, h/2 and h/4 are combined at the frames, so that their leading errors cancel.

BDF2 errs by c h^2 + d h^3 + ... where the motion is smooth. Two runs leave h^3, three leave h^4 (Richardson's deferred
approach to the limit). The combination is linear in the states, so its derivatives are the same combination of
derivatives.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .. import _core
from ..arrays.types import Array
from ..errors import InputError

ORDERS = {"bdf1": 1, "bdf2": 2}
MOST = 3  # runs


def weights(integrator: str, runs: int) -> tuple[float, ...]:
    """Weights of the runs at h, h/2, ... in their combination: (-1, 4)/3 and (1, -12, 32)/21 for BDF2."""
    rows = list(np.eye(runs))
    for order in range(ORDERS[integrator], ORDERS[integrator] + runs - 1):
        rows = [(2**order * finer - row) / (2**order - 1) for row, finer in pairwise(rows)]
    return tuple(rows[0].tolist())


@dataclass(frozen=True)
class _Plan:
    """Tape plans of all runs together, with the numbers of `_core.TapePlan`."""

    steps: int
    states: int
    recomputed: int
    inputs: int
    frames: int
    plan: int
    forward: int
    reverse: int
    heap: int
    tape: int
    least: int


@dataclass(frozen=True)
class _Tapes:
    """The tapes of all runs."""

    each: tuple[Any, ...]

    @property
    def bytes(self) -> int:
        return sum(tape.bytes for tape in self.each)

    @property
    def recomputed(self) -> int:
        return sum(tape.recomputed for tape in self.each)


class Extrapolated:
    """Solvers of one scene at h, h/2, ..., called as the one at h: steps count substeps of h."""

    def __init__(self, solvers: Sequence[_core.Solver], weights: Sequence[float]) -> None:
        self._runs = tuple(zip(solvers, weights, strict=True))

    def simulate(self, inputs: ArrayLike, steps: Sequence[int], t0: float) -> dict[str, Array]:
        """Positions, velocities and multipliers, each combined; what is counted is that of the run at h, whose own
        positions are "uncombined"."""
        found = [(s.simulate(inputs, own, t0), w) for s, own, w in self._each(steps)]
        first, states = found[0][0], ("positions", "velocities", "multipliers")
        return (
            first
            | {"uncombined": first["positions"]}
            | {name: self._sum(w * np.asarray(out[name]) for out, w in found) for name in states}
        )

    def states(self, inputs: ArrayLike, steps: Sequence[int], t0: float) -> Array:
        return self._sum(w * s.states(inputs, own, t0) for s, own, w in self._each(steps))

    def simulate_batch(self, inputs: ArrayLike, steps: Sequence[int], t0: float, lengths: Sequence[int] = ()) -> Array:
        return self._sum(w * s.simulate_batch(inputs, own, t0, lengths) for s, own, w in self._each(steps))

    def jvp(self, inputs: ArrayLike, inputs_dot: ArrayLike, steps: Sequence[int], t0: float) -> tuple[Array, Array]:
        found = [(s.jvp(inputs, inputs_dot, own, t0), w) for s, own, w in self._each(steps)]
        return self._sum(w * x for (x, _), w in found), self._sum(w * x_dot for (_, x_dot), w in found)

    def complex_step(self, inputs: ArrayLike, direction: ArrayLike, steps: Sequence[int], t0: float) -> Array:
        return self._sum(w * s.complex_step(inputs, direction, own, t0) for s, own, w in self._each(steps))

    def redundant_constraints(self, inputs: ArrayLike, t0: float) -> list[int]:
        """Those that any of the runs leaves out, ascending, with those that they follow from."""
        return sorted({k for s, _ in self._runs for k in s.redundant_constraints(inputs, t0)})

    def jvp_batch(
        self, inputs: ArrayLike, inputs_dot: ArrayLike, steps: Sequence[int], t0: float, lengths: Sequence[int] = ()
    ) -> Array:
        return self._sum(w * s.jvp_batch(inputs, inputs_dot, own, t0, lengths) for s, own, w in self._each(steps))

    def record(
        self, inputs: ArrayLike, steps: Sequence[int], t0: float, memory: int | None = None
    ) -> tuple[Array, _Tapes]:
        """States, and one tape per run; all of them share the budget."""
        shares = self._shares(steps, memory)
        found = [
            (*s.record(inputs, own, t0, share), w) for (s, own, w), share in zip(self._each(steps), shares, strict=True)
        ]
        return self._sum(w * x for x, _, w in found), _Tapes(tuple(tape for _, tape, _ in found))

    def vjp(self, inputs: ArrayLike, tape: _Tapes, steps: Sequence[int], x_bar: ArrayLike, t0: float) -> Array:
        runs = zip(self._each(steps), tape.each, strict=True)
        return self._sum(w * s.vjp(inputs, one, own, x_bar, t0) for (s, own, w), one in runs)

    def reverse(
        self, inputs: ArrayLike, tape: _Tapes, steps: Sequence[int], x_bar: ArrayLike, t0: float
    ) -> tuple[Array, int]:
        """`vjp`, and the substeps that were computed again for it."""
        runs = zip(self._each(steps), tape.each, strict=True)
        found = [(s.reverse(inputs, one, own, x_bar, t0), w) for (s, own, w), one in runs]
        return self._sum(w * bar for (bar, _), w in found), sum(again for (_, again), _ in found)

    def vjp_batch(
        self,
        inputs: ArrayLike,
        steps: Sequence[int],
        x_bar: ArrayLike,
        t0: float,
        memory: int | None = None,
        lengths: Sequence[int] = (),
    ) -> Array:
        return self._sum(w * s.vjp_batch(inputs, own, x_bar, t0, memory, lengths) for s, own, w in self._each(steps))

    def vjp_dot_batch(
        self,
        inputs: ArrayLike,
        inputs_dot: ArrayLike,
        steps: Sequence[int],
        x_bar: ArrayLike,
        x_bar_dot: ArrayLike,
        t0: float,
        memory: int | None = None,
        lengths: Sequence[int] = (),
    ) -> Array:
        return self._sum(
            w * s.vjp_dot_batch(inputs, inputs_dot, own, x_bar, x_bar_dot, t0, memory, lengths)
            for s, own, w in self._each(steps)
        )

    def tape_plan(self, steps: Sequence[int], scenes: int = 1, memory: int | None = None) -> _Plan:
        """The plan of all runs. Those of one scene run together, since their tapes are kept side by side; those of a
        batch take turns and have the whole budget each."""
        shares = self._shares(steps, memory) if scenes == 1 else [memory] * len(self._runs)
        plans = [s.tape_plan(own, scenes, share) for (s, own, _), share in zip(self._each(steps), shares, strict=True)]
        return _Plan(**{name: sum(getattr(plan, name) for plan in plans) for name in _Plan.__dataclass_fields__})

    def force_balance(self, inputs: ArrayLike, steps: int, t0: float) -> list[list[list[float]]]:
        raise InputError(
            "solver.extrapolate", "has no balance of forces of its own", len(self._runs), "ask with extrapolate=1"
        )

    def _each(self, steps: Sequence[int]) -> Iterator[tuple[_core.Solver, list[int], float]]:
        for k, (solver, weight) in enumerate(self._runs):
            yield solver, [2**k * step for step in steps], weight

    def _shares(self, steps: Sequence[int], memory: int | None) -> list[int | None]:
        """The budget of each run: the least that it needs, and of the rest as its substeps are to all."""
        if memory is None:
            return [None] * len(self._runs)
        least = [s.tape_plan(own, 1, None).least for s, own, _ in self._each(steps)]
        if memory < sum(least):
            error = _core.BudgetTooSmall(f"memory: the gradient needs at least {sum(least)} bytes")
            error.needed = sum(least)
            raise error
        parts = 2 ** np.arange(len(self._runs)) / (2 ** len(self._runs) - 1)
        return [own + int(part * (memory - sum(least))) for own, part in zip(least, parts, strict=True)]

    @staticmethod
    def _sum(parts: Iterator[Array]) -> Array:
        """The sum in the order of the runs, so that it has the same bits for any number of threads."""
        total = next(parts)
        for part in parts:
            total = total + part
        return total
