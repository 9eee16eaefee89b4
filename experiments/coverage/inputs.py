"""How often 95 % intervals hold an unknown force or wind over time, and the stiffness beside it.

    python experiments/coverage/inputs.py draw rope --seeds 0 20   # one JSON line per seed; known ones are skipped
    python experiments/coverage/inputs.py table

A force pushes a rope, or a wind blows at a flag, and nobody measured it. Its course is drawn from the prior of a given
size and length; the fit finds both, the course and the stiffness. Each draw is also fitted without the unknown input.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import sheetbend as sb
from coverage import OUT, lines
from scipy.stats import binomtest

NOISE = 5e-4
ALONE = {"refine": False, "profiles": False, "beginnings": False}


@dataclass(frozen=True)
class Motion:
    """What is pushed.

    Attributes:
        about: in words.
        make: a scene, with or without the unknown input.
        solver, frames, rate: of the motion, Hz.
        size, length: of the prior that the input is drawn from, in its unit and s.
        fitted: parameters; the first is the one that is told.
    """

    about: str
    make: Callable[[bool], sb.Scene]
    solver: sb.Solver
    frames: int
    rate: float
    size: float
    length: float
    fitted: tuple[str, ...]

    @property
    def times(self) -> np.ndarray:
        return np.arange(self.frames) / self.rate


def rope(unknown: bool) -> sb.Scene:
    own = {"density": 0.05, "EI": 1e-3, "bend_damping": 0.02, "drag_linear": 0.02, "clamp_start": (1.0, 0.0, 0.0)}
    scene = sb.rope(0.4, 10, pinned=(), **own)
    if unknown:
        sb.add_unknown_force(scene, [6], scale=0.02, spacing=0.05, duration=1.0)
    return scene


def draft(unknown: bool) -> sb.Scene:
    scene = rope(False)
    if unknown:
        sb.add_unknown_force(scene, scene.ropes["rope"], scale=0.05, spacing=0.05, duration=1.0)
    return scene


def gust(unknown: bool) -> sb.Scene:
    own = {"density": 0.05, "EI": 1e-3, "bend_damping": 0.02, "drag_linear": 0.05, "drag_quadratic": 0.05}
    scene = sb.rope(0.4, 10, pinned=(), clamp_start=(0.0, 0.0, -1.0), **own)
    if unknown:
        sb.add_unknown_wind(scene, scale=1.0, spacing=0.05, duration=1.0)
    return scene


def flag(unknown: bool) -> sb.Scene:
    mesh = sb.mesh.grid(0.3, 0.2, 6, 4, pattern="one_way")
    scene = sb.Scene("flag")
    given = {"density": 0.15, "warp": 20.0, "shear": 5.0, "bending": 2e-4, "membrane_damping": 0.01}
    cloth = sb.add_cloth(scene, mesh, name="cloth", **given)
    scene.pin(cloth.particles[mesh.sets["left"]])
    scene.add_air(mesh.triangles, 0.6, 0.05, wind=(0.0, 2.0, 0.0))
    if unknown:
        sb.add_unknown_wind(scene, scale=1.0, spacing=0.05, duration=0.6)
    return scene


MOTIONS = {
    "rope": Motion(
        "a force on a rope", rope, sb.Solver(h=1 / 600), 61, 60.0, 0.02, 0.08, ("rope_EI", "rope_bend_damping")
    ),
    "draft": Motion(
        "a draft along a rope", draft, sb.Solver(h=1 / 600), 61, 60.0, 0.05, 0.1, ("rope_EI", "rope_bend_damping")
    ),
    "gust": Motion(
        "a wind at a hanging rope", gust, sb.Solver(h=1 / 600), 61, 60.0, 1.0, 0.1, ("rope_EI", "rope_bend_damping")
    ),
    "flag": Motion(
        "a wind at a flag", flag, sb.Solver(h=0.005, method="newton"), 31, 50.0, 0.5, 0.1, ("cloth_bending",)
    ),
}


def drawn(motion: Motion, seed: int) -> tuple[sb.Recording, np.ndarray]:
    """A recording of an input drawn from the prior, and the input (knots, 3)."""
    rng = np.random.default_rng(seed)
    scene = motion.make(True)
    (own,) = scene.over_time.values()
    q = own.deviations(motion.size, motion.length) * rng.standard_normal(len(own.modes))
    values = dict(zip(own.modes, q, strict=True))
    x = sb.simulate(scene, motion.times, motion.solver, values=values).positions
    recording = sb.Recording(x + NOISE * rng.standard_normal(x.shape), motion.times, name="seen")
    return recording, (own.shapes @ q).reshape(-1, 3)


def fitted(motion: Motion, recording: sb.Recording, unknown: bool) -> sb.Fit:
    scene = motion.make(unknown)
    start = {name: {"initial": 2.0 * scene.quantities[name].value} for name in motion.fitted}
    places = [sb.on_particle(i) for i in range(len(recording.markers))]
    return sb.fit(scene, recording, start, markers=places, solver=motion.solver, sigma=NOISE, **ALONE)


def draw(name: str, seeds: range, folder: Path) -> None:
    """Fit every seed that is not known yet."""
    folder.mkdir(parents=True, exist_ok=True)
    motion, known = MOTIONS[name], lines(folder, f"input_{name}")
    with (folder / f"input_{name}.{seeds.start}-{seeds.stop}.jsonl").open("a") as file:
        file.write("\n")  # ends what a killed process began
        for seed in seeds:
            if seed in known:
                continue
            recording, truth = drawn(motion, seed)
            began = time.process_time()
            found = fitted(motion, recording, True)
            seconds = time.process_time() - began
            plain = fitted(motion, recording, False)
            (course,) = found.result.over_time
            off = np.array(course.values) - truth
            value = motion.make(False).quantities[motion.fitted[0]].value
            entry = {
                "seed": seed,
                "seconds": seconds,
                "inside": int((np.abs(off) < np.array(course.half_widths)).sum()),
                "of": off.size,
                "off": float(np.sqrt(np.mean(off**2))),
                "left": float(np.mean(course.left)),
                "size": [course.size_lower, course.size, course.size_upper],
                "length": [course.length_lower, course.length, course.length_upper],
            }
            for key, fit in (("with", found), ("without", plain)):
                e = fit[motion.fitted[0]]
                holds = e.lower is not None and e.upper is not None and e.lower <= value <= e.upper
                fits = fit.result.misfit
                entry[key] = {
                    "holds": bool(holds),
                    "error": e.value / value - 1.0,
                    "verdict": e.verdict,
                    "chi_square": None if fits is None else fits.reduced_chi_square,
                    "warned": any("misses" in words for words in fit.result.warnings),
                }
            file.write(json.dumps(entry) + "\n")
            file.flush()


def table(folder: Path) -> None:
    """A row of Markdown for every motion that was drawn."""
    print(
        "| motion | draws | values of the input inside their intervals | share | prior variance left "
        "| stiffness inside | its rms error | without the input |"
    )
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    for name, motion in MOTIONS.items():
        known = list(lines(folder, f"input_{name}").values())
        if not known:
            continue
        inside, of = (sum(entry[key] for entry in known) for key in ("inside", "of"))
        holds = {key: sum(entry[key]["holds"] for entry in known) for key in ("with", "without")}
        error = 100 * np.sqrt(np.mean([entry["with"]["error"] ** 2 for entry in known]))
        off = 100 * np.median([abs(entry["without"]["error"]) for entry in known])
        warned = sum(entry["without"]["warned"] or entry["without"]["verdict"] != "identified" for entry in known)
        low, high = binomtest(holds["with"], len(known)).proportion_ci(method="exact")
        print(
            f"| {motion.about} | {len(known)} | {inside:,} of {of:,} | {100 * inside / of:.1f} % "
            f"| {100 * np.mean([e['left'] for e in known]):.0f} % "
            f"| {holds['with']} ({100 * low:.0f} to {100 * high:.0f} %) "
            f"| {error:.2g} % | {holds['without']} inside, {off:.2g} % off, {warned} warned |"
        )
        size = sum(e["size"][0] <= motion.size <= (e["size"][2] or np.inf) for e in known)
        length = sum(e["length"][0] <= motion.length <= (e["length"][2] or np.inf) for e in known)
        print(
            f"size inside {size}, length {length}; {np.median([e['seconds'] for e in known]):.1f} s of processor time"
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["draw", "table"])
    parser.add_argument("motion", nargs="?", choices=list(MOTIONS), default="rope")
    parser.add_argument("--seeds", nargs=2, type=int, default=(0, 20), metavar=("FIRST", "STOP"))
    parser.add_argument("--out", type=Path, default=OUT)
    given = parser.parse_args()
    if given.what == "table":
        table(given.out)
    else:
        draw(given.motion, range(*given.seeds), given.out)


if __name__ == "__main__":
    main()
