"""A feedback policy, trained through the simulation: a hand brings the end of a rope to where it shall be.

python experiments/one_substep/policy.py
"""

import numpy as np
import sheetbend as sb
import torch
from sheetbend.torch import Stepper

torch.manual_seed(0)
h, count = 1 / 60, 150  # 2.5 s
rope = sb.rope(0.3, 4, density=0.1, EI=1e-4, drag_linear=2e-2, start=(0, 0, 0), direction=(0, 0, -1), pinned=())
rope.drive([0], [0.0], np.zeros((1, 1, 3)))  # the hand holds the first particle
stepper = Stepper(rope, sb.Solver(h=h), dtype=torch.float32)
policy = torch.nn.Sequential(torch.nn.Linear(9, 32), torch.nn.Tanh(), torch.nn.Linear(32, 3))
torch.nn.init.zeros_(policy[2].weight)
start = torch.tensor([0.0, 0.0, -0.3])  # of the rope's end


def run(target):
    """Distances of the rope's end from its targets in the last 0.3 s, m."""
    state, hand, far = stepper.start(), torch.zeros(len(target), 3), []
    for k in range(count):
        tip, speed = (x[..., 4, :].expand_as(target) for x in (state.positions, state.velocities))
        seen = 5 * torch.cat([target - tip, tip - start - hand, 0.2 * speed], -1)
        hand = hand + h * 0.5 * torch.tanh(5 * (target - start - hand) + policy(seen))  # at most 0.5 m/s along an axis
        state = stepper(state, boundary=hand[:, None])
        if k >= count - 18:
            far.append((state.positions[:, 4] - target).norm(dim=-1))
    return torch.stack(far)


def score(name, count=200):
    with torch.no_grad():
        new = torch.rand(count, 3, generator=torch.Generator().manual_seed(1))
        worst = run(start + 0.4 * (new - 0.5)).max(0).values
    near, most = (worst < 0.02).float().mean(), float(worst.quantile(0.9))
    print(f"{name}: {near:.0%} of {count} new targets within 2 cm, 90 % {most:.4f} m")
    return most


def main(rounds=60, count=200):
    before = score("before training", count)
    optimizer = torch.optim.Adam(policy.parameters(), lr=1e-2)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, rounds)
    for _ in range(rounds):
        optimizer.zero_grad()
        run(start + 0.4 * (torch.rand(16, 3) - 0.5)).mean().backward()
        optimizer.step()
        schedule.step()
    return before, score("after training", count)


if __name__ == "__main__":
    main()
