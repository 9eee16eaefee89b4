"""What moves the estimates of cloud.py off the truth: the fit's substep and mesh, or the noise of the clouds.

    python experiments/twin_cloth/cloud_bias.py [--draws 8]

At the true values every source is one Gauss-Newton step, in the units of the parameters: of clouds without noise, with
the fit's mesh or that of the data and runs combined from substeps of 1/120 or 1/240 s, beside named markers; and of the
noise alone, by its draws, with their mean. A step of clouds without noise is a bias of all draws. Takes a minute of
processor time, and 3 s for every draw.
"""

from __future__ import annotations

import argparse
from dataclasses import replace

import numpy as np
import sheetbend as sb
from cloud import FINER_OF_DATA, FINER_OF_FIT, FITTED, NOISE, OF_DATA, OF_FIT, PIECES, TIMES, Spots, scene, shown
from sheetbend.experiment.wanted import as_parameters
from sheetbend.problem.problem import FitProblem

Array = np.ndarray
LIMIT = 4 / 3  # from what a mesh twice as fine moves to the limit
FIRST = 1000  # seed of the draws, others than those of the study


def problem(
    recording: sb.Cloud | sb.Recording, finer: int, h: float, named: Spots | None = None, runs: int = 2
) -> FitProblem:
    """At the true values, with runs at h and h/2 combined, or single ones."""
    built = scene(finer)
    places = None
    if named is not None:
        cloths = [built.cloths[name] for name in PIECES]
        spots = zip(named.piece, named.at, strict=True)
        places = [place for k, at in spots for place in sb.on_cloth(cloths[k], [at])]
    solver = replace(OF_FIT, h=h, extrapolate=runs)
    e = sb.Experiment(scene=built, recording=recording, markers=places, solver=solver, start="equilibrium", sigma=NOISE)
    return FitProblem([e], as_parameters(list(FITTED), [e]))


def residuals(p: FitProblem) -> Array:
    """At the true values."""
    _, r, _ = p.evaluate(p.parameters.initial(), jacobian=False)
    return r


def step(J: Array, r: Array) -> Array:
    """(parameters,) the Gauss-Newton step, in their units."""
    return -np.linalg.lstsq(J, r, rcond=None)[0] * list(FITTED.values())


def told(name: str, numbers: Array) -> None:
    print(f"{name:52s}" + "".join(f"{number:9.4f}" for number in numbers), flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--draws", type=int, default=8, help="of the noise")
    draws = parser.parse_args().draws
    built = scene(FINER_OF_DATA)
    states = sb.simulate(built, TIMES, OF_DATA, start=sb.equilibrium(built).positions).positions
    cloud, markers, named = shown(built, states, FIRST, noise=0.0)
    print(" " * 52 + "".join(f"{name.removeprefix('cloth_').partition('_')[0]:>9s}" for name in FITTED))
    h, meshes = OF_FIT.h, (FINER_OF_FIT, FINER_OF_DATA)
    for kind, recording, spots in (("markers", markers, named), ("clouds", cloud, None)):
        fitted = problem(recording, FINER_OF_FIT, h, spots)
        _, r, J = fitted.evaluate(fitted.parameters.initial())
        own = step(J, r)
        told(f"{kind}, the fit's mesh, combined from {h:.4f} s", own)
        told("  the data's mesh", there := step(J, residuals(problem(recording, FINER_OF_DATA, h, spots))))
        told("  moved to the limit of fine meshes", own + LIMIT * (there - own))
        alone = [step(J, residuals(problem(recording, mesh, h, spots, runs=1))) for mesh in meshes]
        told("  moved as single runs say, which a fit does", own + LIMIT * (alone[1] - alone[0]))
    finest = residuals(problem(cloud, FINER_OF_DATA, h / 2))
    told(f"clouds, the data's mesh, combined from {h / 2:.4f} s", step(J, finest))
    steps = []
    for seed in range(FIRST, FIRST + draws):
        clean, noisy = (shown(built, states, seed, noise=size)[0] for size in (0.0, NOISE))
        here = problem(noisy, FINER_OF_FIT, h)
        _, r, J = here.evaluate(here.parameters.initial())
        steps.append(step(J, r - residuals(problem(clean, FINER_OF_FIT, h))))
    if draws > 1:
        told(f"noise alone, mean of {draws} draws", np.mean(steps, axis=0))
        told("  standard error", np.std(steps, axis=0, ddof=1) / np.sqrt(draws))


if __name__ == "__main__":
    main()
