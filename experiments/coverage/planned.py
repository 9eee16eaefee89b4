"""Half-widths that `sheetbend.identify` predicts, against those that fits to noisy data print.

    python experiments/coverage/planned.py experiments/twin_cloth/twin_cloth.toml --seeds 0 20

Data are simulated at a configuration's [published] values, with independent noise of its sigma, and fitted without
refits at finer steps and meshes. Each fit is a JSON line in out/coverage; known seeds are skipped.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import sheetbend as sb
from coverage import OUT, lines
from sheetbend.config import Study, load
from sheetbend.experiment.wanted import as_parameters
from sheetbend.problem.problem import FitProblem
from sheetbend.quantities.parameters import Parameters

NEAR = 0.25


def truth(study: Study) -> tuple[list[sb.Experiment], Parameters, list[np.ndarray]]:
    """What is fitted, with parameters that start at the truth, and markers of the true motions."""
    fitted = [replace(e, held_out=None) for e in study.experiments]
    given = {
        name: dict(fields) | {"initial": study.config.published[name]} for name, fields in study.parameters.items()
    }
    wanted = as_parameters(given, fitted)
    problem = FitProblem(fitted, wanted)
    return fitted, wanted, problem.simulate(problem.parameters.initial())


def half_widths(config: Path, seed: int) -> dict[str, float | None]:
    """That a fit prints."""
    fitted, wanted, clean = truth(load(config))
    rng = np.random.default_rng(seed)
    made = []
    for e, x in zip(fitted, clean, strict=True):
        r = e.fitted()
        made.append(replace(e, fit=None, recording=replace(r, positions=x + e.sigma * rng.standard_normal(x.shape))))
    found = sb.fit(made, parameters=wanted, refine=False, beginnings=False, windows=())
    return {name: found[name].half_width for name in wanted.free}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("config", type=Path)
    parser.add_argument("--seeds", nargs=2, type=int, default=(0, 20), metavar=("FIRST", "STOP"))
    given = parser.parse_args()
    case, (first, stop) = f"planned_{given.config.stem}", given.seeds
    OUT.mkdir(parents=True, exist_ok=True)
    known = lines(OUT, case)
    with (OUT / f"{case}.{first}-{stop}.jsonl").open("a") as file:
        for seed in range(first, stop):
            if seed not in known:
                known[seed] = {"seed": seed, "half_widths": half_widths(given.config, seed)}
                file.write(json.dumps(known[seed]) + "\n")
                file.flush()
    fitted, wanted, _ = truth(load(given.config))
    plan = sb.identify(fitted, parameters=wanted, suggest=False)
    for name in wanted.free:
        ratios = np.array([known[seed]["half_widths"][name] or np.inf for seed in range(first, stop)])
        ratios = ratios / plan[name].half_width
        near = int(np.sum(np.abs(ratios - 1.0) < NEAR))
        print(f"{name}: median ratio {np.median(ratios):.2f}, {near} of {len(ratios)} within 25 %, {ratios.max():.2f}")


if __name__ == "__main__":
    main()
