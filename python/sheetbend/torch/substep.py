"""Autograd Functions of one substep: from a state, the scene's inputs and arrays of this substep to the next state.

    Substep       (core, states, inputs, *given) -> next              backward: SubstepVjp      jvp: SubstepJvp
    SubstepVjp    (..., next, next_bar) -> cotangents in one row      refused: a second derivative
    SubstepJvp    (..., tangents) -> next_dot                         refused: a second derivative

States and inputs are rows (n,), or (batch, n); what is given has its own shape, and the batch before it where they have
one. As in function.py, derivatives are Functions with vmap rules of their own, so that torch.func works.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import torch
from torch import Tensor
from torch.autograd import Function

from ..arrays.types import Array


class Core:
    """A compiled stepper, and where the arrays given for a substep stand in its inputs.

    Args:
        compiled: `_core.Stepper`.
        places: a slice of the inputs for each of the arrays.
        check: raises InputError for inputs (batch, total) that make no sense.
        early: whether to check before a substep. Numbers that merely must be finite are looked at when the next state
            is not.
        translated: a context that raises the package's errors for those of the core.
    """

    def __init__(
        self,
        compiled: Any,
        places: Sequence[slice],
        check: Callable[[Array], None],
        early: bool,
        translated: Callable[[], Any],
    ) -> None:
        self.compiled, self.places, self.translated = compiled, tuple(places), translated
        self._check, self.early = check, early

    def check(self, inputs: Array) -> None:
        """Raises InputError for inputs that make no sense."""
        self._check(inputs.reshape(-1, inputs.shape[-1]))

    def filled(self, inputs: Array, given: Sequence[Array]) -> Array:
        """The inputs with the given arrays in place: a copy where there are any."""
        if not given:
            return inputs
        inputs = inputs.copy()
        for place, array in zip(self.places, given, strict=True):
            inputs[..., place] = array.reshape(*inputs.shape[:-1], -1)
        return inputs


class _SubstepFunction(Function):
    """What the three have in common: arguments (core, states, ...), one tensor of rows out."""

    @classmethod
    def vmap(cls, info: Any, in_dims: tuple[int | None, ...], core: Core, *tensors: Tensor) -> tuple[Tensor, int]:
        mapped = [
            t.expand(info.batch_size, *t.shape) if dim is None else t.movedim(dim, 0)
            for t, dim in zip(tensors, in_dims[1:], strict=True)
        ]
        out = _apply(cls, core, *(t.flatten(0, mapped[0].dim() - 2) for t in mapped))
        return out.reshape(*mapped[0].shape[:-1], -1), 0

    @staticmethod
    def backward(ctx: Any, *bars: Any) -> Any:
        raise NotImplementedError(_SECOND)

    @staticmethod
    def jvp(ctx: Any, *tangents: Any) -> Any:
        raise NotImplementedError(_SECOND)


class Substep(_SubstepFunction):
    """(core, states, inputs, *given) -> next states."""

    @staticmethod
    def forward(core: Core, states: Tensor, inputs: Tensor, *given: Tensor) -> Tensor:
        numbers = core.filled(_array(inputs), [_array(g) for g in given])
        if core.early:
            core.check(numbers)
        try:
            out = core.compiled.step(_array(states), numbers)
        except RuntimeError:
            core.check(numbers)
            with core.translated():
                raise
        return torch.from_numpy(out).view(states.shape)

    @staticmethod
    def setup_context(ctx: Any, inputs: tuple[Any, ...], output: Tensor) -> None:
        ctx.core, *tensors = inputs
        ctx.save_for_backward(*tensors, output)
        ctx.save_for_forward(*tensors)

    @staticmethod
    def backward(ctx: Any, *bars: Tensor) -> tuple[Tensor | None, ...]:
        (next_bar,) = bars
        states, _, *given, _ = saved = ctx.saved_tensors
        row: Any
        tensor: Callable[[Any], Tensor]
        if _transformed() or torch.is_grad_enabled():
            row, tensor = _apply(SubstepVjp, ctx.core, *saved, next_bar), _itself
        else:  # cut as an array, in a third of the time
            row, tensor = _vjp(ctx.core, *saved, next_bar), torch.from_numpy
        own = states.shape[-1]
        states_bar, inputs_bar = tensor(row[..., :own]), row[..., own:]
        places = ctx.core.places
        given_bar = [
            tensor(inputs_bar[..., place].reshape(array.shape)) if wanted else None
            for place, array, wanted in zip(places, given, ctx.needs_input_grad[3:], strict=True)
        ]
        if not ctx.needs_input_grad[2]:
            return None, states_bar, None, *given_bar
        inputs_bar = tensor(inputs_bar)
        if places:
            inputs_bar = inputs_bar.clone()
            for place in places:
                inputs_bar[..., place] = 0.0
        return None, states_bar, inputs_bar, *given_bar

    @staticmethod
    def jvp(ctx: Any, *tangents: Any) -> Tensor:
        dots = tangents[1:]
        return _apply(SubstepJvp, ctx.core, *ctx.saved_tensors[: len(dots)], *dots)


class PlainSubstep(Function):
    """Substep where no transform of torch.func is at work. For Functions that such transforms know, torch looks at the
    signature of `forward` in every call, which takes longer than the substep of a short rope."""

    @staticmethod
    def forward(ctx: Any, core: Core, *tensors: Tensor) -> Tensor:
        out = Substep.forward(core, *tensors)
        Substep.setup_context(ctx, (core, *tensors), out)
        return out

    backward = Substep.backward
    jvp = Substep.jvp


class SubstepVjp(_SubstepFunction):
    """(core, states, inputs, *given, next, next_bar) -> cotangents of the states, then of the inputs."""

    @staticmethod
    def forward(core: Core, states: Tensor, inputs: Tensor, *more: Tensor) -> Tensor:
        return torch.from_numpy(_vjp(core, states, inputs, *more))

    @staticmethod
    def setup_context(ctx: Any, inputs: tuple[Any, ...], output: Tensor) -> None:
        pass


class SubstepJvp(_SubstepFunction):
    """(core, states, inputs, *given, and the tangents of them all) -> tangents of the next states."""

    @staticmethod
    def forward(core: Core, *tensors: Tensor) -> Tensor:
        arrays = list(map(_array, tensors))
        half = len(arrays) // 2
        (states, inputs, *given), (states_dot, inputs_dot, *given_dot) = arrays[:half], arrays[half:]
        with core.translated():
            out = core.compiled.jvp(states, core.filled(inputs, given), states_dot, core.filled(inputs_dot, given_dot))
        return torch.from_numpy(out).view(tensors[0].shape)

    @staticmethod
    def setup_context(ctx: Any, inputs: tuple[Any, ...], output: Tensor) -> None:
        pass


_SECOND = (
    "sheetbend.torch.Stepper: second derivatives of single substeps are not available. Fix: take them of a whole "
    "motion, with sheetbend.torch.simulate"
)


def take_substep(core: Core, rows: Sequence[Tensor]) -> Tensor:
    """The next states from (states, inputs, *given), differentiable once with respect to each."""
    return _apply(Substep if _transformed() else PlainSubstep, core, *rows)


def _transformed() -> bool:
    """Whether a transform of torch.func is at work; torch's own Function asks the same way."""
    found: bool = torch._C._are_functorch_transforms_active()
    return found


def _apply(function: type[Function], core: Core, *tensors: Tensor) -> Tensor:
    out: Tensor = function.apply(core, *tensors)  # type: ignore[no-untyped-call]
    return out


def _vjp(core: Core, states: Tensor, inputs: Tensor, *more: Tensor) -> Array:
    """Cotangents of the states, then of the inputs, in one row for each state."""
    *given, after, after_bar = map(_array, more)
    numbers = core.filled(_array(inputs), given)
    try:
        bars: Array = core.compiled.vjp(_array(states), numbers, after, after_bar)
    except RuntimeError:
        with core.translated():
            raise
    return bars.reshape(*states.shape[:-1], -1)


def _itself(tensor: Tensor) -> Tensor:
    return tensor


def _array(tensor: Tensor) -> Array:
    """A view of the tensor's memory."""
    array: Array = tensor.numpy(force=True)
    return array
