"""What contacts tell of two tossed blocks on a hinge: a fit to the first frames after contact, and a search over whole
paths, which finds the numbers of `block_landings.py`.

    python experiments/elbow/block_landings_study.py [fit | search]

Both see every other toss that has seven frames of free flight or more. The fit takes one minute of processor time, the
search as long.
"""

from __future__ import annotations

import sys

import numpy as np
import sheetbend as sb
from block_landings import BLOCKS, BOX, FEWEST, SCALE, SOLVER, TOUCHING, Toss, errors, halves, of_both, other, scene_of
from blocks import CORNERS
from scipy.optimize import minimize
from sheetbend.arrays.rotations import matrices_of, quaternions_of

AFTER = 10  # frames from the end of free flight on that the fit sees
COMPARED = CORNERS / SCALE
SIGMA = 1e-3  # m, of a corner: what the model may be off by
FROM = {  # where the fit starts; the second block has the numbers of the first
    "first_table_friction": 0.2,
    "first_table_contact_dissipation": 2.0,
    "rounding": 2e-3,
    "hinge_viscosity": 1e-4,
    **{f"first_inertia_{k}": 1.3 * moment for k, moment in BOX.items()},
    "table_z": 0.0,
    "stretch": 0.0,
}
SIZES = {"rounding": 2e-3, "table_z": 1e-3, "stretch": 0.01}


SEARCH = {  # start, and the first step in its logarithm; heavier: moments of inertia over those of homogeneous blocks
    "first_table_friction": (0.17, -0.25),
    "first_table_contact_dissipation": (2.0, 0.5),
    "rounding": (2e-3, 0.5),
    "hinge_viscosity": (2e-4, 1.0),
    "heavier": (1.1, 0.2),
}


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
        scene=scene, recording=recording, markers=markers, solver=SOLVER, sigma=SIGMA, loss="soft_l1", loss_scale=2.0
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
    return sb.fit(experiments, parameters=[*free, *tied], windows=[], refine=False, profiles=False, tolerance=1e-6)


def searched(group: list[Toss], runs: int) -> dict[str, float]:
    """The numbers with which whole paths are predicted best by Nelder and Mead's simplex: the score is the mean error
    of the centers over time plus a third of that at rest."""
    start, step = np.array(list(SEARCH.values())).T
    best: tuple[float, dict[str, float]] = (np.inf, {})

    def score(logs: np.ndarray) -> float:
        nonlocal best
        values = dict(zip(SEARCH, (start * np.exp(logs)).tolist(), strict=True))
        heavier = values.pop("heavier")
        values |= {f"first_inertia_{k}": heavier * moment for k, moment in BOX.items()}
        found = np.mean([errors(toss, of_both(values)) for toss in group], axis=0)
        own = float(found[0] + found[1] / 3.0)
        if own < best[0]:
            best = own, values
            print(f"{own:.1f} mm: " + ", ".join(f"{name} {value:.3g}" for name, value in values.items()), flush=True)
        return own

    simplex = np.concatenate([np.zeros((1, len(step))), np.diag(step)])
    minimize(score, simplex[0], method="Nelder-Mead", options={"initial_simplex": simplex, "maxfev": runs})
    return best[1]


def main(what: str) -> None:
    group = [toss for toss in halves()[0] if toss.free >= FEWEST]
    if what == "fit":
        print(fitted(group).report())
    else:
        searched(group, 22)


if __name__ == "__main__":
    main(*(sys.argv[1:] or ["fit"]))
