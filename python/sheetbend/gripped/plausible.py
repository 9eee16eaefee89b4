"""What motions of a gripped rope tell of themselves: which way is down, and their unit."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .motion import Array, GrippedMotion

SAGS = 0.05  # of the length: less has no direction
FAST = 2.0  # mean squared speed over g times the length
SHORT = 0.01  # m


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
    sag = np.mean([m.sag for m in motions], axis=0)
    if size > 0.0 and np.linalg.norm(sag) > SAGS * length and sag @ g < 0.5 * np.linalg.norm(sag) * size:
        found.append(f"the rope sags along {_numbers(sag)} m, gravity points along {_numbers(g)}: check `gravity`")
    speed = float(np.sqrt(np.mean([np.nanmean((m.velocities**2).sum(axis=2)) for m in motions])))
    if length < SHORT or 0.0 < FAST * size * length < speed**2:
        found.append(f"the rope is {length:.3g} m long and moves at {speed:.3g} m/s on average: check `units`")
    return tuple(found)


def _numbers(vector: Array) -> str:
    return f"[{', '.join(f'{x:.3g}' for x in vector)}]"
