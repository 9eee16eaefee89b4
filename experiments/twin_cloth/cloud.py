"""Two hammocks of the fabric seen by a depth camera: fits to unordered clouds beside fits to as many named markers.

    python experiments/twin_cloth/cloud.py [--draws 20] [--first 0] [--beside 3]

Every frame shows 800 points anywhere on the cloths, another 800 each time, with a noise of 3 mm along every axis; one
in five is missing, where something passes in front of the cloth. The fit knows nothing of which point is which. The
markers have the same noise and are missing at the same places, but each is the same point of the fabric in all frames.
The motion is simulated on meshes twice as fine as those of the fit, with a quarter of its substep. Prints a table and
writes it to out/twin_cloth/cloud.txt; exit code 1 if fewer than 17 of 20 intervals hold the truth, or if an estimate is
farther from it than 1.5 half-widths of the fits to markers.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import sheetbend as sb
from make_data import HAMMOCK, KNOWN, SWINGING, TRUE, Piece, bars
from sheetbend.result.estimate import Estimate

Array = np.ndarray
PIECES = {name: SWINGING[name] for name in ("cloth", "bias_cut")}
FITTED = {"cloth_warp": 100.0, "cloth_shear": 20.0, "cloth_drag_linear": 0.2}
POINTS, MISSING, NOISE = 800, 0.2, 3e-3
TIMES = np.arange(17) / 20
FINER_OF_DATA, FINER_OF_FIT = 4, 2
OF_DATA, OF_FIT = sb.Solver(h=1 / 480, method="newton"), sb.Solver(h=1 / 120, method="newton")
HOLDS, WITHIN = 17 / 20, 1.5


def scene(finer: int, scale: float = 1.0) -> sb.Scene:
    """The hammocks between the bars, fitted numbers off by a factor."""
    built = sb.Scene("cloud")
    values = {name.removeprefix("cloth_"): v for name, v in (TRUE | {"cloth_drag_linear": 0.2}).items()}
    values |= {name.removeprefix("cloth_"): scale * v for name, v in FITTED.items()}
    known = {name: v for name, v in KNOWN.items() if name not in values}
    for own, piece in PIECES.items():
        mesh = piece.mesh(finer)
        held = np.concatenate([mesh.sets[bar] for bar in piece.held.values()])
        fabric = {"fabric": "cloth"} if own != "cloth" else {}
        cloth = sb.add_cloth(built, mesh, own, held=held, **fabric, **(values | known))
        for bar in piece.held.values():
            way = bars(TIMES)[bar]
            built.drive(cloth.particles[mesh.sets[bar]], TIMES, mesh.vertices[mesh.sets[bar]] + (way - way[0])[:, None])
    return built


@dataclass(frozen=True)
class Spots:
    """Points of the fabric: the piece of each, and its material coordinates."""

    piece: Array
    at: Array

    @classmethod
    def scattered(cls, generator: np.random.Generator) -> Spots:
        shares = generator.random((POINTS, 2))
        which = generator.integers(len(PIECES), size=POINTS)
        pieces: list[Piece] = list(PIECES.values())
        at = np.array([(share * HAMMOCK.size) @ pieces[k].axes.T for k, share in zip(which, shares, strict=True)])
        return cls(which, at)

    def positions(self, built: sb.Scene, states: Array) -> Array:
        """(frames, points, 3) m, where they are in states (frames, particles, 3)."""
        found = np.empty((len(states), POINTS, 3))
        for k, name in enumerate(PIECES):
            cloth, own = built.cloths[name], self.piece == k
            found[:, own] = cloth.mesh.at(self.at[own]).positions(states[:, cloth.particles])
        return found


def seen(x: Array, frame: int) -> Array:
    """(points,) bool: a bar that goes along the hammocks hides a fifth of them."""
    width = MISSING * HAMMOCK.size[0]
    left = (HAMMOCK.size[0] - width) * (0.5 + 0.5 * np.sin(0.4 * frame))
    return (x[:, 0] < left) | (x[:, 0] > left + width)


def shown(built: sb.Scene, states: Array, seed: int, noise: float = NOISE) -> tuple[sb.Cloud, sb.Recording, Spots]:
    """What the camera sees as a cloud, and the same with named markers."""
    generator = np.random.default_rng([seed, 25])
    points = []
    for k, state in enumerate(states):
        (x,) = Spots.scattered(generator).positions(built, state[None])
        x = x[seen(x, k)]
        points.append(x + noise * generator.standard_normal(x.shape))
    named = Spots.scattered(generator)
    x = named.positions(built, states)
    hidden = np.array([~seen(one, k) for k, one in enumerate(x)])
    x = x + noise * generator.standard_normal(x.shape)
    x[hidden] = np.nan
    return sb.Cloud.of(points, TIMES, name="cloud"), sb.Recording(x, TIMES, name="markers"), named


def experiment(recording: sb.Recording, named: Spots | None, finer: int) -> sb.Experiment:
    """From 30 % above the truth."""
    built = scene(finer * FINER_OF_FIT, 1.3)
    places = None
    if named is not None:
        cloths = [built.cloths[name] for name in PIECES]
        spots = zip(named.piece, named.at, strict=True)
        places = [place for k, at in spots for place in sb.on_cloth(cloths[k], [at])]
    return sb.Experiment(
        scene=built, recording=recording, markers=places, solver=OF_FIT, start="equilibrium", sigma=NOISE
    )


def fitted(recording: sb.Recording, named: Spots | None = None) -> sb.Fit:
    """With intervals that count the time step and the mesh, by one simulation on a finer one."""
    finer = sb.Refinement(finer=lambda: [experiment(recording, named, 2)], linear=True)
    e = experiment(recording, named, 1)
    return sb.fit(e, parameters=list(FITTED), refine=finer, profiles=False, beginnings=False, windows=())


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--draws", type=int, default=20, help="fits to clouds")
    parser.add_argument("--first", type=int, default=0, help="seed of the first, to go on with a study in parts")
    parser.add_argument("--beside", type=int, default=3, help="of these also fits to markers, which take longer")
    given = parser.parse_args()
    built = scene(FINER_OF_DATA)
    states = sb.simulate(built, TIMES, OF_DATA, start=sb.equilibrium(built).positions).positions
    found: dict[str, list[sb.Fit]] = {"cloud": [], "markers": []}
    for seed in range(given.first, given.first + given.draws):
        cloud, markers, named = shown(built, states, seed)
        found["cloud"].append(told(seed, "cloud", fitted(cloud)))
        if seed < given.first + given.beside:
            found["markers"].append(told(seed, "markers", fitted(markers, named)))
    words, ok = table(found)
    folder = Path("out/twin_cloth")
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "cloud.txt").write_text(words)
    print(words, end="")
    return 0 if ok else 1


def told(seed: int, kind: str, fit: sb.Fit) -> sb.Fit:
    said = "  ".join(f"{fit[n].value:8.4g} +/- {width(fit[n]):6.2g} ({width(fit[n], True):6.2g})" for n in FITTED)
    print(f"{seed:3d} {kind:8s} {said}", flush=True)
    return fit


def width(e: Estimate, statistical: bool = False) -> float:
    """Half-width of an interval; NaN where it is open at one end."""
    found = e.statistical if statistical else e.half_width
    return np.nan if found is None else float(found)


def holds(e: Estimate, true: float) -> bool:
    """Whether the interval, which may be open at either end, holds the truth."""
    return (e.lower is None or e.lower <= true) and (e.upper is None or true <= e.upper)


def table(found: dict[str, list[sb.Fit]]) -> tuple[str, bool]:
    """Rows by parameter, and whether all is as it should be."""
    lines, ok = [], True
    for name, true in FITTED.items():
        wide = {}
        for kind, fits in found.items():
            estimates = [fit[name] for fit in fits]
            values = np.array([e.value for e in estimates])
            held = sum(holds(e, true) for e in estimates)
            wide[kind] = float(np.nanmean([width(e) for e in estimates]))
            statistical = float(np.nanmean([width(e, True) for e in estimates]))
            lines.append(
                f"{name:18s} {kind:8s} mean {values.mean():6.4g}, scatter {values.std(ddof=1):6.2g}, "
                f"half-width {wide[kind]:6.2g} (statistical {statistical:6.2g}), holds {held} of {len(fits)}"
            )
            ok &= kind != "cloud" or held >= HOLDS * len(fits)
        near = sum(abs(fit[name].value - true) <= WITHIN * wide["markers"] for fit in found["cloud"])
        lines.append(
            f"{'':27s} {wide['cloud'] / wide['markers']:.2f} times as wide; {near} of {len(found['cloud'])} "
            f"estimates within {WITHIN} half-widths of the markers"
        )
        ok &= near == len(found["cloud"])
    return "\n".join(lines) + "\n", ok


if __name__ == "__main__":
    sys.exit(main())
