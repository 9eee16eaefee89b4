"""torch: eager autograd, one gather and one index_add per color, a checkpoint per frame where the graph is large."""

from __future__ import annotations

import harness
import torch
from torch.utils.checkpoint import checkpoint

p, _ = harness.load()
torch.set_default_dtype(torch.float64)
torch.set_num_threads(1)
LARGE = 1000  # particles of all scenes, from which on frames are run again in the reverse

factor = torch.tensor(p.inverse_mass_factor)[:, None]
fall = torch.tensor(p.gravity) * p.h * (factor > 0)
target = torch.tensor(p.target)
colors = []
for a, b in p.color_ranges:
    i, j = torch.tensor(p.links[a:b]).T.contiguous()
    weights = torch.cat([factor[i], -factor[j]]), factor[i] + factor[j]
    colors.append((torch.cat([i, j]), b - a, torch.tensor(p.rest[a:b, None]), int(p.bend[a]), *weights))


def frame(x, v, mass, alpha):
    for _ in range(p.substeps):
        q = x + p.h * (v + fall)
        multipliers = [0.0] * len(colors)
        for _ in range(p.iterations):
            for k, (ends, count, rest, kind, signed, both) in enumerate(colors):
                at = q.index_select(1, ends)
                d = at[:, :count] - at[:, count:]
                length = torch.linalg.vector_norm(d, dim=2, keepdim=True)
                a = alpha[:, kind, None, None]
                change = (rest - length - a * multipliers[k]) / (both / mass + a)
                multipliers[k] = multipliers[k] + change
                push = d * (change / (mass * length))
                q = q.index_add(1, ends, signed * torch.cat([push, push], 1))
        x, v = q, (q - x) / p.h
    return x, v


def losses(parameters, x, again):
    mass, alpha = parameters[:, 2, None, None], parameters[:, :2] / p.h**2
    v, total = torch.zeros_like(x), torch.zeros(len(x))
    for wanted in target:
        x, v = checkpoint(frame, x, v, mass, alpha, use_reentrant=False) if again else frame(x, v, mass, alpha)
        total = total + 0.5 * ((x - wanted) ** 2).sum((1, 2))
    return total


def forward():
    with torch.no_grad():
        return losses(torch.tensor(p.parameters), start.clone(), again=False).numpy()


def gradient():
    parameters, x = torch.tensor(p.parameters, requires_grad=True), start.clone().requires_grad_()
    total = losses(parameters, x, again=x.shape[0] * x.shape[1] > LARGE)
    total.sum().backward()
    return total.detach().numpy(), parameters.grad.numpy(), x.grad.numpy()


start = torch.tensor(p.start).repeat(len(p.parameters), 1, 1)
harness.run("torch", torch.__version__, forward, gradient)
