"""Fits of drafts of strongly distorted recordings, beside those of the recordings as they were.

    python tests/python/distorted_fits.py FOLDER [NAME ...]

drafts and fits each recording twice with the command line, without refits and profiles, and prints the values of the
parameters of both, with how far they are apart in half-widths of both. `docs/drafts.md` has the result.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import sheetbend as sb
import takes
from test_look_distorted import EXPERIMENTS, SHIPPED, Table, dropped, reflection, room

SEED = 7
LOST = 0.1  # of the samples
QUICK = "\n[fit]\nhalve_step = false\ndouble_segments = false\nprofiles = false\n"
HANDS = ("hand", "grip")
ROPE = ["--density", "0.05"]
OBJECTS: dict[str, tuple[Callable[[], sb.Recording], list[str]]] = {
    "pendulum": (lambda: sb.Recording.load(EXPERIMENTS / SHIPPED["pendulum"]), []),
    "beam": (lambda: takes.beam(3.0), ["--length", "0.3", "--density", "0.4"]),
    "toss": (takes.toss, []),
    "let go": (lambda: takes.let_go(True), ROPE),
    "pinned": (lambda: takes.let_go(False), ROPE),
    "twin": (lambda: sb.Recording.load(EXPERIMENTS / SHIPPED["two ends"]), ROPE),
    "two": (lambda: takes.rope_in_hand("two", 2.0), ROPE),
    "one": (lambda: takes.rope_in_hand("one", 1.5), ROPE),
    "body": (lambda: takes.rope_in_hand("body", 2.0), ROPE),
    "cloth": (lambda: takes.cloth(1.0), ["--density", "0.2"]),
}
UPRIGHT = ("pendulum", "beam", "toss")  # do not tell, or are described, with z up


def strong(name: str, r: sb.Recording) -> Table:
    """Four marks of the room, a reflection, a fifth of the frames and a tenth of the samples lost, markers without
    names in another order, millimeters, and z down where the object tells."""
    rng = np.random.default_rng(SEED)
    for how in (room, reflection):
        x, t, names = how(r, rng)
        r = sb.Recording(x, t, tuple(names))
    x, t, names = dropped(r, rng)
    x = np.where(rng.random(x.shape[:2])[..., None] < LOST, np.nan, x)
    order = rng.permutation(len(names))
    kept = [names[k] if any(word in names[k] for word in HANDS) else f"Marker_{j}" for j, k in enumerate(order)]
    return 1e3 * x[:, order] * [1, 1, 1 if name in UPRIGHT else -1], t, kept


def fitted(folder: Path, table: Table, options: list[str]) -> dict[str, dict[str, float]]:
    """The parameters of `sheetbend new` and `sheetbend fit`; none where either refuses."""
    x, t, names = table
    folder.mkdir(parents=True, exist_ok=True)
    rows = [
        ",".join([f"{s:.9g}", *("" if np.isnan(v) else f"{v:.9g}" for v in row)])
        for s, row in zip(t, x.reshape(len(t), -1), strict=True)
    ]
    header = ",".join(["time", *(f"{name}_{axis}" for name in names for axis in "xyz")])
    (folder / "take.csv").write_text("\n".join([header, *rows]) + "\n")
    draft, command = folder / "take.toml", [sys.executable, "-m", "sheetbend"]
    draft.unlink(missing_ok=True)
    said = subprocess.run([*command, "new", folder / "take.csv", *options, "-o", draft], capture_output=True, text=True)
    if not draft.is_file():
        print(said.stdout + said.stderr)
        return {}
    if "\n[fit]" not in draft.read_text():
        draft.write_text(draft.read_text() + QUICK)
    subprocess.run([*command, "fit", draft, "--output", folder / "out"], capture_output=True, text=True)
    found: dict[str, dict[str, float]] = json.loads((folder / "out/fit.json").read_text())["parameters"]
    return found


def main() -> None:
    folder, only = Path(sys.argv[1]), sys.argv[2:]
    for name, (make, options) in OBJECTS.items():
        if only and name not in only:
            continue
        r = make()
        plain = fitted(folder / f"{name} plain", (r.positions, r.times, list(r.markers)), options)
        other = fitted(folder / f"{name} strong", strong(name, r), [*options, "--units", "mm"])
        for key, a in plain.items():
            b = other.get(key)
            if b is not None:
                both = float(np.hypot(a["half_width"] or np.nan, b["half_width"] or np.nan))
                off = abs(a["value"] - b["value"]) / both
                print(f"{name:10}{key:22}{a['value']:12.5g}{b['value']:12.5g}{off:8.2f}", flush=True)


if __name__ == "__main__":
    main()
