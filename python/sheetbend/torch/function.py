"""Autograd Functions from a scene's flat inputs to its states, and for their derivatives.

A Function whose backward calls compiled code directly passes gradcheck and yet fails under torch.func, where the
arguments of backward are wrapped tensors. Here every derivative is a Function of its own with a vmap rule, so backward
and jvp only ever call Functions:

    Value     inputs -> states             backward: Vjp                     jvp: Jvp
    Vjp       states_bar -> inputs_bar     backward: VjpDot and Jvp          jvp: VjpDot
    Jvp       inputs_dot -> states_dot     backward: VjpDot and Vjp          jvp: refused
    VjpDot    derivative of Vjp            refused: a third derivative

The backward of Vjp and of Jvp differentiates one number, <states_bar, J inputs_dot> = <inputs_dot, J^T states_bar>,
with respect to the inputs (VjpDot) and to the factor that each takes. All tensors have a leading batch dimension; a
vmap rule folds the mapped dimension into it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NoReturn, Protocol

import torch
from torch import Tensor
from torch.autograd import Function

from ..arrays.types import Array


class Response(Protocol):
    """How states answer to inputs, in NumPy: inputs (B, total), states (B, ...), both contiguous float64."""

    def value(self, inputs: Array) -> Array:
        """States."""

    def vjp(self, inputs: Array, states_bar: Array) -> Array:
        """J^T states_bar, shape (B, total)."""

    def jvp(self, inputs: Array, inputs_dot: Array) -> Array:
        """J inputs_dot, shape of the states."""

    def vjp_dot(self, inputs: Array, inputs_dot: Array, states_bar: Array, states_bar_dot: Array) -> Array:
        """Derivative of `vjp` along (inputs_dot, states_bar_dot), shape (B, total)."""


class _ResponseFunction(Function):
    """What the four have in common: arguments (response, *tensors), one tensor out, each with a batch dimension."""

    @staticmethod
    def setup_context(ctx: Any, inputs: tuple[Any, ...], output: Tensor) -> None:
        ctx.response, *tensors = inputs
        ctx.save_for_backward(*tensors)
        ctx.save_for_forward(*tensors)

    @classmethod
    def vmap(
        cls, info: Any, in_dims: tuple[int | None, ...], response: Response, *tensors: Tensor
    ) -> tuple[Tensor, int]:
        mapped = [
            tensor.expand(info.batch_size, *tensor.shape) if dim is None else tensor.movedim(dim, 0)
            for tensor, dim in zip(tensors, in_dims[1:], strict=True)
        ]
        out = _apply(cls, response, *(tensor.flatten(0, 1) for tensor in mapped))
        return out.reshape(*mapped[0].shape[:2], *out.shape[1:]), 0


def respond(response: Response, inputs: Tensor) -> Tensor:
    """States (B, ...) from inputs (B, total), differentiable."""
    return _apply(Value, response, inputs)


class Value(_ResponseFunction):
    """(response, inputs) -> states."""

    @staticmethod
    def forward(response: Response, inputs: Tensor) -> Tensor:
        return torch.from_numpy(response.value(_array(inputs)))

    @staticmethod
    def backward(ctx: Any, states_bar: Tensor) -> tuple[None, Tensor]:
        (inputs,) = ctx.saved_tensors
        return None, _apply(Vjp, ctx.response, inputs, states_bar)

    @staticmethod
    def jvp(ctx: Any, _: None, inputs_dot: Tensor) -> Tensor:
        (inputs,) = ctx.saved_tensors
        return _apply(Jvp, ctx.response, inputs, inputs_dot)


class Vjp(_ResponseFunction):
    """(response, inputs, states_bar) -> inputs_bar."""

    @staticmethod
    def forward(response: Response, inputs: Tensor, states_bar: Tensor) -> Tensor:
        return torch.from_numpy(response.vjp(_array(inputs), _array(states_bar)))

    @staticmethod
    def backward(ctx: Any, direction: Tensor) -> tuple[None, Tensor | None, Tensor | None]:
        inputs, states_bar = ctx.saved_tensors
        return _product_vjp(ctx, inputs, direction, states_bar, lambda: _apply(Jvp, ctx.response, inputs, direction))

    @staticmethod
    def jvp(ctx: Any, _: None, inputs_dot: Tensor, states_bar_dot: Tensor) -> Tensor:
        inputs, states_bar = ctx.saved_tensors
        return _apply(VjpDot, ctx.response, inputs, inputs_dot, states_bar, states_bar_dot)


class Jvp(_ResponseFunction):
    """(response, inputs, inputs_dot) -> states_dot."""

    @staticmethod
    def forward(response: Response, inputs: Tensor, inputs_dot: Tensor) -> Tensor:
        return torch.from_numpy(response.jvp(_array(inputs), _array(inputs_dot)))

    @staticmethod
    def backward(ctx: Any, states_bar: Tensor) -> tuple[None, Tensor | None, Tensor | None]:
        inputs, inputs_dot = ctx.saved_tensors
        return _product_vjp(ctx, inputs, inputs_dot, states_bar, lambda: _apply(Vjp, ctx.response, inputs, states_bar))

    @staticmethod
    def jvp(ctx: Any, *_: Any) -> NoReturn:
        raise NotImplementedError(
            "sheetbend.torch.function.Jvp: forward over forward is not available. Fix: put reverse mode inside, as in "
            "torch.func.jacfwd(torch.func.jacrev(f)), which is torch.func.hessian(f)"
        )


class VjpDot(_ResponseFunction):
    """(response, inputs, inputs_dot, states_bar, states_bar_dot) -> derivative of Vjp."""

    @staticmethod
    def forward(response: Response, *tensors: Tensor) -> Tensor:
        return torch.from_numpy(response.vjp_dot(*map(_array, tensors)))

    @staticmethod
    def backward(ctx: Any, *_: Any) -> NoReturn:
        raise NotImplementedError(_THIRD)

    @staticmethod
    def jvp(ctx: Any, *_: Any) -> NoReturn:
        raise NotImplementedError(_THIRD)


_THIRD = "sheetbend.torch.function.VjpDot: third derivatives are not available. Fix: differentiate at most twice"


def _product_vjp(
    ctx: Any, inputs: Tensor, inputs_dot: Tensor, states_bar: Tensor, factor_bar: Callable[[], Tensor]
) -> tuple[None, Tensor | None, Tensor | None]:
    """What the backward of Vjp and of Jvp returns: gradients of <states_bar, J inputs_dot> with respect to the inputs
    and to the factor that the Function takes, where they are needed."""
    inputs_bar = bar = None
    if ctx.needs_input_grad[1]:
        inputs_bar = _apply(VjpDot, ctx.response, inputs, inputs_dot, states_bar, torch.zeros_like(states_bar))
    if ctx.needs_input_grad[2]:
        bar = factor_bar()
    return None, inputs_bar, bar


def _apply(function: type[Function], response: Response, *tensors: Tensor) -> Tensor:
    out: Tensor = function.apply(response, *tensors)  # type: ignore[no-untyped-call]
    return out


def _array(tensor: Tensor) -> Array:
    """A view of the tensor's memory; a copy only where it is not contiguous."""
    return tensor.detach().contiguous().numpy()
