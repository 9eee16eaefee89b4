"""How the grips of the synthetic ropes move."""

from __future__ import annotations

import numpy as np
from sheetbend.objects.grip import Grip, any_across, carried
from true_ropes import Array, Rope

KNOTS = 4  # in each frame
UP, ALONG, ACROSS = np.eye(3)[[2, 0, 1]]
DROOP = np.radians(35.0)  # the rope leaves its grips downwards
NOMINAL = [np.cos(DROOP) * ALONG - side * np.sin(DROOP) * UP for side in (1.0, -1.0)]  # directions at start and end
REACH, TURN = 0.3, np.radians(60.0)  # m and rad, how far a grip goes from its nominal pose
MEAN_APART, APART = 0.65, (0.4, 0.9)  # of the rope's length, between the grips
PLACE, SWING = 0.13, 0.5  # m and rad, size of one wave of a grip's place and direction
REST, START = 0.1, 1.0  # s, at rest, and how long the motion takes to reach its full pace


def motion(rope: Rope, rng: np.random.Generator, seconds: float) -> tuple[Grip, Grip]:
    """Two grips that start at rest and move at random, as smoothly as two robot arms."""
    knots = KNOTS * rope.rate
    times = np.arange(round(seconds * knots) + 1) / knots
    base = MEAN_APART * rope.length * ALONG
    while True:
        (x0, d0), (x1, d1) = (_wander(rng, times, nominal) for nominal in NOMINAL)
        apart = np.linalg.norm(x1 + base - x0, axis=1) / rope.length
        if APART[0] < apart.min() and apart.max() < APART[1]:
            break
    q0, q1 = (_director(rope, n, d) for n, d in zip(NOMINAL, (d0, d1), strict=True))
    extra = rope.extra_roll * np.sin(2.0 * np.pi * 0.15 * _pace(times))[:, None]
    q1 = np.cos(extra) * q1 + np.sin(extra) * np.cross(d1, q1)
    return Grip(times, x0, d0, q0), Grip(times, x1 + base, d1, q1)


def _director(rope: Rope, nominal: Array, d: Array) -> Array:
    """(knots, 3) as `Grip.from_markers` has it; or of a wrist that keeps an axis level, and rolls as it leans aside."""
    across = any_across(nominal)
    if not rope.wrist:
        return carried(across, nominal, d)
    level = across - (d @ across)[:, None] * d
    level /= np.linalg.norm(level, axis=1, keepdims=True)
    roll = rope.wrist * np.arcsin(d @ np.cross(nominal, across))[:, None]
    return np.asarray(np.cos(roll) * level + np.sin(roll) * np.cross(d, level))


def _wander(rng: np.random.Generator, times: Array, nominal: Array) -> tuple[Array, Array]:
    """(knots, 3) m off the nominal place, and (knots, 3) unit directions."""
    frequency, start = rng.uniform(0.1, 0.9, (4, 5)), rng.uniform(0.0, 2.0 * np.pi, (4, 5))
    size = rng.normal(size=(4, 5)) / np.sqrt(2.0)
    waves = (size * np.sin(2.0 * np.pi * frequency * _pace(times)[:, None, None] + start)).sum(axis=1)
    across = _within(TURN, SWING * waves[:, 3:])
    angle = np.linalg.norm(across, axis=1)[:, None]
    plane = np.stack([ACROSS, np.cross(nominal, ACROSS)])
    return _within(REACH, PLACE * waves[:, :3]), np.cos(angle) * nominal + np.sinc(angle / np.pi) * across @ plane


def _within(limit: float, vectors: Array) -> Array:
    """Vectors (knots, k) shortened smoothly to less than a limit."""
    share = np.linalg.norm(vectors, axis=1, keepdims=True) / limit
    return np.asarray(vectors * np.tanh(share) / np.maximum(share, 1e-12))


def _pace(times: Array) -> Array:
    """The motion's own time: it stands still at first and then comes smoothly to full pace."""
    u = np.clip((times - REST) / START, 0.0, 1.0)
    return START * (2.5 * u**4 - 3.0 * u**5 + u**6) + np.maximum(times - REST - START, 0.0)
