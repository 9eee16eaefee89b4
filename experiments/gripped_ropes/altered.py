"""What changes from one recording of a laboratory's rope to the next, and what its files lose."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from sheetbend.objects.grip import Grip
from true_ropes import Array, Rope

SLIDES = 0.2  # s, that a slip takes
EARLIEST, LATEST = 0.2, 0.8  # of a recording, between which it happens


def as_recorded(rope: Rope, rng: np.random.Generator) -> Rope:
    """The rope as one recording finds it: its rest curvature of that day, its stiffness at that temperature."""
    if not (rope.creep or rope.warming):
        return rope
    size = 1.0 + rope.creep * rng.standard_normal()
    softer = 1.0 + rope.warming * rng.uniform(-0.5, 0.5)
    values = dict(rope.values)
    for name in values:
        values[name] *= size if name.startswith("curvature_") else softer if name in ("EI", "GJ") else 1.0
    return replace(rope, values=values)


def slipping(rope: Rope, start: Grip, end: Grip, rng: np.random.Generator) -> tuple[Grip, Grip]:
    """Where the rope leaves the grips: the material points that did so at first slide along it at some time. They stay
    clamped, which is right while a slip is short beside the length over which the rope bends."""
    if not rope.slip:
        return start, end
    slid = []
    for grip in (start, end):
        t, last = grip.times, float(grip.times[-1])
        when, way = rng.uniform(EARLIEST, LATEST) * last, rng.choice([-1.0, 1.0])
        along = 0.5 * way * rope.slip * (1.0 + np.tanh((t - when) / (0.5 * SLIDES)))
        slid.append(replace(grip, position=grip.position + along[:, None] * grip.direction))
    return slid[0], slid[1]


def late(rope: Rope, grip: Array, knots: int) -> Array:
    """(knots, ...) of a grip's markers as they are recorded, so many knots a frame."""
    by = round(rope.late * rope.rate * knots)
    return grip if by == 0 else np.concatenate([np.repeat(grip[:1], by, axis=0), grip[:-by]])


def as_kept(rope: Rope, positions: Array, rng: np.random.Generator) -> Array:
    """(frames, markers, 3) m without the frames that are lost, and with those that repeat the one before."""
    if not (rope.lost or rope.repeated):
        return positions
    frames = len(positions)
    repeated = rng.choice(np.arange(1, frames), rope.repeated, replace=False)
    kept = positions.copy()
    for k in np.sort(repeated):
        kept[k] = kept[k - 1]
    return np.delete(kept, rng.choice(np.arange(1, frames), rope.lost, replace=False), axis=0)
