"""What self-contact costs: a cloth that is folded twice falls on itself, three layers on a table.

    python experiments/bench/folded_cloth.py [--vertices 5000] [--substeps 15] [--friction 0.3]

Prints Newton matrices per substep, processor time per substep and per matrix, and the share of the search for pairs.
The fine cloth (5,000 vertices) takes minutes. The layers meet after 9 of the substeps of 1 ms.
"""

from __future__ import annotations

import argparse
import time

import numpy as np
import sheetbend as sb
from sheetbend.mesh import grid

THICKNESS, EDGE = 1e-3, 4e-3  # m
RATE = 100.0  # 1/s, at which all heights become smaller at the start
SEARCHES = 2  # per substep with friction: where it starts, and of what touches at its end; one without


def folded(s: np.ndarray, length: float) -> np.ndarray:
    """(n, 2) along and above the table at arc lengths `s` of a line that is folded twice, as a letter is."""
    third, bend = (length - 2 * np.pi * EDGE) / 3, np.pi * EDGE
    x, z = s.copy(), np.zeros_like(s)
    for turn, start in ((-1.0, third), (1.0, 2 * third + bend)):
        beyond = s - start
        angle = np.clip(beyond / EDGE, 0.0, np.pi)
        after = np.maximum(beyond - bend, 0.0)
        edge = third if turn < 0 else 0.0
        x = np.where(beyond > 0, edge - turn * EDGE * np.sin(angle) + turn * after, x)
        z = np.where(beyond > 0, z + EDGE * (1.0 - np.cos(angle)), z)
    return np.stack([x, z], axis=1)


def cloth(vertices: int, friction: float) -> sb.Scene:
    """In three layers, which are two edges apart."""
    side = round(np.sqrt(vertices)) - 1
    mesh = grid(side * EDGE, side * EDGE, side, side, "one_way")
    along = folded(mesh.vertices[:, 0], side * EDGE)
    x = np.stack([along[:, 0], mesh.vertices[:, 1], along[:, 1] + 0.5 * THICKNESS + 1e-4], axis=1)
    scene = sb.Scene("folded")
    made = sb.add_cloth(scene, mesh, density=0.2, warp=300.0, shear=60.0, bending=2e-6, positions=x)
    scene.add_contact(made, sb.Plane(name="table"), friction=0.0, radius=0.5 * THICKNESS)
    scene.add_self_contact(made, radius=0.5 * THICKNESS, **({"friction": friction} if friction else {}))
    return scene


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--vertices", type=int, default=5000)
    parser.add_argument("--substeps", type=int, default=15)
    parser.add_argument("--friction", type=float, default=0.0)
    given = parser.parse_args()
    solver = sb.Solver(h=1e-3, method="implicit", integrator="bdf1")
    scene = cloth(given.vertices, given.friction)
    compiled = scene.compiled
    core, inputs = solver.core(compiled), compiled.inputs()
    x, v = (inputs[compiled.core.layout[q][0] :] for q in ("position", "velocity"))
    heights = slice(2, 3 * scene.particle_count, 3)
    v[heights] = -RATE * x[heights]
    start = time.process_time()
    balance = core.force_balance(inputs, given.substeps, 0.0)
    seconds = time.process_time() - start
    matrices = np.array([sum(len(block) for block in substep) for substep in balance])
    start = time.process_time()
    compiled.core.pair_gaps(inputs)
    search = (time.process_time() - start) * (SEARCHES if given.friction else 1)
    print(f"{scene.particle_count} vertices, friction {given.friction:g}, {given.substeps} substeps")
    print(f"Newton matrices by substep: {matrices.tolist()}, {seconds / matrices.sum():.3f} s each")
    seconds /= given.substeps
    print(
        f"{seconds:.2f} s a substep, of which the search for pairs takes {search:.4f} s, {100 * search / seconds:.1f} %"
    )


if __name__ == "__main__":
    main()
