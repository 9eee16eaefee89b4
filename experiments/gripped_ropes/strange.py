"""True values of ropes that the recipe has no model of: with a knot, a flat section, stretch or other losses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from true_ropes import GRAVITY, Array, Rope, ropes

TURNED = (1, 2, 0)  # axes of a recording whose second axis points up


def strange(seed: int = 7) -> list[Rope]:
    """Four ropes, each a nasty one with something that the recipe's model lacks, and recorded in another way.

    1. Mass that varies by a third along the rope, and a knot of a tenth of its mass; 16 markers with a noise of 1 mm;
       the recordings' y axis points up.
    2. A flat section, whose EI2 is 0.4 EI. 8 markers at 120 Hz.
    3. Other losses: drag that grows with the square of the speed, twist that is damped four times as much as bending;
       60 Hz.
    4. Stretch of some 1 % under the rope's own weight, and a grip that rolls by 15 degrees unseen.
    """
    first, second, third, fourth, _ = ropes(seed, nasty=True)
    weight = fourth.values["density"] * GRAVITY * fourth.length
    return [
        marked(
            replace(
                _with(first, density_1=0.3, density_2=-0.2),
                knot=(0.4, 0.1 * first.values["density"] * first.length),
                louder=2.0,
                axes=TURNED,
            ),
            16,
            seed,
        ),
        marked(replace(_with(second, EI2=0.4 * second.values["EI"]), rate=120), 8, seed),
        replace(
            _with(third, drag_linear=1e-6, drag_quadratic=0.02, twist_damping=4.0 * third.values["bend_damping"]),
            rate=60,
            extra_roll=0.0,
            weighed=True,
        ),
        replace(
            _with(fourth, EA=50.0 * weight, stretch_damping=0.01),
            extra_roll=np.radians(15.0),
        ),
    ]


def _with(rope: Rope, **values: float) -> Rope:
    return replace(rope, values={**rope.values, **values})


def marked(rope: Rope, markers: int, seed: int, beside: tuple[float, float] = (1e-3, 2e-3)) -> Rope:
    """The same with so many markers, at uneven distances and from `beside[0]` to `beside[1]` m beside the axis."""
    rng = np.random.default_rng([seed, markers])
    free = markers - 4
    around, off = rng.uniform(0.0, 2.0 * np.pi, free), rng.uniform(*beside, free)
    slack = np.stack([off * np.cos(around), off * np.sin(around), rng.uniform(-3e-3, 3e-3, free)], axis=1)
    gaps: Array = rng.uniform(0.75, 1.3, free + 1)
    return replace(rope, markers=markers, slack=slack, places=rope.free_length * np.cumsum(gaps)[:-1] / gaps.sum())
