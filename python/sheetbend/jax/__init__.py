"""JAX: simulations as differentiable functions of arrays, for jit, grad, vjp, jacrev and vmap.

The only part of sheetbend that imports jax. A simulation runs on the CPU as a callback, in float64 inside. Its arrays
are float64 after `jax.config.update("jax_enable_x64", True)`, and otherwise float32, as everywhere in JAX.
"""

from ..optional import require

require("jax", "jax")

from .simulate import simulate  # noqa: E402

__all__ = ["simulate"]
