"""Motions as small JSON values: 16-bit places over the motion's extent, in base64, and no more frames than fit."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..arrays.types import Array
from .shown import Sheet, Shown

MOST_FRAMES = 300  # drawn of one motion
MOST_BYTES = 3_000_000  # of all motions of a page
MISSING = -32768  # of a marker that was not seen
_FULL = 32767
_SHADES = 255


def packed_motions(motions: Sequence[Shown]) -> list[dict[str, Any]]:
    """All motions of a page as JSON values; frames are left out evenly where there are too many."""
    counts = [min(len(m.times), MOST_FRAMES) for m in motions]
    sizes = [_bytes_of_a_frame(m) for m in motions]
    total = sum(count * size for count, size in zip(counts, sizes, strict=True))
    share = min(1.0, MOST_BYTES / max(total, 1.0))
    return [_packed(m, max(2, int(share * count))) for m, count in zip(motions, counts, strict=True)]


def _bytes_of_a_frame(motion: Shown) -> float:
    numbers = sum(6 * x.shape[1] for x in motion.points) + sum(s.strain.shape[1] for s in motion.sheets.values())
    return numbers * 4 / 3


def _packed(motion: Shown, most: int) -> dict[str, Any]:
    frames = np.unique(np.linspace(0, len(motion.times) - 1, min(most, len(motion.times))).round().astype(int))
    x = np.concatenate([part[frames].reshape(-1, 3) for part in motion.points] or [np.zeros((1, 3))])
    x = x[np.isfinite(x).all(axis=1)]
    x = x if len(x) else np.zeros((1, 3))
    middle, reach = (x.max(axis=0) + x.min(axis=0)) / 2, float(np.ptp(x, axis=0).max()) / 2
    scale = (reach or 1.0) / _FULL

    def places(part: Array | None) -> str | None:
        """(frames, n, 3) as 16-bit numbers: middle + scale * number, m."""
        if part is None:
            return None
        numbers = np.rint((part[frames] - middle) / scale)
        seen = np.isfinite(numbers).all(axis=2, keepdims=True)
        return _base64(np.where(seen, np.clip(numbers, -_FULL, _FULL), MISSING).astype("<i2"))

    return {
        "name": motion.name,
        "frames": len(frames),
        "recorded": len(motion.times),
        "times": [float(f"{t:.6g}") for t in motion.times[frames]],
        "middle": middle.tolist(),
        "scale": scale,
        "up": motion.up.tolist(),
        "markers": list(motion.markers),
        "isCloud": motion.is_cloud,
        "hasBodies": bool(motion.bodies),
        "masses": places(motion.masses),
        "measured": places(motion.measured),
        "simulated": places(motion.simulated),
        "baseline": places(motion.baseline),
        "residual": _residual(motion, frames),
        "heldOut": [] if motion.held_out is None else motion.held_out[frames].astype(int).tolist(),
        "lines": [
            {"name": name, "kind": motion.line_kind, "nodes": x.shape[1], "places": places(x)}
            for name, x in motion.lines.items()
        ],
        "ticks": [
            {"name": name, "nodes": 2 * x.shape[1], "places": places(x.reshape(len(x), -1, 3))}
            for name, x in motion.ticks.items()
        ],
        "sheets": [_sheet(name, sheet, frames, places(sheet.positions)) for name, sheet in motion.sheets.items()],
    }


def _sheet(name: str, sheet: Sheet, frames: Array, places: str | None) -> dict[str, Any]:
    """Strain in shades of the 99.5 % quantile, so that one bad triangle does not darken the rest."""
    strain = sheet.strain[frames]
    finite = strain[np.isfinite(strain)]
    largest = float(np.quantile(finite, 0.995)) if finite.size else 0.0
    shades = np.clip(np.nan_to_num(strain) / (largest or 1.0), 0.0, 1.0) * _SHADES
    return {
        "name": name,
        "kind": sheet.kind,
        "nodes": sheet.positions.shape[1],
        "triangles": _base64(sheet.triangles.astype("<u4")),
        "places": places,
        "strain": _base64(np.rint(shades).astype("u1")),
        "largestStrain": largest,
    }


def _residual(motion: Shown, frames: Array) -> dict[str, Any] | None:
    """Distances (frames, markers) between measured and simulated in 16 bits of the largest; 65535 is missing."""
    if motion.measured is None or motion.simulated is None:
        return None
    distance = np.linalg.norm(motion.measured - motion.simulated, axis=2)[frames]
    seen = np.isfinite(distance)
    if not seen.any():
        return None
    largest = float(distance[seen].max())
    numbers = np.where(seen, np.rint(np.nan_to_num(distance) / (largest or 1.0) * 65534), 65535)
    return {"largest": largest, "distances": _base64(numbers.astype("<u2"))}


def _base64(array: Array) -> str:
    return base64.b64encode(np.ascontiguousarray(array).tobytes()).decode("ascii")
