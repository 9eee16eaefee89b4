"""What takes energy from a pendulum of one arm: dry friction, viscosity of its hinge, drag of the air, or several.

With the arm's angle q and rate w, and the length L of a point mass that swings alike, the sum

    w^2/2 + g/L (1 - cos(q - q0)) + a int |w| dt + b int w^2 dt + c int |w|^3 dt

does not change. It is linear in g/L cos q0, g/L sin q0, a, b, c and its value. In a long gap no curve tells what is
lost, so its value is another one behind it. Dry friction lets a swing become smaller linearly in time, viscosity
exponentially, drag by its inverse.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import combinations
from typing import NamedTuple

import numpy as np

from ..arrays.types import Array
from .swing import Swing

WORDS = {"friction": "dry friction", "viscosity": "a viscous hinge", "drag": "drag of the air"}
"""By key of `[[scene.pendulum]]`."""
STAYS = 0.01  # of the noise of energies where it moves most: below, the arm is held or at rest, and loses nothing
BRIDGED = 4.0  # memories, of a gap at most
RIVAL = 6.0  # of Schwarz's criterion: with less of a difference, a decay hardly tells two models apart


class Decay(NamedTuple):
    """Losses that explain how a swing decays.

    Attributes:
        torques: N m over a power of rad/s, by key of `[[scene.pendulum]]`, where the arm's inertia is 1 kg m^2.
        rivals: the keys of other sets of losses, which lack one of these and explain it about as well.
    """

    torques: dict[str, float]
    rivals: list[tuple[str, ...]]

    def words(self) -> str:
        """What is fitted, and what else may be the cause."""
        said = (
            f"how it loses energy: {_joined(self.torques)} explain{'s' * (len(self.torques) == 1)} how its swing decays"
            if self.torques
            else "how it loses energy: its swing does not decay within its noise, and no loss is fitted"
        )
        if not self.rivals:
            return said
        others = ", or ".join(_joined(keys) for keys in self.rivals)
        return (
            f"{said}. So {'do' if len(self.rivals) > 1 or len(self.rivals[0]) > 1 else 'does'} {others} about as well, "
            "with other values: compare a fit with these, or record until it is at rest"
        )


def _joined(keys: Iterable[str]) -> str:
    return " and ".join(WORDS[key] for key in keys) or "no loss"


def decay(swing: Swing, memory: float) -> Decay:
    """The losses with the best of Schwarz's criterion (1978), none of them negative; none where nothing is lost.

    Args:
        swing: of one arm, over the whole recording, since losses differ most where the swing has become small.
        memory: s, over which it is smoothed: energies so far apart have independent noise.
    """
    t, q, w, seen = swing.times, swing.angles[0], np.abs(swing.rates[0]), swing.seen
    powers = w[:, None] ** (1, 2, 3)
    lost = np.zeros_like(powers)
    lost[1:] = np.cumsum(np.diff(t)[:, None] * 0.5 * (powers[1:] + powers[:-1]), axis=0)
    # of the parabola fitted over `memory`, noise of the rate is 2.3 times that of the angle per `memory`
    noise = np.hypot(w, memory / 2.3 * np.gradient(swing.rates[0], t))
    told = seen & (noise > STAYS * noise.max(where=seen, initial=0.0))
    part = np.cumsum(np.diff(t[seen], prepend=t[0]) > BRIDGED * memory)
    value = (part[:, None] == np.unique(part))[told[seen]] / noise[told, None]
    energy, height = 0.5 * w[:, None] ** 2, np.stack([np.cos(q), np.sin(q)], axis=1)
    energy, height, lost = (of_all[told] / noise[told, None] for of_all in (energy, height, lost))
    samples = float(t[-1] - t[0]) * float(told.mean()) / memory
    found: dict[tuple[str, ...], tuple[float, Array]] = {}
    for count in range(len(WORDS) + 1):
        for chosen in combinations(range(len(WORDS)), count):
            rows = np.concatenate([lost[:, chosen], height, value], axis=1)
            values = np.linalg.lstsq(rows, -energy[:, 0])[0]
            if (values[:count] >= 0.0).all():
                rest = float(np.square(energy[:, 0] + rows @ values).mean())
                score = samples * math.log(max(rest, np.finfo(float).tiny)) + count * math.log(max(samples, 1.0))
                found[tuple(list(WORDS)[k] for k in chosen)] = score, values[:count]
    best = min(found, key=lambda keys: found[keys][0])
    near = [keys for keys in found if not set(keys) >= set(best) and found[keys][0] < found[best][0] + RIVAL]
    return Decay(dict(zip(best, found[best][1].tolist(), strict=True)), near)
