"""Driven motion that is known in a frame of its own, whose place and attitude may be quantities of the scene."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Protocol

from numpy.typing import ArrayLike

from ..arrays.types import Array
from .body import FrameState
from .held import HeldScene


class HasCorrection(Protocol):
    """A frame of poses whose quantities correct them (`HandEye`)."""

    def drive(
        self, scene: Any, particles: ArrayLike, times: Array, motion: Array, vectors: ArrayLike = False
    ) -> None: ...

    def turned(self, by: Array, factors: Mapping[str, str]) -> Iterator[tuple[dict[str, str], Array]]: ...

    def corrected_start(self, scene: Any, start: FrameState) -> FrameState: ...


def drive_in_frame(
    scene: HeldScene,
    frame: HasCorrection | None,
    particles: ArrayLike,
    times: Array,
    motion: Array,
    vectors: ArrayLike = False,
) -> None:
    """Drive particles along a motion (knots, particles, 3) m that a frame corrects; None = the world's own.

    Args:
        times: (knots,) s.
        vectors: (particles,) which of them are directions, that a frame turns and does not shift.
    """
    if frame is None:
        scene.drive(particles, times, motion)
    else:
        frame.drive(scene, particles, times, motion, vectors=vectors)


def add_motion_in_frame(
    scene: HeldScene, frame: HasCorrection | None, particles: ArrayLike, by: Array, factors: Mapping[str, str]
) -> None:
    """Add `by`, (knots, 3) or (knots, particles, 3), times a product of functions of quantities to driven particles."""
    terms = [(dict(factors), by)] if frame is None else frame.turned(by, factors)
    for all_factors, coefficients in terms:
        scene.add_motion_term(particles, coefficients, all_factors)
