"""What motions of a gripped rope tell of themselves: which way is down, and their unit."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..arrays.types import Array
from .model import GRAVITY
from .motion import GrippedMotion

SAGS = 0.05  # of the length: less has no direction
FAST = 2.0  # mean squared speed over g times the length
SHORT = 0.01  # m


ALONG = 0.9  # of the sag, that is along one axis where that axis may point down


def gravities(motions: Sequence[GrippedMotion]) -> tuple[tuple[float, float, float], ...]:
    """Gravities, m/s^2, that recordings may mean that tell none: the usual one, and the one along the axis of their sag
    where the sag contradicts it. A stiff rope may be bent upwards, so that the sag alone does not decide."""
    found = sag_axis(motions)
    if not _contradicts(motions, GRAVITY) or found is None:
        return (GRAVITY,)
    axis, sign = found
    down = np.zeros(3)
    down[axis] = float(np.linalg.norm(GRAVITY)) * sign
    return GRAVITY, (float(down[0]), float(down[1]), float(down[2]))


def sag_axis(motions: Sequence[GrippedMotion]) -> tuple[int, int] | None:
    """The axis along which a rope clearly sags, and the sign; None where there is none."""
    sag, length = _sag(motions), float(np.mean([m.length for m in motions]))
    size, axis = float(np.linalg.norm(sag)), int(np.argmax(np.abs(sag)))
    if size <= SAGS * length or abs(sag[axis]) < ALONG * size:
        return None
    return axis, int(np.sign(sag[axis]))


def _sag(motions: Sequence[GrippedMotion]) -> Array:
    return np.asarray(np.mean([m.sag for m in motions], axis=0))


def _contradicts(motions: Sequence[GrippedMotion], gravity: Sequence[float] | Array) -> bool:
    """Whether the rope sags clearly, and along another direction."""
    sag, g = _sag(motions), np.array(gravity)
    size, length = float(np.linalg.norm(g)), float(np.mean([m.length for m in motions]))
    clear = size > 0.0 and np.linalg.norm(sag) > SAGS * length
    return bool(clear and sag @ g < 0.5 * np.linalg.norm(sag) * size)


def doubts(motions: Sequence[GrippedMotion], gravity: Sequence[float]) -> tuple[str, ...]:
    """Sentences on a gravity and a unit that the motions speak against.

    Args:
        motions: of one rope.
        gravity: m/s^2, where the recordings do not tell.
    """
    found = []
    g = np.array(next((m.recording.gravity for m in motions if m.recording.gravity is not None), gravity))
    size = float(np.linalg.norm(g))
    length = float(np.mean([m.length for m in motions]))
    if _contradicts(motions, g):
        found.append(
            f"the rope sags along {_numbers(_sag(motions))} m, gravity points along {_numbers(g)}: check `gravity`"
        )
    speed = float(np.sqrt(np.mean([np.nanmean((m.velocities**2).sum(axis=2)) for m in motions])))
    if length < SHORT or 0.0 < FAST * size * length < speed**2:
        found.append(f"the rope is {length:.3g} m long and moves at {speed:.3g} m/s on average: check `units`")
    return tuple(found)


def _numbers(vector: Array) -> str:
    return f"[{', '.join(f'{x:.3g}' for x in vector)}]"
