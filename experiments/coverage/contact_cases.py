"""Ropes and cloth that slide: twins whose friction, stiffness and air drag are fitted.

Targets are made at an eighth of the substep of the fit, from two runs that are combined: the world knows no substep.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache

import numpy as np
import sheetbend as sb
from sheetbend.result.estimate import Estimate

SIGMA = 1e-3  # m
FORCE_SIGMA = 0.01  # N
SOLVER = sb.Solver(h=2e-3, method="implicit", integrator="bdf1")
FINE = replace(SOLVER, h=SOLVER.h / 8, extrapolate=2)
SETTLED = 0.2  # s, of a motion with forces, which ring at its start
RATE = 50  # frames per second
STIFFNESS = 2e4  # N/m of ropes where they touch
SOFTNESS = 200.0  # N/m of a particle of cloth where it touches
SHARE = 1.3  # of the truth: where fits start


def smooth(share: np.ndarray) -> np.ndarray:
    """From 0 to 1, at rest at both ends."""
    share = np.clip(share, 0.0, 1.0)
    return share**3 * (10.0 - 15.0 * share + 6.0 * share**2)


def frames(seconds: float) -> np.ndarray:
    return np.arange(round(seconds * RATE) + 1) / RATE


def moved(at: np.ndarray, times: np.ndarray, displacement: np.ndarray) -> np.ndarray:
    """(frames, particles, 3): particles that all move alike, by (frames, 3)."""
    return np.asarray(at)[None] + displacement[:, None]


DRAG = {"table_friction": 0.3, "rope_EI": 3e-4, "rope_drag_linear": 0.03}


def drag(friction: float, EI: float, drag_linear: float) -> tuple[sb.Scene, np.ndarray, list[sb.Place]]:
    """A rope on a table: its start is drawn aside slowly, and then back and along, fast and through the air."""
    scene = sb.rope(0.4, 16, density=0.05, EA=200.0, EI=EI, drag_linear=drag_linear, start=(0, 0, 0.005), pinned=())
    rope, times = scene.ropes["rope"], frames(0.9)
    aside, back = smooth(times / 0.4), smooth((times - 0.4) / 0.45)
    path = np.stack([-0.1 * back, 0.12 * aside - 0.24 * back, 0.1 * back], axis=1)
    scene.drive(rope.particles[:1], times, moved(scene.positions[rope.particles[:1]], times, path))
    scene.add_contact(rope, sb.Plane(name="table"), friction=friction, radius=0.005, stiffness=STIFFNESS)
    return scene, times, [sb.on_rope(rope, 0.4 * (k + 1) / 12) for k in range(12)]


DRAWN = {"edge_friction": 0.4, "cloth_bending": 1e-3, "cloth_drag_linear": 1.0}


def drawn(friction: float, bending: float, drag_linear: float) -> tuple[sb.Scene, np.ndarray, list[sb.Place]]:
    """A cloth that hangs over a table's round edge and is drawn over it by a part of its side, on a bent way."""
    mesh, scene = sb.mesh.grid(0.2, 0.12, 6, 3, "one_way"), sb.Scene("cloth")
    x, y = mesh.material.T
    at = np.column_stack([x - 0.16, y, np.full(len(x), 0.002)])
    held = np.flatnonzero((x > 0.19) & (y > 0.05))
    cloth = sb.add_cloth(
        scene, mesh, density=0.2, warp=40.0, weft=40.0, shear=8.0, bending=bending, drag_linear=drag_linear,
        membrane_damping=3e-3, bend_damping=3e-3, positions=at, held=held,
    )  # fmt: skip
    times = frames(0.4)
    along = smooth(times / 0.4)
    path = np.stack([0.1 * along, -0.05 * smooth((times - 0.1) / 0.3), -0.04 * along], axis=1)
    grip = cloth.particles[held]
    scene.drive(grip, times, moved(scene.positions[grip], times, path))
    table = sb.Box(center=(-0.25, 0.06, -0.1), size=(0.6, 0.6, 0.2), edge_radius=0.05, name="edge")
    scene.add_contact(cloth, table, friction=friction, radius=0.002, stiffness=SOFTNESS)
    spots = np.array([(x, y) for x in (0.01, 0.07, 0.13, 0.19) for y in (0.005, 0.04, 0.115)])
    return scene, times, list(sb.on_cloth(cloth, spots))


