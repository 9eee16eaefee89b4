"""A sheet of triangles with strain and bending: a swatch of 441 vertices, the same in larger, eight swatches in lanes,
and a substep of global Newton.

A square meter of 0.2 kg/m^2, held at two corners, falls under gravity for substeps of 1/60 s, backward Euler with 20
Gauss-Seidel sweeps over orthotropic strain (three rows per triangle) and hinges. The loss is the sum of the last
coordinates. A unit of work is one constraint in one sweep; `step_ms` is a whole substep.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from sheetbend.mesh import grid
from sheetbend.motion.solver import Solver
from sheetbend.objects.cloth import add_cloth
from sheetbend.scene.scene import Scene
from sheetbend.version import __version__

from .machine import isa, machine
from .measurement import LANES
from .ropes import Ropes
from .timing import in_fresh_process, peak_mb, timed

CELLS = (20, 89, 101, 120, 256)  # along a side: 441 to 66,049 vertices
VERTEX_SUBSTEPS = 20_000
MIN_SUBSTEPS = 2
SWEEPS = 20
H = 1 / 60  # s
BATCH = 8  # swatches in lanes
CHECKED = (8, 4)  # cells along a side, and substeps of the sheet whose gradient is compared with a complex step
BOUND = 1e-9
SOLVER = Solver(h=H, integrator="bdf1", method="gauss_seidel", iterations=SWEEPS)


def sheets(
    cells: int, substeps: int, solver: Solver = SOLVER, count: int = 1, bending_model: str = "dihedral"
) -> tuple[Ropes, int]:
    """`count` sheets whose stiffness differs, and the number of constraints of one."""
    scenes = [sheet(cells, bending_model, 200.0 * 1.1**k) for k in range(count)]
    inputs = np.stack([s.compiled.inputs() for s in scenes])
    constraints = sum(len(g.particles) for g in scenes[0].groups)
    return Ropes(scenes[0].compiled, inputs, solver, substeps), constraints


def measure_cloth(
    threads: int = 1,
    repeats: int = 5,
    cells: tuple[int, ...] = CELLS,
    vertex_substeps: int = VERTEX_SUBSTEPS,
    progress: Callable[[dict[str, Any]], None] = lambda row: None,
) -> dict[str, Any]:
    """One row per size, swatches with the default bending, by Newton and in lanes; `progress` gets each row."""
    rows: list[dict[str, Any]] = []
    for n in cells:
        rows.append(in_fresh_process(_climb, n, substeps_of(n, vertex_substeps), threads, repeats))
        progress(rows[-1])
    substeps = substeps_of(cells[0], vertex_substeps)
    return {
        "workload": "cloth",
        **rows[0],
        "threads": threads,
        "lanes": LANES,
        "isa": isa(),
        "repeats": repeats,
        "rows": rows,
        "swatch": {
            "curvature": _row(cells[0], substeps, _solver(threads), repeats, "curvature"),
            "newton": _row(cells[0], 5, Solver(h=H, method="newton", threads=threads), repeats, "curvature"),
            "batch": _batch(cells[0], substeps, threads, repeats),
        },
        "gradient_error": gradient_error(),
        "gradient_error_bound": BOUND,
        "sheetbend": __version__,
        "machine": machine(),
    }


def gradient_error() -> float:
    """Of the adjoint on a small sheet, relative to complex step."""
    return sheets(*CHECKED)[0].gradient_error()


def sheet(cells: int, bending_model: str = "dihedral", warp: float = 200.0) -> Scene:
    """A sheet of so many cells along a side; `warp` in N/m."""
    mesh = grid(1.0, 1.0, cells, cells, "one_way" if bending_model == "curvature" else "alternating")
    scene = Scene("sheet")
    cloth = add_cloth(
        scene,
        mesh,
        density=0.2,
        warp=warp,
        weft=0.75 * warp,
        shear=0.3 * warp,
        poisson=0.2,
        bending=1e-4,
        bending_model=bending_model,
    )
    corners = [int(np.argmin(np.abs(mesh.material - corner).sum(axis=1))) for corner in ((0, 0), (1, 0))]
    scene.pin(cloth.particles[corners])
    return scene


def substeps_of(cells: int, vertex_substeps: int) -> int:
    """As many as are measured: fewer of larger sheets."""
    return max(MIN_SUBSTEPS, vertex_substeps // (cells + 1) ** 2)


def _solver(threads: int) -> Solver:
    return replace(SOLVER, threads=threads)


def _climb(cells: int, substeps: int, threads: int, repeats: int) -> dict[str, Any]:
    """One row; for a process of its own."""
    peak = peak_mb(sheets(cells, substeps, _solver(threads))[0].gradient)
    return {**_row(cells, substeps, _solver(threads), repeats, "dihedral"), "peak_mb": peak}


def _row(cells: int, substeps: int, solver: Solver, repeats: int, bending_model: str) -> dict[str, Any]:
    one, constraints = sheets(cells, substeps, solver, bending_model=bending_model)
    work = constraints * solver.sweeps * substeps
    forward, _ = timed(one.forward, repeats)
    gradient, _ = timed(one.gradient, repeats)
    found: dict[str, Any] = {
        "particles": (cells + 1) ** 2,
        "constraints": constraints,
        "substeps": substeps,
        "iterations": solver.sweeps,
        "projections": work,
        **forward.figures("forward", work),
        **gradient.figures("gradient", work),
    }
    for what in ("forward", "gradient"):
        found[f"{what}_step_ms"] = found[f"{what}_cpu_ns"] * constraints * solver.sweeps / 1e6
    return found


def _batch(cells: int, substeps: int, threads: int, repeats: int) -> dict[str, Any]:
    swatches, constraints = sheets(cells, substeps, _solver(threads), BATCH)
    figures = swatches.batch_figures(repeats, BATCH * constraints * SWEEPS * substeps)
    found: dict[str, Any] = {"sheets": BATCH, "substeps": substeps, **figures}
    for name in ("forward", "gradient"):
        found[f"{name}_speedup"] = found[f"{name}_singly_cpu_ns"] / found[f"{name}_cpu_ns"]
    return found
