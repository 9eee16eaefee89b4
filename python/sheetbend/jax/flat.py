"""The flat inputs of a scene from its quantities and replaced arrays, and back, in NumPy: what a callback computes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..arrays.types import Array
from ..motion.inputs_of_quantities import InputsOfQuantities
from ..motion.rollouts import Rollouts
from ..scene.compiled import CompiledScene


class FlatInputs:
    """Positions of one scene at its frames, and their reverse, with respect to quantities and to input arrays.

    Leading dimensions are a batch, which goes through the core in one call.

    Args:
        compiled: the scene.
        rollouts: of its frames.
        names: of the quantities that are given.
        arrays: of the input arrays that are given.
        nodes: show all nodes, not particles alone.
    """

    def __init__(
        self,
        compiled: CompiledScene,
        rollouts: Rollouts,
        names: Sequence[str],
        arrays: Sequence[str],
        nodes: bool = False,
    ) -> None:
        self._compiled, self._rollouts, self._of_quantities = compiled, rollouts, InputsOfQuantities(compiled)
        self._shown = compiled.nodes if nodes else compiled.particles
        self._columns = [compiled.names.index(name) for name in names]
        self._places = [slice(o, o + n) for o, n in (compiled.given[name] for name in arrays)]

    def positions(self, theta: Array, arrays: Sequence[Array]) -> Array:
        """(*batch, frames, particles or nodes, 3) m from theta (*batch, names) and arrays (*batch, ...)."""
        batch = theta.shape[:-1]
        states = self._rollouts.value(self._inputs(*self._rows(theta, arrays)))
        return states.reshape(*batch, *states.shape[1:-1], -1, 3)[..., : self._shown, :]

    def vjp(self, theta: Array, arrays: Sequence[Array], bar: Array) -> tuple[Array, list[Array]]:
        """Cotangents of theta and of the arrays."""
        every, rows = self._rows(theta, arrays)
        states_bar = np.zeros((len(every), bar.shape[-3], self._compiled.nodes, 3))
        states_bar[..., : self._shown, :] = np.asarray(bar, dtype=float).reshape(len(every), *bar.shape[-3:])
        inputs_bar = self._rollouts.vjp(self._inputs(every, rows), states_bar.reshape(len(every), bar.shape[-3], -1))
        arrays_bar = [inputs_bar[:, p].reshape(a.shape) for p, a in zip(self._places, arrays, strict=True)]
        kept = inputs_bar.copy()
        for place in self._places:
            kept[:, place] = 0.0  # what was given itself does not follow from quantities
        return self._of_quantities.vjp(every, kept)[:, self._columns].reshape(theta.shape), arrays_bar

    def _rows(self, theta: Array, arrays: Sequence[Array]) -> tuple[Array, list[Array]]:
        """All quantities (batch, quantities), and the arrays (batch, numbers)."""
        given = np.asarray(theta, dtype=float).reshape(-1, theta.shape[-1]) if theta.shape[-1] else None
        count = int(np.prod(theta.shape[:-1], dtype=int))
        every = np.tile(self._compiled.theta, (count, 1))
        if given is not None:
            every[:, self._columns] = given
        return every, [np.asarray(a, dtype=float).reshape(count, -1) for a in arrays]

    def _inputs(self, every: Array, rows: Sequence[Array]) -> Array:
        inputs = self._of_quantities.value(every)
        for place, row in zip(self._places, rows, strict=True):
            inputs[:, place] = row
        return inputs
