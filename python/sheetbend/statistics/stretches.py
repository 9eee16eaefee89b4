"""What an estimate from the beginnings of recordings would make of the errors of their other stretches.

Errors that change as slowly as a beginning is long vanish in its own fit: they go into the parameters, and the
residuals that are left tell nothing of them. The rest of the recordings shows such errors. So the estimate, near its
minimum a linear map of errors, is applied to the residuals of stretches of the same length elsewhere. Their scatter is
what the beginning of a right model may differ by.

But a wrong model leaves large residuals everywhere. The given sigma tells what size of errors its user puts up with.
`within_sigma` scales residuals down to what sigma leaves beside their white noise.
"""

from __future__ import annotations

import numpy as np

from ..arrays.types import Array
from .layout import Layout
from .white_noise import white_noise

OVERLAP = 4  # stretches begin apart by this part of their length


def scatter(residuals: Array, layout: Layout, part: Layout, jacobian: Array) -> Array:
    """(p, p) mean square of what the estimate from a part makes of residuals elsewhere.

    Every recording is gone through in a circle, in steps that are the same share of each, so that a short one has as
    many stretches as a long one.

    Args:
        residuals: (rows,) of the whole.
        layout: of these.
        part: of the data's rows of the part, which are the first frames of every recording.
        jacobian: (part's rows + others, p) of the part, of full column rank; rows of priors behind those of the data.
    """
    every = [_Series(residuals, layout, part, *owner) for owner in sorted(set(_owners(part)))]
    share = min(s.frames / len(s.errors) for s in every)
    steps = np.arange(share, 1.0 - share + 1e-9, share / OVERLAP) if share <= 0.5 else np.array([0.25, 0.5, 0.75])
    size = np.linalg.norm(jacobian, axis=0)
    estimate = np.linalg.pinv(jacobian / size)[:, : len(part.frame)] / size[:, None]
    made = sum(np.stack([estimate[:, s.rows] @ s.elsewhere(step) for step in steps]) for s in every)
    return np.asarray(np.transpose(made) @ made / len(steps))


def within_sigma(residuals: Array, layout: Layout) -> Array:
    """(rows,) weighted residuals, those of each recording scaled down so that what is slow in them is no larger than
    the given sigma leaves: by variances, 1 less the white noise."""
    scaled = residuals.copy()
    for i in np.unique(layout.recording).tolist():
        own = layout.recording == i
        white = white_noise(residuals, layout, i)
        slow = float(np.mean(residuals[own] ** 2)) - white
        if slow > 1.0 - white:
            scaled[own] *= np.sqrt((1.0 - white) / slow)
    return scaled


def _owners(layout: Layout) -> list[tuple[int, int]]:
    return list(zip(layout.recording.tolist(), layout.clocks.tolist(), strict=True))


class _Series:
    """One recording's frames: the residuals of the whole as (frames, channels), zero where none was seen, and the rows
    of the part that are among them."""

    def __init__(self, residuals: Array, layout: Layout, part: Layout, recording: int, clock: int) -> None:
        whole = np.flatnonzero((layout.recording == recording) & (layout.clocks == clock))
        self.rows = np.flatnonzero((part.recording == recording) & (part.clocks == clock))
        frame, first = layout.frame[whole], layout.frame[whole].min()
        channels, channel = np.unique(layout.channel[whole], return_inverse=True)
        self.errors = np.zeros((int(frame.max() - first) + 1, len(channels)))
        self.errors[frame - first, channel] = residuals[whole]
        self._frame = part.frame[self.rows] - first
        self._channel = np.searchsorted(channels, part.channel[self.rows])
        self.frames = int(self._frame.max()) + 1

    def elsewhere(self, step: float) -> Array:
        """(part's rows,) the residuals that lie later by a share of the recording."""
        shift = round(step * len(self.errors))
        return self.errors[(self._frame + shift) % len(self.errors), self._channel]
