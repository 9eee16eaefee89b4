"""Pulls of knits that lock, made up: loops of yarn that are unbent, and a yarn that stretches once they are straight.

A quarter of a loop is a planar elastica, clamped in direction at its crest and free of moment at its inflection, at
rest bent to theta = a cos(pi s/2). Its axis stretches by a yarn's law, EA sinh(c e)/c. Four loops of different bends
stand in series. None of the laws that are fitted is in it.
"""

from dataclasses import dataclass

import numpy as np

CELLS, LOOPS, REPEATS = 24, 4, 5
FORCES = np.geomspace(0.02, 4000.0, 70)  # of EI over the square of a quarter loop's length
END = 30.0  # N, where a pull ends
PRETENSION = 1.0  # N
POINTS = 120  # of a repeat


@dataclass(frozen=True)
class MadePull:
    """Repeats of one knit: strain and force (N) from the pretension on, both rising; end: largest strain of all."""

    repeats: tuple[tuple[np.ndarray, np.ndarray], ...]
    end: float


def loop_strains(bends, EA, stiffening, forces=FORCES):
    """Strains (forces, m) of quarter loops with rest angles `bends` (m,) rad at their inflections, EI = length = 1."""
    h = 1.0 / CELLS
    s = (np.arange(CELLS) + 0.5) * h
    rest = bends[:, None] * np.cos(np.pi * s / 2.0)
    bending = (2.0 * np.eye(CELLS) - np.eye(CELLS, k=1) - np.eye(CELLS, k=-1)) / h
    bending[0, 0], bending[-1, -1] = 1.0 / h, 3.0 / h  # no moment at the inflection, no angle at the crest
    EA, stiffening = EA[:, None], stiffening[:, None]
    diagonal, theta, found = np.arange(CELLS), rest.copy(), []
    for force in forces:
        for _ in range(30):
            pull = force * np.cos(theta) * stiffening / EA
            stretch = np.arcsinh(pull) / stiffening
            softness = np.cos(theta) / (EA * np.sqrt(1.0 + pull**2))
            residual = (theta - rest) @ bending + h * force * (1.0 + stretch) * np.sin(theta)
            jacobian = np.broadcast_to(bending, (len(bends), CELLS, CELLS)).copy()
            turning = (1.0 + stretch) * np.cos(theta) - force * np.sin(theta) ** 2 * softness
            jacobian[:, diagonal, diagonal] += h * force * turning
            step = np.linalg.solve(jacobian, -residual[..., None])[..., 0]
            theta = theta + step
            if np.abs(step).max() < 1e-9:
                break
        stretch = np.arcsinh(force * np.cos(theta) * stiffening / EA) / stiffening
        found.append(((1.0 + stretch) * np.cos(theta)).sum(axis=1) / np.cos(rest).sum(axis=1) - 1.0)
    return np.array(found)


def made(count, seed):
    """A population: bends of 45 to 105 degrees, EA of 50 to 5,000, each pulled to where its force is 2.2 to 9 times
    that at 60 % of the strain; repeats that differ in force, slack and stick-slip."""
    random = np.random.default_rng(seed)
    middle, unequal = np.radians(random.uniform(45, 105, count)), random.uniform(0.02, 0.12, count)
    bends = middle[:, None] * (1.0 + unequal[:, None] * np.linspace(-1.0, 1.0, LOOPS))
    EA, stiffening = np.exp(random.uniform(np.log(50), np.log(5000), count)), random.uniform(0.1, 15, count)
    strains = loop_strains(bends.ravel(), np.repeat(EA, LOOPS), np.repeat(stiffening, LOOPS))
    strains = strains.reshape(len(FORCES), count, LOOPS).mean(axis=2)
    return [_pulled(np.r_[0.0, strains[:, k]], np.r_[0.0, FORCES], random) for k in range(count)]


def _pulled(strain, force, random):
    ratio = np.exp(random.uniform(np.log(2.2), np.log(9.0)))
    ratios = force[5:] / np.interp(0.6 * strain[5:], strain, force)
    k = 5 + int(np.argmax(ratios >= ratio) if (ratios >= ratio).any() else np.argmax(ratios))
    end, scale = strain[k], END / force[k]
    gains, slacks, noise = random.uniform(0.03, 0.09), random.uniform(0.01, 0.04), random.uniform(0.005, 0.025)
    repeats = []
    for repeat in range(REPEATS):
        first = 0.05 if repeat == 0 else 0.0  # the first pull sets a knit
        gain, stretch = np.exp(gains * random.normal() + first), 1.0 + slacks * random.normal()
        x = np.linspace(0.0, 1.15 * end, POINTS)[1:]
        smooth = gain * scale * np.exp(np.interp(x * stretch, strain[1:], np.log(force[1:])))
        f = np.r_[0.0, np.maximum.accumulate(smooth * np.exp(noise * _wandering(len(x), random)))]
        x = np.r_[0.0, x]
        slack, kept = np.interp(PRETENSION, f, x), (f > PRETENSION) & (f < END)
        repeats.append((np.r_[0.0, (1.0 + x[kept]) / (1.0 + slack) - 1.0], np.r_[PRETENSION, f[kept]]))
    return MadePull(tuple(repeats), max(float(x[-1]) for x, _ in repeats))


def _wandering(count, random, memory=6.0):
    """Noise of variance 1 that forgets within `memory` points."""
    keep, out = np.exp(-1.0 / memory), np.zeros(count)
    for k in range(1, count):
        out[k] = keep * out[k - 1] + np.sqrt(1.0 - keep**2) * random.normal()
    return out
