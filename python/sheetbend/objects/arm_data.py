"""A rigid arm of a scene: its particles, and the terms that move its end."""

from __future__ import annotations

from dataclasses import dataclass

from ..arrays.types import Array
from ..quantities.quantities import Term
from .markers import Place


@dataclass(frozen=True)
class Arm:
    """An arm in a scene.

    Attributes:
        name: quantities are called `<name>_...`.
        pivot, end: particles; the end carries the next arm.
        particles: all that are the arm's own (the pivot too where it is fixed).
        root: (3,) m, the fixed point that the linkage hangs from.
        motion: terms of the end's position and velocity, counted from the root.
    """

    name: str
    pivot: int
    end: int
    particles: tuple[int, ...]
    root: Array
    motion: tuple[Term, ...]

    def place(self, radius: float) -> Place:
        """A marker on the arm's line, `radius` m from the pivot whatever the arm's length is."""
        return Place((self.pivot, self.end), (1.0, 0.0), (-1.0, 1.0)).with_offset((radius, 0.0, 0.0))
