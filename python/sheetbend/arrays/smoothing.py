"""Smooth positions and velocities of a recorded motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .types import Array

FEWEST = 5  # frames that a parabola is fitted to
WIDER = (2.0, 2.8, 4.0, 5.6, 8.0)  # times a width: longer ones, in which a polynomial of degree 4 replaces a parabola


def smoothed(times: Array, positions: Array, width: float) -> tuple[Array, Array]:
    """Values and slopes of the parabola fitted around each frame (Savitzky & Golay 1964), one-sided at the ends.

    Args:
        times: (frames,) s, increasing; the intervals need not be equal.
        positions: (frames, ...) finite.
        width: s; fewer than five frames leave the positions as they are, with central differences.
    """
    step = float(np.median(np.diff(times)))
    frames = min(2 * round(width / step / 2) + 1, len(times) - (1 - len(times) % 2))
    if frames < 5:
        return positions, np.gradient(positions, times, axis=0)
    first = np.clip(np.arange(len(times)) - frames // 2, 0, len(times) - frames)
    unit = step * (frames // 2)
    powers = ((times[first[:, None] + np.arange(frames)] - times[:, None]) / unit)[..., None] ** np.arange(3)
    fit = np.linalg.pinv(powers)  # (frames, 3, window): value, slope and half the bend from the window's samples
    value, slope = sum(np.einsum("nc,n...->cn...", fit[:, :2, k], positions[first + k]) for k in range(frames))
    return value, slope / unit


@dataclass(frozen=True)
class LocalFit:
    """Smoothing by the polynomial fitted around each frame, one-sided at the ends.

    Attributes:
        width: s.
        degree: of the polynomial.
    """

    width: float
    degree: int

    def frames(self, times: Array) -> int:
        """How many frames (odd) a polynomial is fitted to."""
        return 2 * round(self.width / float(np.median(np.diff(times))) / 2) + 1

    def of(self, times: Array, positions: Array) -> tuple[Array, float]:
        """Smoothed positions, and the mean weight of a frame in its own value.

        Args:
            times: (frames,) s, increasing; the intervals need not be equal.
            positions: (frames, ...) finite.
        """
        count = self.frames(times)
        first = np.clip(np.arange(len(times)) - count // 2, 0, len(times) - count)
        apart = times[first[:, None] + np.arange(count)] - times[:, None]
        powers = (apart / np.abs(apart).max())[..., None] ** np.arange(self.degree + 1)
        value = np.zeros((len(times), self.degree + 1))
        value[:, 0] = 1.0
        inner = np.linalg.solve(np.swapaxes(powers, 1, 2) @ powers, value[..., None])
        weights = (powers @ inner)[..., 0]
        smooth = sum(np.einsum("n,n...->n...", weights[:, k], positions[first + k]) for k in range(count))
        return np.asarray(smooth), float(np.mean(weights[np.arange(len(times)), np.arange(len(times)) - first]))


def steadiest(times: Array, positions: Array, width: float, wider: Sequence[float] = WIDER) -> LocalFit | None:
    """How positions are best smoothed, over `width` s or more: what is smoothest where they are noise beside a slow
    motion, and no more than `width` where they are not. Decided by generalized cross-validation (Craven & Wahba 1979).

    Args:
        times: (frames,) s, increasing.
        positions: (frames, ...) finite.
        width: s.
        wider: times `width`, ascending, what else is tried.

    Returns:
        None where `width` holds too few frames to smooth over.
    """
    narrow, least = LocalFit(width, 2), np.inf
    best: LocalFit | None = None
    if not FEWEST <= narrow.frames(times) <= len(times):
        return None
    for tried in (narrow, *(LocalFit(factor * width, 4) for factor in wider)):
        if tried.frames(times) > len(times):
            break
        smooth, own = tried.of(times, positions)
        score = float(np.mean((positions - smooth) ** 2)) / (1.0 - own) ** 2
        if score < least:
            best, least = tried, score
    return best


def state_at(times: Array, positions: Array, at: float, width: float) -> tuple[Array, Array]:
    """Positions and velocities (markers, 3) of the parabola through the frames within `width` s about a time; NaN for
    markers that are seen in fewer than `FEWEST` of them.

    Args:
        times: (frames,) s, increasing.
        positions: (frames, markers, 3) m, NaN = not seen.
    """
    order = np.argsort(np.abs(times - at), kind="stable")
    near = np.sort(order[: max(FEWEST, int((np.abs(times - at) <= width / 2).sum()))])
    x, v = (np.full(positions.shape[1:], np.nan) for _ in range(2))
    for marker in range(positions.shape[1]):
        seen = near[~np.isnan(positions[near, marker, 0])]
        if len(seen) >= FEWEST:
            unit = float(np.ptp(times[seen])) / 2
            powers = np.vander((times[seen] - at) / unit, 3, increasing=True)
            x[marker], v[marker], _ = np.linalg.lstsq(powers, positions[seen, marker], rcond=None)[0]
            v[marker] /= unit
    return x, v
