"""The true values of the five synthetic ropes."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

GRIPPED = 0.03  # m of rope in each grip, between its two markers
GRAVITY = 9.81  # m/s^2
MODES = (0, 1, 2)  # of the rest curvature of a clean rope
SHARES = (1.0, 0.7, 0.4)  # sizes of these modes
NASTY_SHARES = (1.0, 0.7, 0.5, 0.4, 0.35, 0.3, 0.25, 0.2, 0.15)  # nine modes of a nasty rope
SOFTNESS = (0.25, 0.2, 0.15, 0.12, 0.1, 0.08)  # of its modes 1 to 6, of the logarithm of the compliance
YIELDS_AT = 0.35  # its yield curvature times its bending length
UNEVEN = (0.75, 1.3)  # of its markers' distances, beside equal ones

Array = np.ndarray


@dataclass(frozen=True)
class Rope:
    """True values of a rope; `values` are quantities of its rod, in SI units.

    Attributes:
        length: m, between the outermost markers, the gripped pieces included.
        extra_roll: rad, by which the end grip slowly rolls beside what `Grip.from_markers` knows: a model error.
        slack: (free markers, 3) m, where a marker sits off its material point: along the rope's two directors, and
            along its arc.
        places: (free markers,) m, arc lengths of the material points from the start grip.
        marker_mass: kg of each free marker.
        lists: whether its pickles hold lists of numbers instead of NumPy arrays.
        weighed: whether whoever fits it knows its density.
        knot: where it is, as a share of the free length, and its mass, kg.
        rate: Hz, of the frames.
        louder: noise of its markers over that of the others.
        axes: which axes of the simulation, whose third one points up, are the first to third of a recording.
        creep: standard deviation between recordings of the size of its rest curvature, relative to it.
        warming: share by which its stiffness differs between recordings at most, as temperature changes it.
        slip: m, by which it slides out of each grip or into it at some time of a recording.
        late: s, by which the markers of the grips lag behind the others.
        wrist: rad by which each grip rolls for each rad that it leans aside, beside keeping an axis level; 0 = neither.
        lost, repeated: frames of a recording that are lost, and that repeat the frame before.
    """

    name: str
    markers: int
    length: float
    values: dict[str, float]
    extra_roll: float
    slack: Array
    places: Array
    marker_mass: float = 0.0
    lists: bool = False
    weighed: bool = True
    knot: tuple[float, float] = (0.0, 0.0)
    rate: int = 100
    louder: float = 1.0
    axes: tuple[int, int, int] = (0, 1, 2)
    creep: float = 0.0
    warming: float = 0.0
    slip: float = 0.0
    late: float = 0.0
    wrist: float = 0.0
    lost: int = 0
    repeated: int = 0

    @property
    def free_length(self) -> float:
        return self.length - 2.0 * GRIPPED


def ropes(seed: int = 7, nasty: bool = False) -> list[Rope]:
    """Five ropes, from soft to stiff: the bending length (EI/(density g))^(1/3) goes from 0.1 to 0.45 m.

    Args:
        nasty: also give them a finer rest shape, uneven stiffness, internal friction, uneven and heavy markers.
    """
    table = [
        # markers, length, density, bending length, GJ/EI, bend and twist damping, drag, rest curvature, extra roll
        (13, 1.04, 0.045, 0.10, 0.60, 0.030, 0.030, 4e-3, 2.0, 0.0),
        (12, 0.93, 0.060, 0.16, 1.30, 0.020, 0.030, 6e-3, 1.2, 0.0),
        (12, 0.90, 0.080, 0.23, 0.30, 0.015, 0.020, 4e-3, 0.9, np.radians(15.0)),
        (13, 1.00, 0.070, 0.33, 0.80, 0.010, 0.015, 8e-3, 0.6, 0.0),
        (12, 0.96, 0.110, 0.45, 1.00, 0.008, 0.010, 5e-3, 0.3, 0.0),
    ]
    clean = [_rope(number, seed, *row) for number, row in enumerate(table, start=1)]
    return [_nasty(rope, number, seed) for number, rope in enumerate(clean, start=1)] if nasty else clean


def _rope(
    number: int,
    seed: int,
    markers: int,
    length: float,
    density: float,
    bending_length: float,
    ratio: float,
    bend_damping: float,
    twist_damping: float,
    drag: float,
    curvature: float,
    extra_roll: float,
) -> Rope:
    rng = np.random.default_rng([seed, number])
    EI = density * GRAVITY * bending_length**3
    values = {"density": density, "EI": EI, "GJ": ratio * EI}
    values |= {"bend_damping": bend_damping, "twist_damping": twist_damping, "drag_linear": drag}
    for k, share in zip(MODES, SHARES, strict=True):
        angle = rng.uniform(0.0, 2.0 * np.pi)
        values[f"curvature_1_{k}"] = share * curvature * np.cos(angle)
        values[f"curvature_2_{k}"] = share * curvature * np.sin(angle)
    for grip in ("start", "end"):
        tilt, angle = np.radians(rng.uniform(2.0, 5.0)), rng.uniform(0.0, 2.0 * np.pi)
        values[f"{grip}_tilt_1"], values[f"{grip}_tilt_2"] = tilt * np.cos(angle), tilt * np.sin(angle)
    values["roll"] = rng.choice([-1.0, 1.0]) * rng.uniform(0.7, 1.3)
    free = markers - 4
    around, off = rng.uniform(0.0, 2.0 * np.pi, free), rng.uniform(1e-3, 2e-3, free)
    slack = np.stack([off * np.cos(around), off * np.sin(around), rng.uniform(-3e-3, 3e-3, free)], axis=1)
    places = (length - 2.0 * GRIPPED) * np.arange(1, free + 1) / (free + 1)
    return Rope(f"rope_{number}", markers, length, values, extra_roll, slack, places)


def _nasty(rope: Rope, number: int, seed: int) -> Rope:
    """The same with what real ropes showed: half of them in lists, the third not weighed."""
    rng = np.random.default_rng([seed, number, 1])
    values = {k: v for k, v in rope.values.items() if not k.startswith("curvature_")}
    bending_length = (values["EI"] / (values["density"] * GRAVITY)) ** (1.0 / 3.0)
    size = np.hypot(rope.values["curvature_1_0"], rope.values["curvature_2_0"])
    for k, share in enumerate(NASTY_SHARES):
        angle = rng.uniform(0.0, 2.0 * np.pi)
        values[f"curvature_1_{k}"], values[f"curvature_2_{k}"] = share * size * np.array([np.cos(angle), np.sin(angle)])
    for k, most in enumerate(SOFTNESS, start=1):
        values[f"softness_{k}"] = rng.choice([-1.0, 1.0]) * most
    values["yield_curvature"], values["yield_share"] = YIELDS_AT / bending_length, rng.uniform(0.3, 0.5)
    gaps = rng.uniform(*UNEVEN, rope.markers - 3)
    places = rope.free_length * np.cumsum(gaps)[:-1] / gaps.sum()
    values = {k: float(v) for k, v in values.items()}
    odd = number % 2 == 1
    return replace(rope, values=values, places=places, marker_mass=6e-4, lists=odd, weighed=number != 3)
