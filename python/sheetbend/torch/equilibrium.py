"""Differentiable static equilibrium of scenes."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any, NamedTuple, NoReturn, cast

import numpy as np
from numpy.typing import ArrayLike
from torch import Tensor

from .. import _core
from ..arrays.types import Array
from ..errors import NoEquilibriumError, SceneError, refusal
from ..motion.core_terms import forces_by_group, pressures_by_volume
from ..motion.equilibrium import whole_start
from ..scene.given import check_scene
from ..scene.scene import Scene
from .compiled import not_traced
from .function import respond
from .inputs import InputMap, dtype_of


class Equilibrium(NamedTuple):
    """A state of rest.

    Attributes:
        positions: (*batch, particles, 3) m.
        forces: per group the multipliers (*batch, count, rows), as in `sheetbend.Equilibrium`.
        pressures: per volume that is kept (*batch,) Pa.
        nodes: (*batch, nodes, 3) m, the positions of all nodes, see `sheetbend.Trajectory.nodes`.
    """

    positions: Tensor
    forces: Mapping[str, Tensor]
    pressures: Mapping[str, Tensor]
    nodes: Tensor


class Equilibria:
    """Coordinates and multipliers (B, dofs + rows + volumes) of the equilibria for inputs (B, total), spread over
    threads."""

    def __init__(
        self, scene: Scene, start: Array | None, stable: bool, threads: int, replaced: Collection[str]
    ) -> None:
        self._scene, self._start, self._stable, self._threads = scene, start, stable, threads
        self._replaced = replaced
        self._kept: tuple[Array, list[_core.EquilibriumSolution]] | None = None

    def value(self, inputs: Array) -> Array:
        """Raises InputError where inputs are not finite or negative without sense, NoEquilibriumError."""
        return np.stack([np.concatenate([s.positions, s.multipliers]) for s in self._solutions(inputs)])

    def vjp(self, inputs: Array, states_bar: Array) -> Array:
        out: Array = _core.equilibria_vjp(self._solutions(inputs), states_bar, self._threads)
        return out

    def jvp(self, inputs: Array, inputs_dot: Array) -> Array:
        out: Array = _core.equilibria_jvp(self._solutions(inputs), inputs_dot, self._threads)
        return out

    def vjp_dot(self, *_: Array) -> NoReturn:
        raise NotImplementedError(
            "sheetbend.torch.equilibrium: second derivatives are not available. Fix: differentiate once"
        )

    def _solutions(self, inputs: Array) -> list[_core.EquilibriumSolution]:
        kept = self._kept
        if kept is not None and np.array_equal(kept[0], inputs):
            return kept[1]
        self._scene.compiled.domain.check_inputs(inputs, replaced=self._replaced)
        # jacrev and jacfwd repeat one scene once per row or column.
        rows, scene_of = np.unique(inputs, axis=0, return_inverse=True)
        try:
            distinct = _core.equilibria(self._scene.compiled.core, rows, self._start, self._stable, self._threads)
        except ValueError as error:
            raise refusal(error, SceneError, self._scene.name) from error
        for solution in distinct:
            if not solution.converged:
                raise NoEquilibriumError(f"{self._scene.name}: {solution.message}")
        solutions = [distinct[k] for k in scene_of.reshape(-1)]
        self._kept = inputs.copy(), solutions
        return solutions


@not_traced
def equilibrium(
    scene: Scene,
    start: ArrayLike | None = None,
    values: Mapping[str, Tensor | float] | None = None,
    inputs: Mapping[str, Tensor] | None = None,
    stable: bool = True,
    threads: int = 1,
) -> Equilibrium:
    """The equilibrium that a start leads to, differentiable in every tensor given, by the implicit function theorem.

    Once: second derivatives raise NotImplementedError. A batch is one call of the core, which spreads the scenes over
    threads: each takes its own steps, so they share no vector.

    The result is float32 if all tensors given are float32, else float64; everything is computed in float64.

    Args:
        scene: frozen by this call.
        start: (particles, 3) m, or (nodes, 3) m as of `sheetbend.simulate`, not differentiated; the scene's initial
            positions by default.
        values: quantities to change, by name: tensors (*batch,), or plain numbers.
        inputs: input arrays to replace, as in `simulate`.
        stable: leave saddles; False goes to the nearest equilibrium whatever its stability.
        threads: for a batch; the result does not depend on it.

    Raises:
        SceneError: the start has the wrong shape, or the forces of the scene have no energy.
        InputError: a tensor with an unknown name, of the wrong shape or dtype, on another device, not finite, or with a
            negative stiffness, mass or length; the message names the quantity and the scene of the batch.
        NoEquilibriumError: not converged; says how far it came and what to try.
    """
    check_scene(scene)
    x = None if start is None else whole_start(scene, start, scene.compiled.inputs())
    flat = InputMap(scene)(values, inputs)
    batch, dofs = flat.shape[:-1], scene.compiled.core.dofs
    equilibria = Equilibria(scene, x, stable, threads, tuple(inputs or ()))
    states = respond(equilibria, flat.reshape(-1, flat.shape[-1])).reshape(*batch, -1)
    states = states.to(dtype_of(values or {}, inputs or {}))
    multipliers: Any = states[..., dofs:]  # slices and reshapes only, so tensors pass
    forces, pressures = forces_by_group(scene, multipliers), pressures_by_volume(scene, multipliers)
    nodes = states[..., :dofs].reshape(*batch, -1, 3)
    return Equilibrium(nodes[..., : scene.particle_count, :], cast(Any, forces), cast(Any, pressures), nodes)
