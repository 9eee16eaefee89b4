"""Ropes that a benchmark runs: one of them or all, forward or with the gradient of the sum of the last coordinates."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from sheetbend.motion.solver import Solver
from sheetbend.scene.compiled import CompiledScene

from .timing import timed
from .workloads import Array


class Ropes:
    """Ropes of one topology, ready to run for so many substeps; inputs (ropes, inputs) tell them apart."""

    def __init__(self, scene: CompiledScene, inputs: Array, solver: Solver, substeps: int) -> None:
        self.inputs = inputs
        self.core = solver.core(scene)
        self.steps = [substeps]
        self._bar = np.ones((len(inputs), 1, scene.core.dofs))

    def forward(self) -> None:
        """One rope."""
        self.core.states(self.inputs[0], self.steps, 0.0)

    def gradient(self) -> Array:
        """One rope: (inputs,)."""
        _, tape = self.core.record(self.inputs[0], self.steps, 0.0)
        return self.core.vjp(self.inputs[0], tape, self.steps, self._bar[0], 0.0)

    def jacobian(self, directions: Array) -> None:
        """One rope, along (directions, inputs)."""
        self.core.jvp(self.inputs[0], directions, self.steps, 0.0)

    def all_forward(self) -> None:
        """All ropes in one call."""
        self.core.simulate_batch(self.inputs, self.steps, 0.0)

    def all_gradients(self) -> None:
        """All ropes in one call."""
        self.core.vjp_batch(self.inputs, self.steps, self._bar, 0.0)

    def singly(self, work: Callable[[], object]) -> None:
        """The same work once per rope, one after the other."""
        for _ in self.inputs:
            work()

    def batch_figures(self, repeats: int, work: int) -> dict[str, float]:
        """Times of all ropes in one call, forward and with the gradient, and of one after the other (`..._singly`),
        per unit of so much work. The gradient of a batch is one call that includes its forward run."""
        found: dict[str, float] = {}
        for name, together, alone in (
            ("forward", self.all_forward, self.forward),
            ("gradient", self.all_gradients, self.gradient),
        ):
            batched, _ = timed(together, repeats)
            singly, _ = timed(partial(self.singly, alone), repeats)
            found |= batched.figures(name, work) | singly.figures(f"{name}_singly", work)
        return found

    def gradient_error(self) -> float:
        """Of the adjoint on one rope, along a fixed random direction of all inputs, relative to complex step."""
        direction = np.random.default_rng(5).standard_normal(self.inputs.shape[1]) * np.abs(self.inputs[0])
        wanted = self.core.complex_step(self.inputs[0], direction, self.steps, 0.0).sum()
        return float(abs(np.vdot(self.gradient(), direction) / wanted - 1))
