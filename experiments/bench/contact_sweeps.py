"""What contact costs between sweeps: processor time of a cloth beside that of the same cloth without contacts.

    python experiments/bench/contact_sweeps.py [--columns 33]

With `gauss_seidel`, five sweeps and a substep of 1 ms, a cloth is far above a plane, lies on it and sticks, and slides.
"""

from __future__ import annotations

import argparse
import time

import numpy as np
import sheetbend as sb
from sheetbend.mesh import grid

STEPS, TURNS = 200, 5
SOLVER = sb.Solver(h=1e-3, method="gauss_seidel", iterations=5)
ASKED = 1.3


def cloth(case: str, columns: int) -> sb.Scene:
    """A cloth on a plane that is level in its frame; gravity leans as the plane would."""
    lean = 0.1 if case == "sticks" else 0.5
    scene = sb.Scene(case.replace(" ", "_"), gravity=(9.81 * np.sin(lean), 0.0, -9.81 * np.cos(lean)))
    mesh = grid(0.4, 0.4, columns - 1, columns - 1)
    height = 0.0 if case in ("sticks", "slides") else 100.0
    lying = np.asarray(mesh.vertices) + np.array([0.0, 0.0, height])
    built = sb.add_cloth(scene, mesh, "cloth", positions=lying, density=0.2, warp=40.0, shear=10.0, bending=1e-5)
    if case != "without":
        scene.add_contact(built, sb.Plane(name="table"), friction=0.3)
    return scene


def seconds(case: str, columns: int) -> tuple[float, float]:
    """Processor time of the motion, and of its gradient with respect to everything [s]."""
    compiled = cloth(case, columns).compiled
    core, inputs = SOLVER.core(compiled), compiled.inputs()
    start = time.process_time()
    core.simulate(inputs, [STEPS], 0.0)
    forward = time.process_time() - start
    start = time.process_time()
    states, tape = core.record(inputs, [STEPS], 0.0)
    core.reverse(inputs, tape, [STEPS], np.ones_like(states), 0.0)
    return forward, time.process_time() - start


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--columns", type=int, default=33, help="particles along each side")
    columns = parser.parse_args().columns
    best: dict[str, tuple[float, float]] = {}
    for _ in range(TURNS):  # in turn, so that all meet the same machine
        for case in ("without", "far above", "sticks", "slides"):
            found = seconds(case, columns)
            best[case] = tuple(map(min, best.get(case, found), found))
    for case, (forward, both) in best.items():
        ratios = f"ratio {forward / best['without'][0]:.2f}, with gradient {both / best['without'][1]:.2f}"
        print(f"{case:10} {1e6 * forward / STEPS:7.1f} us a substep, {1e6 * both / STEPS:8.1f} with gradient, {ratios}")
    print(f"asked: {ASKED}")


if __name__ == "__main__":
    main()
