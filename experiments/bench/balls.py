"""What balls that hit each other cost: processor time per substep of a gas in a box, and of a heap that falls together.

    python experiments/bench/balls.py [--counts 50 200 800]

Balls of 1 cm radius, substeps of 2 ms, 0.2 s. Prints a table in Markdown.
"""

from __future__ import annotations

import argparse
import time

import numpy as np
import sheetbend as sb

RADIUS, STEPS = 0.01, 100
SOLVER = sb.Solver(h=2e-3, method="gauss_seidel", iterations=2)


def box_of_balls(count: int, heap: bool) -> sb.Scene:
    """Balls on a disturbed grid between six walls. A gas has five radii between two and loses nothing; a heap falls
    from half a radius, with a restitution of 0.5 and a friction of 0.2."""
    random = np.random.default_rng(0)
    side = int(np.ceil(count ** (1 / 3)))
    apart = (2.5 if heap else 5.0) * RADIUS
    grid = np.stack(np.meshgrid(*3 * [np.arange(side)], indexing="ij"), axis=-1).reshape(-1, 3)[:count, [1, 2, 0]]
    at = grid * apart + 1.5 * RADIUS + 0.05 * RADIUS * random.standard_normal((count, 3))
    scene = sb.Scene("heap" if heap else "gas", gravity=(0, 0, -9.81 if heap else 0.0))
    balls = scene.add_particles(at, 0.01, 0.0 * at if heap else random.standard_normal((count, 3)))
    restitution, friction = (0.5, 0.2) if heap else (1.0, 0.0)
    scene.add_collisions(balls, radius=RADIUS, restitution=restitution)
    wide = np.full(3, side * apart + 2 * RADIUS)
    for axis, name in enumerate("xyz"):
        for end, inward in (("low", 1.0), ("high", -1.0)):
            wall = sb.Plane(
                point=np.zeros(3) if inward > 0 else wide, normal=inward * np.eye(3)[axis], name=f"{name}_{end}"
            )
            scene.add_contact(balls, wall, friction=friction, radius=RADIUS, restitution=restitution)
    return scene


def measured(scene: sb.Scene) -> tuple[int, float, float]:
    """Impacts of balls with each other, and processor time of the motion and with its gradient, s."""
    times = [0.0, STEPS * SOLVER.h]
    began = time.process_time()
    motion = sb.simulate(scene, times, SOLVER)
    forward = time.process_time() - began
    began = time.process_time()
    rollout = sb.rollout(scene, times, SOLVER)
    rollout.gradient(np.ones_like(rollout.positions))
    return motion.contacts["balls"].began, forward, time.process_time() - began


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--counts", type=int, nargs="+", default=[50, 200, 800])
    counts = parser.parse_args().counts
    print("| balls | | impacts per substep | ms per substep | with gradient |\n| --- | --- | --- | --- | --- |")
    for heap in (False, True):
        for count in counts:
            scene = box_of_balls(count, heap)
            impacts, forward, both = measured(scene)
            per = 1e3 / STEPS
            print(
                f"| {count} | {scene.name} | {impacts / STEPS:.3g} | {per * forward:.2g} | {per * both:.2g} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
