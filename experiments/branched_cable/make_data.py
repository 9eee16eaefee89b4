"""Writes data/harness.npz: a synthetic recording from twice the links and half the substep of the fit.

    python experiments/branched_cable/make_data.py

The harness hangs at rest, then the grip moves. The same seed gives the same file.
"""

import sys
from pathlib import Path

import numpy as np
import sheetbend as sb

sys.path.insert(0, str(Path(__file__).parent))
import harness

TRUE = {"trunk_EI": 4e-3, "left_EI": 2e-3, "right_EI": 1e-3, "trunk_bend_damping": 0.02}
FINER, NOISE, SEED = 2, 5e-4, 12


def main(file: Path = harness.FILE) -> None:
    built = harness.scene(TRUE, FINER)
    h = 1 / (harness.RATE * harness.SUBSTEPS * FINER)
    times = harness.grip_motion()[0]
    motion = sb.simulate(built, times, sb.Solver(h=h), start=sb.equilibrium(built).nodes)
    places = harness.places(built)
    weights = {name: np.array(place.weights)[:, None] for name, place in places.items()}
    seen = [(motion.positions[:, list(place.particles)] * weights[name]).sum(axis=1) for name, place in places.items()]
    positions = np.stack(seen, axis=1)
    noise = NOISE * np.random.default_rng(SEED).standard_normal(positions.shape)
    metadata = {
        "what": "SYNTHETIC: a branched cable, its trunk moved by a grip; no measurement",
        "true": TRUE,
        "made_with": {"links_and_steps_finer": FINER, "substep": h, "noise": NOISE, "seed": SEED},
        "units_of_values": "SI: N m^2, s, m; noise is the standard deviation of each coordinate",
    }
    recording = sb.Recording(
        positions=positions + noise,
        times=times,
        markers=tuple(places),
        name="harness",
        gravity=(0.0, 0.0, -9.81),
        metadata=metadata,
    )
    file.parent.mkdir(exist_ok=True)
    recording.save(file)


if __name__ == "__main__":
    main()
