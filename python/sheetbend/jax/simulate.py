"""Differentiable simulation of scenes under JAX."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import given_by_name
from ..errors import InputError, choices
from ..motion.core_terms import substeps
from ..motion.rollouts import Rollouts
from ..motion.solver import Solver
from ..scene.given import check_scene
from ..scene.scene import Scene
from .flat import FlatInputs


def simulate(
    scene: Scene,
    times: ArrayLike,
    solver: Solver | None = None,
    values: Mapping[str, jax.Array | float] | None = None,
    inputs: Mapping[str, jax.Array] | None = None,
    nodes: bool = False,
) -> jax.Array:
    """Positions of a simulated scene, differentiable once in reverse mode with respect to every array given.

    Works under `jax.jit`, `grad`, `vjp`, `jacrev` and `vmap`; a batch of `vmap` is one call of the core, eight scenes
    to a vector. Forward mode and second derivatives are not available: `sheetbend.torch.simulate` has them. Backward
    simulates once more.

    Args:
        scene: frozen by this call.
        times: (frames,) s on the substep grid.
        solver: `Solver()` by default.
        values: quantities to change, by name: scalars.
        inputs: input arrays to replace, by name, as in `sheetbend.torch.simulate`, without batch dimensions.
        nodes: return the positions of all nodes, as of `sheetbend.torch.simulate`.

    Returns:
        (frames, particles, 3) m, or (frames, nodes, 3) m; float64 where JAX has 64-bit numbers, else float32.

    Raises:
        InputError: times off the grid, unknown names, wrong shapes. Values outside their range and motions that diverge
            are found while the program runs; JAX then raises its own error with the package's message.
    """
    check_scene(scene)
    values, inputs = given_by_name("values", values), given_by_name("inputs", inputs)
    solver = Solver.given(solver)
    compiled, steps = scene.compiled, substeps(times, solver.h)
    named, arrays = _quantities(scene, values), _arrays(scene, inputs)
    rollouts = Rollouts(scene, solver.core(compiled), steps, False, solver, replaced=tuple(arrays))
    flat = FlatInputs(compiled, rollouts, tuple(named), tuple(arrays), nodes)
    kind = jnp.result_type(float)
    theta = jnp.stack([jnp.asarray(v, kind) for v in named.values()]) if named else jnp.zeros(0, kind)
    shape = (len(steps), compiled.nodes if nodes else compiled.particles, 3)
    return _function(flat, jax.ShapeDtypeStruct(shape, kind))(theta, [jnp.asarray(a, kind) for a in arrays.values()])


def _function(flat: FlatInputs, out: jax.ShapeDtypeStruct) -> Any:
    """Positions of (theta, arrays), as callbacks; under vmap all arguments get the mapped dimensions."""

    def called(f: Any, result: Any, *args: Any) -> Any:
        def on_numpy(*given: Any) -> Any:
            found = f(*jax.tree.map(np.asarray, given))
            return jax.tree.map(lambda a: np.asarray(a, out.dtype), found)

        return jax.pure_callback(on_numpy, result, *args, vmap_method="broadcast_all")

    positions = jax.custom_vjp(lambda theta, arrays: called(flat.positions, out, theta, arrays))

    def forward(theta: jax.Array, arrays: Sequence[jax.Array]) -> tuple[jax.Array, Any]:
        return positions(theta, arrays), (theta, arrays)

    def backward(given: Any, bar: jax.Array) -> Any:
        result = jax.tree.map(lambda a: jax.ShapeDtypeStruct(a.shape, out.dtype), given)
        return called(flat.vjp, result, *given, bar)

    positions.defvjp(forward, backward)
    return positions


def _quantities(scene: Scene, values: Mapping[str, Any]) -> dict[str, Any]:
    names = scene.compiled.names
    for name, value in values.items():
        if name not in names:
            raise InputError(f"values.{name}", "is not a quantity of the scene", name, choices(name, names))
        if jnp.shape(value) != ():
            raise InputError(f"values.{name}", "is not a scalar", jnp.shape(value), "use jax.vmap for batches")
    return dict(values)


def _arrays(scene: Scene, inputs: Mapping[str, Any]) -> dict[str, Any]:
    shapes = {name: shape for name, shape in scene.compiled.shapes.items() if math.prod(shape)}
    for name, array in inputs.items():
        if name not in shapes:
            raise InputError(f"inputs.{name}", "is not an input array of the scene", name, choices(name, shapes))
        if jnp.shape(array) != shapes[name]:
            fix = f"give {shapes[name]}; use jax.vmap for batches"
            raise InputError(f"inputs.{name}", "has the wrong shape", jnp.shape(array), fix)
    return dict(inputs)
