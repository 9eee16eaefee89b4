"""Measures sheetbend and its peers on the same workloads in one run, and writes JSON with the machine's description.

Run: python experiments/bench/compare.py FOLDER [--workloads W1 W2] [--tools sheetbend jax] [--keep]

FOLDER holds the peers' environments (setup_peers.sh makes them) and keeps their compiled kernels. Everything runs on
one core, tool after tool within each workload; then sheetbend alone on every core, on chains, on sheets and on the
ladder. A tool that is not there is left out with a word.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import plain
import plain_cloth
import table
from sheetbend_bench import WORKLOADS, workload
from sheetbend_bench.machine import machine
from sheetbend_bench.problem import Problem
from sheetbend_bench.reference import shipped

HERE = Path(__file__).resolve().parent
PEERS = ("numba", "jax", "warp", "torch", "taichi")
TOOLS = ("sheetbend", "plain C++", *PEERS)
LIMIT = 1200  # s for one tool on one workload


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--workloads", nargs="+", default=list(WORKLOADS))
    parser.add_argument("--tools", nargs="+", default=list(TOOLS), choices=TOOLS)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--output", type=Path, help="results/MACHINE.json by default")
    parser.add_argument(
        "--keep", action="store_true", help="keep what the output file has and this run does not measure"
    )
    parser.add_argument(
        "--page", action="store_true", help="write the tables of docs/benchmarks.md from the output file"
    )
    given = parser.parse_args()
    told = {"repeats": given.repeats, "machine": described()}
    path = given.output or HERE / "results" / f"{slug(told['machine'])}.json"
    told["results"] = compare(given.folder.resolve(), given.workloads, given.tools, given.repeats)
    if "sheetbend" in given.tools:
        cores = sorted(os.sched_getaffinity(0))
        told["threads"] = [ours(name, given.repeats, cores) for name in given.workloads if len(cores) > 1]
        told |= {name: ours(name, given.repeats, cores[:1]) for name in ("chain", "cloth", "ladder")}
        if "plain C++" in given.tools and plain.compiler() is not None:
            told["cloth"]["plain"] = plain_sheet(given.folder.resolve(), given.repeats, cores[:1])
    if given.keep and path.exists():
        told = merged(json.loads(path.read_text()), told)
    path.write_text(json.dumps(told, indent=1) + "\n")
    print(f"written to {path}")
    if given.page:
        table.main(path)


def merged(old: Mapping[str, Any], new: Mapping[str, Any]) -> dict[str, Any]:
    """The new measurements, and of the old ones those that were not taken again."""
    found = {**old, **new}
    for part, keys in (("results", ("workload", "tool")), ("threads", ("workload",))):
        rows = {tuple(row[key] for key in keys): row for row in [*old.get(part, []), *new.get(part, [])]}
        found[part] = sorted(rows.values(), key=lambda row: (list(WORKLOADS).index(row["workload"]), _place(row)))
    return found


def _place(row: Mapping[str, Any]) -> int:
    return TOOLS.index(row.get("tool", "sheetbend"))


def compare(folder: Path, names: Sequence[str], tools: Sequence[str], repeats: int) -> list[dict[str, Any]]:
    """One row per workload and tool."""
    rows = []
    core = sorted(os.sched_getaffinity(0))[:1]
    with tempfile.TemporaryDirectory() as scratch:
        for name in names:
            problem = Path(scratch) / f"{name}.npz"
            Problem(workload(name)).export(problem)
            for tool in tools:
                try:
                    row = _row(tool, name, problem, folder, repeats, core)
                except NotMeasured as why:
                    print(f"{name:4s} {tool:10s} left out: {why}", flush=True)
                else:
                    rows.append({"workload": name, "tool": tool, "taken": time.strftime("%Y-%m-%d %H:%M"), **row})
                    print(_line(rows[-1]), flush=True)
    return rows


class NotMeasured(Exception):
    """A tool is not there, does not take the workload, or failed."""


def _row(tool: str, name: str, problem: Path, folder: Path, repeats: int, core: Sequence[int]) -> dict[str, Any]:
    if tool == "sheetbend":
        found = ours(name, repeats, core)
        kept = [key for key in found if key.endswith(("_ns", "_ns_min"))] + ["gradient_error", "peak_mb", "isa"]
        return {"version": found["sheetbend"], **{key: found[key] for key in kept}}
    if tool == "plain C++":
        if plain.compiler() is None:
            raise NotMeasured("there is no compiler")
        if workload(name).scenes > 1:
            raise NotMeasured("it takes one scene")
        program = plain.build(folder / "plain", "-march=native")
        return _figures(name, _run([str(program), name, str(repeats)], core), {"version": compiler()})
    python = folder / tool / "bin" / "python"
    if not python.exists():
        raise NotMeasured(f"there is no {python}; setup_peers.sh makes it")
    script = HERE / "peers" / f"with_{tool}.py"
    found = _run([str(python), str(script), str(problem), str(repeats)], core, WARP_CACHE=str(folder / "warp_cache"))
    return _figures(name, found, {"version": found["version"], "peak_mb": found["peak_mb"]})


def _figures(name: str, found: Mapping[str, Any], more: Mapping[str, Any]) -> dict[str, Any]:
    """Seconds to ns per projection, the four numbers to an error."""
    count = Problem(workload(name)).projections
    row = dict(more)
    for what in ("forward", "gradient"):
        if f"{what}_s" in found:
            row[f"{what}_ns"] = 1e9 * statistics.median(found[f"{what}_s"]) / count
            row[f"{what}_ns_min"] = 1e9 * min(found[f"{what}_s"]) / count
            row[f"{what}_cpu_ns"] = 1e9 * statistics.median(found[f"{what}_cpu_s"]) / count
        if f"{what}_first_s" in found:
            row[f"{what}_first_s"] = found[f"{what}_first_s"]
    if "numbers" in found:
        wanted = shipped(name)
        row["gradient_error"] = max(
            float(np.abs(np.array(found["numbers"][k]) / g - 1).max()) for k, g in wanted.items()
        )
    return row


def ours(name: str, repeats: int, cores: Sequence[int]) -> dict[str, Any]:
    """measure.py on these cores, one thread each."""
    command = [sys.executable, str(HERE / "measure.py"), name, "--json"]
    return _run([*command, "--repeats", str(repeats), "--threads", str(len(cores))], cores)


def plain_sheet(folder: Path, repeats: int, cores: Sequence[int]) -> dict[str, Any]:
    """The smallest sheet of `measure.py cloth` as a plain loop, ns per projection."""
    program = plain.build(folder / "plain", "-march=native", name="plain_cloth")
    with tempfile.TemporaryDirectory() as scratch:
        sheet = Path(scratch) / "sheet.txt"
        projections = plain_cloth.write_swatch(sheet)
        found = _run([str(program), str(sheet), str(repeats)], cores)
    return {"forward_cpu_ns": 1e9 * statistics.median(found["forward_cpu_s"]) / projections}


def _run(command: Sequence[str], cores: Sequence[int], **environment: str) -> dict[str, Any]:
    """The last line of what a command prints, as JSON."""
    try:
        done = subprocess.run(
            command,
            check=False,
            capture_output=True,
            text=True,
            timeout=LIMIT,
            env={**os.environ, **environment},
            preexec_fn=lambda: os.sched_setaffinity(0, cores),
        )
    except subprocess.TimeoutExpired as error:
        raise NotMeasured(f"it took more than {LIMIT} s") from error
    if done.returncode:
        raise NotMeasured(f"it failed with {done.returncode}: {done.stderr[-2000:]}")
    return json.loads(done.stdout.splitlines()[-1])


def _line(row: Mapping[str, Any]) -> str:
    gradient = f"{row['gradient_cpu_ns']:8.2f}" if "gradient_ns" in row else "    none"
    error = f"  error {row['gradient_error']:.0e}" if "gradient_error" in row else ""
    return f"{row['workload']:4s} {row['tool']:10s} forward {row['forward_cpu_ns']:8.2f}  gradient {gradient}{error}"


def described() -> dict[str, Any]:
    return machine() | {"compiler": compiler()}


def compiler() -> str:
    if shutil.which("c++") is None:
        return "none"
    return subprocess.run(["c++", "--version"], check=True, capture_output=True, text=True).stdout.splitlines()[0]


def slug(of: Mapping[str, Any]) -> str:
    words = f"{of['processor']} {of['family']} {of['model']} {of['cores']} cores"
    return re.sub(r"[^a-z0-9]+", "_", words.lower()).strip("_")


if __name__ == "__main__":
    main()
