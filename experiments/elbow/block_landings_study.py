"""What tosses tell of two blocks on a hinge: a fit to their flights, also those between impacts, which finds moments of
inertia and the viscosity of the hinge, a fit to the first frames after contact, and a search over the first 40.

    python experiments/elbow/block_landings_study.py [flights | fit | search]

All see every other toss; the last two those of them that have seven frames of free flight or more. Each takes one to
two minutes of processor time. `block_landings.py` has the numbers of the first and the last.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from itertools import pairwise

import blocks
import numpy as np
import sheetbend as sb
from block_landings import (
    BLOCKS,
    BOX,
    DOWN,
    FEWEST,
    FOUND,
    SCALE,
    TOUCHING,
    Toss,
    centers_apart,
    halves,
    of_both,
    other,
    poses,
    scene_of,
)
from blocks import CORNERS, RATE, Flight
from scipy.optimize import minimize
from sheetbend.arrays.rotations import matrices_of, quaternions_of

PULL = 9.0  # m/s^2, by which gravity may miss the acceleration of a flight
LEAST = 7  # frames of a flight
LONG, FAST = 12, 4.0  # frames, rad/s of the hinge: flights that are either count
AFTER = 10  # frames from the end of free flight on that the fit sees
FINE = sb.Solver(h=1 / (16 * RATE), method="implicit")  # of that fit
COMPARED = CORNERS / SCALE
SIGMA = 1e-3  # m, of a corner: what the model may be off by
FROM = {  # where the fit starts; the second block has the numbers of the first
    "first_table_friction": 0.25,
    "first_table_contact_dissipation": 0.4,
    "first_table_contact_stiffness": 2e5,
    "rounding": 1e-3,
    "hinge_viscosity": 1e-4,
    "hinge_tilt_stiffness": 90.0,
    "hinge_tilt_damping": 0.05,
    **{f"first_inertia_{k}": 1.3 * moment for k, moment in BOX.items()},
    "table_z": 0.0,
    "stretch": 0.0,
}
SIZES = {"rounding": 2e-3, "table_z": 1e-3, "stretch": 0.01}
SEARCH = {  # start, and the first step in its logarithm
    "first_table_friction": (0.3, -0.25),
    "first_table_contact_dissipation": (0.5, 0.5),
    "hinge_tilt_stiffness": (90.0, 0.4),
    "hinge_tilt_damping": (0.12, -0.7),
}
RUNS = 26
SEEN = {10: 10.0, 20: 25.0, 40: 45.0}  # frames after free flight, and how far off a rigid hinge is there, mm


def between(toss: Toss) -> list[Flight]:
    """The parts of a toss in which nothing but gravity acts and all corners are 4 mm above the table."""
    seen = (toss.positions, matrices_of(toss.quaternions)), toss.second()
    corners = [(x[:, None] + np.einsum("fab,kb->fka", frames, TOUCHING))[..., 2].min(axis=1) for x, frames in seen]
    low = np.min(corners, axis=0)[1:-1] < seen_height(toss) + 0.004
    pull = np.linalg.norm(np.diff(toss.middle(), 2, axis=0) * RATE**2 - DOWN, axis=1)
    edges = [-1, *np.flatnonzero(low | (pull > PULL)), len(pull)]
    parts = [slice(a + 1, b + 2) for a, b in pairwise(edges) if b - a + 1 >= LEAST]
    return [
        Flight(f"{toss.name} {p.start}", toss.times[p] - toss.times[p.start], toss.positions[p], toss.quaternions[p], a)
        for p in parts
        if len(a := toss.angles[p]) >= LONG or abs(np.polyfit(toss.times[p], a, 1)[0]) > FAST
    ]


def fitted_flights(group: list[Toss]) -> sb.FitResult:
    """Gravity, the viscosity of the hinge and the moments of inertia, alike of both blocks, from all their flights."""
    moments = [sb.Parameter(name=f"first_inertia_{k}", initial=1.5 * moment) for k, moment in BOX.items()]
    tied = [sb.Parameter(name=other(moment.name), tied_to=moment.name) for moment in moments]
    flights = [flight for toss in group for flight in between(toss)]
    experiments = [replace(blocks.experiment(f), sigma=2e-4, loss="soft_l1", loss_scale=2.0) for f in flights]
    free = [*blocks.parameters(["gravity", "hinge_viscosity"]), *moments, *tied]
    return sb.fit(experiments, parameters=free, windows=[], refine=False, profiles=False)


def seen_height(toss: Toss) -> float:
    """Of the table, m, from where the blocks rest."""
    seen = (toss.positions, matrices_of(toss.quaternions)), toss.second()
    return float(min((x[-1] + TOUCHING @ frames[-1].T)[:, 2].min() for x, frames in seen))


def experiment(toss: Toss) -> sb.Experiment:
    """A toss up to its first frames after contact."""
    scene, until = scene_of(toss, seen_height(toss)), min(toss.free + AFTER, len(toss.times))
    centers, turned = toss.second()
    poses = (toss.positions, toss.quaternions), (centers, quaternions_of(turned))
    parts = [sb.Recording.from_poses(toss.times[:until], x[:until], q[:until], COMPARED) for x, q in poses]
    recording = sb.Recording(
        np.concatenate([part.positions for part in parts], axis=1),
        toss.times[:until],
        markers=tuple(f"{block}_{k}" for block in BLOCKS for k in range(len(COMPARED))),
        name=toss.name.replace(" ", "_"),
    )
    markers = [one for block in BLOCKS for one in sb.on_body(scene.bodies[block], COMPARED)]
    return sb.Experiment(
        scene=scene, recording=recording, markers=markers, solver=FINE, sigma=SIGMA, loss="soft_l1", loss_scale=2.0
    )


def fitted(group: list[Toss]) -> sb.Fit:
    """The numbers that all tosses share. Where each begins is given by its free flight."""
    free = [
        sb.Parameter(
            name=name,
            initial=value,
            scale=SIZES.get(name),
            log=name not in SIZES,
            **({"lower": 0.0, "upper": 0.02} if name == "rounding" else {}),
        )
        for name, value in FROM.items()
    ]
    tied = [sb.Parameter(name=other(name), tied_to=name) for name in FROM if name.startswith("first")]
    experiments = [experiment(toss) for toss in group]
    return sb.fit(experiments, parameters=[*free, *tied], windows=[], refine=False, profiles=False, tolerance=1e-4)


def after(toss: Toss, values: dict[str, float]) -> np.ndarray:
    """mm, mean of both centers, at the frames of SEEN, on a table as high as the blocks rest on."""
    end = min(toss.free + max(SEEN), len(toss.times))
    kept = {name: getattr(toss, name)[:end] for name in ("times", "positions", "quaternions", "angles")}
    part = replace(toss, **kept)
    apart = centers_apart(part, poses(part, {**of_both(values), "table_z": seen_height(toss)})).mean(axis=0)
    return np.array([apart[min(toss.free - 1 + k, end - 1)] for k in SEEN])


def searched(group: list[Toss], runs: int) -> dict[str, float]:
    """The numbers with which paths after the first impacts are predicted best by Nelder and Mead's simplex: the score
    is the mean error of the centers at the frames of SEEN, each over its size there."""
    start, step = np.array(list(SEARCH.values())).T
    best: tuple[float, dict[str, float]] = (np.inf, {})

    def score(logs: np.ndarray) -> float:
        nonlocal best
        values = dict(zip(SEARCH, (start * np.exp(logs)).tolist(), strict=True))
        found = np.mean([after(toss, FOUND | values) for toss in group], axis=0)
        own = float(np.mean(found / list(SEEN.values())))
        if own < best[0]:
            best = own, values
            told = ", ".join(f"{name} {value:.3g}" for name, value in values.items())
            print(f"{own:.3f} ({', '.join(f'{a:.1f}' for a in found)} mm): {told}", flush=True)
        return own

    simplex = np.concatenate([np.zeros((1, len(step))), np.diag(step)])
    minimize(score, simplex[0], method="Nelder-Mead", options={"initial_simplex": simplex, "maxfev": runs})
    return best[1]


def main(what: str) -> None:
    seen = halves()[0]
    group = [toss for toss in seen if toss.free >= FEWEST]
    if what == "flights":
        found = fitted_flights(seen)
        for name in ("gravity", "hinge_viscosity", *(f"first_inertia_{k}" for k in BOX)):
            one, unit = found[name], BOX[int(name[-1])] if "inertia" in name else 1.0
            half = np.inf if one.half_width is None else one.half_width
            print(f"{name:16s} {one.value / unit:9.4g} +- {half / unit:8.2g}  {one.verdict}")
        print("moments of inertia are over those of a homogeneous block")
    elif what == "fit":
        print(fitted(group).report())
    else:
        searched(group, RUNS)


if __name__ == "__main__":
    main(*(sys.argv[1:] or ["flights"]))
