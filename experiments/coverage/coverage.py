"""How often 95 % intervals hold the truth.

    python experiments/coverage/coverage.py draw rope --seeds 0 200   # one JSON line per seed; known ones are skipped
    python experiments/coverage/coverage.py table                     # what all lines say

Chunks of seeds may run side by side, each with an `--out` of its own: the table reads every file of the folder.
`--out experiments/coverage/expected` shows the cases of which every draw is kept.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from cases import CASES
from scipy.stats import binomtest

OUT = Path("out/coverage")


def lines(folder: Path, case: str) -> dict[int, dict]:
    """What is known of a case, by seed; a line that a killed process left half written does not count."""
    known: dict[int, dict] = {}
    for file in sorted(folder.glob(f"{case}.*.jsonl")):
        for line in file.read_text().splitlines():
            try:
                entry = json.loads(line)
            except ValueError:
                continue
            known[entry["seed"]] = entry
    return known


def short(value: float | None) -> float | None:
    return None if value is None else float(f"{value:.9g}")


def draw(case: str, seeds: range, folder: Path) -> None:
    """Fit every seed that is not known yet."""
    folder.mkdir(parents=True, exist_ok=True)
    known = lines(folder, case)
    with (folder / f"{case}.{seeds.start}-{seeds.stop}.jsonl").open("a") as file:
        file.write("\n")  # ends what a killed process began
        for seed in seeds:
            if seed in known:
                continue
            began = time.process_time()
            found = CASES[case].fit(seed)
            estimates = {name: [*map(short, (e.value, e.lower, e.upper)), e.verdict] for name, e in found.items()}
            entry = {"seed": seed, "seconds": short(time.process_time() - began), "estimates": estimates}
            file.write(json.dumps(entry) + "\n")
            file.flush()


def rows(folder: Path) -> Iterator[str]:
    """A row of Markdown for every parameter of every case that was drawn."""
    yield (
        "| case | parameter | intervals that contain the true value | of | share, 95 % bounds | expected of 200 "
        "| median half-width | over that with the same mesh and step in data and fit |"
    )
    yield "| --- | --- | --- | --- | --- | --- | --- | --- |"
    for name, case in CASES.items():
        known = lines(folder, name)
        matched = lines(folder, case.beside) if case.beside else {}
        for parameter, truth in case.truth.items() if known else ():
            ends = [entry["estimates"][parameter][1:3] for entry in known.values()]
            inside = sum(holds(lower, upper, truth) for lower, upper in ends)
            low, high = binomtest(inside, len(ends)).proportion_ci(method="exact")
            half = median_half(known, parameter)
            ratio = f"{half / median_half(matched, parameter):.2f}" if matched else ""
            bounds = f"{100 * inside / len(ends):.1f} % [{100 * low:.1f}, {100 * high:.1f}]"
            wanted = f"{case.least} to {case.most}"
            yield (
                f"| {case.about} | {parameter} | {inside} | {len(ends)} | {bounds} | {wanted} "
                f"| {100 * half / truth:.2g} % | {ratio} |"
            )


def holds(lower: float | None, upper: float | None, truth: float) -> bool:
    """Whether an interval holds the truth; it may be open on one side, and one that is open on both tells nothing."""
    told = lower is not None or upper is not None
    return told and (lower is None or lower <= truth) and (upper is None or truth <= upper)


def median_half(known: dict[int, dict], parameter: str) -> float:
    """Median half-width, an open interval counted as infinite."""
    ends = [entry["estimates"][parameter][1:3] for entry in known.values()]
    return float(np.median([np.inf if None in pair else (pair[1] - pair[0]) / 2 for pair in ends]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["draw", "table"])
    parser.add_argument("case", nargs="?", choices=list(CASES))
    parser.add_argument("--seeds", nargs=2, type=int, default=(0, 200), metavar=("FIRST", "STOP"))
    parser.add_argument("--out", type=Path, default=OUT)
    given = parser.parse_args()
    if given.what == "table":
        print("\n".join(rows(given.out)))
    elif given.case is None:
        parser.error("draw needs a case")
    else:
        draw(given.case, range(*given.seeds), given.out)


if __name__ == "__main__":
    main()
