"""An overhand knot that is pulled tight, and then with less and less: at which load does it begin to open?

    python experiments/bench/knot.py [--segments 180] [--friction 0 0.05 0.1 0.15 0.2]

A rope of 1.12 m, radius 3 mm and EI 5e-6 N m^2 without weight is pulled at its ends with 4 mN until it is at rest. The
load then falls to zero within 6 s. Prints the rope's length in the loop when it is tight and at the end, the load at
which the loop has grown by 2 %, and processor time.
"""

from __future__ import annotations

import argparse
import time

import numpy as np
import sheetbend as sb

PULL, GROWN = 4e-3, 0.02  # N; a share of the loop
TIGHTENED, HELD, LET_GO = 2.0, 5.0, 11.0  # s
H, EVERY = 2e-3, 25  # of a substep, s; substeps from frame to frame


def open_knot(segments: int, friction: float) -> tuple[sb.Scene, np.ndarray, np.ndarray]:
    """The open knot, a trefoil that is cut, its two ends, and the directions away from each other there."""
    t = np.linspace(-2.15, 2.15, 1001)
    points = np.stack([t**3 - 3 * t, t**4 - 4 * t**2, 0.55 * (t**5 - 10 * t)], 1) * 0.02
    scene = sb.Scene("knot", gravity=(0, 0, 0))
    rope = sb.add_rope(
        scene, points=points, segments=segments, density=0.02, EA=100.0, EI=5e-6, stretch_damping=5e-3,
        bend_damping=5e-3, drag_linear=0.05,
    )  # fmt: skip
    scene.add_self_contact(rope, radius=3e-3, friction=friction)
    ends = rope.particles[[0, -1]]
    x = scene.nodes[ends]
    return scene, ends, (x - x.mean(0)) / np.linalg.norm(x - x.mean(0), axis=1)[:, None]


def scene_of(segments: int, friction: float) -> sb.Scene:
    """The open knot with forces on its ends."""
    scene, ends, away = open_knot(segments, friction)
    load = PULL * np.array([0.3, 1.0, 1.0, 0.0, 0.0])
    times = [0.0, TIGHTENED, HELD, LET_GO, LET_GO + 0.3]
    scene.add_force(ends, load[:, None, None] * away, times)
    return scene


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--segments", type=int, default=180)
    parser.add_argument("--friction", type=float, nargs="+", default=[0.0, 0.05, 0.1, 0.15, 0.2])
    given = parser.parse_args()
    times = np.arange(round((LET_GO + 0.3) / (H * EVERY)) + 1) * H * EVERY
    for friction in given.friction:
        scene = scene_of(given.segments, friction)
        start = time.process_time()
        motion = sb.simulate(scene, times, sb.Solver(h=H, method="implicit", integrator="bdf1"))
        seconds = time.process_time() - start
        rope = scene.ropes["rope"]
        x = motion.positions[:, rope.particles[[0, -1]]]
        loop = rope.length - np.linalg.norm(x[:, 1] - x[:, 0], axis=1)
        tight = loop[times <= HELD][-1]
        opening = times[(times > HELD) & (loop > (1.0 + GROWN) * tight)]
        load = PULL * (LET_GO - opening[0]) / (LET_GO - HELD) if len(opening) else 0.0
        print(
            f"friction {friction:g}: {1e3 * tight:.0f} mm in the loop, {1e3 * loop[-1]:.0f} mm at the end, "
            f"opens below {1e3 * max(load, 0.0):.2f} mN; {seconds:.1f} s",
            flush=True,
        )


if __name__ == "__main__":
    main()
