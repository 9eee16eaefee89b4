"""Populations of ropes: 50 specimens whose EI scatters by 10 %, each fitted by itself, and what they are together."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import sheetbend as sb
from sheetbend.report.collected import Collected, Trait

SPECIMENS, MEDIAN, SPREAD = 50, 1e-3, 0.1  # N m^2, and the deviation of its logarithm
TRUTH = {"median": MEDIAN, "spread": SPREAD}
LINKS, MARKERS, SIGMA = 8, 4, 3e-3
TIMES = np.arange(25) / 60
SOLVER = sb.Solver(h=1 / 240)


@dataclass(frozen=True)
class Interval:
    """What is told of a population, as an estimate."""

    value: float
    lower: float
    upper: float
    verdict: str


def rope(EI: float) -> sb.Scene:
    """Clamped level and let go."""
    return sb.rope(0.5, LINKS, density=0.05, EI=EI, bend_damping=0.01, drag_linear=5e-3, clamp_start=(1, 0, 0))


def fit_population(seed: int) -> dict[str, Interval]:
    """Median and spread of EI of the population with that number."""
    rng = np.random.default_rng(seed)
    fits = {f"rope {k}": specimen(rng).result for k in range(SPECIMENS)}
    (trait,) = Collected.of(fits).traits
    return told(trait)


def specimen(rng: np.random.Generator) -> sb.Fit:
    """The fit of one rope of the population."""
    EI, scene = MEDIAN * math.exp(SPREAD * rng.standard_normal()), rope(1.3 * MEDIAN)
    places = [sb.on_rope(scene.ropes["rope"], 0.5 * (k + 1) / MARKERS) for k in range(MARKERS)]
    at = [LINKS * (k + 1) // MARKERS for k in range(MARKERS)]
    x = sb.simulate(rope(EI), TIMES, SOLVER).positions[:, scene.ropes["rope"].particles[at]]
    recording = sb.Recording(x + SIGMA * rng.standard_normal(x.shape), TIMES, name="rope")
    return sb.fit(scene, recording, ["rope_EI"], markers=places, solver=SOLVER, sigma=SIGMA, refine=False)


def told(trait: Trait) -> dict[str, Interval]:
    """Mean and spread with their intervals."""
    p = trait.found
    if p is None or not trait.log:
        raise RuntimeError(f"too few specimens count: {dict(trait.left_out)}")
    lower, upper = map(math.exp, p.mean_interval)
    spread = Interval(p.spread, *p.spread_interval, "identified")
    return {"median": Interval(math.exp(p.mean), lower, upper, "identified"), "spread": spread}
