"""What the controller of mpc.py moves: a rope that a hand swings up, and a towel that is folded on a table."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import sheetbend as sb
import torch
from sheetbend.torch import State, Stepper
from torch import Tensor

Now = tuple[State, Tensor]  # a state of the scene, and place and velocity of the hand (..., 2, 3) in m, m/s


@dataclass(frozen=True)
class Rope:
    """A rope of 0.3 m with a weight of 10 g hangs from a hand. The weight shall be above the hand and stay there.

    An action is the acceleration of the hand along each axis, at most 25 m/s^2.
    """

    stepper: Stepper
    goal: Tensor
    plans: int = 20  # of 0.1 s
    strongest = 25.0  # m/s^2
    near = 0.25  # m, how far from its first place the hand should be at most

    @staticmethod
    def make() -> Rope:
        scene = sb.Scene("rope")
        made = sb.add_rope(
            scene, length=0.3, segments=4, density=0.03, EI=5e-3, bend_damping=0.05, direction=(0, 0, -1)
        )
        scene.add_point_mass(int(made.particles[-1]), 0.01, "weight")
        scene.drive(made.particles[:1], [0.0], np.zeros((1, 1, 3)))
        return Rope(Stepper(scene, sb.Solver(h=1 / 120)), torch.tensor([0.0, 0.0, 0.28], dtype=torch.float64))

    def start(self) -> Now:
        return self.stepper.start(), torch.zeros(2, 3, dtype=torch.float64)

    def first_plan(self, knots: int) -> Tensor:
        """Back and forth: the gradient of a rope that hangs straight down has no component that leaves the vertical."""
        plan = torch.zeros(knots, 3, dtype=torch.float64)
        plan[:, 0] = torch.tensor([0.3, 0.0, -0.3, 0.0, 0.3])
        return plan

    def step(self, now: Now, action: Tensor) -> Now:
        state, hand = now
        h = self.stepper.solver.h
        speed = hand[..., 1, :] + h * self.strongest * torch.tanh(action)
        place = hand[..., 0, :] + h * speed
        return self.stepper(state, boundary=place[..., None, :]), torch.stack([place, speed], -2)

    def cost(self, now: Now, last: bool) -> Tensor:
        state, hand = now
        end = (state.positions[..., -1, :] - self.goal).square().sum(-1)
        end = end + 0.01 * state.velocities[..., -1, :].square().sum(-1)
        return (3.0 if last else 1.0) * end + 4.0 * (hand[..., 0, :].norm(dim=-1) - self.near).clamp(min=0) ** 2

    def missed(self, now: Now) -> float:
        """Distance of the end from where it shall be, m."""
        return float((now[0].positions[-1] - self.goal).norm())


@dataclass(frozen=True)
class Towel:
    """A towel of 0.3 m by 0.3 m lies on a table. One corner shall come to the opposite one, and the others shall stay.

    An action is the force on that corner along each axis, at most 0.3 N. The towel weighs 0.18 N.
    """

    stepper: Stepper
    corners: tuple[int, ...]  # pulled, opposite, the two others
    plans: int = 10  # of 0.1 s
    strongest = 0.3  # N

    @staticmethod
    def make(cells: int = 6) -> Towel:
        scene = sb.Scene("towel")
        mesh = sb.mesh.grid(0.3, 0.3, cells, cells, pattern="one_way")
        stiffness = {"warp": 40.0, "weft": 40.0, "shear": 4.0, "bending": 2e-5}
        damping = {"membrane_damping": 5e-3, "bend_damping": 2e-2, "drag_linear": 0.5}
        cloth = sb.add_cloth(scene, mesh, density=0.2, **stiffness, **damping)
        corners = tuple(int(cloth.particles[k]) for k in (0, -1, cells, -1 - cells))
        scene.add_force(corners[:1], np.zeros((1, 1, 3)))
        table = sb.Plane(name="table", point=(0.0, 0.0, -0.002))
        scene.add_contact(cloth, table, friction=0.5, radius=0.002)
        return Towel(Stepper(scene, sb.Solver(h=1 / 60, method="implicit")), corners)

    def start(self) -> Now:
        return self.stepper.start(), torch.zeros(0)

    def first_plan(self, knots: int) -> Tensor:
        """Up: a corner that lies on the table is held back by friction."""
        plan = torch.zeros(knots, 3, dtype=torch.float64)
        plan[:, 2] = 0.3
        return plan

    def step(self, now: Now, action: Tensor) -> Now:
        state, nothing = now
        return self.stepper(state, force=self.strongest * torch.tanh(action)[..., None, :]), nothing

    def cost(self, now: Now, last: bool) -> Tensor:
        x, v = now[0].positions, now[0].velocities
        pulled, opposite, *others = self.corners
        at_rest = self.stepper.start().positions
        end = (x[..., pulled, :] - at_rest[opposite]).square().sum(-1) + 0.01 * v[..., pulled, :].square().sum(-1)
        return (3.0 if last else 1.0) * end + 0.3 * (x[..., others, :] - at_rest[others]).square().sum((-1, -2))

    def missed(self, now: Now) -> float:
        """Distance of the corner from the opposite corner's first place, m."""
        return float((now[0].positions[self.corners[0]] - self.stepper.start().positions[self.corners[1]]).norm())
