"""Differentiable forces at supports of moving scenes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import torch
from numpy.typing import ArrayLike
from torch import Tensor

from .. import _core
from ..arrays.checks import given_by_name
from ..errors import InputError
from ..experiment.force_readings import read_at, readings_problem
from ..motion.core_terms import divergence
from ..motion.solver import Solver
from ..scene.body import Body
from ..scene.scene import Scene
from .compiled import not_traced
from .inputs import dtype_of


@not_traced
def forces(
    scene: Scene,
    times: ArrayLike,
    at: tuple[str, str] | Sequence[int] | Body,
    solver: Solver | None = None,
    values: Mapping[str, Tensor | float] | None = None,
    *,
    start: str = "given",
    quaternions: ArrayLike | None = None,
    **sensor: Any,
) -> Tensor:
    """Force and torque at a support along a simulation, differentiable once in named quantities.

    The derivatives are tangents of the rollout, eight to a simulation, so their cost grows with the number of tensors;
    input arrays are not differentiated. Arguments: see `sheetbend.simulate_forces`; of `values`, tensors (each of one
    number) are differentiated.

    Returns:
        (samples, 6), N and N m in the sensor's axes. float32 if all tensors given are float32, else float64; everything
        is computed in float64.

    Raises:
        InputError: times, particles, tensors or fields that do not suit.
        DivergenceError: as `sheetbend.simulate`.
    """
    given = given_by_name("values", values)
    tensors = {name: value for name, value in given.items() if isinstance(value, Tensor)}
    for name, value in tensors.items():
        kinds = (torch.float64, torch.float32)
        if value.numel() != 1 or value.dtype not in kinds or value.device.type != "cpu":
            got, wanted = (tuple(value.shape), str(value.dtype), str(value.device)), "float64 or float32, on the CPU"
            raise InputError(name, f"must be one number, {wanted}", got, "give a tensor of that sort")
    numbers = {name: float(v.detach() if isinstance(v, Tensor) else v) for name, v in given.items()}
    made = read_at(times, at, quaternions, **sensor)
    span = (0.0, float(made.recording.times[-1]))
    problem = readings_problem(made, scene, Solver.given(solver), numbers, list(tensors), start, span)
    scalars = (t.reshape(()).double() for t in tensors.values())
    read: Tensor = _Readings.apply(problem, scene, *scalars)  # type: ignore[no-untyped-call]
    return read.to(dtype_of(tensors, {}))


class _Readings(torch.autograd.Function):
    """Readings (samples, 6) by the parameters of a problem that ends with them."""

    @staticmethod
    def forward(ctx: Any, problem: _core.Problem, scene: Scene, *values: Tensor) -> Tensor:
        u = np.array([float(value) for value in values])
        with divergence(scene):
            read = problem.readings(0, u)
        rows = read.size
        if any(ctx.needs_input_grad):
            ok, _, J = problem.evaluate(u)
            if not ok:
                raise InputError("values", "have no derivatives", problem.failure, "give others")
            ctx.jacobian = torch.from_numpy(np.ascontiguousarray(J[len(J) - rows :]))
        return torch.from_numpy(read)

    @staticmethod
    @torch.autograd.function.once_differentiable
    def backward(ctx: Any, bar: Tensor) -> tuple[Tensor | None, ...]:
        return (None, None, *(ctx.jacobian.T @ bar.reshape(-1)))
