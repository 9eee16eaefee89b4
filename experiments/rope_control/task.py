"""A task of control: what shall be reached by which motion, and at what cost."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import sheetbend as sb
from motion import Array, Control
from scipy.sparse import csr_array
from sheetbend.motion.core_terms import substeps
from sheetbend.motion.rollouts import Rollouts


class Outcome(NamedTuple):
    """What a motion leads to: the cost that is minimized, the error in m, the speed in m/s, and whether it will do."""

    cost: float
    error: float
    speed: float
    reached: bool


@dataclass(frozen=True)
class Task:
    """What shall be reached, and by what.

    Attributes:
        frames: (frames,) s at which the loss looks.
        target: (3,) or (nodes, 3) m.
        loss: of positions (frames, particles, 3), with its derivative with respect to them.
        error: of the same, in m: how far the rope is from its target.
        speed: of the same, in m/s: that of the rope in the last two frames, where it is fastest or where it matters.
        reached: of an error and a speed.
        effort: what an effort of 1 costs beside the loss.
        residuals: of the same, where the loss is the sum of their squares; with their derivative (residuals, positions)
            with respect to the positions in their order.
        posts: (x, y, radius) m of upright posts on a table; pictures of such a task look from above.
    """

    name: str
    control: Control
    frames: Array
    solver: sb.Solver
    target: Array
    loss: Callable[[Array], tuple[float, Array]]
    error: Callable[[Array], float]
    speed: Callable[[Array], float]
    reached: Callable[[float, float], bool]
    effort: float
    residuals: Callable[[Array], tuple[Array, csr_array]] | None = None
    posts: tuple[tuple[float, float, float], ...] = ()

    @property
    def size(self) -> int:
        return len(self.control.scales)

    def outcome(self, unknowns: Array) -> Outcome:
        """Of one rollout."""
        values = self.control.values(unknowns)
        x = sb.simulate(self.control.scene, self.frames, self.solver, values).positions
        return self._outcome(unknowns, self.loss(x)[0], x)

    def outcome_and_gradient(self, unknowns: Array) -> tuple[Outcome, Array]:
        """The same, with the gradient of the cost with respect to the unknowns."""
        x, value, felt = self._rolled_back(unknowns)
        by_knot = np.array([felt.quantities[name] for name in self.control.scales])
        return self._outcome(unknowns, value, x), self.control.knots.T @ by_knot + 2.0 * self.effort * unknowns

    def outcome_and_residuals(self, unknowns: Array) -> tuple[Outcome, Array, Array]:
        """The same, with residuals whose squares add up to the cost, and their Jacobian (residuals, unknowns)."""
        assert self.residuals is not None
        compiled = self.control.scene.compiled
        theta = compiled.values(self.control.values(unknowns))
        inputs, places = compiled.inputs(theta), [compiled.names.index(name) for name in self.control.scales]
        along = np.zeros((self.size, len(theta)))
        along[:, places] = self.control.knots.T
        tangents = np.array([compiled.inputs_dot(theta, each) for each in along])
        x = self._cut(self._rollouts.value(inputs[None]))[0]
        x_dot = self._cut(self._rollouts.jvp(np.broadcast_to(inputs, tangents.shape), tangents))
        rest, derivative = self.residuals(x)
        jacobian = derivative @ x_dot.reshape(self.size, -1).T
        weight = np.sqrt(self.effort)
        return (
            self._outcome(unknowns, float(rest @ rest), x),
            np.append(rest, weight * unknowns),
            np.vstack([jacobian, weight * np.eye(self.size)]),
        )

    @cached_property
    def _rollouts(self) -> Rollouts:
        scene, steps = self.control.scene, substeps(self.frames, self.solver.h)
        return Rollouts(scene, self.solver.core(scene.compiled), steps, keep_tape=False, solver=self.solver)

    def _cut(self, states: Array) -> Array:
        """(batch, frames, particles, 3) of (batch, frames, dofs)."""
        particles = self.control.scene.particle_count
        return np.asarray(states).reshape(len(states), len(self.frames), -1, 3)[:, :, :particles]

    def require_gradient(self, unknowns: Array) -> None:
        """Raises EmptyGradientError where the loss does not feel the control; effort is always felt and not counted."""
        self._rolled_back(unknowns)[2].require(self.control.scales)

    def _outcome(self, unknowns: Array, loss: float, x: Array) -> Outcome:
        error, speed = self.error(x), self.speed(x)
        return Outcome(loss + self.effort * float(unknowns @ unknowns), error, speed, self.reached(error, speed))

    def _rolled_back(self, unknowns: Array) -> tuple[Array, float, sb.Gradient]:
        rolled = sb.rollout(self.control.scene, self.frames, self.solver, self.control.values(unknowns))
        value, bar = self.loss(rolled.positions)
        return rolled.positions, value, rolled.gradient(bar)
