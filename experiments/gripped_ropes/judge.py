"""Judges the recipe on nasty ropes: errors on unseen recordings beside those of the true values, and EI.

    python experiments/gripped_ropes/make_data.py out/nasty --train 8 --eval 2 --nasty
    python experiments/gripped_ropes/judge.py out/nasty rope_1 [rope_2 ...] [--six] [--one] [--threads 1]

For each rope it fits the recordings of `train` with the whole recipe, with --six also six numbers alone (a straight
rope with twist), to `train` and to the unseen recordings themselves, and with --one the whole recipe to one recording.
It prints one line of JSON each: errors in mm, EI at small strain (over the density where the rope was not weighed) with
its 95 % interval and the true one, and the processor time in s.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import sheetbend as sb
from sheetbend.gripped import RopeFit, RopeReport, Rung, Screened, evaluate, fit_rope, screened
from sheetbend.gripped.ladder import LADDER, TWIST

SMOOTHING = 0.08  # s


def judged(
    what: str, train: Screened, unseen: Screened, told: dict[str, Any], ladder: Sequence[Rung], threads: int, out: Path
) -> dict[str, Any]:
    """The errors of a fit beside those of the true values, and its EI beside the true one."""
    began, processor = time.perf_counter(), time.process_time()

    def say(text: str) -> None:
        print(f"  {time.perf_counter() - began:6.1f} s  {text}", flush=True)

    density = told["true"]["density"] if told["weighed"] else None
    found = fit_rope(train, density=density, ladder=ladder, threads=threads, say=say)
    seconds = time.process_time() - processor
    evaluation = evaluate(found, unseen)
    out.write_text(RopeReport(what, found, evaluation).plain())
    scored = evaluation.scores
    error = None if scored is None or evaluation.diverged else 1e3 * scored.error
    missed = 1e3 * float(np.mean(told["missed_by_true_values"]))
    return {
        "fit": what,
        "error": error,
        "of true values": missed,
        "ratio": None if error is None else error / missed,
        **_stiffness(found, told),
        "stays": [step.name for step in found.steps if step.stays],
        "converged": found.fit.result.converged,
        "processor seconds": seconds,
    }


def _stiffness(found: RopeFit, told: dict[str, Any]) -> dict[str, Any]:
    name = "rope_EI" if found.weighed else "rope_EI/density"
    true = told["true"]["EI"] / (1.0 if found.weighed else told["true"]["density"])
    e = found.fit.result[name]
    inside = e.lower is not None and e.upper is not None and e.lower <= true <= e.upper
    return {name: e.value, "interval": [e.lower, e.upper], "true": true, "inside": inside, "verdict": e.verdict}


def main(folder: Path, rope: str, six: bool, one: bool, threads: int) -> None:
    told = json.loads((folder / f"{rope}.json").read_text())
    train, unseen = (screened(sb.recordings(folder / rope / part), SMOOTHING) for part in ("train", "eval"))
    for note in train.notes:
        print(f"  {note}")

    def show(what: str, fitted: Screened, ladder: Sequence[Rung]) -> None:
        line = judged(what, fitted, unseen, told, ladder, threads, folder / f"{what.replace(' ', '_')}.txt")
        print(json.dumps(line, default=float), flush=True)

    show(rope, train, LADDER)
    if six:
        show(f"{rope} six numbers", train, (TWIST,))
        show(f"{rope} six numbers of the unseen", unseen, (TWIST,))
    if one:
        show(f"{rope} one recording", Screened(train.motions[:1]), LADDER)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("ropes", nargs="+")
    parser.add_argument("--six", action="store_true")
    parser.add_argument("--one", action="store_true")
    parser.add_argument("--threads", type=int, default=1)
    given = parser.parse_args()
    for name in given.ropes:
        main(given.folder, name, given.six, given.one, given.threads)
