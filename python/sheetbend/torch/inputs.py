"""The flat inputs of a scene as torch operations on the tensors of its named quantities and arrays."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor
from torch.autograd import Function

from ..arrays.checks import given_by_name
from ..errors import InputError, choices
from ..quantities.quantities import FUNCTIONS
from ..scene.scene import Scene

_TORCH: Mapping[str, Callable[[Tensor], Tensor]] = {
    "identity": lambda x: x,
    "inverse": torch.reciprocal,
    "square": torch.square,
    "sin": torch.sin,
    "cos": torch.cos,
    "sqrt": torch.sqrt,
    "inverse_sqrt": torch.rsqrt,
    "over_one_plus": lambda x: 1.0 / (1.0 + x),
    "over_one_minus_twice": lambda x: 1.0 / (1.0 - 2.0 * x),
}

NEEDS = {
    "force": "scene.add_force(particles, forces)",
    "boundary": "scene.drive(particles, times, positions)",
    "wind": "scene.set_wind(velocity)",
    "pressure": "scene.add_pressure(triangles, ...)",
}
"""What gives a scene the arrays that it may lack."""


class ParameterMap:
    """inputs[target] = base[target] + sum of coefficient * (prod f(theta) * exp(sum weight * theta)), in the order of
    adjoint/observe/parameter_map.h.

    Plain torch operations, so every transform differentiates and batches it by itself. Intermediate values stand before
    theta. Each step computes those that are made of earlier ones, and the last step computes the inputs.
    """

    def __init__(self, scene: Scene) -> None:
        arrays = scene.compiled.map()
        self._base = torch.tensor(arrays["base"], dtype=torch.float64)
        depth, made = _depths(arrays), max(0, -int(arrays["target"].min(initial=0)))
        self._intermediates, last = made, int(depth.max(initial=0))
        self._steps = [_Step.of(arrays, depth == k, made) for k in range(last)]
        self._last = _Step.of(arrays, depth == last, made)

    def __call__(self, theta: Tensor) -> Tensor:
        """(..., quantities) to (..., total)."""
        batch = theta.shape[:-1]
        known = torch.cat([theta.new_zeros(*batch, self._intermediates), theta], -1)
        for step in self._steps:
            known = step.added_to(known, known)
        return self._last.added_to(self._base.expand(*batch, -1), known)


@dataclass(frozen=True, eq=False)
class _Step:
    """Terms that are made of known values, and where they go.

    Attributes:
        target, coefficient: (terms,).
        functions: (name, values, weights) of all functions of weighted values; each is computed once.
        factors, exponents: (terms, most) places among them, in the order of each term.
    """

    target: Tensor
    coefficient: Tensor
    functions: list[tuple[str, Tensor, Tensor]]
    factors: Tensor
    exponents: Tensor

    @classmethod
    def of(cls, arrays: Mapping[str, np.ndarray], chosen: np.ndarray, intermediates: int) -> _Step:
        """Some of the terms of a map, all of which go to inputs or all to intermediate values."""
        count = np.diff(arrays["first_factor"])
        own = np.repeat(chosen, count)
        parameter, function = arrays["parameter"][own], arrays["function"][own]
        place = np.where(parameter < 0, -1 - parameter, intermediates + parameter)
        each = np.stack([function, place, arrays["weight"][own]], 1).astype(float).reshape(-1, 3)
        distinct, which = np.unique(each, axis=0, return_inverse=True)
        groups = {name: distinct[distinct[:, 0] == number] for name, number in FUNCTIONS.items()}
        count, which = count[chosen], which.ravel()
        term, grows = np.repeat(np.arange(len(count)), count), each[:, 0] == FUNCTIONS["exp"]
        one, zero = len(distinct), len(distinct) + 1
        target = arrays["target"][chosen]
        return cls(
            torch.tensor(np.where(target < 0, -1 - target, target), dtype=torch.long),
            torch.tensor(arrays["coefficient"][chosen], dtype=torch.float64),
            [(n, torch.tensor(rows[:, 1], dtype=torch.long), torch.tensor(rows[:, 2])) for n, rows in groups.items()],
            _rows(term[~grows], which[~grows], len(count), one),
            _rows(term[grows], which[grows], len(count), zero),
        )

    def added_to(self, sums: Tensor, known: Tensor) -> Tensor:
        """The sums with the terms of known values (..., intermediate values and quantities) added."""
        arguments = [(name, weight * known.index_select(-1, which)) for name, which, weight in self.functions]
        functions = [x if name == "exp" else _TORCH[name](x) for name, x in arguments]
        batch = known.shape[:-1]
        values = torch.cat([*functions, known.new_ones(*batch, 1), known.new_zeros(*batch, 1)], -1)
        product, exponent = known.new_ones(()), known.new_zeros(())
        for column in self.factors.unbind(1):
            product = product * values.index_select(-1, column)
        for column in self.exponents.unbind(1):
            exponent = exponent + values.index_select(-1, column)
        product = self.coefficient * (product * torch.exp(exponent))
        return sums.index_add(-1, self.target, product.expand(*batch, -1))


def _depths(arrays: Mapping[str, np.ndarray]) -> np.ndarray:
    """(terms,) how many intermediate values a term is made of one after another; those that go to inputs come last."""
    first, parameter, target = arrays["first_factor"], arrays["parameter"], arrays["target"]
    depth, of_value = np.zeros(len(target), dtype=int), dict[int, int]()
    for t in np.flatnonzero(target < 0):
        made_of = parameter[first[t] : first[t + 1]]
        depth[t] = max((1 + of_value[k] for k in made_of.tolist() if k < 0), default=0)
        of_value[int(target[t])] = max(depth[t], of_value.get(int(target[t]), 0))
    depth[target >= 0] = 1 + max(of_value.values(), default=-1)
    return depth


def _rows(term: np.ndarray, place: np.ndarray, terms: int, none: int) -> Tensor:
    """(terms, most) the places of each term, in their order; short rows are filled up with `none`."""
    count = np.bincount(term, minlength=terms)
    rows = np.full((terms, int(count.max(initial=0))), none)
    rows[term, np.arange(len(term)) - np.repeat(np.cumsum(count) - count, count)] = place
    return torch.from_numpy(rows)


class InputMap:
    """The map from tensors by name to flat inputs (*batch, total)."""

    def __init__(self, scene: Scene) -> None:
        compiled = scene.compiled
        self._names, self._layout, self._domain = compiled.names, compiled.layout, compiled.domain
        self._given = compiled.given
        self._without_effect = _without_effect(scene)
        self._shapes = compiled.shapes
        self._theta = torch.tensor(compiled.theta, dtype=torch.float64)
        self._map = ParameterMap(scene)

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
        flat = self._map(self._quantities(values, batch))
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
            raise InputError(field, "is no quantity of the scene", name, choices(name, self._names))
        return () if isinstance(value, int | float) else _dense(field, value)

    def _batch_of_array(self, name: str, array: Tensor) -> tuple[int, ...]:
        field = f"inputs.{name}"
        present = [n for n, (_, size) in self._given.items() if size > 0]
        if name not in present:
            fix = f"call {NEEDS[name]} first" if name in NEEDS else choices(name, present)
            raise InputError(field, "is no input array of the scene", name, fix)
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
        theta = torch.stack([torch.as_tensor(v, dtype=torch.float64).expand(batch) for v in each], -1)
        rows = theta.reshape(-1, len(each))
        out: Tensor = _Checked.apply(self._domain.check_quantities, rows)  # type: ignore[no-untyped-call]
        return out.reshape(theta.shape)


def dtype_of(values: Mapping[str, Tensor | float], arrays: Mapping[str, Tensor]) -> torch.dtype:
    """What comes of these: float32 where all tensors are, else float64."""
    own = {t.dtype for t in (*values.values(), *arrays.values()) if isinstance(t, Tensor)}
    return torch.float32 if own == {torch.float32} else torch.float64


class _Checked(Function):
    """(check, rows) -> rows, once `check` has seen their numbers; under every transform."""

    @staticmethod
    def forward(check: Callable[[np.ndarray], None], rows: Tensor) -> Tensor:
        check(rows.detach().numpy())
        return rows.clone()

    @staticmethod
    def setup_context(ctx: Any, inputs: tuple[Any, ...], output: Tensor) -> None:
        pass

    @staticmethod
    def backward(ctx: Any, rows_bar: Tensor) -> tuple[None, Tensor]:
        return None, rows_bar

    @staticmethod
    def jvp(ctx: Any, _: None, rows_dot: Tensor) -> Tensor:
        return rows_dot.clone()

    @staticmethod
    def vmap(info: Any, in_dims: tuple[None, int], check: Any, rows: Tensor) -> tuple[Tensor, int]:
        every = rows.movedim(in_dims[1], 0)
        out: Tensor = _Checked.apply(check, every.flatten(0, 1))  # type: ignore[no-untyped-call]
        return out.reshape(every.shape), 0


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
