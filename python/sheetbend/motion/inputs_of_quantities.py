"""The flat inputs of a scene from its quantities, with their derivatives: a `Response`, as `Rollouts` is."""

from __future__ import annotations

import numpy as np

from ..arrays.types import Array
from ..scene.compiled import CompiledScene


class InputsOfQuantities:
    """Inputs (B, total) from quantities (B, names), computed by the core one scene after the other."""

    def __init__(self, compiled: CompiledScene) -> None:
        self._map, self._domain = compiled.map_of_quantities, compiled.domain

    def value(self, theta: Array) -> Array:
        """Inputs. Raises SceneError where a quantity is outside its range."""
        self._domain.check_quantities(theta)
        return np.stack([self._map.inputs(one) for one in theta])

    def vjp(self, theta: Array, inputs_bar: Array) -> Array:
        """Cotangents of the quantities."""
        return np.stack([self._map.theta_bar(*pair) for pair in zip(theta, inputs_bar, strict=True)])

    def jvp(self, theta: Array, theta_dot: Array) -> Array:
        """Tangents of the inputs."""
        return np.stack([self._map.inputs_dot(*pair) for pair in zip(theta, theta_dot, strict=True)])

    def vjp_dot(self, theta: Array, theta_dot: Array, inputs_bar: Array, inputs_bar_dot: Array) -> Array:
        """Derivative of `vjp` along (theta_dot, inputs_bar_dot)."""
        rows = zip(theta, theta_dot, inputs_bar, inputs_bar_dot, strict=True)
        return np.stack([self._map.theta_bar_dot(*row)[1] for row in rows])
