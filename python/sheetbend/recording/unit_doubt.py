"""Whether a recording's lengths can be in meters."""

from __future__ import annotations

import numpy as np

from ..files.units import METERS
from ..quantities.wording import short
from .recording import Recording

LONGEST = 20.0  # m, of what is recorded in meters: nothing that hangs in a hand is 700 m long


def extent(recording: Recording) -> float:
    """m, the diagonal of the box that all markers stay in."""
    x = recording.positions
    return float(np.linalg.norm(np.nanmax(x, axis=(0, 1)) - np.nanmin(x, axis=(0, 1))))


def unit_words(recording: Recording, unit: str, why: str) -> str:
    """Say how large a recording is in a unit that was assumed, and in others.

    Args:
        recording: in m, by `unit`.
        unit: the assumed unit.
        why: the reason for it, a clause.
    """
    size = extent(recording) / METERS[unit]
    others = ", ".join(f"in {other} {short(size * METERS[other], 3)} m" for other in METERS if other != unit)
    flat = (np.nanmax(recording.positions, axis=(0, 1)) == np.nanmin(recording.positions, axis=(0, 1))).any()
    return (
        f"lengths are taken as {unit}, {why}. The markers then move within {short(size * METERS[unit], 3)} m ({others})"
        f". If another unit is right, begin again with --units{'. Scale pixels to m first' if flat else ''}"
    )


def unit_doubt(recording: Recording) -> str | None:
    """The unit, "mm" or "cm", in which a recording is more plausible than in the one that was read; None where it is
    plausible as it is."""
    size = extent(recording)
    return None if size <= LONGEST else "cm" if size <= 10 * LONGEST else "mm"
