"""Rollouts of one scene over batches of inputs, with their derivatives: the `Response` of a simulation."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..errors import InputError
from ..scene import Scene
from ..simulate import divergence
from ..solver import Solver
from ..tape import budget

Array = np.ndarray


class Rollouts:
    """Positions (B, frames, dofs) at the wanted substeps from inputs (B, total).

    A batch of several goes through the core in one call, eight scenes at a time in the lanes of a vector; a batch of
    one takes the scalar path. Both give the same bits.

    Args:
        core: the compiled solver of the scene.
        steps: wanted substeps, ascending.
        solver: its memory is the budget of a gradient.
        keep_tape: keep the tape of a single rollout for the `vjp` that will follow, which else records it again.
    """

    def __init__(self, scene: Scene, core: Any, steps: Sequence[int], keep_tape: bool, solver: Solver) -> None:
        self._scene, self._core, self._steps, self._keep_tape = scene, core, list(steps), keep_tape
        self._solver = solver
        self._kept: tuple[Array, Any] | None = None

    def value(self, inputs: Array) -> Array:
        """Positions. Raises InputError where inputs are not finite, DivergenceError."""
        expect_finite(self._scene, inputs)
        out: Array
        with divergence(self._scene):
            if len(inputs) != 1:
                out = self._core.simulate_batch(inputs, self._steps, 0.0)
                return out
            if self._keep_tape:
                out, tape = self._record(inputs)
                self._kept = inputs, tape  # no copy: torch itself refuses a saved tensor that has changed
            else:
                out = self._core.states(inputs[0], self._steps, 0.0)
            return out[None]

    def vjp(self, inputs: Array, states_bar: Array) -> Array:
        """One call of the core for the whole batch."""
        out: Array
        with divergence(self._scene), budget(self._solver):
            if len(inputs) != 1:
                out = self._core.vjp_batch(inputs, self._steps, states_bar, 0.0, self._solver.budget)
                return out
            kept = self._kept
            tape = kept[1] if kept is not None and np.array_equal(kept[0], inputs) else self._record(inputs)[1]
            out = self._core.vjp(inputs[0], tape, self._steps, states_bar[0], 0.0)
            return out[None]

    def jvp(self, inputs: Array, inputs_dot: Array) -> Array:
        """One call per distinct scene, eight tangents to a rollout: the core has no lanes of scenes for tangents."""
        out = np.empty((len(inputs), len(self._steps), self._scene.compiled.core.dofs))
        _, first, scene_of = np.unique(inputs, axis=0, return_index=True, return_inverse=True)
        scene_of = scene_of.reshape(-1)
        with divergence(self._scene):
            for k, row in enumerate(first):
                same = scene_of == k
                out[same] = self._core.jvp(inputs[row], inputs_dot[same], self._steps, 0.0)[1]
        return out

    def vjp_dot(self, inputs: Array, inputs_dot: Array, states_bar: Array, states_bar_dot: Array) -> Array:
        """One call per scene of the batch: the core has no lanes for second derivatives."""
        out = np.empty_like(inputs)
        with divergence(self._scene), budget(self._solver):
            for b in range(len(inputs)):
                out[b] = self._core.vjp_dot(
                    inputs[b], inputs_dot[b], self._steps, states_bar[b], states_bar_dot[b], 0.0, self._solver.budget
                )[1]
        return out

    def _record(self, inputs: Array) -> tuple[Array, Any]:
        with budget(self._solver):
            states, tape = self._core.record(inputs[0], self._steps, 0.0, self._solver.budget)
        return states, tape


def expect_finite(scene: Scene, inputs: Array) -> None:
    """Raises InputError that names the array and the scene of the batch where inputs (B, total) are not finite."""
    bad = np.argwhere(~np.isfinite(inputs))
    if len(bad) == 0:
        return
    row, column = bad[0].tolist()
    array = next(name for name, (offset, size) in scene.compiled.layout.items() if offset <= column < offset + size)
    where = f" in scene {row} of the batch" if len(inputs) > 1 else ""
    raise InputError(array, f"is not finite{where}", float(inputs[row, column]), "check the values and arrays given")
