"""Derivatives of a loss of a rollout by two paths that do not use the adjoint: complex step, and differences."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from .. import _core

DIFFERENCES_BOUND = 1e-4
STEP_FACTORS = (1.0, 1e2, 1e-2, 1e4)  # the first whose own error is far below the bound is enough
ENOUGH = 0.05  # of the differences' bound
FELT = 1e-2  # of the loss: what a step of the size of an entry that is zero moves
LOUD = 10.0  # times what other last digits of the inputs moved: what is taken for noise
JITTERS = 2  # inputs with other last digits, on which noise is measured


def jittered(inputs: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """The inputs, changed by rounding errors."""
    return np.asarray(inputs * (1.0 + np.finfo(float).eps * rng.standard_normal(len(inputs))))


class Probe:
    """Derivatives of the loss along directions of the inputs, by the two independent paths.

    Attributes:
        rounding: what the loss changes by when its positions are rounded.
        loudness: what it changes by, beyond its gradient, when the last digits of its inputs do: more in a stiff scene.
    """

    def __init__(
        self, core: Any, inputs: np.ndarray, steps: Sequence[int], weights: np.ndarray, adjoint: np.ndarray
    ) -> None:
        self.core, self.inputs, self.steps, self.weights = core, inputs, steps, weights
        self.loss_size = float(np.abs(core.simulate(inputs, steps, 0.0)["positions"] * weights).sum())
        self.rounding = np.finfo(float).eps * self.loss_size
        rng, here = np.random.default_rng(3), self.loss(inputs)
        moved = [(x, self.loss(x) - here) for x in (jittered(inputs, rng) for _ in range(JITTERS))]
        self.loudness = max(self.rounding, LOUD * max(abs(by - float(adjoint @ (x - inputs))) for x, by in moved))

    def complex_step(self, direction: np.ndarray) -> float:
        return float((self.core.complex_step(self.inputs, direction, self.steps, 0.0) * self.weights).sum())

    def noise(self, direction: np.ndarray, exact: float) -> float:
        """How much the complex step changes when the last digits of the inputs do."""
        rng, plain = np.random.default_rng(2), self.inputs
        found = []
        for _ in range(JITTERS):
            self.inputs = jittered(plain, rng)
            found.append(abs(self.complex_step(direction) - exact))
        self.inputs = plain
        return max(found)

    def loss(self, inputs: np.ndarray) -> float:
        return float((self.core.simulate(inputs, self.steps, 0.0)["positions"] * self.weights).sum())

    def size(self, value: float, least: float, positive: bool, exact: float) -> float:
        """What a step of an entry is judged against: a number's own size, however small, where it must be positive.
        Where it is zero, no unit tells a size, but what the loss feels does."""
        if positive and value > 0:
            return value
        if value == 0.0 and exact != 0.0:
            return min(least, FELT * self.loss_size / abs(exact))
        return max(abs(value), least)

    def differences(self, direction: np.ndarray, step: float, exact: float) -> tuple[float, float]:
        """Central differences with one Richardson step, and their error, at the first step size where that is small, or
        at the one where truncation and rounding together are least, among those that agree with smaller ones.

        No single step suits all: rounding drowns a faint gradient at small ones, and rigid links turn soft at large
        ones. How much halving the step changes the differences tells their truncation error (Ridders 1982).
        """
        found: list[tuple[float, float, float]] = []  # size, differences, error
        for factor in STEP_FACTORS:
            size = step * factor
            try:
                coarse, fine = self._central(direction, size), self._central(direction, size / 2.0)
            except (_core.Diverged, _core.Unconverged):  # a step as large as a mass
                continue
            found.append((size, (4.0 * fine - coarse) / 3.0, abs(fine - coarse) + self.loudness / size))
            if found[-1][2] <= ENOUGH * DIFFERENCES_BOUND * abs(exact):
                break
        best = np.nan, np.inf
        for _, value, error in sorted(found):  # a loss that stops to change at large steps has no derivative of zero
            if error < best[1] and (np.isinf(best[1]) or abs(value - best[0]) <= error + best[1]):
                best = value, error
        return best

    def _central(self, direction: np.ndarray, step: float) -> float:
        return (self.loss(self.inputs + step * direction) - self.loss(self.inputs - step * direction)) / (2.0 * step)
