"""The flat inputs of a scene as a differentiable function of the tensors of its named quantities and arrays."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import torch
from torch import Tensor

from ..arrays.checks import given_by_name
from ..errors import InputError, choices
from ..motion.inputs_of_quantities import InputsOfQuantities
from ..scene.scene import Scene
from .function import respond

NEEDS = {
    "force": "scene.add_force(particles, forces)",
    "boundary": "scene.drive(particles, times, positions)",
    "wind": "scene.set_wind(velocity)",
    "pressure": "scene.add_pressure(triangles, ...)",
}
"""What gives a scene the arrays that it may lack."""


class InputMap:
    """The map from tensors by name to flat inputs (*batch, total)."""

    def __init__(self, scene: Scene) -> None:
        compiled = scene.compiled
        self._names, self._layout = compiled.names, compiled.layout
        self._given = compiled.given
        self._without_effect = _without_effect(scene)
        self._shapes = compiled.shapes
        self._theta = torch.tensor(compiled.theta, dtype=torch.float64)
        self._of_quantities = InputsOfQuantities(compiled)

    def __call__(
        self, values: Mapping[str, Tensor | float] | None, inputs: Mapping[str, Tensor] | None = None
    ) -> Tensor:
        """Quantities (*batch,) and arrays (*batch, ...), whose batch dimensions broadcast, to (*batch, total).

        Raises:
            InputError: unknown name, not a tensor, no floating type, not on the CPU, wrong shape, batches that do not
                broadcast, arrays without effect in this scene, values outside the range of their quantity.
        """
        values, arrays = given_by_name("values", values), given_by_name("inputs", inputs)
        batches = {name: self._batch_of_value(name, value) for name, value in values.items()}
        batches |= {name: self._batch_of_array(name, array) for name, array in arrays.items()}
        batch = broadcast(batches)
        theta = self._quantities(values, batch)
        flat = respond(self._of_quantities, theta.reshape(math.prod(batch), theta.shape[-1])).reshape(*batch, -1)
        if not arrays:
            return flat
        parts = []
        for name, (offset, size) in self._layout.items():
            start, own = offset, self._given[name][1]
            if name in arrays:
                parts.append(arrays[name].double().reshape(*batches[name], own).expand(*batch, own))
                start += own  # hidden nodes stay
            parts.append(flat[..., start : offset + size])
        return torch.cat(parts, -1)

    def _batch_of_value(self, name: str, value: Tensor | float) -> tuple[int, ...]:
        field = f"values.{name}"
        if name not in self._names and name in self._layout:
            fix = f"give it in `inputs`: inputs={{{name!r}: ...}}"
            raise InputError(field, "is an input array of the scene, and no quantity", name, fix)
        if name not in self._names:
            raise InputError(field, "is not a quantity of the scene", name, choices(name, self._names))
        return () if isinstance(value, int | float) else _dense(field, value)

    def _batch_of_array(self, name: str, array: Tensor) -> tuple[int, ...]:
        field = f"inputs.{name}"
        present = [n for n, (_, size) in self._given.items() if size > 0]
        if name not in present:
            fix = f"call {NEEDS[name]} first" if name in NEEDS else choices(name, present)
            raise InputError(field, "is not an input array of the scene", name, fix)
        if name in self._without_effect:
            raise InputError(field, "has no effect on this scene", name, self._without_effect[name])
        shape, wanted = _dense(field, array), self._shapes[name]
        dims = len(shape) - len(wanted)
        if dims < 0 or shape[dims:] != wanted:
            raise InputError(field, "has the wrong shape", shape, f"give {wanted}, batch dimensions before it if any")
        return shape[:dims]

    def _quantities(self, values: Mapping[str, Tensor | float], batch: tuple[int, ...]) -> Tensor:
        """(*batch, quantities)."""
        if not values:
            return self._theta.expand(*batch, -1)
        each = [values.get(name, default) for name, default in zip(self._names, self._theta, strict=True)]
        return torch.stack([torch.as_tensor(v, dtype=torch.float64).expand(batch) for v in each], -1)


def dtype_of(values: Mapping[str, Tensor | float], arrays: Mapping[str, Tensor]) -> torch.dtype:
    """What comes of these: float32 where all tensors are, else float64."""
    own = {t.dtype for t in (*values.values(), *arrays.values()) if isinstance(t, Tensor)}
    return torch.float32 if own == {torch.float32} else torch.float64


def _without_effect(scene: Scene) -> dict[str, str]:
    """The arrays that the scene has no use for, and what gives it one."""
    found = {}
    if not scene.has_drag:
        found = dict.fromkeys(("drag_linear", "drag_quadratic"), "call scene.set_drag first (zero will do)")
    if not any(g.damped for g in scene.groups):
        found["damping"] = "add a group with damping (zero will do)"
    return found


def _dense(field: str, tensor: object) -> tuple[int, ...]:
    """The shape of a dense tensor of floats on the CPU, or an error that says what else it is."""
    if not isinstance(tensor, Tensor):
        fix = "give a torch tensor of float64 or float32"
        raise InputError(field, "is not a tensor", type(tensor).__name__, fix)
    if tensor.device.type != "cpu":
        raise InputError(field, "is not on the CPU", str(tensor.device), "move it there with .cpu()")
    if tensor.dtype not in (torch.float64, torch.float32):
        raise InputError(field, "is not float64 or float32", str(tensor.dtype), "convert it with .double()")
    if tensor.layout != torch.strided:
        raise InputError(field, "is not dense", str(tensor.layout), "convert it with .to_dense()")
    return tuple(tensor.shape)


def broadcast(batches: Mapping[str, tuple[int, ...]]) -> tuple[int, ...]:
    try:
        batch = np.broadcast_shapes(*batches.values())
    except ValueError as error:
        fix = "give all the same batch dimensions, or none"
        raise InputError("batch", "dimensions do not broadcast", dict(batches), fix) from error
    if math.prod(batch) == 0:
        raise InputError("batch", "is empty", batch, "give at least one scene")
    return batch
