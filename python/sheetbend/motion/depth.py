"""How deep particles were in the shapes that they touch, at the frames of a motion."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..scene.compiled import CompiledScene
from .contact_counts import ContactMode

Array = np.ndarray


def deepest(
    scene: CompiledScene, inputs: Array, times: Array, states: Array, modes: Mapping[str, Array]
) -> dict[str, float]:
    """By contact the largest depth [m] of what touched in the substep before a frame; 0 where nothing did.

    Args:
        inputs: flat, of the motion.
        times: (frames,) s.
        states: (frames, coordinates) of all nodes.
        modes: by contact (frames, particles), see `ContactMode`.
    """
    at = inputs.copy()
    first, size = scene.layout["position"]
    found = {}
    for k, (name, mode) in enumerate(modes.items()):
        touched = mode != ContactMode.APART
        found[name] = 0.0
        for frame in np.flatnonzero(touched.any(axis=1)):
            at[first : first + size] = states[frame]
            gaps = scene.core.contact_gaps(at, float(times[frame]), k)[:, 0]
            found[name] = max(found[name], -float(gaps[touched[frame]].min()))
    return found
