"""numba: the plain loop, compiled; it has no reverse mode."""

from __future__ import annotations

import harness
import numba
import numpy as np

p, _ = harness.load()


@numba.njit(error_model="numpy")
def loss(links, rest, bend, factor, x0, target, gravity, h, frames, substeps, iterations, stretch, soft, mass):
    n = len(x0)
    alpha = np.array([stretch, soft]) / h**2
    w = factor / mass
    x, q, v, multiplier = x0.copy(), x0.copy(), np.zeros_like(x0), np.zeros(len(rest))
    total = 0.0
    for frame in range(frames):
        for _ in range(substeps):
            for i in range(n):
                for d in range(3):
                    if factor[i] > 0:
                        v[i, d] += h * gravity[d]
                    q[i, d] = x[i, d] + h * v[i, d]
            multiplier[:] = 0.0
            for _ in range(iterations):
                for k in range(len(rest)):
                    i, j, a = links[k, 0], links[k, 1], alpha[bend[k]]
                    dx, dy, dz = q[i, 0] - q[j, 0], q[i, 1] - q[j, 1], q[i, 2] - q[j, 2]
                    length = np.sqrt(dx * dx + dy * dy + dz * dz)
                    change = (rest[k] - length - a * multiplier[k]) / (w[i] + w[j] + a)
                    multiplier[k] += change
                    push_i, push_j = w[i] * change / length, w[j] * change / length
                    q[i, 0] += push_i * dx
                    q[i, 1] += push_i * dy
                    q[i, 2] += push_i * dz
                    q[j, 0] -= push_j * dx
                    q[j, 1] -= push_j * dy
                    q[j, 2] -= push_j * dz
            for i in range(n):
                for d in range(3):
                    v[i, d] = (q[i, d] - x[i, d]) / h
                    x[i, d] = q[i, d]
        for i in range(n):
            for d in range(3):
                total += 0.5 * (x[i, d] - target[frame, i, d]) ** 2
    return total


def forward() -> list[float]:
    scene = (p.links, p.rest, p.bend, p.inverse_mass_factor, p.start, p.target, p.gravity)
    return [loss(*scene, p.h, p.frames, p.substeps, p.iterations, *row) for row in p.parameters]


harness.run("numba", numba.__version__, forward)
