"""Writes data/cloth_in_wind.npz: a synthetic cloth on a mesh one and a half times and with substeps twice finer than
those of the fit.

    python experiments/cloth_in_wind/make_data.py

The cloth hangs from its upper edge, flat and at rest; at time 0 a steady wind sets in. The same seed gives the same
file. It takes some minutes.
"""

from pathlib import Path

import numpy as np
import sheetbend as sb

TRUE = {
    "cloth_warp": 60.0,
    "cloth_bending": 3e-5,
    "wind_x": 0.8,
    "wind_y": 1.6,
    "cloth_air_normal": 0.7,
    "cloth_air_tangential": 0.05,
}
WIDTH, HEIGHT, DENSITY, POISSON = 0.5, 0.7, 0.15, 0.3
DAMPING = {"membrane_damping": 0.01, "bend_damping": 0.02}
CELLS, H = (45, 68), 1 / 360
RATE, FRAMES = 90, 251
COLUMNS, ROWS = 8, 9
NOISE, SEED = 1e-3, 7


def scene(cells: tuple[int, int]) -> tuple[sb.Scene, sb.Cloth]:
    """The cloth with the true values, on a mesh of so many cells along width and height."""
    flat = sb.mesh.grid(WIDTH, HEIGHT, *cells, "one_way")
    mesh = sb.TriangleMesh(flat.vertices[:, [0, 2, 1]], flat.triangles, flat.material, flat.sets)
    built, warp = sb.Scene("cloth_in_wind"), TRUE["cloth_warp"]
    isotropic = {"warp": warp, "shear": warp / (2 * (1 + POISSON)), "poisson": POISSON}
    held = mesh.sets["top"]
    fabric = {"density": DENSITY, "bending": TRUE["cloth_bending"], **isotropic, **DAMPING}
    cloth = sb.add_cloth(built, mesh, held=held, **fabric)
    built.pin(cloth.particles[held])
    wind = (TRUE["wind_x"], TRUE["wind_y"], 0.0)
    triangles = cloth.particles[mesh.triangles]
    built.add_air(triangles, TRUE["cloth_air_normal"], TRUE["cloth_air_tangential"], wind)
    return built, cloth


def places() -> np.ndarray:
    """(markers, 2) m: where the markers sit along warp and weft, row by row from below; no edge is touched."""
    across = (np.arange(COLUMNS) + 0.5) * WIDTH / COLUMNS
    up = (np.arange(ROWS) + 0.5) * HEIGHT / ROWS
    return np.array([[round(x, 5), round(z, 5)] for z in up for x in across])


def main(folder: Path) -> None:
    built, cloth = scene(CELLS)
    times = np.arange(FRAMES) / RATE
    motion = sb.simulate(built, times, sb.Solver(h=H, method="newton", iterations=1))
    positions = cloth.mesh.at(places()).positions(motion.positions[:, cloth.particles])
    noise = NOISE * np.random.default_rng(SEED).standard_normal(positions.shape)
    metadata = {
        "what": "SYNTHETIC: a cloth held along its upper edge in a wind that sets in at time 0; no measurement",
        "true": TRUE,
        "places_of_markers": places().tolist(),
        "made_with": {
            "width": WIDTH,
            "height": HEIGHT,
            "density": DENSITY,
            "poisson": POISSON,
            **DAMPING,
            "cells": CELLS,
            "substep": H,
            "noise": NOISE,
            "seed": SEED,
        },
        "units_of_values": "SI: m, kg/m^2, s, N/m, N m, m/s, kg/m^3; noise is the standard deviation of each "
        "coordinate in m, places are along warp and weft in m",
    }
    recording = sb.Recording(
        positions=np.round(positions + noise, 6),
        times=times,
        markers=tuple(f"m{k}" for k in range(positions.shape[1])),
        name="cloth_in_wind",
        gravity=(0.0, 0.0, -9.81),
        metadata=metadata,
    )
    recording.save(folder / "cloth_in_wind.npz")


if __name__ == "__main__":
    main(Path(__file__).parent / "data")
