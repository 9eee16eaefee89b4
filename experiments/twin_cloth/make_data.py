"""Writes data/*.npz: pieces of one synthetic fabric, swinging and draped, on meshes four times as fine and with a
substep four times smaller than those of the fit.

    python experiments/twin_cloth/make_data.py

`swinging`: three hammocks cut along the warp, along the weft and on the bias hang between two bars, and a flap lies
over a rod; bars and rod move. `draped`: a square lies over a rod and rests. The same seed gives the same files.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import sheetbend as sb

Array = np.ndarray
TRUE = {
    "cloth_warp": 100.0,
    "cloth_weft": 60.0,
    "cloth_shear": 20.0,
    "cloth_poisson": 0.3,
    "cloth_bending": 5e-5,
    "cloth_bending_weft": 3e-5,
}
KNOWN = {"density": 0.2, "membrane_damping": 3e-3, "drag_linear": 0.2}
FINER, H = 4, 1 / 960
RATE, SECONDS, STILLS = 60, 1.5, 5
NOISE, SEED = 2e-4, 7  # m per coordinate


@dataclass(frozen=True)
class Piece:
    """A rectangle of the fabric in the level plane, its long side along x.

    Attributes:
        size: m, along x and y.
        cells: of the fit's mesh along x and y.
        corner: of lowest x and y, m.
        warp: degrees from x to the warp.
        held: where x is held, m from the corner, and by what.
        seen: markers at these shares of the long side, in three rows.
    """

    size: tuple[float, float]
    cells: tuple[int, int]
    corner: tuple[float, float]
    warp: float
    held: dict[float, str]
    seen: tuple[float, ...]

    def mesh(self, finer: int) -> sb.TriangleMesh:
        """Placed, with the vertices of each bar or rod as a set."""
        flat = sb.mesh.grid(*self.size, *(finer * c for c in self.cells), pattern="one_way")
        turned = replace(
            flat,
            vertices=flat.vertices + np.array([*self.corner, 0.0]),
            material=flat.vertices[:, :2] @ self.axes.T,
        )
        for at, bar in self.held.items():
            turned = turned.with_set(bar, np.flatnonzero(np.abs(flat.vertices[:, 0] - at) < 1e-9))
        return turned

    @property
    def axes(self) -> Array:
        """(2, 2) unit vectors along warp and weft."""
        angle = np.radians(self.warp)
        return np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])

    def markers(self) -> Array:
        """(k, 2) m, material coordinates."""
        (length, width), edge = self.size, 0.01
        across = (edge, width / 2, width - edge)
        return np.array([(share * length, y) for share in self.seen for y in across]) @ self.axes.T


HAMMOCK = Piece((0.4, 0.1), (12, 3), (0.0, 0.0), 0.0, {0.0: "left", 0.4: "right"}, (1 / 6, 1 / 3, 1 / 2, 2 / 3, 5 / 6))
OVER_ROD = (0.0, 1 / 8, 1 / 4, 3 / 4, 7 / 8, 1.0)
SWINGING = {
    "cloth": HAMMOCK,
    "weft_cut": replace(HAMMOCK, corner=(0.0, 0.2), warp=90.0),
    "bias_cut": replace(HAMMOCK, corner=(0.0, 0.4), warp=45.0),
    "flap": Piece((0.16, 0.1), (24, 6), (-0.08, 0.6), 0.0, {0.08: "rod"}, OVER_ROD),
}
DRAPED = {"square": Piece((0.16, 0.16), (24, 6), (-0.08, 0.0), 90.0, {0.08: "rod"}, OVER_ROD)}


def bars(times: Array) -> dict[str, Array]:
    """(frames, 3) m, where the bars and the rod are."""
    begun, pulled = risen(times / 0.5), risen((times - 0.6) / 0.5)
    up = 0.02 * begun * np.sin(2 * np.pi * 1.5 * times)
    aside = 0.02 * begun * np.sin(2 * np.pi * 1.2 * times)
    none = np.zeros_like(times)
    return {
        "left": np.column_stack([none, none, up]),
        "right": np.column_stack([0.4 + 0.016 * pulled, none, up]),
        "rod": np.column_stack([aside, none, up]),
    }


def risen(share: Array) -> Array:
    """From 0 to 1 while the share does, smoothly."""
    s = np.clip(share, 0.0, 1.0)
    return s - np.sin(2 * np.pi * s) / (2 * np.pi)


def scene(name: str, pieces: dict[str, Piece], times: Array) -> sb.Scene:
    """The pieces, held by the bars and the rod."""
    built = sb.Scene(name)
    values = {name.removeprefix("cloth_"): value for name, value in TRUE.items()}
    for own, piece in pieces.items():
        mesh = piece.mesh(FINER)
        held = np.concatenate([mesh.sets[bar] for bar in piece.held.values()])
        cloth = sb.add_cloth(built, mesh, own, held=held, **values, **KNOWN)
        for bar in piece.held.values():
            way = bars(times)[bar]
            built.drive(cloth.particles[mesh.sets[bar]], times, mesh.vertices[mesh.sets[bar]] + (way - way[0])[:, None])
    return built


def recorded(built: sb.Scene, pieces: dict[str, Piece], what: str, states: Array, times: Array) -> sb.Recording:
    """Markers on the fabric with noise, and where bars and rod are."""
    seen, names = [], []
    for piece in pieces:
        cloth = built.cloths[piece]
        x = cloth.mesh.at(pieces[piece].markers()).positions(states[:, cloth.particles])
        seen.append(x + NOISE * np.random.default_rng([SEED, *piece.encode()]).standard_normal(x.shape))
        names += [f"{piece}_{k}" for k in range(x.shape[1])]
    ways = bars(times)
    metadata = {
        "what": f"SYNTHETIC: {what}; no measurement",
        "true": TRUE,
        "made_with": {"finer": FINER, "substep": H, "noise": NOISE, "seed": SEED, **KNOWN},
        "units_of_values": "SI: kg/m^2, N/m, N m, s, N s/m^3; noise is the standard deviation of each coordinate in m",
    }
    return sb.Recording(
        positions=np.concatenate([*seen, np.stack(list(ways.values()), axis=1)], axis=1),
        times=times,
        markers=(*names, *ways),
        name=built.name,
        gravity=(0.0, 0.0, -9.81),
        metadata=metadata,
    )


def swinging(frames: int | None = None, pieces: dict[str, Piece] = SWINGING) -> sb.Recording:
    """The motion from rest, or its first frames; what some pieces do does not depend on the others."""
    times = np.arange(round(SECONDS * RATE) + 1) / RATE
    built = scene("swinging", pieces, times)
    rest = sb.equilibrium(built).positions
    seen = times[:frames]
    states = sb.simulate(built, seen, sb.Solver(h=H, method="newton"), start=rest).positions
    what = "hammocks between two moving bars, and a flap over a moving rod"
    return recorded(built, pieces, what, states, seen)


def draped() -> sb.Recording:
    """The square at rest, some stills with a noise each."""
    built = scene("draped", DRAPED, np.zeros(1))
    states = np.repeat(sb.equilibrium(built).positions[None], STILLS, axis=0)
    return recorded(built, DRAPED, "a square over a rod, at rest", states, np.arange(STILLS) / RATE)


def main(folder: Path) -> None:
    for recording in (swinging(), draped()):
        recording.save(folder / f"{recording.name}.npz")


if __name__ == "__main__":
    main(Path(__file__).parent / "data")
