"""A swinging rope that four markers see from the middle of its motion; the fit finds how it starts on the way."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

import numpy as np
import sheetbend as sb
from sheetbend.arrays.smoothing import state_at
from sheetbend.result.estimate import Estimate

TRUTH = {"rope_EI": 1e-3, "rope_bend_damping": 0.02, "rope_drag_linear": 5e-3}
LENGTH, LINKS, SIGMA, BEGUN = 0.6, 40, 1e-3, 30
SOLVER, TIMES = sb.Solver(h=1 / 240), np.arange(91) / 60
SEEN = [LINKS * k // 4 for k in range(1, 5)]


def rope(points: np.ndarray, velocity: np.ndarray | None = None, share: float = 1.0) -> sb.Scene:
    """Hung at its first point."""
    scene = sb.Scene("rope")
    own = {name.removeprefix("rope_"): value for name, value in TRUTH.items()}
    own |= {name: share * own[name] for name in ("EI", "bend_damping")}
    moving = {} if velocity is None else {"velocity": velocity}
    made = sb.add_rope(scene, length=LENGTH, segments=LINKS, density=0.05, points=points, **own, **moving)
    scene.pin([int(made.particles[0])])
    return scene


@cache
def clean() -> np.ndarray:
    start = np.array([[0.0, 0.0, 0.0], [0.54, 0.0, -0.26]])
    return sb.simulate(rope(start), TIMES, SOLVER).positions[:, SEEN]


def fit(seed: int) -> Mapping[str, Estimate]:
    """From twice the stiffness and the damping, and a start that goes smoothly through the markers."""
    x = clean() + SIGMA * np.random.default_rng(seed).standard_normal((len(TIMES), len(SEEN), 3))
    recording = sb.Recording(x[BEGUN:], TIMES[BEGUN:], name="rope")
    place, velocity = state_at(recording.times, recording.positions, TIMES[BEGUN], 0.1)
    pivot = np.zeros((1, 3))
    scene = rope(np.concatenate([pivot, place]), np.concatenate([pivot, velocity]), share=2.0)
    places = [sb.on_particle(int(scene.ropes["rope"].particles[i])) for i in SEEN]
    e = sb.Experiment(scene=scene, recording=recording, markers=places, solver=SOLVER, sigma=SIGMA, start="estimated")
    found = sb.fit(e, parameters=list(TRUTH), refine=False, profiles=False, beginnings=False)
    return {name: found[name] for name in TRUTH}
