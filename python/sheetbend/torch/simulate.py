"""Differentiable simulation of scenes."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import torch
from numpy.typing import ArrayLike
from torch import Tensor

from ..arrays.checks import numbers
from ..errors import InputError
from ..motion.core_terms import substeps
from ..motion.rollouts import Rollouts
from ..motion.solver import Solver
from ..scene.given import check_scene
from ..scene.scene import Scene
from .compiled import not_traced
from .function import respond
from .inputs import InputMap, dtype_of


class Simulation:
    """A scene, its frame times and its solver, prepared for many calls; see `simulate` for the arguments."""

    def __init__(self, scene: Scene, times: ArrayLike, solver: Solver | None = None, nodes: bool = False) -> None:
        check_scene(scene)
        self.scene, self.solver = scene, Solver.given(solver)
        self._shown = scene.node_count if nodes else scene.particle_count
        self._steps = substeps(times, self.solver.h)
        self._inputs = InputMap(scene)
        self._core = self.solver.core(scene.compiled)

    @not_traced
    def __call__(
        self,
        values: Mapping[str, Tensor | float] | None = None,
        inputs: Mapping[str, Tensor] | None = None,
        lengths: ArrayLike | None = None,
    ) -> Tensor:
        flat = self._inputs(values, inputs)
        batch = flat.shape[:-1]
        keep_tape = torch.is_grad_enabled() and flat.requires_grad
        own = None if lengths is None else _checked(lengths, batch, len(self._steps))
        rollouts = Rollouts(self.scene, self._core, self._steps, keep_tape, self.solver, own, tuple(inputs or ()))
        states = respond(rollouts, flat.reshape(-1, flat.shape[-1])).to(dtype_of(values or {}, inputs or {}))
        return states.reshape(*batch, len(self._steps), -1, 3)[..., : self._shown, :]


@not_traced
def simulate(
    scene: Scene,
    times: ArrayLike,
    solver: Solver | None = None,
    values: Mapping[str, Tensor | float] | None = None,
    inputs: Mapping[str, Tensor] | None = None,
    lengths: ArrayLike | None = None,
    nodes: bool = False,
) -> Tensor:
    """Positions of a simulated scene, differentiable in every tensor given.

    Gradients are those of the discrete rollout, to rounding: reverse mode by the adjoint, forward mode by tangents,
    second derivatives by forward over reverse (double backward, torch.func.hessian). Forward over forward and third
    derivatives raise NotImplementedError.

    Leading batch dimensions, and torch.func.vmap, simulate many scenes: each derivative too is one call of the core,
    which spreads them over `solver.threads`. Forward and reverse go eight scenes to a vector, tangents eight of one
    scene to a rollout, second derivatives one at a time.

    Args:
        scene: frozen by this call.
        times: (frames,) s on the substep grid.
        solver: `Solver()` by default; its `memory` is the budget of a gradient (see `sheetbend.tape_plan`).
        values: quantities to change, by name: tensors (*batch,), or plain numbers.
        inputs: input arrays to replace, by name: tensors (*batch, ...), whatever quantities made them up. "position",
            "velocity" (particles, 3), "mass" (particles,), "compliance", "damping" (constraints,), "rest" (all rest
            parameters,), "boundary" (knots, driven, 3), "force" (knots, loaded, 3), "gravity" (3,), "drag_linear",
            "drag_quadratic" (particles,), "wind" (knots, 3), "air_normal", "air_tangential",
            "pressure" (triangles in air,), "volume", "volume_compliance" (volumes,).
            Constraints and rest parameters come group after group, as added. An array that this scene has no use for
            is refused: drag where none was set, damping where no group is damped.
        lengths: (*batch,) how many of the frames each scene has, where recordings differ in length; all by default.
            After its last frame a scene stands still, and what a loss makes of those frames has no gradient. Scenes of
            like length share a vector, so short ones do not pay for long ones.
        nodes: return the positions of all nodes, hidden ones behind the particles, as `sheetbend.Trajectory.nodes` has
            them: the axes of bodies and the directors of rods are among these.

    Returns:
        (*batch, frames, particles, 3) m, or (*batch, frames, nodes, 3) m. float32 if all tensors given are float32,
        else float64; everything is computed in float64.

    Raises:
        InputError: times off the grid; lengths that fit neither batch nor frames; a budget below the least that works;
            a tensor with an unknown name, of the wrong shape or dtype, on another device, not finite, or with a
            negative stiffness, mass or length; the message names the quantity and the scene of the batch.
        DivergenceError: a state became infinite; says when and where.
    """
    return Simulation(scene, times, solver, nodes)(values, inputs, lengths)


def _checked(lengths: ArrayLike, batch: tuple[int, ...], frames: int) -> np.ndarray:
    """(scenes,)"""
    numbers("lengths", lengths, InputError)
    own = np.asarray(lengths)
    if own.shape != batch or not np.issubdtype(own.dtype, np.integer):
        fix = f"give {batch}, of the batch; without one cut the times"
        raise InputError("lengths", "must be whole numbers, one per scene", own.shape, fix)
    if own.min() < 1 or own.max() > frames:
        raise InputError("lengths", "do not lie within the frames", [int(own.min()), int(own.max())], f"1 to {frames}")
    return own.reshape(-1)
