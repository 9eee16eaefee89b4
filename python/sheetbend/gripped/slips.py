"""A rope that slides through its grip in the middle of a recording, by some millimeters.

The markers of a grip stay where they are; the rope between the grip and the first free marker gets longer or shorter.
Their distance is that length, less what bends take off it: a quadratic form of the angles between the grip, this link
and the next; and less what a clock of the grips that is late makes of their speed. What is left jumps where the rope
slips. The grips of a fit are then moved along the rope by what has slipped, so that they hold the same piece of it all
the time. Predictions do not know of a slip that comes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..arrays.types import Array
from ..quantities.wording import short
from ..statistics.least_squares import unexplained
from .motion import GrippedMotion, chords_of, fractions_of

LEAST = 1e-3  # m, that a slip is told from
CLEAR = 0.7  # of the variance that a jump explains, from which on it is one
SHARED = 0.5  # of a jump, that the way to the second free marker shows too: else the first one slid along the rope
SECONDS = 0.2  # that a slip takes
EDGE, STEP = 0.2, 0.05  # s from both ends of a recording in which none is looked for, and between places
MOST = 3  # slips through one grip
FEWEST = 30  # frames


@dataclass(frozen=True)
class Slip:
    """How a rope slid through a grip.

    Attributes:
        end: whether through the end grip.
        by: m, out of the grip; negative into it.
        time: s, its middle.
    """

    end: bool
    by: float
    time: float

    def along(self, times: Array) -> Array:
        """(frames,) m, that has slid out."""
        return np.asarray(self.by * _ramp(times, self.time))


def slips(motion: GrippedMotion) -> tuple[Slip, ...]:
    """The slips through both grips, largest first at each."""
    return tuple(slip for end in (False, True) for slip in _through(motion, end))


def held(motion: GrippedMotion, found: tuple[Slip, ...]) -> GrippedMotion:
    """The motion between grips that hold the same piece of the rope all the time."""
    if not found:
        return motion
    x, v, times = motion.positions.copy(), motion.velocities.copy(), motion.recording.times
    for slip in found:
        k = slice(motion.inner[1], None) if slip.end else slice(motion.inner[0] + 1)
        out = (-1.0 if slip.end else 1.0) * slip.along(times)[:, None] * motion.directions(slip.end)
        x[:, k] += out[:, None]
        v[:, k] += np.gradient(out, times, axis=0)[:, None]
    return replace(motion, positions=x, velocities=v, fractions=fractions_of(chords_of(x), motion.inner))


def slips_said(motion: GrippedMotion, found: tuple[Slip, ...]) -> list[str]:
    """A sentence on each slip."""
    return [
        f"{motion.recording.name}: the rope slips by {short(1e3 * abs(slip.by), 2)} mm "
        f"{'out of' if slip.by > 0 else 'into'} its {'end' if slip.end else 'start'} grip about {slip.time:.1f} s; a "
        "fit follows it, a prediction cannot"
        for slip in found
    ]


def _through(motion: GrippedMotion, end: bool) -> list[Slip]:
    inner, toward = (motion.inner[1], -1) if end else (motion.inner[0], 1)
    markers = [inner + toward * k for k in (-1, 0, 1, 2)]
    x, times = motion.positions[:, markers], motion.recording.times
    seen = np.isfinite(x).all(axis=(1, 2))
    if len(motion.free) < 2 or seen.sum() < FEWEST:
        return []
    x, times = x[seen], times[seen]
    places = np.arange(times[0] + EDGE, times[-1] - EDGE, STEP)
    links = np.diff(x, axis=1)
    lengths = np.linalg.norm(links, axis=2)
    grip, first, second = np.moveaxis(links / lengths[..., None], 1, 0)
    lateness = (motion.velocities[seen, inner] * first).sum(axis=1)
    bends = np.column_stack([_products(first - grip, second - first), lateness])
    one, both = unexplained(bends, np.column_stack([lengths[:, 1], lengths[:, 1] + lengths[:, 2]])).T
    ramps = unexplained(bends, _ramp(times[:, None], places[None]))
    size = np.square(ramps).sum(axis=0)
    found: list[Slip] = []
    while len(found) < MOST and len(places):
        by = ramps.T @ one / size
        k = int(np.argmax(by**2 * size))
        shared = float(np.sign(by[k]) * (ramps[:, k] @ both) / size[k])
        if abs(by[k]) < LEAST or by[k] ** 2 * size[k] < CLEAR * (one @ one) or shared < SHARED * abs(by[k]):
            break
        found.append(Slip(end, float(by[k]), float(places[k])))
        one, both = one - by[k] * ramps[:, k], both - by[k] * ramps[:, k]
    return found


def _ramp(times: Array, middle: float | Array) -> Array:
    return np.clip((times - middle) / SECONDS + 0.5, 0.0, 1.0)


def _products(a: Array, b: Array) -> Array:
    """(frames, 4): a constant, and the products of two vectors (frames, 3) with each other."""
    return np.stack([np.ones(len(a)), (a * a).sum(axis=1), (a * b).sum(axis=1), (b * b).sum(axis=1)], axis=1)
