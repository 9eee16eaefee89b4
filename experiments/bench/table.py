"""Writes the tables and the figure of docs/benchmarks.md from a file that compare.py made.

Run: python experiments/bench/table.py experiments/bench/results/MACHINE.json
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from sheetbend_bench.figure import draw_ladder

DOCS = Path(__file__).resolve().parents[2] / "docs"
QUIET = 1.1  # clock over processor time, below which a machine counts as quiet
Data = Mapping[str, Any]


def main(path: Path) -> None:
    data = json.loads(path.read_text())
    page = DOCS / "benchmarks.md"
    page.write_text(filled(page.read_text(), data, path.name))
    if "ladder" in data:
        draw_ladder(data["ladder"], DOCS / "benchmark_ladder.png")


def filled(text: str, data: Data, name: str) -> str:
    """The page with its tables replaced by those of the data, which stand in the results file of this name."""
    parts = {"machine": machine(data, name), "workloads": workloads(data), "quality": quality(data)}
    if "ladder" in data:
        parts |= {"threads": threads(data), "chain": chain(data["chain"]), "ladder": ladder(data["ladder"])}
        parts["cloth"] = cloth(data["cloth"])
    for part, lines in parts.items():
        before, mark, rest = text.partition(f"<!-- {part} -->\n")
        _, end, after = rest.partition(f"<!-- end of {part} -->")
        if not (mark and end):
            raise SystemExit(f"the page has no place for {part}. Fix: put '<!-- {part} -->' and its end into it.")
        text = before + mark + "\n".join(lines) + "\n" + end + after
    return text


def machine(data: Data, name: str) -> list[str]:
    m = data["machine"]
    caches = ", ".join(f"{level} {size // 1024:,} KiB" for level, size in m["caches"].items())
    busy = max(row["forward_ns"] / row["forward_cpu_ns"] for row in data["results"])
    quiet = (
        "" if busy < QUIET else f" Other work ran too: the clock showed up to {busy:.1f} times the processor's time."
    )
    return [
        f"{m['processor']} (family {m['family']}, model {m['model']}), {m['cores']} cores, {caches}, "
        f"{m['memory_gb']:.0f} GB, {m['isa']}; {m['compiler']}; Python {m['python']}. Taken {_span(data)}, "
        f"[`{name}`](../experiments/bench/results/{name}).{quiet}"
    ]


def workloads(data: Data) -> list[str]:
    names = _in_order(row["workload"] for row in data["results"])
    lines = _head("forward / gradient", *names)
    for tool in _in_order(row["tool"] for row in data["results"]):
        mine = {row["workload"]: row for row in data["results"] if row["tool"] == tool}
        version = next(iter(mine.values()))["version"] if tool != "plain C++" else "one at a time"
        cells = [_pair(mine[n]) if n in mine else "" for n in names]
        lines.append(_line(f"{tool} ({version})", *cells))
    return [*lines, _line("best other gradient over ours", *(_lead(data, n) for n in names))]


def quality(data: Data) -> list[str]:
    lines = _head("", "gradient error", "peak memory, MB", "first call forward / gradient, s")
    for row in data["results"]:
        if "gradient_error" not in row:
            continue
        first = f"{row['forward_first_s']:.1f} / {row['gradient_first_s']:.1f}" if "forward_first_s" in row else ""
        name = f"{row['workload']} {row['tool']}"
        lines.append(_line(name, f"{row['gradient_error']:.0e}", f"{row['peak_mb']:,.0f}", first))
    return lines


def threads(data: Data) -> list[str]:
    lines = _head("wall clock, forward / gradient", "1 thread", "all cores", "speed-up")
    alone = {row["workload"]: row for row in data["results"] if row["tool"] == "sheetbend"}
    for row in data["threads"]:
        one = alone[row["workload"]]
        ratio = [one[f"{what}_ns_min"] / row[f"{what}_ns_min"] for what in ("forward", "gradient")]
        walls = [f"{r['forward_ns_min']:.3g} / {r['gradient_ns_min']:.3g}" for r in (one, row)]
        lines.append(_line(f"{row['workload']}, {row['threads']} threads", *walls, f"{ratio[0]:.2f} / {ratio[1]:.2f}"))
    return lines


def chain(data: Data) -> list[str]:
    lines = _head("segments", "forward", "gradient", "ratio")
    for row in data["rows"]:
        forward, gradient = row["forward_cpu_ns"], row["gradient_cpu_ns"]
        lines.append(_line(f"{row['segments']:,}", f"{forward:.0f}", f"{gradient:.0f}", f"{gradient / forward:.2f}"))
    b = data["batch"]
    gains = {what: b[f"{what}_singly_cpu_ns"] / b[f"{what}_cpu_ns"] for what in ("forward", "gradient")}
    return [
        *lines,
        "",
        f"{b['ropes']} ropes of {b['segments']} segments as one batch take {b['forward_cpu_ns']:.0f} ns forward and "
        f"{b['gradient_cpu_ns']:.0f} ns with the gradient, {gains['forward']:.1f} and {gains['gradient']:.1f} times "
        "the throughput of one rope at a time.",
    ]


def cloth(data: Data) -> list[str]:
    lines = _head("vertices", "constraints", "ns per projection", "ms per substep", "peak memory of the gradient, MB")
    for row in data["rows"]:
        lines.append(_line(f"{row['particles']:,}", f"{row['constraints']:,}", *_costs(row), f"{row['peak_mb']:,.0f}"))
    swatch = data["swatch"]
    for name, label in (("curvature", "sheet_curvature"), ("newton", "sheet_curvature, Newton, 2 iterations")):
        row = swatch[name]
        costs = _costs(row) if name == "curvature" else ("", _costs(row)[1])
        lines.append(_line(f"{row['particles']:,}, {label}", f"{row['constraints']:,}", *costs, ""))
    b = swatch["batch"]
    told = []
    if "plain" in data:
        loop, ours = data["plain"]["forward_cpu_ns"], data["rows"][0]["forward_cpu_ns"]
        told = [
            "",
            f"A plain loop over the same constraints (`plain_cloth.cpp`, one at a time) takes {loop:.3g} ns per "
            f"projection of the swatch forward, {loop / ours:.1f} times as long.",
        ]
    return [
        *lines,
        *told,
        "",
        f"Forward / gradient. {b['sheets']} swatches as one batch take {b['forward_cpu_ns']:.3g} / "
        f"{b['gradient_cpu_ns']:.3g} ns per projection, {b['forward_speedup']:.1f} and {b['gradient_speedup']:.1f} "
        "times the throughput of one at a time.",
    ]


def _costs(row: Data) -> tuple[str, str]:
    each = f"{row['forward_cpu_ns']:.3g} / {row['gradient_cpu_ns']:.3g}"
    return each, f"{row['forward_step_ms']:.3g} / {row['gradient_step_ms']:.3g}"


def ladder(data: Data) -> list[str]:
    lines = _head("particles", "forward", "gradient", "substeps", "peak memory of the gradient, MB")
    for row in data["rows"]:
        figures = f"{row['forward_cpu_ns']:.3g}", f"{row['gradient_cpu_ns']:.3g}"
        lines.append(_line(f"{row['particles']:,}", *figures, f"{row['substeps']:,}", f"{row['peak_mb']:,.0f}"))
    return [*lines, "", "![Cost per projection over the number of particles](benchmark_ladder.png)"]


def _span(data: Data) -> str:
    times = sorted(row["taken"] for row in data["results"])
    return " to ".join(dict.fromkeys((times[0], times[-1])))


def _lead(data: Data, name: str) -> str:
    costs = {row["tool"]: row.get("gradient_cpu_ns") for row in data["results"] if row["workload"] == name}
    others = {tool: ns for tool, ns in costs.items() if tool != "sheetbend" and ns is not None}
    if not others or costs.get("sheetbend") is None:
        return ""
    best = min(others, key=lambda tool: others[tool])
    return f"{others[best] / costs['sheetbend']:.1f} ({best})"


def _pair(row: Data) -> str:
    gradient = _ns(row["gradient_cpu_ns"]) if "gradient_cpu_ns" in row else "none"
    return f"{_ns(row['forward_cpu_ns'])} / {gradient}"


def _ns(value: float) -> str:
    return f"{value:.3g}" if value < 1000 else f"{value:,.0f}"


def _head(*cells: str) -> list[str]:
    return [_line(*cells), _line(*("---" for _ in cells))]


def _line(*cells: str) -> str:
    return f"| {' | '.join(cells)} |"


def _in_order(names: Iterable[str]) -> list[str]:
    return list(dict.fromkeys(names))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
