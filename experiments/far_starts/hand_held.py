"""A rod held in a hand: one end follows a smooth motion for 2 s, the rest swings. Data come from a rod of twice the
links at half the step, with noise; fits use 33 links at 2 ms."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import sheetbend as sb
from sheetbend.objects.markers import on_rope
from sheetbend.objects.rod import add_rod

LENGTH, DENSITY = 0.5, 0.06
LINKS, H, RATE, SECONDS = 33, 2e-3, 100, 2.0
NOISE = 3e-4  # m, of each coordinate
MARKERS = 8
SOFTNESS, CURVATURE = range(1, 8), range(0, 4)

FEW = {"rod_EI": 3e-3, "rod_bend_damping": 0.01, "rod_drag_linear": 0.03}
TWELVE = {
    **FEW,
    **{f"rod_softness_{k}": v for k, v in zip(SOFTNESS, (0.2, -0.1, 0.1, 0.05, -0.08, 0.04, -0.05), strict=True)},
    "rod_drag_quadratic": 0.02,
    "rod_start_tilt_1": 0.03,
}
MANY = {
    **TWELVE,
    **{f"rod_curvature_1_{k}": v for k, v in zip(CURVATURE, (0.3, -0.2, 0.2, 0.1), strict=True)},
    **{f"rod_curvature_2_{k}": v for k, v in zip(CURVATURE, (-0.2, 0.3, 0.1, -0.1), strict=True)},
    "rod_GJ": 2e-3,
    "rod_start_tilt_2": -0.02,
    "rod_twist_damping": 0.02,
    "rod_density_1": 0.1,
}


def hand(times: np.ndarray) -> sb.Grip:
    """The grip's motion: smooth, from rest, in all directions, with some turning."""
    t = np.asarray(times)
    ease = 1.0 - np.exp(-((t / 0.15) ** 2))
    x = 0.08 * np.sin(2 * np.pi * 1.1 * t) * ease
    y = 0.05 * np.sin(2 * np.pi * 0.8 * t + 0.5) * ease - 0.05 * np.sin(0.5) * ease
    z = 0.06 * np.sin(2 * np.pi * 1.7 * t) * ease
    pitch, yaw = 0.4 * np.sin(2 * np.pi * 0.9 * t) * ease, 0.3 * np.sin(2 * np.pi * 1.3 * t) * ease
    ahead = np.stack([np.cos(pitch) * np.cos(yaw), np.cos(pitch) * np.sin(yaw), np.sin(pitch)], axis=1)
    first = np.stack([x, y, z], axis=1)
    return sb.Grip.from_markers(t, first - 0.05 * ahead, first)


def scene(finer: int, wanted: Mapping[str, float]) -> sb.Scene:
    """The rod on `finer` times the links, with every quantity of `wanted` at its value."""
    modes = {
        "softness_modes": SOFTNESS if "rod_softness_1" in wanted else (),
        "curvature_modes": CURVATURE if "rod_curvature_1_0" in wanted else (),
        "density_modes": (1,) if "rod_density_1" in wanted else (),
    }
    plain = {"EI", "GJ", "bend_damping", "twist_damping", "drag_linear", "drag_quadratic"}
    given: dict[str, Any] = {"EI": 3e-3, "GJ": 2e-3, "twist_damping": 0.02, **modes}
    given |= {k.removeprefix("rod_"): v for k, v in wanted.items() if k.removeprefix("rod_") in plain}
    made = sb.Scene("rod")
    times = np.arange(0.0, SECONDS + 0.011, 0.01)
    add_rod(
        made,
        "rod",
        length=LENGTH,
        segments=LINKS * finer,
        density=DENSITY,
        start=hand(times),
        tilts="rod_start_tilt_1" in wanted,
        **given,
    )
    return made


def recording(wanted: Mapping[str, float], seed: int = 0, seconds: float = SECONDS, finer: int = 2) -> sb.Recording:
    """Markers at equal distances on the rod of `finer` times the links, at half the step."""
    fine = scene(finer, wanted)
    times = np.arange(round(seconds * RATE) + 1) / RATE
    values = {name: value for name, value in wanted.items() if name in fine.quantities}
    x = sb.simulate(fine, times, sb.Solver(h=H / 2), values).positions
    rod = fine.ropes["rod"]
    places = [on_rope(rod, s) for s in where()]
    seen = np.stack([np.tensordot(x[:, list(p.particles)], np.array(p.weights), (1, 0)) for p in places], axis=1)
    noisy = seen + NOISE * np.random.default_rng(seed).standard_normal(seen.shape)
    return sb.Recording(positions=noisy, times=times, name="rod")


def where() -> np.ndarray:
    """The markers' distances from the hand, m."""
    return LENGTH * np.arange(1, MARKERS + 1) / MARKERS


def experiment(wanted: Mapping[str, float], measured: sb.Recording, finer: int = 1) -> sb.Experiment:
    """The fit's rod with the recording, or one of `finer` times the links."""
    made = scene(finer, wanted)
    rod = made.ropes["rod"]
    return sb.Experiment(
        scene=made,
        recording=measured,
        markers=[on_rope(rod, s) for s in where()],
        solver=sb.Solver(h=H),
        sigma=NOISE,
        start_time=0.0,
    )
