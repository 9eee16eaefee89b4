"""Feeds mutated files to the readers: `python tests/python/fuzz.py csv --seed 1 --cases 1000` or `--seconds 600`.

Several readers may be given (`csv npz:200`, of which the second gets 200 cases). Each runs in a process of its own,
forked from one that has imported everything, and prints one line of JSON.

Files that tests write and experiments ship (`fuzz_targets.py`) are cut, flipped, repeated and filled with odd numbers
and words (`mutations.py`). A reader may read such a file or refuse it with an error of the package. A finding is
anything else: another exception, memory beyond 1 GB, or 10 s of processor time, which ends the process by SIGPROF (a
crash ends it anyway), with the case left in the folder that `--keep` names. A refusal that says only that the file is
damaged is no finding; the first of each cause is printed as `unspecific`.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import random
import resource
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import sheetbend as sb
from fuzz_targets import TARGETS

MEMORY = 10**9  # bytes more than the imported program has
SECONDS = 10.0  # of processor time for a case


def run(name: str, seed: int, cases: int, seconds: float, keep: Path) -> dict[str, Any]:
    """Feed cases until their number or the processor time is up; gives what came of them."""
    target, rng = TARGETS[name], random.Random(seed)
    counts: Counter[str] = Counter()
    findings: list[str] = []
    unspecific: dict[str, str] = {}
    longest = 0.0
    with tempfile.TemporaryDirectory() as made:
        seeds = target.seeds(Path(made))
    contents = [next(iter(files.values())) for files in seeds]
    begun = time.process_time()
    limit(MEMORY)
    while counts.total() < cases and time.process_time() - begun < seconds:
        files = rng.choice(seeds)
        main = next(iter(files))
        case = {**files, main: target.mutate(rng, files[main], contents)}
        folder = keep / name
        folder.mkdir(parents=True, exist_ok=True)
        for file, content in case.items():
            (folder / file).write_bytes(content)
        signal.setitimer(signal.ITIMER_PROF, SECONDS)
        started = time.process_time()
        outcome, told, cause = outcome_of(target.read, folder / main)
        longest = max(longest, time.process_time() - started)
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        counts[outcome] += 1
        if cause:
            unspecific.setdefault(outcome, cause)
        if told:
            findings.append(told)
            os.rename(folder, keep / f"{name}_{seed}_{len(findings)}")
        else:
            for file in case:
                (folder / file).unlink()
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
    return {"reader": name, "cases": counts.total(), "outcomes": dict(counts), "longest_s": round(longest, 2),
            "peak_mb": peak, "findings": findings, "unspecific": unspecific}  # fmt: skip


def outcome_of(read: Callable[[Path], object], path: Path) -> tuple[str, str, str]:
    """What came of a case, what is to be told of it, and where a refusal that names no fault came from."""
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            read(path)
    except sb.SheetbendError as error:
        cause = error.__cause__
        while cause is not None and cause.__cause__ is not None:
            cause = cause.__cause__
        if isinstance(cause, MemoryError) and not untouched(cause):
            return "memory", f"more than 1 GB: {error}", ""
        if cause is not None and "not what its reader takes it for" in str(error):
            where = "".join(traceback.format_list(traceback.extract_tb(cause.__traceback__)[-2:]))
            return f"refused: {type(cause).__name__}", "", f"{cause}\n{where}"
        return "refused", "", ""
    except Exception:
        return "foreign", traceback.format_exc(), ""
    return "read", "", ""


def untouched(error: MemoryError) -> bool:
    """Whether what was asked for is filled only as far as the file goes, so that memory is never taken."""
    line = traceback.extract_tb(error.__traceback__)[-1].line or ""
    return any(call in line for call in ("fromfile(", "np.empty(", "fp.read("))


def limit(more: int) -> None:
    """Let the process have so many bytes more than it has."""
    now = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (now + more, now + more))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def fed(name: str, given: argparse.Namespace) -> None:
    """Feed one reader and print what came of it; exits with 1 where there are findings."""
    name, _, cases = name.partition(":")
    told = run(name, given.seed, int(cases or given.cases), given.seconds, given.keep)
    print(json.dumps(told), flush=True)
    sys.exit(1 if told["findings"] else 0)


def main() -> None:
    """Run readers from the command line; exits with 1 where there are findings or a process was ended."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("readers", nargs="+", metavar="reader", help=", ".join(TARGETS))
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--cases", type=int, default=10**9)
    parser.add_argument("--seconds", type=float, default=1e9)
    parser.add_argument("--keep", type=Path, default=Path("fuzzed"))
    given = parser.parse_args()
    if unknown := {name.partition(":")[0] for name in given.readers} - set(TARGETS):
        parser.error(f"unknown readers: {', '.join(sorted(unknown))}")
    failed = False
    for name in given.readers:
        process = multiprocessing.get_context("fork").Process(target=fed, args=(name, given))
        process.start()
        process.join()
        failed |= process.exitcode != 0
        if process.exitcode and process.exitcode < 0:
            print(json.dumps({"reader": name.partition(":")[0], "ended": -process.exitcode}), flush=True)
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
