"""What contact costs: processor time per Newton step of a rope beside that of the same rope without contacts.

    python experiments/bench/contact.py [--integrator bdf1]

A rope of 50 segments falls far above a plane, lies on it and sticks, and slides down it.
"""

from __future__ import annotations

import argparse
import time

import numpy as np
import sheetbend as sb

STEPS, TURNS = 300, 3
ASKED = {"far above": 1.15, "sticks": 1.6, "slides": 2.5}


def rope(case: str) -> sb.Scene:
    """A wavy rope on a plane that is level in its frame; gravity leans as the plane would."""
    lean = 0.1 if case == "sticks" else 0.5
    scene = sb.Scene(case.replace(" ", "_"), gravity=(9.81 * np.sin(lean), 0.0, -9.81 * np.cos(lean)))
    height = 0.0 if case in ("sticks", "slides") else 100.0
    y = np.linspace(0.0, 1.0, 51)
    line = np.stack([0.002 * np.sin(15 * y), y, np.full_like(y, height)], axis=1)
    built = sb.add_rope(scene, "rope", segments=50, points=line, density=0.05, EA=1e3, EI=1e-4)
    if case != "without":
        scene.add_contact(built, sb.Plane(name="table"), friction=0.3)
    return scene


def step_time(case: str, solver: sb.Solver) -> tuple[float, float]:
    """Processor time per Newton step [s], and Newton steps per substep."""
    compiled = rope(case).compiled
    core, inputs = solver.core(compiled), compiled.inputs()
    count = sum(len(block) for substep in core.force_balance(inputs, STEPS, 0.0) for block in substep)
    start = time.process_time()
    core.simulate(inputs, [STEPS], 0.0)
    return (time.process_time() - start) / count, count / STEPS


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--integrator", choices=["bdf1", "bdf2"], default="bdf2")
    solver = sb.Solver(h=1e-3, method="implicit", integrator=parser.parse_args().integrator)
    best: dict[str, float] = {}
    for _ in range(TURNS):  # in turn, so that all meet the same machine
        for case in ("without", *ASKED):
            seconds, steps = step_time(case, solver)
            best[case] = min(best.get(case, np.inf), seconds)
            ratio = best[case] / best["without"]
            asked = f", asked {ASKED[case]:.2f}" if case in ASKED else ""
            took = f"{1e6 * best[case]:7.1f} us per Newton step, {steps:.2f} a substep"
            print(f"{case:10} {took}, ratio {ratio:.2f}{asked}")


if __name__ == "__main__":
    main()
