"""Where markers sit beside the rope's axis: glued to its surface, fixed in its frame, the same in every recording.

A simulation tells where the axis is. So the offsets are found from what it leaves, by linear least squares, and the
recordings are moved by them onto the axis: what is compared, and the shape that a motion starts from. The rope's frames
come from a simulation that has seen the first frames alone, so that a prediction sees no more with offsets than
without.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..arrays.types import Array
from ..errors import SheetbendError
from .model import RopeModel
from .motion import GrippedMotion
from .offsets import frames_at_markers
from .slid import window_of

LARGE = 5e-3  # m, of an offset, standard deviation
ALIKE = 20.0  # frames over which residuals of a moving rope are alike, at least
Offsets = tuple[tuple[float, float], ...]
"""Of each free marker, m, about the rope's two directors."""


def frames_of(model: RopeModel, motion: GrippedMotion, values: Mapping[str, float]) -> Array:
    """(frames, free markers, 2, 3): the rope's directors at its markers, predicted from the first frame.

    Raises:
        SheetbendError: the motion diverges.
    """
    e = window_of(model, motion, None, values)
    known = {name: value for name, value in values.items() if name in e.scene.quantities}
    return frames_at_markers(e, motion.recording, known)


def beside(model: RopeModel, motion: GrippedMotion, values: Mapping[str, float], offsets: Offsets) -> Array:
    """(frames, free markers, 3) m, from the axis to the markers; not a number where the motion diverges."""
    try:
        frames = frames_of(replace(model, beside=()), motion, values)
    except SheetbendError:
        return np.full((len(motion.recording.times), len(motion.free), 3), np.nan)
    return np.asarray(np.einsum("fmkx,mk->fmx", frames, np.array(offsets)))


def offsets_found(
    motions: Sequence[GrippedMotion], predicted: Sequence[Array], frames: Sequence[Array]
) -> Offsets | None:
    """The offsets that leave the least, with a prior of 5 mm; None where a prediction is not finite.

    Args:
        motions: not moved.
        predicted: of each (frames, markers, 3) m, of the axis.
        frames: of each (frames, free markers, 2, 3), from `frames_of`.
    """
    count = len(motions[0].free)
    H, g, size, rows = np.zeros((count, 2, 2)), np.zeros((count, 2)), 0.0, 0
    for motion, x, axes in zip(motions, predicted, frames, strict=True):
        free = list(motion.free)
        if not (np.isfinite(x[:, free]).all() and np.isfinite(axes).all()):
            return None
        r = motion.recording.positions[:, free] - x[:, free]
        seen = np.isfinite(r).all(axis=2)
        r, axes = np.where(seen[..., None], r, 0.0), axes * seen[..., None, None]
        H += np.einsum("fmkx,fmlx->mkl", axes, axes)
        g += np.einsum("fmkx,fmx->mk", axes, r)
        size, rows = size + float(np.square(r).sum()), rows + 3 * int(seen.sum())
    prior = ALIKE * size / max(rows, 1) / LARGE**2
    found = np.linalg.solve(H + prior * np.eye(2), g[..., None])[..., 0]
    return tuple((float(a), float(b)) for a, b in found)
