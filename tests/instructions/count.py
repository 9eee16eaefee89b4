"""Instructions per projection of every kind of constraint, counted by callgrind, against recorded ones.

Run: python tests/instructions/count.py PROGRAM [--update]

PROGRAM is the built tests/instructions/sweeps.cpp. Exit codes: 0 all within the margin, 1 some are not, 77 nothing can
be compared here (no valgrind, its header was missing in the build, or no counts are recorded for this compiler). Fewer
instructions than recorded fail too, so that a gain is recorded and kept.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

EXPECTED = Path(__file__).with_name("expected.json")
MARGIN = 0.03
SETS = ("x86-64-v3",)  # valgrind runs no AVX-512, and the portable kernels are not compiled to be fast
SKIPPED = 77

Counts = dict[str, dict[str, float]]  # instruction set -> what -> instructions per projection


def count(program: str, isa: str) -> dict[str, float]:
    """What grows with both substeps and sweeps, per projection: set-up and the rest of a substep cancel."""
    found: dict[str, dict[tuple[int, int, int], int]] = {}
    with tempfile.TemporaryDirectory() as folder:
        command = ["valgrind", "--tool=callgrind", f"--callgrind-out-file={folder}/out", program]
        subprocess.run(command, check=True, capture_output=True, env=os.environ | {"SHEETBEND_ISA": isa})
        for dump in Path(folder).glob("out.*"):
            text = dump.read_text()
            label = re.search(r"^desc: Trigger: Client Request: (.+) (\d+) (\d+) (\d+)$", text, re.M)
            total = re.search(r"^(?:totals|summary): (\d+)", text, re.M)
            assert label and total, f"cannot read what callgrind wrote: {text[:300]}"
            found.setdefault(label[1], {})[int(label[2]), int(label[3]), int(label[4])] = int(total[1])
    return {name: round(per_projection(totals), 2) for name, totals in sorted(found.items())}


def per_projection(totals: dict[tuple[int, int, int], int]) -> float:
    """From instructions by (constraints, substeps, sweeps), of two numbers of substeps times two of sweeps."""
    (constraints,) = {sizes[0] for sizes in totals}
    few, many = sorted({sizes[1] for sizes in totals})
    low, high = sorted({sizes[2] for sizes in totals})
    more = {steps: totals[constraints, steps, high] - totals[constraints, steps, low] for steps in (few, many)}
    return (more[many] - more[few]) / (constraints * (many - few) * (high - low))


def compare(found: Counts, recorded: Counts) -> list[str]:
    """Prints a table; what is off by more than the margin, or recorded and not found. A new kind is only told of."""
    wrong = []
    for isa in sorted({*found, *recorded}):
        ours, theirs = found.get(isa, {}), recorded.get(isa, {})
        for name in sorted({*ours, *theirs}):
            got, wanted = ours.get(name), theirs.get(name)
            if (
                got is not None
                and wanted is None
                and not any(known.startswith(f"{name.split()[0]} ") for known in theirs)
            ):
                print(f"{isa}  {name:28s} {got!s:>8}   new: --update records it")
                continue
            fine = got is not None and wanted is not None and abs(got / wanted - 1) <= MARGIN
            print(f"{isa}  {name:28s} {got!s:>8} {wanted!s:>8}{'' if fine else '  <- off'}")
            wrong += [] if fine else [f"{isa} {name}"]
    return wrong


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--update", action="store_true", help="record what is counted now")
    given = parser.parse_args()
    if shutil.which("valgrind") is None:
        print("skipped: there is no valgrind (Debian, Ubuntu: sudo apt-get install valgrind)")
        return SKIPPED
    told = subprocess.run([given.program], check=True, capture_output=True, text=True).stdout
    *compiler, counts = told.split()
    name = " ".join(compiler)
    if counts != "1":
        print("skipped: the program was built without valgrind's header; install valgrind and build again")
        return SKIPPED
    recorded = json.loads(EXPECTED.read_text()) if EXPECTED.exists() else {}
    if name not in recorded and not given.update:
        print(f"skipped: no counts are recorded for {name}; --update records them")
        return SKIPPED
    found = {isa: count(given.program, isa) for isa in SETS}
    if given.update:
        EXPECTED.write_text(json.dumps({**recorded, name: found}, indent=2, sort_keys=True) + "\n")
    print(f"instructions per projection, {name}; found, recorded; margin {MARGIN:.0%}")
    wrong = compare(found, found if given.update else recorded[name])
    if wrong:
        print(f"{len(wrong)} off. A change that is meant is recorded by: python {sys.argv[0]} {given.program} --update")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
