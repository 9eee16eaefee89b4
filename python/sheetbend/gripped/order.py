"""The order of markers along a gripped rope, as a recording shows it."""

from __future__ import annotations

import numpy as np

from ..arrays.timeseries import mean_position
from ..arrays.types import Array
from ..errors import RecordingError
from ..recording.recording import Recording
from .end_links import end_link

MOST_FRAMES = 200  # of a recording, that its order is judged by
SHORTER, STEADIER = 0.8, 0.85  # of two links' lengths and of how much these vary: links that are taken instead


def check_order(recording: Recording, inner: tuple[int, int], usual: Array | None) -> None:
    """Refuse markers out of order along the rope, in time wherever the rope bends.

    Args:
        inner: numbers of the two inner gripped markers.
        usual: (markers - 1,) m, lengths of the links in other recordings of the rope (`usual_links`).

    Raises:
        RecordingError: another order has shorter links that keep their length better; or a grip points away from the
            rope, which does not fold back there.
    """
    names = recording.markers
    frames = np.linspace(0, len(recording.times) - 1, min(len(recording.times), MOST_FRAMES)).astype(int)
    positions = recording.positions[frames]
    order = marker_order(positions)
    if order != list(range(len(names))):
        fix = f"give them as {', '.join(names[i] for i in order)} (`Recording.select` reorders)"
        problem = f"of {recording.name} are not in order along the rope"
        raise RecordingError("markers", problem, list(names), fix)
    for k, ahead, end in ((inner[0], 1, "first"), (inner[1], -1, "last")):
        grip, rope = positions[:, k] - positions[:, k - ahead], positions[:, k + ahead] - positions[:, k]
        if np.nansum((grip * rope).sum(axis=1)) < 0.0:
            link = end_link(recording.positions, k - ahead, inner, usual)
            if link is not None and link.in_order:
                continue
            problem = f"of the {end} grip of {recording.name} are not in order: they point away from the rope"
            got = [names[k - ahead], names[k]]
            raise RecordingError("markers", problem, got, "exchange them (`Recording.select` reorders)")


def marker_order(positions: Array) -> list[int]:
    """Markers (frames, markers, 3) in the order in which they hang together, ends kept: stretches of the given order
    turn round as long as both links that this makes are shorter and steadier."""
    distance = np.linalg.norm(positions[:, :, None] - positions[:, None], axis=3)
    mean = mean_position(distance)
    spread = np.sqrt(mean_position((distance - mean) ** 2))
    order = list(range(positions.shape[1]))
    turned = True
    while turned:
        turned = False
        for i in range(1, len(order) - 2):
            for j in range(i + 1, len(order) - 1):
                a, b, c, d = (order[k] for k in (i - 1, i, j, j + 1))
                shorter = mean[a, c] + mean[b, d] < SHORTER * (mean[a, b] + mean[c, d])
                if shorter and spread[a, c] + spread[b, d] < STEADIER * (spread[a, b] + spread[c, d]):
                    order[i : j + 1] = order[i : j + 1][::-1]
                    turned = True
    return order
