"""A rollout that can be differentiated, in NumPy."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .. import _core
from ..arrays.checks import check_kind, numbers
from ..arrays.types import Array
from ..errors import EmptyGradientError, InputError, choices
from ..scene.scene import Scene
from .core_terms import compiled_of, divergence, over_all_nodes, substeps
from .solver import Solver
from .tape import TapePlan, planned

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Gradient:
    """Derivatives of a loss with respect to everything that a rollout depends on.

    Attributes:
        quantities: derivative with respect to each named quantity, by its name.
        inputs: derivative with respect to each input array, by its name and in its shape, of particles without hidden
            nodes, whose share reaches the quantities: "position", "velocity"
            (particles, 3), "mass" (particles,), "compliance", "damping" (constraints,), "rest" (all rest
            parameters,), "boundary", "force" (knots times particles, 3), "gravity" (3,), "drag_linear",
            "drag_quadratic" (particles,), "wind" (knots, 3), "air_normal", "air_tangential", "pressure" (triangles
            in air,), "volume", "volume_compliance" (volumes,), "friction", "contact_radius" (contacts,),
            "contact_stiffness" (those that are not rigid,), "collider_pose" (position and rotation at each knot of
            each collider, 3), "collider_size" (lengths of all colliders,), "restitution" and
            "contact_dissipation" (contacts that have one,).
        recomputed: substeps that the forward program ran again: as planned, or more where the same rollout was
            differentiated before and its tape no longer holds what it held.
        tape: bytes of the tape.
        rounding: what the loss may change by when positions are rounded in the last bit of the largest of them.
    """

    quantities: Mapping[str, float]
    inputs: Mapping[str, Array]
    recomputed: int
    tape: int
    rounding: float

    def require(self, scales: Mapping[str, float]) -> None:
        """Refuse a gradient that is empty for some named quantities: one that no optimizer can go along.

        Args:
            scales: by name, in the quantity's unit, how far it is likely to move.

        Raises:
            InputError: a name that is no quantity of the scene.
            EmptyGradientError: to the first order none of these moves changes the loss by more than `rounding`.
        """
        check_kind("scales", scales, Mapping, "give numbers by the names of quantities")
        unknown = [name for name in scales if name not in self.quantities]
        if unknown:
            fix = choices(unknown[0], self.quantities)
            raise InputError("scales", "name no quantity of the scene", unknown[0], fix)
        change = max((abs(self.quantities[name] * scale) for name, scale in scales.items()), default=0.0)
        if not change > self.rounding:
            raise EmptyGradientError(tuple(scales), change, self.rounding)


class Rollout:
    """The result of `rollout`: positions, and gradients on request.

    Attributes:
        times: (frames,) s.
        positions: (frames, particles, 3) m.
        nodes: (frames, nodes, 3) m, the positions of all nodes, see `Trajectory.nodes`.
        plan: what the gradient costs.
    """

    def __init__(self, scene: Scene, times: ArrayLike, solver: Solver, values: Mapping[str, float] | None) -> None:
        self._scene, self._solver, self._compiled = scene, solver, compiled_of(scene)
        self._core = solver.core(self._compiled)
        self._steps = substeps(times, solver.h)
        self._theta = self._compiled.values(values)
        self._inputs = self._compiled.inputs(self._theta)
        allowed = solver.budget
        self.plan: TapePlan = planned(self._core, self._steps, solver, allowed)
        if solver.memory is None and self.plan.policy != "every boundary":
            log.warning("%s: solver.memory is not given, so half of the free memory is used. %s", scene.name, self.plan)
        self._tape: _core.Tape
        with divergence(scene):
            states, self._tape = self._core.record(self._inputs, self._steps, 0.0, allowed)
        self.times: Array = np.array(self._steps) * solver.h
        self.nodes: Array = states.reshape(len(self._steps), -1, 3)
        self.positions: Array = self.nodes[:, : self._compiled.particles]

    def gradient(self, positions_bar: ArrayLike) -> Gradient:
        """The gradient of a loss whose derivative with respect to the positions is `positions_bar`, (frames,
        particles, 3), or with respect to those of all nodes, (frames, nodes, 3).

        May be called again, with other cotangents, and from several threads; where the tape dropped states they take
        turns.

        Raises:
            InputError: wrong shape, NaN.
            DivergenceError: the gradient grew by more than 1/eps on its way back through the motion.
            UnconvergedError: as `rollout`.
        """
        bar = numbers("positions_bar", positions_bar, InputError)
        bar = over_all_nodes(bar, self.nodes.shape, self._compiled.particles, InputError)
        with divergence(self._scene):
            inputs_bar, recomputed = self._core.reverse(self._inputs, self._tape, self._steps, bar, 0.0)
        by_quantity = self._compiled.theta_bar(self._theta, inputs_bar)
        return Gradient(
            dict(zip(self._compiled.names, by_quantity.tolist(), strict=True)),
            self._compiled.unpack(inputs_bar),
            recomputed,
            self._tape.bytes,
            float(np.finfo(float).eps * np.abs(self.positions).max() * np.abs(bar).sum()),
        )


def rollout(
    scene: Scene, times: ArrayLike, solver: Solver | None = None, values: Mapping[str, float] | None = None
) -> Rollout:
    """Simulate a scene and store what its gradient needs, within `solver.memory`, by default half of the free memory.

    If this default is too little for all states, the gradient computes some again, and the logger
    "sheetbend.motion.rollout" warns of the cost.

    Examples:
        >>> rope = sb.rope(0.6, 20, density=0.05, EI=1e-3)
        >>> run = sb.rollout(rope, [0.25], sb.Solver(h=1 / 480))
        >>> bar = np.zeros_like(run.positions)
        >>> bar[-1, -1, 2] = 1.0  # the loss is the final height of the free end
        >>> gradient = run.gradient(bar)
        >>> sorted(gradient.quantities)  # derivatives of the loss with respect to these
        ['rope_EI', 'rope_density', 'rope_length']

    Args:
        scene: frozen by this call.
        times: (frames,) s on the substep grid, at which the loss needs positions. Memory grows with their number.
        solver: `Solver()` by default.
        values: quantities to change for this run, by name.

    Raises:
        InputError: times off the grid, unknown quantities, a budget below the least that works or above what is free.
        DivergenceError: a state became infinite, or nothing put into the scene explains it; says when and where.
        UnconvergedError: method "newton_cg" ran out of iterations, here or in a gradient.
        UnbalancedError: method "implicit" did not bring a substep's forces into balance.
    """
    return Rollout(scene, times, Solver.given(solver), values)