OVER = {"post_friction": 0.25, "rope_EI": 3e-5, "rope_drag_linear": 0.2}
RADIUS, ROPE_RADIUS = 0.04, 0.004


def over(friction: float, EI: float, drag_linear: float) -> tuple[sb.Scene, np.ndarray, list[sb.Place]]:
    """A rope over a cylinder; a hand draws one end down and aside."""
    reach, turns = RADIUS + ROPE_RADIUS, np.linspace(np.pi, 0.0, 181)
    arc = np.column_stack([reach * np.cos(turns), 0.0 * turns, reach * np.sin(turns)])
    points = np.vstack([[-reach, 0, -0.16], arc, [reach, 0, -0.2]])
    scene = sb.rope(
        segments=26,
        density=0.1,
        EA=300.0,
        EI=EI,
        bend_damping=0.03,
        stretch_damping=3e-3,
        drag_linear=drag_linear,
        points=1.0005 * points,
        pinned=(),
    )
    rope, times = scene.ropes["rope"], frames(1.0)
    down = 0.05 * smooth(times / 0.5) + 0.03 * smooth((times - 0.5) / 0.2)
    path = np.stack([0.0 * down, 0.3 * down, -down], axis=1)
    scene.drive(rope.particles[:1], times, moved(scene.positions[rope.particles[:1]], times, path))
    post = sb.Capsule(start=(0, -0.5, 0), end=(0, 0.5, 0), radius=RADIUS, name="post")
    scene.add_contact(rope, post, friction=friction, radius=ROPE_RADIUS, stiffness=STIFFNESS)
    return scene, times, [sb.on_rope(rope, rope.length * (k + 1) / 12) for k in range(12)]


Make = Callable[..., tuple[sb.Scene, np.ndarray, list[sb.Place]]]


def twin(make: Make, truth: Mapping[str, float], sensed: bool = False) -> Callable[[int], Mapping[str, Estimate]]:
    """A fit to the world's motion with noise; `sensed` adds a force sensor at the hand."""

    @cache
    def world() -> tuple[np.ndarray, sb.ForceRecording | None]:
        scene, times, places = make(*truth.values())
        x = sum(w * sb.simulate(scene, times, FINE.with_h(h)).positions for h, w in FINE.runs)
        markers = np.stack([np.tensordot(x[:, list(p.particles)], p.weights, (1, 0)) for p in places], axis=1)
        samples = np.arange(2, round(times[-1] * 100)) / 100
        force = sb.simulate_forces(scene, samples, ("rope", "start"), FINE) if sensed else None
        return markers, force

    def fit(seed: int) -> Mapping[str, Estimate]:
        rng = np.random.default_rng(seed)
        (markers, force), sensors = world(), []
        scene, times, places = make(*(SHARE * value for value in truth.values()))
        seen = sb.Recording(positions=markers + SIGMA * rng.standard_normal(markers.shape), times=times, name="twin")
        if force is not None:
            noisy = replace(force, forces=force.forces + FORCE_SIGMA * rng.standard_normal(force.forces.shape))
            sensors = [sb.ForceSensor(recording=noisy, at=("rope", "start"), sigma=FORCE_SIGMA)]
        window = (SETTLED, float(times[-1])) if sensed else None
        how = {"solver": SOLVER, "sigma": SIGMA, "fit": window, "start_time": 0.0, "beginnings": False}
        found = sb.fit(scene, seen, list(truth), markers=places, forces=sensors, **how)
        return {name: found[name] for name in truth}

    return fit
