"""Rollouts of one scene over batches of inputs, with their derivatives: the `Response` of a simulation."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any

import numpy as np

from ..arrays.types import Array
from ..errors import InputError
from ..scene.scene import Scene
from .core_terms import divergence
from .solver import Solver
from .tape import budget


class Rollouts:
    """Positions (B, frames, dofs) at the wanted substeps from inputs (B, total).

    A batch of several goes through the core in one call, eight scenes at a time in the lanes of a vector; a batch of
    one takes the scalar path. Both give the same bits.

    Args:
        core: the compiled solver of the scene.
        steps: wanted substeps, ascending.
        solver: its memory is the budget of a gradient.
        keep_tape: keep the tape of a single rollout for the `vjp` that will follow, which else records it again.
        lengths: (B,) how many of the steps each scene has; then it stands still, and those frames have no derivatives.
        replaced: names of the input arrays that were given as they are, for messages.
    """

    def __init__(
        self,
        scene: Scene,
        core: Any,
        steps: Sequence[int],
        keep_tape: bool,
        solver: Solver,
        lengths: Array | None = None,
        replaced: Collection[str] = (),
    ) -> None:
        self._scene, self._core, self._steps, self._keep_tape = scene, core, list(steps), keep_tape
        self._solver, self._lengths, self._replaced = solver, lengths, replaced
        self._kept: tuple[Array, Any] | None = None

    def value(self, inputs: Array) -> Array:
        """Positions. Raises InputError where inputs are not finite or negative without sense, DivergenceError."""
        self._scene.compiled.domain.check_inputs(inputs, replaced=self._replaced)
        lengths = self._lengths_of(inputs)
        out: Array
        with divergence(self._scene):
            if len(inputs) != 1 or lengths:
                out = self._core.simulate_batch(inputs, self._steps, 0.0, lengths)
                return out
            if self._keep_tape:
                out, tape = self._record(inputs)
                self._kept = inputs, tape  # no copy: torch itself refuses a saved tensor that has changed
            else:
                out = self._core.states(inputs[0], self._steps, 0.0)
            return out[None]

    def vjp(self, inputs: Array, states_bar: Array) -> Array:
        """One call of the core for the whole batch."""
        lengths = self._lengths_of(inputs)
        out: Array
        with divergence(self._scene), budget(self._solver):
            if len(inputs) != 1 or lengths:
                out = self._core.vjp_batch(inputs, self._steps, states_bar, 0.0, self._solver.budget, lengths)
                return out
            kept = self._kept
            tape = kept[1] if kept is not None and np.array_equal(kept[0], inputs) else self._record(inputs)[1]
            out = self._core.vjp(inputs[0], tape, self._steps, states_bar[0], 0.0)
            return out[None]

    def jvp(self, inputs: Array, inputs_dot: Array) -> Array:
        """One call for the whole batch; tangents of one scene share a rollout, eight at a time."""
        with divergence(self._scene):
            out: Array = self._core.jvp_batch(inputs, inputs_dot, self._steps, 0.0, self._lengths_of(inputs))
        return out

    def vjp_dot(self, inputs: Array, inputs_dot: Array, states_bar: Array, states_bar_dot: Array) -> Array:
        """One call for the whole batch, one rollout per scene."""
        lengths, memory = self._lengths_of(inputs), self._solver.budget
        bars = states_bar, states_bar_dot
        with divergence(self._scene), budget(self._solver):
            out: Array = self._core.vjp_dot_batch(inputs, inputs_dot, self._steps, *bars, 0.0, memory, lengths)
        return out

    def _lengths_of(self, inputs: Array) -> list[int]:
        """Numbers of frames of the batch's scenes; empty where all scenes have every frame."""
        if self._lengths is None:
            return []
        if len(self._lengths) != len(inputs):
            fix = "give the batch as leading dimensions instead of through torch.func.vmap"
            raise InputError("lengths", f"are those of {len(self._lengths)} scenes", len(inputs), fix)
        return [int(n) for n in self._lengths]

    def _record(self, inputs: Array) -> tuple[Array, Any]:
        with budget(self._solver):
            states, tape = self._core.record(inputs[0], self._steps, 0.0, self._solver.budget)
        return states, tape
