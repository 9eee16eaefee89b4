"""How often 95 % intervals of a stiffness that varies from place to place hold the truth, and how they depend on the
modes and the motion: of 392 triangles of a cloth, or of 20 joints of a rope.

    python experiments/coverage/fields.py draw short --seeds 0 20   # one JSON line per seed; known ones are skipped
    python experiments/coverage/fields.py table
    python experiments/coverage/fields.py figure short 0            # one draw as a map: what is left beside the error
    python experiments/coverage/fields.py known long --seeds 0 6    # what a draw itself tells of its prior

A square cloth of 14 x 14 cells is let go at the level of its pins, or a rope of 20 links that is clamped at one end.
ln E is drawn from the prior with all modes that the mesh has; the fit has some of them, and finds the size and the
length of the prior.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import sheetbend as sb
from coverage import OUT, lines
from scipy.stats import binomtest
from sheetbend.cli.cloth_figures import stiffness_panels
from sheetbend.minimum.field_priors import Picture
from sheetbend.objects.stiffness_field import StiffnessField
from sheetbend.problem.counts import counted
from sheetbend.problem.smooth import Field

SIDE, CELLS, WARP, EI, JOINTS = 0.3, 14, 20.0, 1e-3, 20
SIZE, LENGTH = 0.3, 0.1  # of the prior that fields are drawn from
AFTER_NEWTON = {"refine": False, "profiles": False}
EXACT = 1e-6  # error of a mode that counts as known


@dataclass(frozen=True)
class Motion:
    """A cloth or a rope that falls.

    Attributes:
        about: in words.
        pinned: vertices of a cloth; none of a rope.
        frames: at 50 Hz, of a rope at 60 Hz.
        modes: that are fitted.
    """

    about: str
    pinned: tuple[int, ...]
    frames: int
    modes: int

    @property
    def is_rope(self) -> bool:
        return not self.pinned

    @property
    def every(self) -> int:
        """Modes of the mesh."""
        return JOINTS - 1 if self.is_rope else (CELLS + 1) ** 2 - 1

    @property
    def noise(self) -> float:
        return 5e-4 if self.is_rope else 1e-3

    @property
    def mean(self) -> tuple[str, float]:
        """The quantity of the mean stiffness, and its true value."""
        return ("rope_EI", EI) if self.is_rope else ("cloth_warp", WARP)


CORNERS, EDGE = (0, CELLS), tuple(range(CELLS + 1))
MOTIONS = {
    "short": Motion("from two corners, 0.24 s", CORNERS, 13, 60),
    "edge": Motion("from an edge, 0.48 s", EDGE, 25, 60),
    "few": Motion("from two corners, 0.48 s", CORNERS, 25, 20),
    "long": Motion("from two corners, 0.48 s", CORNERS, 25, 60),
    "rope": Motion("a rope from a clamp, 1 s", (), 61, 12),
}


def hung(motion: Motion, modes: int) -> sb.Scene:
    if motion.is_rope:
        own = {"density": 0.05, "EI": EI, "bend_damping": 0.02, "drag_linear": 0.02, "clamp_start": (1.0, 0.0, 0.0)}
        return sb.rope(0.4, JOINTS, pinned=(), softness_modes=range(1, modes + 1), **own)
    mesh = sb.mesh.grid(SIDE, SIDE, CELLS, CELLS, pattern="one_way")
    given = {"density": 0.2, "warp": WARP, "shear": 8.0, "bending": 1e-4, "membrane_damping": 0.01}
    return sb.cloth(mesh, pinned=motion.pinned, stiffness_modes=modes, **given)


def drawn(motion: Motion, rng: np.random.Generator) -> tuple[sb.Scene, StiffnessField, np.ndarray]:
    """The scene with all modes of its mesh, its field, and the modes drawn from the prior."""
    scene = hung(motion, motion.every)
    field = scene.ropes["rope"].field if motion.is_rope else scene.cloths["cloth"].field
    return scene, field, field.deviations(SIZE, LENGTH) * rng.standard_normal(motion.every)


def fitted(motion: Motion, seed: int) -> tuple[sb.Fit, np.ndarray]:
    """A fit to a field drawn from the prior, and the true ln E (triangles,)."""
    rng = np.random.default_rng(seed)
    scene, field, q = drawn(motion, rng)
    times = np.arange(motion.frames) / (60 if motion.is_rope else 50)
    solver = sb.Solver(h=1 / 600) if motion.is_rope else sb.Solver(h=0.01, method="newton")
    x = sb.simulate(scene, times, solver, values=dict(zip(field.modes, q, strict=True))).positions
    recording = sb.Recording(x + motion.noise * rng.standard_normal(x.shape), times, name="fall")
    found = sb.fit(
        hung(motion, motion.modes),
        recording,
        [motion.mean[0]],
        markers=[sb.on_particle(i) for i in range(x.shape[1])],
        solver=solver,
        sigma=motion.noise,
        smooth={field.name: sb.Smooth()},
        **AFTER_NEWTON,
    )
    return found, np.log(motion.mean[1]) + field.shapes @ q


def draw(name: str, seeds: range, folder: Path) -> None:
    """Fit every seed that is not known yet."""
    folder.mkdir(parents=True, exist_ok=True)
    known = lines(folder, f"field_{name}")
    with (folder / f"field_{name}.{seeds.start}-{seeds.stop}.jsonl").open("a") as file:
        file.write("\n")  # ends what a killed process began
        for seed in seeds:
            if seed in known:
                continue
            began, made = time.process_time(), counted()
            found, lnE = fitted(MOTIONS[name], seed)
            (field,) = found.result.fields
            off = np.log(field.stiffness) - lnE
            entry = {
                "seed": seed,
                "seconds": time.process_time() - began,
                "jacobians": counted()[1] - made[1],
                "inside": int((np.abs(off) < field.half_widths).sum()),
                "of": len(off),
                "half_width": float(np.mean(field.half_widths)),
                "off": float(np.sqrt(np.mean(off**2))),
                "left": float(np.mean(field.left)),
                "size": [field.size_lower, field.size, field.size_upper],
                "length": [field.length_lower, field.length, field.length_upper],
                "verdict": found[MOTIONS[name].mean[0]].verdict,
                "mean": [found[MOTIONS[name].mean[0]].lower, found[MOTIONS[name].mean[0]].upper],
            }
            file.write(json.dumps(entry) + "\n")
            file.flush()


def table(folder: Path) -> None:
    """A row of Markdown for every motion that was drawn."""
    print("| motion | modes | draws | inside | share | fewest in a draw | half-width of ln E | rms error | left |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- | --- |")
    for name, motion in MOTIONS.items():
        known = list(lines(folder, f"field_{name}").values())
        if not known:
            continue
        inside, of = (sum(entry[key] for entry in known) for key in ("inside", "of"))
        mean = {key: np.mean([entry[key] for entry in known]) for key in ("half_width", "left")}
        off = np.sqrt(np.mean([entry["off"] ** 2 for entry in known]))
        print(
            f"| {motion.about} | {motion.modes} | {len(known)} | {inside:,} of {of:,} | {100 * inside / of:.1f} % "
            f"| {min(entry['inside'] for entry in known)} | {mean['half_width']:.2f} | {off:.3f} "
            f"| {100 * mean['left']:.1f} % |"
        )
        holds = sum(e["size"][0] <= SIZE <= (e["size"][2] or np.inf) for e in known)
        long = sum(e["length"][0] <= LENGTH <= (e["length"][2] or np.inf) for e in known)
        low, high = binomtest(holds, len(known)).proportion_ci(method="exact")
        seconds = [entry["seconds"] for entry in known]
        verdicts = sorted({entry["verdict"] for entry in known})
        print(
            f"size inside {holds} ({100 * low:.0f} to {100 * high:.0f} %), length inside {long} of {len(known)}; "
            f"{np.median(seconds):.1f} s (at most {max(seconds):.1f}), "
            f"{np.median([e['jacobians'] for e in known]):.0f} Jacobians; verdicts: {', '.join(verdicts)}"
        )


def known(name: str, seeds: range) -> None:
    """The likeliest size and length of the prior of every draw, and their intervals, where all modes are known."""
    for seed in seeds:
        _, field, q = drawn(MOTIONS[name], np.random.default_rng(seed))
        exact = np.column_stack([np.eye(len(q)) / EXACT, np.zeros(len(q))])
        picture = Picture(exact, (np.arange(len(q)),), q)
        found = picture.bounded((picture.likeliest((Field(field, sb.Smooth(), SIZE, LENGTH),), 0),), 0)
        told = [
            f"{value:.3f} {ends}" for value, ends in ((found.size, found.size_ends), (found.length, found.length_ends))
        ]
        rms = np.sqrt(np.mean((field.shapes @ q) ** 2))
        print(f"draw {seed}: rms {rms:.3f}, size {told[0]}, length {told[1]}", flush=True)


def figure(name: str, seed: int, file: Path) -> None:
    """The map of one draw: what is left of the prior, and the true error."""
    found, lnE = fitted(MOTIONS[name], seed)
    (field,) = found.result.fields
    for comparison in found.comparisons:
        cloth = comparison.experiment.scene.cloths["cloth"]
        stiffness, interval, left = stiffness_panels(field, cloth)
        moves, lnE_fitted = np.isfinite(left.values), np.log(field.stiffness)
        true = _over(moves, 100 * np.expm1(lnE - lnE_fitted.mean()))
        panels = [
            sb.plot.Field("fitted", stiffness.values, scale=stiffness.label),
            sb.plot.Field("true", true, scale=stiffness.label),
            left,
            sb.plot.Field("half-width", interval.values, scale="of the stiffness [%]"),
            sb.plot.Field(
                "error without its sign",
                _over(moves, 100 * np.expm1(np.abs(lnE_fitted - lnE))),
                scale="of the stiffness [%]",
            ),
        ]
        sb.plot.save(sb.plot.fields(cloth.mesh, panels, title=f"{MOTIONS[name].about}, draw {seed}"), file)


def _over(moves: np.ndarray, values: np.ndarray) -> np.ndarray:
    found = np.full(len(moves), np.nan)
    found[moves] = values
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["draw", "table", "figure", "known"])
    parser.add_argument("motion", nargs="?", choices=list(MOTIONS), default="short")
    parser.add_argument("seed", nargs="?", type=int, default=0)
    parser.add_argument("--seeds", nargs=2, type=int, default=(0, 20), metavar=("FIRST", "STOP"))
    parser.add_argument("--out", type=Path, default=OUT)
    given = parser.parse_args()
    if given.what == "table":
        table(given.out)
    elif given.what == "known":
        known(given.motion, range(*given.seeds))
    elif given.what == "figure":
        given.out.mkdir(parents=True, exist_ok=True)
        figure(given.motion, given.seed, given.out / f"field_{given.motion}_{given.seed}.png")
    else:
        draw(given.motion, range(*given.seeds), given.out)


if __name__ == "__main__":
    main()
