"""A double pendulum that is let go near the top for 20 s, where displacements grow by some e^3.6 per second, and what
is found of it by multiple shooting."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache

import numpy as np
import sheetbend as sb
from sheetbend.experiment.wanted import as_parameters
from sheetbend.problem.problem import FitProblem
from sheetbend.result.estimate import Estimate

TRUTH = {
    "upper_first_moment": 0.0102,
    "lower_first_moment": 0.0161,
    "lower_inertia": 0.00316,
    "upper_friction": 1e-4,
    "lower_friction": 5e-5,
}
START = {"upper_angle": 3.0, "lower_angle": 2.6, "upper_rate": 0.0, "lower_rate": 0.0}
SIGMA, WINDOW, SECONDS = 1e-4, 0.5, 20.0  # m, s
SOLVER = sb.Solver(h=1 / 400)
TIMES = np.arange(round(200 * SECONDS) + 1) / 200


def pendulum(moments: Mapping[str, float] = TRUTH, start: Mapping[str, float] = START) -> sb.Experiment:
    """Both arms, each with a marker, and a recording of zeros."""
    scene, length = sb.Scene("let go near the top"), 0.1727
    own = {
        name: {k.removeprefix(name): v for k, v in {**moments, **start}.items() if k.startswith(name)}
        for name in ("upper_", "lower_")
    }
    upper = sb.add_arm(scene, "upper", mass=0.0938, inertia=0.00154358, length=length, **own["upper_"])
    lower = sb.add_arm(scene, "lower", mass=0.137596, length=0.25, pivot=upper, **own["lower_"])
    blank = sb.Recording(np.zeros((len(TIMES), 2, 3)), TIMES, markers=("m1", "m2"), name="whole")
    markers = {"m1": upper.place(length), "m2": lower.place(0.1168)}
    return sb.Experiment(scene=scene, recording=blank, markers=markers, solver=SOLVER, axes="xz", sigma=SIGMA)


@cache
def clean() -> np.ndarray:
    """Markers of the true motion, as one unbroken run."""
    e = pendulum()
    problem = FitProblem([e], as_parameters(list(TRUTH), [e]))
    return problem.simulate(problem.parameters.initial())[0]


def fit(seed: int) -> Mapping[str, Estimate]:
    """From values and a start that are 5 to 7 % off, to either side."""
    rng = np.random.default_rng(seed)
    off = {name: v * (1 + rng.choice([-1.0, 1.0]) * rng.uniform(0.05, 0.07)) for name, v in {**TRUTH, **START}.items()}
    x = clean()
    noisy = x.copy()
    noisy[..., [0, 2]] += SIGMA * rng.standard_normal((*x.shape[:2], 2))
    e = pendulum({n: off[n] for n in TRUTH}, {n: off[n] for n in START})
    e = replace(e, recording=replace(e.recording, positions=noisy), shooting=WINDOW)
    found = sb.fit(e, parameters=[*TRUTH, *START], refine=False, profiles=False, beginnings=False)
    return {name: found[name] for name in TRUTH}
