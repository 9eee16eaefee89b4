"""Fits held_cloth.toml to what the camera makes of one motion under many seeds, and counts which intervals hold the
truth.

    python experiments/held_cloth/seeds.py 50 out/held_cloth/study.json

The truth has 18 x 18 cells here. A seed takes some 6 s of processor time. What is in the JSON file already is kept, so
that the study can be stopped.
"""

from __future__ import annotations

import json
import sys
import tempfile
from pathlib import Path

import camera
import numpy as np
import sheetbend as sb
from sheetbend.config import build, parse

HERE = Path(__file__).parent
FINER = 3  # cells of the truth, as a real cloth has no mesh: intervals are about the limit of fine ones


def fitted(real: camera.Truth, seed: int) -> dict[str, object]:
    """The fit to one seed: estimates, half-widths, and errors on the frames that it did not see, m."""
    config = parse(HERE / "held_cloth.toml")
    with tempfile.TemporaryDirectory() as folder:
        camera.seen(real, seed).save(Path(folder) / "seen.npz")
        told = config.recording[0].model_copy(update={"file": str(Path(folder) / "seen.npz")})
        study = build(config.model_copy(update={"recording": [told]}), HERE)
        found = sb.fit(study.experiments, parameters=study.parameters, **study.options)
    (row,) = found.result.recordings
    (compared,) = found.comparisons
    held = compared.held_out
    clean = camera.exact(real, compared.recording.times[held] - camera.LATE)
    return {
        "converged": found.result.converged,
        "seconds": found.result.seconds,
        "parameters": {
            e.name: {"value": e.value, "interval": [e.lower, e.upper], "verdict": e.verdict}
            for e in found.result.estimates
        },
        "held_out": row.held_out,
        "without_physics": dict(row.without_physics),
        "noise": rms(compared.recording.positions[held] - clean),
        "against_truth": rms(compared.simulated[held] - clean),
    }


def rms(apart: np.ndarray) -> float:
    return float(np.sqrt((apart**2).sum(axis=-1).mean()))


def inside(one: dict[str, object], name: str, true: float) -> bool:
    """Whether an interval holds the truth; an open end holds all."""
    lower, upper = one["parameters"][name]["interval"]
    return (lower is None or lower <= true) and (upper is None or true <= upper)


def written(found: dict[str, dict[str, object]]) -> str:
    """JSON with a line for each seed and six digits."""
    lines = [f"{json.dumps(seed)}: {json.dumps(_short(one))}" for seed, one in found.items()]
    return "{\n" + ",\n".join(lines) + "\n}\n"


def _short(value: object) -> object:
    if isinstance(value, dict):
        return {key: _short(part) for key, part in value.items()}
    if isinstance(value, list):
        return [_short(part) for part in value]
    return float(f"{value:.6g}") if isinstance(value, float) else value


def summary(found: dict[str, dict[str, object]]) -> str:
    every = list(found.values())
    lines = [f"{len(every)} seeds, {sum(bool(one['converged']) for one in every)} converged"]
    for name, true in camera.TRUTH.items():
        held = sum(inside(one, name, true) for one in every)
        ends = [one["parameters"][name] for one in every]
        values = np.array([e["value"] for e in ends])
        widths = np.array([(e["interval"][1] - e["interval"][0]) / 2 for e in ends if None not in e["interval"]])
        verdicts = [e["verdict"] for e in ends]
        told = ", ".join(f"{verdicts.count(v)} {v}" for v in dict.fromkeys(verdicts))
        lines.append(
            f"  {name:18s} true {true:9.4g}  mean {values.mean():9.4g}  sd {values.std():8.2g}  "
            f"half-width {np.median(widths) if len(widths) else np.nan:8.2g}  holds {held}/{len(every)}  {told}"
        )
    for key in ("held_out", "noise", "against_truth"):
        lines.append(f"  {key}: {1e3 * np.mean([one[key] for one in every]):.2f} mm")
    carried = [min(one["without_physics"].values()) for one in every]
    lines.append(f"  strongest without physics: {1e3 * np.mean(carried):.1f} mm")
    return "\n".join(lines)


def main(seeds: int, path: Path) -> None:
    found = json.loads(path.read_text()) if path.exists() else {}
    path.parent.mkdir(parents=True, exist_ok=True)
    real = camera.truth(FINER)
    for seed in range(seeds):
        if str(seed) not in found:
            found[str(seed)] = fitted(real, seed)
            path.write_text(written(found))
        print(seed, f"{found[str(seed)]['seconds']:.0f} s", flush=True)
    print(summary(found))


if __name__ == "__main__":
    main(int(sys.argv[1]), Path(sys.argv[2]))
