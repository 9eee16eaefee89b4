"""True values of ropes as a laboratory records them: the rope and its grips change, clocks and files lose time, and a
hose has a kink."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from strange import marked
from true_ropes import Array, Rope, ropes

SLEEVE, STIFFER = 0.04, 4.0  # m beside each grip, in which a connector makes the rope so many times as stiff
KINK, KINK_AT, SOFTER = 0.03, 0.4, 5.0  # m; share of the free length; times softer
FINE = tuple(range(1, 41))  # modes that hold a step


def laboratory(seed: int = 7) -> list[Rope]:
    """Five ropes, each a nasty one without an unseen roll, and with something else that recordings do not tell.

    1. It was stored on a drum: a rest curvature of 3/m about one axis, which differs by 15 % from recording to
       recording. Its stiffness differs by up to 10 % either way, as the room warms up. Markers sit 5 to 7 mm beside the
       axis.
    2. It slips through its grips by 3 mm each in every recording, and connectors stiffen its ends.
    3. The grips' markers come 15 ms late. Six frames of each recording of `train` are lost, and six repeat the one
       before.
    4. Its grips are wrists of robots that keep an axis level and roll by 0.4 rad for each rad that they lean aside.
    5. It is a hose with a kink: 3 cm of it are a fifth as stiff as the rest.
    """
    _, second, third, fourth, fifth = ropes(seed, nasty=True)
    return [
        replace(
            marked(_with(fourth, curvature_1_0=3.0, curvature_2_0=0.0), fourth.markers, seed, (5e-3, 7e-3)),
            name="rope_1",
            creep=0.15,
            warming=0.2,
        ),
        replace(_sleeved(third), name="rope_2", extra_roll=0.0, weighed=True, slip=3e-3),
        replace(second, name="rope_3", late=0.015, lost=6, repeated=6),
        replace(fifth, name="rope_4", wrist=0.4),
        replace(_softer(fourth, lambda s: abs(s - KINK_AT) < 0.5 * KINK / fourth.free_length, SOFTER), name="rope_5"),
    ]


def _sleeved(rope: Rope) -> Rope:
    """The rope with connectors at its ends; EI stays that of the rope between them, before it varies."""
    return _softer(rope, lambda s: np.minimum(s, 1.0 - s) * rope.free_length < SLEEVE, 1.0 / STIFFER)


def _softer(rope: Rope, inside: Callable[[Array], NDArray[np.bool_]], times: float) -> Rope:
    """The rope, so many times softer where shares of its free length are inside; EI stays that of the rest."""
    s: Array = (np.arange(4000) + 0.5) / 4000
    compliance: Array = np.where(inside(s), np.log(times), 0.0)
    mean = float(compliance.mean())
    values = {f"softness_{k}": 2.0 * float(np.mean(compliance * np.cos(k * np.pi * s))) for k in FINE}
    values = {name: value + rope.values.get(name, 0.0) for name, value in values.items()}
    return _with(rope, EI=rope.values["EI"] * np.exp(-mean), **values)


def _with(rope: Rope, **values: float) -> Rope:
    return replace(rope, values={**rope.values, **values})
