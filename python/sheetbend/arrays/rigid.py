"""The motion of a rigid body from markers on it."""

from __future__ import annotations

import numpy as np

from ..errors import SceneError
from .types import Array

FEWEST = 3  # markers, not on one line, that tell a rotation
LOOSE = 0.2  # of the least distance of two markers: some that move so much against each other sit on no rigid piece
FLAT = 0.02  # of the widest extent of a body: markers that spread less across their line do not tell its roll


def rigid_motion(markers: Array) -> tuple[Array, Array, float]:
    """Rotations and centers of a rigid body from its markers, by least squares (Arun, Huang & Blostein 1987, IEEE
    Trans. Pattern Anal. Mach. Intell. 9, 698).

    Args:
        markers: (frames, k, 3) m with k >= 3; NaN where a marker was not seen.

    Returns:
        Rotations (frames, 3, 3) from the body's pose in the first frame to its pose in each frame; (frames, 3) m, the
        places of the point that is the markers' mean in the first frame; and the root mean square distance of the
        markers from the rigid body, m.

    Raises:
        SceneError: fewer than three markers are seen in a frame, they are on one line, or they move against each other.
    """
    x = np.asarray(markers, dtype=float)
    seen = ~np.isnan(x[:, :, 0])
    few = np.flatnonzero(seen.sum(axis=1) < FEWEST)
    if len(few):
        fix = "start later, cut the recording, or use another grip"
        raise SceneError("markers", f"of a body: fewer than three are seen in frame {few[0]}", len(few), fix)
    whole = np.flatnonzero(seen.all(axis=1))
    if not len(whole):
        raise SceneError("markers", "of a body are never all seen at once", x.shape[1], "leave one of them out")
    shape = x[whole[0]] - x[whole[0]].mean(axis=0)
    for _ in range(3):  # the mean shape, so that the noise of one frame does not stay
        turns, centers = _poses(shape, x, seen)
        back = np.einsum("fab,fka->fkb", turns, np.where(seen[..., None], x - centers[:, None], 0.0))
        shape = back.sum(axis=0) / seen.sum(axis=0)[:, None]
    spread = np.linalg.svd(shape - shape.mean(axis=0), compute_uv=False)
    if spread[1] < FLAT * spread[0]:
        fix = "give two of them, in the order in which the rope passes them, or add one off the line"
        raise SceneError("markers", "of a body are on one line", spread.tolist(), fix)
    turns, centers = _poses(shape, x, seen)
    off = x - centers[:, None] - np.einsum("fab,kb->fka", turns, shape)
    rms = float(np.sqrt(np.nanmean(np.sum(off**2, axis=2))))
    apart = np.linalg.norm(x[:, :, None] - x[:, None], axis=3)
    means = np.nanmean(apart, axis=0)
    loose = np.nanstd(apart, axis=0) > LOOSE * means[~np.eye(len(means), dtype=bool)].min()
    if loose.any():
        first, second = (int(k) for k in np.argwhere(loose)[0])
        problem = f"of a body move against each other, such as the markers {first} and {second} of it"
        raise SceneError("markers", problem, x.shape[1], "name markers of one rigid piece")
    return np.einsum("fab,cb->fac", turns, turns[0]), centers, rms


def _poses(shape: Array, x: Array, seen: Array) -> tuple[Array, Array]:
    """Rotation (3, 3) and origin (3,) of each frame that carry `shape` (k, 3) nearest to the markers that are seen."""
    w = seen / seen.sum(axis=1, keepdims=True)
    filled = np.where(seen[..., None], x, 0.0)
    own = np.einsum("fk,ka->fa", w, shape)
    mean = np.einsum("fk,fka->fa", w, filled)
    cross = np.einsum("fk,fka,fkb->fab", w, filled - mean[:, None], shape[None] - own[:, None])
    u, _, vt = np.linalg.svd(cross)
    flip = np.ones((len(x), 3))
    flip[:, 2] = np.sign(np.linalg.det(u @ vt))
    turns = np.einsum("fab,fb,fbc->fac", u, flip, vt)
    return turns, mean - np.einsum("fab,fb->fa", turns, own)
