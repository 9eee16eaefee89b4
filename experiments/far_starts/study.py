"""Fits of a hand-held rod from starts far off, with nothing set by the user: prints a table.

    python experiments/far_starts/study.py three|twelve|many [DRAWS]

`three`: EI, damping and drag, each 10 to 100 times off either way, or as they are: 27 starts. `twelve` and `many` (24
numbers): every number 2 to 5 times off either way, modes and tilts at minus, zero or twice their value; DRAWS (20)
draws of start and noise. Right is an end whose intervals hold all truths, or else a cost within 1 % of that of a search
which starts at the truth. Seconds are of processor time.
"""

from __future__ import annotations

import itertools
import sys
import time
from collections.abc import Iterator, Mapping

import numpy as np
import sheetbend as sb
from hand_held import FEW, MANY, TWELVE, experiment, recording

SAME = 1.01


def three() -> Iterator[tuple[str, int, dict[str, float]]]:
    """Starts on a grid of -1, 0, 1, each 10 to 100 times off."""
    rng = np.random.default_rng(0)
    for signs in itertools.product((-1, 0, 1), repeat=3):
        far = 10.0 ** (np.array(signs) * rng.uniform(1.0, 2.0, 3))
        words = "  ".join(f"{f:8.3g}" for f in far)
        yield words, 0, {name: value * f for (name, value), f in zip(FEW.items(), far, strict=True)}


def drawn(truth: Mapping[str, float], draws: int) -> Iterator[tuple[str, int, dict[str, float]]]:
    """Starts at random."""
    for seed in range(draws):
        rng = np.random.default_rng(seed)
        yield str(seed), seed, {name: off(name, value, rng) for name, value in truth.items()}


def off(name: str, value: float, rng: np.random.Generator) -> float:
    """Another value: 2 to 5 times off for what is positive, minus to twice the value for what may be zero."""
    if any(part in name for part in ("softness", "curvature", "tilt", "density_")):
        return float(value * rng.choice([-1.0, 0.0, 2.0]))
    return float(value * np.exp(rng.uniform(np.log(2.0), np.log(5.0)) * rng.choice([-1, 1])))


def fitted(e: sb.Experiment, start: Mapping[str, float]) -> tuple[sb.Fit, float]:
    """A fit that counts the mesh, all else by default, and its processor time in s."""
    began = time.process_time()
    finer = sb.Refinement(finer=lambda: [experiment(start, e.recording, finer=2)], linear=True)
    found = sb.fit(e, parameters={name: {"initial": value} for name, value in start.items()}, refine=finer)
    return found, time.process_time() - began


def lowest(e: sb.Experiment, truth: Mapping[str, float]) -> float:
    """The cost where a search from the truth ends."""
    wanted = {name: {"initial": value} for name, value in truth.items()}
    near = sb.fit(e, parameters=wanted, refine=False, profiles=False, beginnings=False)
    return float(near.result.cost)


def main(which: str, draws: int) -> None:
    truth = {"three": FEW, "twelve": TWELVE, "many": MANY}[which]
    starts = three() if which == "three" else drawn(truth, draws)
    made: dict[int, sb.Experiment] = {}
    best: dict[int, float] = {}
    right, rows, times, inside = 0, 0, [], dict.fromkeys(truth, 0)
    print("start                         right  inside  identified  doubtful  iterations  simulations  seconds")
    for words, seed, start in starts:
        if seed not in made:
            made[seed] = experiment(truth, recording(truth, seed, finer=4 if which == "three" else 2))
        found, seconds = fitted(made[seed], start)
        r, end = found.result, found.result.starts[0].cost
        held = [
            p.name
            for p in r.estimates
            if p.lower is not None and p.upper is not None and p.lower <= truth[p.name] <= p.upper
        ]
        inside |= {name: inside[name] + 1 for name in held}
        if len(held) < len(truth) and seed not in best:
            best[seed] = lowest(made[seed], truth)
        same = len(held) == len(truth) or (end is not None and end < SAME * best[seed])
        verdicts = [sum(p.verdict == verdict for p in r.estimates) for verdict in ("identified", "doubtful")]
        right, rows = right + same, rows + 1
        times.append(seconds)
        print(
            f"{words:30}{'yes' if same else 'NO':5}{len(held):8}{verdicts[0]:12}{verdicts[1]:10}{r.iterations:12}"
            f"{r.evaluations:13}{seconds:9.2f}",
            flush=True,
        )
    print(f"right: {right} of {rows}; seconds: median {np.median(times):.2f}, most {max(times):.2f}")
    print("inside:", ", ".join(f"{name} {count}" for name, count in inside.items()))


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 20)
