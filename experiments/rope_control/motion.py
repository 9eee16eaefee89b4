"""Motions that are controlled: cubic splines whose knots are quantities of a scene."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import sheetbend as sb
from scipy.interpolate import CubicSpline
from scipy.linalg import block_diag

Array = np.ndarray
RATE = 100  # Hz, of the boundary knots that carry a motion


@dataclass(frozen=True)
class Motion:
    """How far something is moved over time: a cubic spline through knots, at rest before it starts.

    Attributes:
        seconds: how long it lasts, from time zero.
        knots: how many are free; the first is zero and not counted.
        stops: whether it comes to rest at its end; it then stays there.
    """

    seconds: float
    knots: int
    stops: bool

    @cached_property
    def spline(self) -> CubicSpline:
        times = np.linspace(0.0, self.seconds, self.knots + 1)
        ends = ("clamped", "clamped" if self.stops else "natural")
        return CubicSpline(times, np.eye(self.knots + 1)[:, 1:], bc_type=ends)

    def places(self, times: Array) -> Array:
        """(times, knots): what each knot does."""
        return np.asarray(self.spline(np.minimum(times, self.seconds)))

    def mean_square(self, derivative: int) -> Array:
        """(knots, knots): the mean square over time of the motion (0) or of its acceleration (2), as a form."""
        values = self.spline(np.linspace(0.0, self.seconds, 40 * self.knots + 1), derivative)
        return np.asarray(values.T @ values / len(values))


@dataclass
class Control:
    """The motions that a scene is moved by, each a channel of knots that are quantities of the scene.

    The unknowns are such that a motion's effort is the sum of their squares: a step of any optimizer is then a smooth
    motion, and one of size 1 is a likely one.

    Attributes:
        scales: by quantity, how far it is likely to move, m or rad.
        blocks: per channel (knots, knots), its knots from its unknowns.
    """

    scene: sb.Scene
    motion: Motion
    scales: dict[str, float] = field(default_factory=dict)
    blocks: list[Array] = field(default_factory=list)

    def add(self, name: str, unit: str, reach: float, acceleration: float, moved: dict[int, Array]) -> None:
        """Let knots move driven particles: by each particle's vector (3,) for every unit of the channel.

        Args:
            reach, acceleration: root mean squares over time that cost an effort of 1 each, in units and per s^2.
        """
        places = self.motion.places(self.scene.boundary.times)
        for k in range(self.motion.knots):
            knot = self.scene.add_quantity(f"{name}_{k + 1}", 0.0, unit, positive=False, scale=reach)
            for particle, vector in moved.items():
                self.scene.add_motion_term(particle, np.outer(places[:, k], vector), {knot: "identity"})
            self.scales[knot] = reach
        form = self.motion.mean_square(2) / acceleration**2 + self.motion.mean_square(0) / reach**2
        self.blocks.append(np.linalg.inv(np.linalg.cholesky(form)).T)

    @cached_property
    def knots(self) -> Array:
        """(quantities, unknowns)."""
        return np.asarray(block_diag(*self.blocks))

    def values(self, unknowns: Array) -> dict[str, float]:
        """Quantities of the scene from unknowns."""
        return dict(zip(self.scales, (self.knots @ unknowns).tolist(), strict=True))
