"""The ladder's figure: cost per projection over size, with the sizes at which the caches are full."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sheetbend.optional import require
from sheetbend.pictures.drawing import ACCENT, GRAY, INK, clean, key, new_figure

BYTES_PER_PARTICLE = 32  # coordinates and inverse mass
BYTES_PER_CONSTRAINT = 32  # two particles' places, compliance, rest length, multiplier


def draw_ladder(data: Mapping[str, Any], path: Path) -> None:
    """Write the figure of `measure_ladder`'s data; the format follows from the name.

    With one thread the times are those on the processor. A cache counts as full where it could just hold what a forward
    sweep touches: the particles' rows and, per constraint, its particles, values and multiplier.
    """
    rows, caches = data["rows"], data["machine"]["caches"]
    clock = "cpu_ns" if data["threads"] == 1 else "ns"
    sizes = [row["particles"] for row in rows]
    figure = new_figure(7.2, 3.6, f"cloths on {data['machine']['processor']}, threads: {data['threads']}")
    panel = figure.subplots()
    clean(panel)
    panel.set_xscale("log")
    for name, color in (("gradient", ACCENT), ("forward", INK)):
        costs = [row[f"{name}_{clock}"] for row in rows]
        panel.plot(sizes, costs, "o-", color=color, markersize=4, linewidth=1.4)
        panel.annotate(f"{costs[-1]:.3g}", (sizes[-1], costs[-1]), (6, 0), textcoords="offset points", color=color)
    panel.set_ylim(0, 1.15 * max(row[f"gradient_{clock}"] for row in rows))
    for name, size in caches.items():
        full = size / sweep_bytes(rows[-1])
        if sizes[0] < full < sizes[-1]:
            panel.axvline(full, color=GRAY, linewidth=0.8, linestyle=(0, (4, 3)))
            panel.annotate(
                f"{name} full",
                (full, 1),
                (3, -2),
                xycoords=("data", "axes fraction"),
                textcoords="offset points",
                color=GRAY,
                fontsize=8,
                va="top",
            )
    panel.xaxis.set_minor_locator(require("matplotlib.ticker", "plot").NullLocator())
    panel.set_xticks(sizes, [_short(size) for size in sizes])
    panel.set_xlabel("particles")
    panel.set_ylabel("ns per projection")
    key(panel, [("forward", INK), ("value and gradient", ACCENT)])
    figure.savefig(path, dpi=160, facecolor="white")


def sweep_bytes(row: Mapping[str, Any]) -> float:
    """What a forward sweep touches, bytes per particle."""
    constraints = row["projections"] / row["substeps"] / row["iterations"] / row["particles"]
    return BYTES_PER_PARTICLE + BYTES_PER_CONSTRAINT * constraints


def _short(count: int) -> str:
    return f"{count / 1e6:.3g} M" if count >= 1e6 else f"{count / 1e3:.3g} k" if count >= 1e3 else str(count)
