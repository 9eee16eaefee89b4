"""A mass at the free end of a rope in a recording, such as a plug on a cable.

A flexible rope carries no force across itself, so what is beyond a point of it, rope and mass, balances across its
direction there: rho integral(a - g) ds + m (a_end - g) has no part across the tangent. Only m/rho is unknown.
"""

from __future__ import annotations

import numpy as np

from ..arrays.smoothing import smoothed
from ..arrays.types import Array
from .held import Held
from .seen import REST, Seen, motion_of

FEWEST, FRAMES = 4, 20  # markers on the rope, and frames in which all are seen, at least
MOVES = 0.3  # m/s^2, root mean square across the rope, at least: less is hidden by noise
COUNTS, MOST = 0.05, 30.0  # masses of the rope: less cannot be told from markers and stiffness, nor more from it
AGREE = 0.25  # of the median: how far apart the quartiles of what the markers tell may be
HEAVY = 3.0  # masses of the rope: where all agree on more, it does not matter on how much
ALONG = 0.15  # of the pull of a heavy load: so much of it is across the rope at most, unless it is stiff


def free_end(found: Held) -> str | None:
    """The end that nothing holds, "start" or "end"; None where both or none are held."""
    pins = found.rope.get("pinned", [])
    ends = {at for at, k in (("start", 0), ("end", -1)) if f"clamp_{at}" in found.rope or k in pins}
    ends |= {grip["at"] for grip in found.grips}
    if len(ends) != 1:
        return None
    return "end" if "start" in ends else "start"


def loaded_end(s: Seen, found: Held) -> tuple[str, float] | None:
    """The free end that carries a mass, and this mass in masses of 1 m of the rope; None where no end does."""
    free = free_end(found)
    if free is None:
        return None
    mass = end_load(s, found.order if free == "end" else found.order[::-1])
    return None if mass is None else (free, mass)


def end_load(s: Seen, way: tuple[int, ...]) -> float | None:
    """kg per kg/m of the rope, of a mass at the far end; None where there is none, or the motion does not tell.

    Args:
        way: markers in order from where the rope is held to its free end.
    """
    moving = _moving(s, way)
    if moving is None:
        return None
    x, acceleration = moving
    pull = acceleration - s.gravity
    arc = s.along(way)
    told = []
    for k in range(1, 1 + len(way) // 2):  # the bending stiffness counts more near the free end
        of_rope, of_mass = (across(x, k, v) for v in (beyond(pull, arc, k), pull[:, -1]))
        told.append(_balance(of_rope, of_mass, float(np.linalg.norm(_shares(arc, k)))))
    low, load, high = np.quantile(np.minimum(told, MOST * arc[-1]), [0.25, 0.5, 0.75])
    heavy = low > HEAVY * arc[-1] and np.mean(of_mass**2) < ALONG**2 * np.mean(pull[:, -1] ** 2)
    agree = heavy or high - low < AGREE * load <= AGREE * HEAVY * arc[-1]
    return float(load) if load > COUNTS * arc[-1] and agree else None  # not where one is not a number


def _balance(of_rope: Array, of_mass: Array, noise: float) -> float:
    """The factor of `of_mass` (frames, 3) that balances `of_rope`, whose noise is so many times as large (Deming):
    below a heavy load a rope is straight, and nearly nothing of it is across. Not a number where both are small."""
    both = np.stack([of_rope.ravel() / noise, of_mass.ravel()])
    sizes, ways = np.linalg.eigh(both @ both.T / len(of_rope))
    (rope, mass) = ways[:, 0]
    if sizes[1] < MOVES**2:
        return float("nan")
    heavier = rope * mass <= 0.0 and abs(mass) > abs(rope)  # than any, by chance
    return float("inf") if heavier else float(noise * mass / rope)


def _moving(s: Seen, way: tuple[int, ...]) -> tuple[Array, Array] | None:
    """Smoothed places and accelerations of markers (frames, markers, 3), where all are known and move; None of few."""
    t = s.recording.times
    if len(way) < FEWEST or len(t) < FRAMES:
        return None
    x, speed = motion_of(s.recording)
    x, speed = x[:, list(way)], speed[:, list(way)]
    _, acceleration = smoothed(t, np.nan_to_num(speed), REST / 2)
    reach = round(REST / 2 / float(np.median(np.diff(t))))
    lost = np.convolve(~np.isfinite(x).all(axis=(1, 2)), np.ones(2 * reach + 1), "same") > 0
    moving = ~lost & (t > t[0] + s.rest)
    return (x[moving], acceleration[moving]) if moving.sum() >= FRAMES else None


def beyond(pull: Array, arc: Array, k: int) -> Array:
    """(frames, 3) m^2/s^2, the integral of a - g along the rope from its k-th marker on.

    Args:
        pull: (frames, markers, 3) m/s^2, of each marker.
        arc: (markers,) m, along the rope.
    """
    return np.asarray(np.einsum("k,fkx->fx", _shares(arc, k), pull[:, k:]))


def _shares(arc: Array, k: int) -> Array:
    """(markers - k,) m, the length of rope at each marker from the k-th on."""
    half = 0.5 * np.diff(arc[k:])
    return np.concatenate([half, [0.0]]) + np.concatenate([[0.0], half])


def across(x: Array, k: int, v: Array) -> Array:
    """(frames, 3) the part of v across the rope at the k-th of its markers (frames, markers, 3)."""
    tangent = x[:, k + 1] - x[:, k - 1]
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    return np.asarray(v - np.sum(v * tangent, axis=1, keepdims=True) * tangent)
