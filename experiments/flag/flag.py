"""A flag on a pole that turns on a hinge: writes the recording, and fits it under several draws of the noise.

    python experiments/flag/flag.py [--draws 10]

The truth is flag.toml with its published values, twice as many cells and substeps of 1/480 s. With --draws, each draw
is fitted and the intervals that hold the truth are counted; without, data/flag.npz is written, which is the first draw.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np
import sheetbend as sb
from sheetbend.config import build, parse
from sheetbend.config.scenes import build_scene

HERE = Path(__file__).parent
FINER, H = 2, 1 / 480  # s
RATE, SECONDS = 60, 2.0  # Hz, s
NOISE = 5e-4  # m, of each coordinate


def motion() -> tuple[list[str], np.ndarray]:
    """Names of the markers, and where they are without noise, (frames, markers, 3) m."""
    config = parse(HERE / "flag.toml")
    scene, _ = build_scene("truth", config.scene, None, {}, finer=FINER)
    frames = np.arange(round(RATE * SECONDS) + 1) / RATE
    found = sb.simulate(scene, frames, sb.Solver(h=H, method="newton", iterations=2), config.published)
    cloth, (section,) = scene.cloths["flag"], config.scene.cloth
    assert isinstance(section.markers, dict)
    on_cloth = cloth.mesh.at(list(section.markers.values())).positions(found.positions[:, cloth.particles])
    origin, frame = scene.bodies["pole"].pose(found)
    on_pole = [origin + frame @ np.array(marker.point) for marker in config.marker]
    names = [*section.markers, *(str(marker.marker) for marker in config.marker)]
    return names, np.concatenate([on_cloth, np.stack(on_pole, axis=1)], axis=1)


def recorded(names: list[str], clean: np.ndarray, draw: int) -> sb.Recording:
    """What cameras see of it."""
    noise = NOISE * np.random.default_rng(draw + 1).standard_normal(clean.shape)
    about = {
        "what": "SYNTHETIC: a flag on a pole that turns on a hinge, in a steady wind; no measurement",
        "true": parse(HERE / "flag.toml").published,
        "made_with": {"finer": FINER, "substep": H, "noise": NOISE, "seed": draw + 1},
        "units_of_values": "SI",
    }
    return sb.Recording(
        positions=np.round(clean + noise, 6),
        times=np.arange(len(clean)) / RATE,
        markers=tuple(names),
        name="flag",
        gravity=(0.0, 0.0, -9.81),
        metadata=about,
    )


def fitted(recording: sb.Recording) -> sb.Fit:
    """The fit of flag.toml to another recording."""
    config = parse(HERE / "flag.toml")
    with tempfile.TemporaryDirectory() as folder:
        recording.save(Path(folder) / "seen.npz")
        told = config.recording[0].model_copy(update={"file": str(Path(folder) / "seen.npz")})
        study = build(config.model_copy(update={"recording": [told]}), HERE)
        return sb.fit(study.experiments, parameters=study.parameters, **study.options)


def main(draws: int) -> None:
    names, clean = motion()
    if not draws:
        recorded(names, clean, 0).save(HERE / "data" / "flag.npz")
        return
    true = parse(HERE / "flag.toml").published
    inside = dict.fromkeys(true, 0)
    for draw in range(draws):
        found = fitted(recorded(names, clean, draw))
        for name, value in true.items():
            one = found[name]
            held = one.lower is not None and one.upper is not None and bool(one.lower <= value <= one.upper)
            inside[name] += held
            width = np.inf if one.half_width is None else one.half_width
            told = f"{name:16s} {value:7.4g}  fitted {one.value:9.5g} +- {width:8.2g}  {one.verdict}"
            print(f"draw {draw}: {told}{'' if held else '  <- outside'}")
        (row,) = found.result.recordings
        print(f"draw {draw}: held-out frames off by {1e3 * row.held_out:.2f} mm", flush=True)
    print(f"intervals that hold the truth, of {draws}: {inside}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--draws", type=int, default=0)
    main(parser.parse_args().draws)
