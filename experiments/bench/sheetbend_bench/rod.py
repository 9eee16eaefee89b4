"""A rope of 12 markers as a rod between two moving grips: what a substep of a fit costs.

Two markers at each end are gripped, so nine links are free. BDF2, one Newton iteration per substep, damping of bending
and twist, drag: the model that `sheetbend.gripped` fits. A unit of work is one substep of one rope. The loss is the
sum of the last coordinates.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from sheetbend.motion.solver import Solver
from sheetbend.objects.grip import Grip, carried
from sheetbend.objects.rod import rod
from sheetbend.scene.scene import Scene
from sheetbend.version import __version__

from .machine import isa, machine
from .measurement import LANES
from .ropes import Ropes
from .timing import in_fresh_process, peak_mb, timed

LINKS = 9
H = 1 / 200  # s
SUBSTEPS = 1000
DIRECTIONS = 8  # of the Jacobian
BATCH = 8  # recordings in lanes
CHECKED = 60  # substeps of the run whose gradient is compared with a complex step
BOUND = 1e-9


def rods(substeps: int, threads: int = 1, count: int = 1, iterations: int = 1) -> Ropes:
    """`count` ropes with different motions."""
    scenes = [_scene(k, substeps).compiled for k in range(count)]
    solver = Solver(h=H, iterations=iterations, threads=threads)
    return Ropes(scenes[0], np.stack([s.inputs() for s in scenes]), solver, substeps)


def measure_rod(threads: int = 1, repeats: int = 5, substeps: int = SUBSTEPS) -> dict[str, Any]:
    """ns per substep: forward with one and two iterations, gradient, eight columns of a Jacobian, and eight ropes in
    lanes against one at a time."""
    one, all_ = rods(substeps, threads), rods(substeps, threads, BATCH)
    directions = np.random.default_rng(1).standard_normal((DIRECTIONS, one.inputs.shape[1])) * np.abs(one.inputs[0])
    found: dict[str, Any] = {
        "workload": "rod",
        "particles": LINKS + 1,
        "projections": substeps,
        "substeps": substeps,
        "threads": threads,
        "lanes": LANES,
        "isa": isa(),
        "repeats": repeats,
    }
    works: dict[str, tuple[Callable[[], object], int]] = {
        "forward": (one.forward, 1),
        "two_iterations": (rods(substeps, threads, iterations=2).forward, 1),
        "gradient": (one.gradient, 1),
        "jacobian": (partial(one.jacobian, directions), 1),
        "forward_batch": (all_.all_forward, BATCH),
        "forward_singly": (partial(all_.singly, all_.forward), BATCH),
        "gradient_batch": (all_.all_gradients, BATCH),
        "gradient_singly": (partial(all_.singly, all_.gradient), BATCH),
    }
    for name, (work, ropes) in works.items():
        times, _ = timed(work, repeats)
        found |= times.figures(name, ropes * substeps)
    return found | {
        "gradient_error": gradient_error(),
        "gradient_error_bound": BOUND,
        "peak_mb": in_fresh_process(_peak_mb, substeps, threads),
        "sheetbend": __version__,
        "machine": machine(),
    }


def gradient_error() -> float:
    """Of the adjoint, relative to complex step."""
    return rods(CHECKED).gradient_error()


def _scene(number: int, substeps: int) -> Scene:
    """A rope of 0.87 m whose grips move at random, smoothly."""
    rng = np.random.default_rng(number)
    times = np.linspace(0.0, substeps * H, 101)
    phase, rate = rng.uniform(0, 2 * np.pi, (2, 6)), rng.uniform(2.0, 5.0, (2, 6))
    waves = np.sin(rate * times[:, None, None] + phase) - np.sin(phase)
    grips = []
    for k, (place, nominal) in enumerate((([0.0, 0.0, 0.0], [0.8, 0.0, -0.6]), ([0.6, 0.0, 0.0], [0.8, 0.0, 0.6]))):
        direction = np.array(nominal) + 0.2 * waves[:, k, 3:]
        direction /= np.linalg.norm(direction, axis=1, keepdims=True)
        director = carried(np.array([0.0, 1.0, 0.0]), np.array(nominal), direction)
        grips.append(Grip(times, np.array(place) + 0.05 * waves[:, k, :3], direction, director))
    s = np.linspace(0.0, 1.0, 50)
    points = np.stack([0.6 * s, 0.0 * s, -1.1 * s * (1.0 - s)], axis=1)
    return rod(
        0.87,
        LINKS,
        density=0.06,
        EI=2.4e-3,
        GJ=3e-3,
        start=grips[0],
        end=grips[1],
        points=points,
        tilts=True,
        roll=True,
        bend_damping=0.02,
        twist_damping=0.02,
        drag_linear=0.006,
        curvature_modes=(0, 1),
    )


def _peak_mb(substeps: int, threads: int) -> float:
    return peak_mb(rods(substeps, threads).gradient)
