"""A network learns the force that a model of a rope lacks, through 200 substeps of the simulation.

    python experiments/one_substep/residual.py

The recordings are those of a twin: a rope that swings in air, whose drag grows with the square of the speed. The model
has linear drag alone. Its coefficient is fitted first; then a network adds a force on each particle, as a function of
the particle's speed, and is trained on the same recordings. Both are judged by throws that neither has seen.
"""

from __future__ import annotations

import math

import numpy as np
import sheetbend as sb
import torch
from sheetbend.torch import Stepper
from torch import Tensor, nn

SOLVER, SUBSTEPS = sb.Solver(h=1 / 240), 200
LINEAR, QUADRATIC, NOISE = 1e-3, 0.02, 1e-3  # the twin's drag, N s/m^2 and N s^2/m^3; noise of its markers, m
LENGTH, SEGMENTS = 0.6, 8


def rope(linear: float, quadratic: float = 0.0) -> sb.Scene:
    """A rope of 0.6 m that is pinned at one end and can be pushed at each particle."""
    scene = sb.Scene("rope")
    scene.add_force(_nodes(scene, linear, quadratic)[1:], np.zeros((1, SEGMENTS, 3)))
    return scene


def _nodes(scene: sb.Scene, linear: float, quadratic: float) -> np.ndarray:
    drag = {"drag_linear": linear, "drag_quadratic": quadratic}
    made = sb.add_rope(scene, length=LENGTH, segments=SEGMENTS, density=0.02, EI=1e-4, bend_damping=1e-3, **drag)
    scene.pin(made.particles[:1])
    return made.particles


class Push(nn.Module):
    """Force on each particle along its velocity: -g(speed) velocity, in which a network makes g."""

    def __init__(self) -> None:
        super().__init__()
        self.net = nn.Sequential(nn.Linear(1, 16), nn.Tanh(), nn.Linear(16, 1)).double()
        nn.init.zeros_(self.net[2].weight)
        nn.init.zeros_(self.net[2].bias)

    def forward(self, velocity: Tensor) -> Tensor:
        speed = (velocity.square().sum(-1, keepdim=True) + 1e-12).sqrt()
        return -1e-3 * self.net(speed) * velocity  # N, of particles that weigh 1.5 g


def throws(stepper: Stepper, count: int, seed: int) -> Tensor:
    """Velocities (count, particles, 3) at the start: the rope turns about its pinned end, in any direction."""
    rng = np.random.default_rng(seed)
    x = stepper.start().positions
    spin = torch.from_numpy(rng.uniform(-1, 1, (count, 1, 3)) * 8.0)
    return torch.cross(spin.expand(count, *x.shape), (x - x[0]).expand(count, *x.shape), dim=-1)


def motion(stepper: Stepper, start: Tensor, inputs: Tensor | None, push: Push | None) -> Tensor:
    """Positions (substeps, throws, particles, 3)."""
    offset, size = stepper.scene.compiled.layout["velocity"]
    base = (stepper.inputs() if inputs is None else inputs).expand(len(start), -1)
    own = torch.cat([base[:, :offset], start.flatten(1), base[:, offset + size :]], -1)
    state, seen = stepper.start(own), []
    for _ in range(SUBSTEPS):
        given = {} if push is None else {"force": push(state.velocities[:, 1:])}
        state = stepper(state, own, **given)
        seen.append(state.positions)
    return torch.stack(seen)


def rms(difference: Tensor) -> float:
    return math.sqrt(float(difference.detach().square().sum(-1).mean()))


def fit_linear(stepper: Stepper, start: Tensor, seen: Tensor, steps: int = 6) -> Tensor:
    """The drag coefficient that the model alone is best with; log scale, since it is positive."""
    log = torch.tensor(math.log(5e-3), dtype=torch.float64, requires_grad=True)
    search = torch.optim.LBFGS([log], max_iter=steps, line_search_fn="strong_wolfe")

    def loss() -> Tensor:
        search.zero_grad()
        found = motion(stepper, start, stepper.inputs({"rope_drag_linear": log.exp()}), None)
        value = 1e4 * (found - seen).square().sum(-1).mean()
        value.backward()
        return value

    search.step(loss)
    return log.exp().detach()


def train(stepper: Stepper, start: Tensor, seen: Tensor, inputs: Tensor, steps: int) -> Push:
    """A network that was trained through all substeps of the recordings."""
    torch.manual_seed(0)
    push = Push()
    search = torch.optim.LBFGS(push.parameters(), max_iter=steps, line_search_fn="strong_wolfe")

    def loss() -> Tensor:
        search.zero_grad()
        value = 1e4 * (motion(stepper, start, inputs, push) - seen).square().sum(-1).mean()
        value.backward()
        return value

    search.step(loss)
    return push


def laws(speed: float, drag: float, push: Push) -> tuple[float, float]:
    """Drag per length over speed at a speed [N s/m^2]: what the model lacks, and what the network adds."""
    velocity = torch.tensor([[speed, 0.0, 0.0]], dtype=torch.float64)
    with torch.no_grad():
        added = -float(push(velocity)[0, 0]) / speed / (LENGTH / SEGMENTS)
    return LINEAR + QUADRATIC * speed - drag, added


def main(train_throws: int = 4, new_throws: int = 4, steps: int = 15) -> tuple[float, float]:
    """Root mean square errors on new throws: of the model alone, and with the network [m]."""
    twin, model = Stepper(rope(LINEAR, QUADRATIC), SOLVER), Stepper(rope(5e-3), SOLVER)
    old, new = throws(twin, train_throws, 0), throws(twin, new_throws, 1)
    with torch.no_grad():
        clean, unseen = motion(twin, old, None, None), motion(twin, new, None, None)
    seen = clean + NOISE * torch.from_numpy(np.random.default_rng(2).standard_normal(clean.shape))
    drag = fit_linear(model, old, seen)
    inputs = model.inputs({"rope_drag_linear": float(drag)})
    push = train(model, old, seen, inputs, steps)
    with torch.no_grad():
        alone, helped = motion(model, new, inputs, None), motion(model, new, inputs, push)
    errors = rms(alone - unseen), rms(helped - unseen)
    print(f"linear drag fitted to {train_throws} throws: {float(drag):.2e} N s/m^2")
    print(f"{new_throws} new throws, {SUBSTEPS} substeps, rms error of the particles:")
    print(f"  linear drag alone          {1e3 * errors[0]:6.2f} mm")
    print(f"  with the network's force   {1e3 * errors[1]:6.2f} mm, {errors[1] / errors[0]:.2f} of it")
    print("drag over speed, per length, that the model lacks and that the network adds [1e-2 N s/m^2]:")
    for speed in (0.5, 1.0, 2.0, 3.0, 4.0):
        lacks, adds = laws(speed, float(drag), push)
        print(f"  at {speed:.1f} m/s  {1e2 * lacks:+6.2f}  {1e2 * adds:+6.2f}")
    less = 1 - errors[1] / errors[0]
    print(f"The coefficient is fitted to the same throws: {less:.0%} less error is the network's work.")
    return errors


if __name__ == "__main__":
    main()
