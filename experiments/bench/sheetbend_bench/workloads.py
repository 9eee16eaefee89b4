"""The workloads: sheets and ropes of distance constraints, described so that any XPBD code can run them.

A sheet has rows x columns particles on a unit square (a rope is a sheet of one row on a unit length), x along the
columns and z along the rows, at rest, with gravity -9.81 m/s^2 along y. Particle 0 is pinned, and on a sheet the other
three corners. The free particles share the mass M as if the pinned ones had theirs too: w = n/M. Stretch constraints
link neighbors (on a sheet along both axes and both diagonals), bend constraints link each second particle along the
axes. Each frame is 1/60 s of `substeps` substeps of backward Euler with `iterations` Gauss-Seidel sweeps, color after
color.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from sheetbend.errors import InputError

Array = np.ndarray

GRAVITY = -9.81  # m/s^2, along y
SPREAD = np.array([0.754877666, 0.569840291, 0.438579021])  # a low-discrepancy row, per scene of a batch
CHECKED_SCENES = 8  # of a batch, spread evenly, whose gradients are compared with a reference


@dataclass(frozen=True)
class Links:
    """One color: particles (count, 2) that no two links share, their rest lengths (count,) m, and what they resist."""

    particles: Array
    rest: Array
    bend: bool


@dataclass(frozen=True)
class Workload:
    """A benchmark's scene and how it is stepped.

    Attributes:
        rows, columns: of particles; one row is a rope.
        frames, substeps, iterations: frames, substeps per frame, sweeps per substep.
        mass: M, kg.
        stretch, bend: compliances, m/N.
        scenes: 1, or how many ropes a batch has.
        bound: of the gradient's relative error.
        frame_rate: Hz.
    """

    name: str
    rows: int
    columns: int
    frames: int
    substeps: int
    iterations: int
    mass: float
    stretch: float
    bend: float
    scenes: int = 1
    bound: float = 1e-9
    frame_rate: float = 60.0

    @property
    def particles(self) -> int:
        """Of one scene."""
        return self.rows * self.columns

    @property
    def h(self) -> float:
        """Substep, s."""
        return 1 / self.frame_rate / self.substeps

    @property
    def steps(self) -> list[int]:
        """Substeps after which a frame is compared."""
        return [self.substeps * (k + 1) for k in range(self.frames)]

    @property
    def nominal(self) -> Array:
        """(stretch, bend, mass)."""
        return np.array([self.stretch, self.bend, self.mass])

    @property
    def parameters(self) -> Array:
        """(scenes, 3): nominal, and in a batch log-uniform over one decade around it from the second scene on."""
        u = np.arange(self.scenes)[:, None] * SPREAD % 1.0
        u[0] = 0.5
        return self.nominal * 10 ** (u - 0.5)

    @property
    def checked(self) -> list[int]:
        """Scenes whose gradient has a reference."""
        return sorted(set(np.linspace(0, self.scenes - 1, CHECKED_SCENES).astype(int).tolist()))

    def shortened(self, frames: int) -> Workload:
        """The same workload for fewer frames.

        Raises:
            InputError: not between 1 and the workload's frames.
        """
        if not 1 <= frames <= self.frames:
            raise InputError("frames", f"must lie between 1 and {self.frames}", frames, "leave it out for all of them")
        return replace(self, frames=frames)


WORKLOADS = {
    w.name: w
    for w in (
        Workload("W1", 1, 100, 120, 10, 10, mass=0.1, stretch=1e-4, bend=1e-2),
        Workload("W1s", 1, 100, 120, 20, 1, mass=0.1, stretch=1e-4, bend=1e-2, bound=1e-8),
        Workload("W2", 64, 64, 60, 10, 5, mass=0.3, stretch=1e-3, bend=1e-2, bound=1e-8),
        Workload("W5", 1, 100, 120, 10, 10, mass=0.1, stretch=1e-4, bend=1e-2, scenes=256),
    )
}
"""W1 a rope, W1s the same in small steps, W2 a cloth, W5 256 ropes of differing parameters. The bounds of W1s and W2
are wider, since the order of rounding alone moves their gradients by 1e-9."""


def workload(name: str) -> Workload:
    """A workload by name.

    Raises:
        InputError: there is none of this name.
    """
    if name not in WORKLOADS:
        raise InputError("workload", "is unknown", name, f"use one of: {', '.join(WORKLOADS)}")
    return WORKLOADS[name]


def start(w: Workload) -> Array:
    """Initial positions, (particles, 3) m."""
    row, column = np.divmod(np.arange(w.particles), w.columns)
    x = np.zeros((w.particles, 3))
    x[:, 0] = column / (w.columns - 1)
    x[:, 2] = row / max(w.rows - 1, 1)
    return x


def pinned(w: Workload) -> Array:
    """Indices of what is held."""
    last = w.particles - 1
    return np.array([0] if w.rows == 1 else [0, w.columns - 1, last - w.columns + 1, last])


def colors(w: Workload) -> list[Links]:
    """The links in the order in which a sweep visits them: two colors for each direction."""
    stretch = [(0, 1)] if w.rows == 1 else [(0, 1), (1, 0), (1, 1), (1, -1)]
    bend = [(0, 2)] if w.rows == 1 else [(0, 2), (2, 0)]
    x = start(w)
    row, column = np.divmod(np.arange(w.particles), w.columns)
    found = []
    for down, right in stretch + bend:
        there = (row + down < w.rows) & (column + right >= 0) & (column + right < w.columns)
        color = row // down % 2 if down else column // right % 2
        for wanted in (0, 1):
            first = np.flatnonzero(there & (color == wanted))
            pairs = np.stack([first, first + down * w.columns + right], axis=1)
            rest = np.linalg.norm(x[pairs[:, 0]] - x[pairs[:, 1]], axis=1)
            found.append(Links(pairs, rest, (down, right) in bend))
    return found


def projections(w: Workload) -> int:
    """Constraint projections of the whole workload."""
    return w.scenes * w.frames * w.substeps * w.iterations * sum(len(c.particles) for c in colors(w))


def direction(w: Workload) -> Array:
    """A rough direction of the initial positions, (particles, 3), along which their gradient is compared."""
    d = np.sin(1.0 + 0.7 * np.arange(3 * w.particles)).reshape(-1, 3)
    d[pinned(w)] = 0.0
    return d
