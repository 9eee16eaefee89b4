"""Writes data/twin.npz: a synthetic rope on a mesh four times and a substep eight times finer than those of the fit.

    python experiments/twin/make_data.py

The rope is clamped level at one end, straight, and let go. The same seed gives the same file.
"""

from pathlib import Path

import numpy as np
import sheetbend as sb

TRUE = {"rope_EI": 2e-3, "rope_bend_damping": 0.01, "rope_drag_linear": 0.02}
LENGTH, DENSITY = 0.6, 0.05
SEGMENTS, H = 160, 1 / 3840
RATE, FRAMES, MARKERS = 120, 181, 9
NOISE, SEED = 5e-4, 20


def main(folder: Path) -> None:
    values = {name.removeprefix("rope_"): value for name, value in TRUE.items()}
    scene = sb.rope(LENGTH, SEGMENTS, density=DENSITY, clamp_start=(1, 0, 0), **values)
    nodes = scene.ropes["rope"].particles[:: SEGMENTS // (MARKERS - 1)]
    times = np.arange(FRAMES) / RATE
    positions = sb.simulate(scene, times, sb.Solver(h=H)).positions[:, nodes]
    noise = NOISE * np.random.default_rng(SEED).standard_normal(positions.shape)
    metadata = {
        "what": "SYNTHETIC: a rope clamped level at one end, straight, let go at time 0; no measurement",
        "true": TRUE,
        "made_with": {
            "length": LENGTH,
            "density": DENSITY,
            "segments": SEGMENTS,
            "substep": H,
            "noise": NOISE,
            "seed": SEED,
        },
        "units_of_values": "SI: m, kg/m, s, N m^2, N s/m^2; noise is the standard deviation of each coordinate in m",
    }
    recording = sb.Recording(
        positions=positions + noise, times=times, name="twin", gravity=(0.0, 0.0, -9.81), metadata=metadata
    )
    recording.save(folder / "twin.npz")


if __name__ == "__main__":
    main(Path(__file__).parent / "data")
