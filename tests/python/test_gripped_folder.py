"""Folders of gripped ropes as strangers may have them: each is read with a note on what was done, or refused with the
file and the fix, before any work."""

from __future__ import annotations

import gzip
import io
import json
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sheetbend.cli.gripped import RopeData, load_ropes
from sheetbend.config import parse_any
from sheetbend.errors import ConfigError

Array = np.ndarray
FRAMES, COUNT, RATE = 200, 12, 100
CONFIG = """\
[experiment]
name = "rope"
about = "a rope of a stranger"

[[gripped_rope]]
name = "rope"
train = "train"
eval = "eval"
"""


def swinging(number: int) -> Array:
    """(frames, markers, 3) m: a rope with uneven links that sags and swings between two moving grips, 3 cm long."""
    rng = np.random.default_rng(number)
    t = np.arange(FRAMES)[:, None] / RATE
    places = np.concatenate([[0.0], np.cumsum([0.08, 0.11, 0.07, 0.10, 0.12, 0.09, 0.08, 0.13, 0.10])])
    s = np.concatenate([[-0.03], places, [places[-1] + 0.03]]) - places[-1] / 2
    inside = np.clip(s, -places[-1] / 2, places[-1] / 2)
    curvature = 2.0 + 0.4 * np.sin(3.0 * t + number)
    angle, beyond = curvature * inside, s - inside
    x = np.sin(angle) / curvature + beyond * np.cos(angle)
    z = (1.0 - np.cos(angle)) / curvature + beyond * np.sin(angle)
    positions = np.stack([x, 0.2 * np.sin(4.0 * t + number) + 0.0 * x, z], axis=-1)
    return positions + 3e-4 * rng.standard_normal(positions.shape)


TRAIN = {f"{k:02d}": swinging(k) for k in range(5)}
EVAL = {"00": swinging(50), "01": swinging(51)}


def pickled(positions: Array, protocol: int = 4) -> bytes:
    return pickle.dumps([frame.T.tolist() for frame in positions], protocol=protocol)


class Folder:
    """A rope's folder, which a variant changes."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.config = CONFIG
        for part, all_of_it in (("train", TRAIN), ("eval", EVAL)):
            for name, positions in all_of_it.items():
                self.put(f"{part}/{name}.pkl", pickled(positions))

    def put(self, name: str, content: bytes) -> int:
        path = self.root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        return path.write_bytes(content)

    def each(self, change: Callable[[Array], object], only: tuple[str, ...] = (), suffix: str = "pkl") -> None:
        """Write the recordings of both parts anew, or some of `train`."""
        for part, all_of_it in (("train", TRAIN), ("eval", EVAL)):
            for name, positions in all_of_it.items():
                if not only or (part == "train" and name in only):
                    changed = change(positions)
                    content = changed if isinstance(changed, bytes) else pickle.dumps(changed)
                    (self.root / f"{part}/{name}.pkl").unlink(missing_ok=True)
                    self.put(f"{part}/{name}.{suffix}", content)

    def loaded(self) -> RopeData:
        (self.root / "rope.toml").write_text(self.config)
        config: Any = parse_any(self.root / "rope.toml")
        (rope,) = load_ropes(config, self.root)
        return rope


def frames(positions: Array) -> Array:
    return np.ascontiguousarray(positions.transpose(0, 2, 1))


def timed(positions: Array) -> Array:
    times = np.arange(FRAMES) / 120.0
    return np.concatenate([frames(positions), np.broadcast_to(times[:, None, None], (FRAMES, 1, COUNT))], axis=1)


def without(positions: Array, markers: int | list[int] | slice, seconds: slice = slice(None)) -> list[Any]:
    changed = positions.copy()
    changed[seconds, markers] = np.nan
    return frames(changed).tolist()


def npy(positions: Array) -> bytes:
    buffer = io.BytesIO()
    np.save(buffer, positions)
    return buffer.getvalue()


def npz(positions: Array) -> bytes:
    buffer = io.BytesIO()
    np.savez(buffer, positions=positions, times=np.arange(FRAMES) / RATE)
    return buffer.getvalue()


def table(positions: Array) -> bytes:
    header = ",".join(["time", *(f"m{k}_{axis}" for k in range(COUNT) for axis in "xyz")])
    rows = np.column_stack([np.arange(FRAMES) / RATE, positions.reshape(FRAMES, -1)])
    return "\n".join([header, *(",".join(f"{v:.9g}" for v in row) for row in rows)]).encode()


def swapped(positions: Array) -> list[Any]:
    changed = positions.copy()
    changed[120:, [0, 1, 10, 11]] = positions[120:, [11, 10, 1, 0]]
    return frames(changed).tolist()


GRIPS_FIRST = [0, 1, 10, 11, *range(2, 10)]
GRIPS_LAST = [*range(2, 10), 0, 1, 11, 10]
ASSUMED = "no rate is told: 100 frames per second are assumed"
LEFT = "01 is left out: "


def beside(folder: Folder, **said: object) -> None:
    for part in ("train", "eval"):
        folder.put(f"{part}.json", json.dumps(said).encode())


def clamped(folder: Folder) -> None:
    folder.config += "clamped = [0, 1, 10, 11]\n"
    beside(folder, rate=100)


# name -> (change, recordings that are used, words of the notes; without words there is no note)
READ: dict[str, tuple[Callable[[Folder], object], int, tuple[str, ...]]] = {
    "as it is": (lambda f: None, 5, (ASSUMED,)),
    "a rate beside the folder": (lambda f: beside(f, rate=100), 5, ()),
    "axes (markers, 3, frames)": (lambda f: f.each(lambda x: x.transpose(1, 2, 0).tolist()), 5, ("its axes are",)),
    "axes (frames, markers, 3)": (lambda f: f.each(lambda x: x), 5, ("its axes are (frames, markers, coordinates)",)),
    "axes (3, markers, frames)": (lambda f: f.each(lambda x: x.transpose(2, 1, 0).copy()), 5, ("its axes are",)),
    "axes (markers, frames, 3) in one": (
        lambda f: f.each(lambda x: x.transpose(1, 0, 2).tolist(), ("01",)),
        5,
        ("01: its axes are (markers, frames, coordinates)",),
    ),
    "times as a fourth row": (lambda f: f.each(timed), 5, ("the row of number 3 beside its coordinates",)),
    "frames that are None": (
        lambda f: f.each(lambda x: [None if k in (40, 41) else v.tolist() for k, v in enumerate(frames(x))], ("01",)),
        5,
        ("01: 2 of 200 frames hold nothing",),
    ),
    "frames that are empty": (
        lambda f: f.each(lambda x: [[] if k == 40 else v.tolist() for k, v in enumerate(frames(x))], ("01",)),
        5,
        ("01: 1 of 200 frames hold nothing",),
    ),
    "frames of NaN": (lambda f: f.each(lambda x: without(x, slice(None), slice(40, 44)), ("01",)), 5, (ASSUMED,)),
    "frames that are missing": (
        lambda f: f.each(lambda x: np.delete(frames(x), [80, 150], axis=0), ("01",)),
        5,
        ("01: 2 frames were lost",),
    ),
    "a marker lost in one file": (lambda f: f.each(lambda x: without(x, 5), ("01",)), 4, ("it has 11 markers",)),
    "a marker lost in all files": (lambda f: f.each(lambda x: without(x, 5)), 5, ("m5 of 12 markers is never seen",)),
    "a grip lost in one file": (lambda f: f.each(lambda x: without(x, [0, 1]), ("01",)), 4, (LEFT, "not two grips")),
    "grips first": (lambda f: f.each(lambda x: frames(x[:, GRIPS_FIRST])), 5, ("its markers are in the order",)),
    "grips last": (lambda f: f.each(lambda x: frames(x[:, GRIPS_LAST])), 5, ("its markers are in the order",)),
    "free markers shuffled in one": (
        lambda f: f.each(lambda x: frames(x[:, [0, 1, 7, 3, 9, 2, 6, 4, 8, 5, 10, 11]]), ("01",)),
        5,
        ("01: its markers are in the order m0, m1, m5, m3,",),
    ),
    "markers the other way round in one": (
        lambda f: f.each(lambda x: frames(x[:, ::-1]), ("01",)),
        5,
        ("01: its markers run against those of the others",),
    ),
    "grips swapped from mid-file": (lambda f: f.each(swapped, ("01",)), 5, ("m0, m1, m10 and m11 exchange",)),
    "millimeters": (lambda f: f.each(lambda x: frames(1e3 * x).tolist()), 5, ("its lengths are divided by 1000",)),
    "centimeters": (lambda f: f.each(lambda x: frames(1e2 * x)), 5, ("its lengths are divided by 100",)),
    "whole millimeters": (
        lambda f: f.each(lambda x: frames(np.rint(1e3 * x).astype(int)).tolist()),
        5,
        ("its lengths are divided by 1000",),
    ),
    "millimeters in one": (lambda f: f.each(lambda x: frames(1e3 * x), ("01",)), 5, ("01: its lengths are divided",)),
    "inches in one": (
        lambda f: f.each(lambda x: frames(x / 0.0254), ("01",)),
        5,
        ("01: its lengths are divided by 39.3701",),
    ),
    "a rope of 22 m": (lambda f: f.each(lambda x: frames(25.0 * x)), 5, ("its lengths are divided by 100",)),
    "a rope of 22 m, and meters told beside the folder": (
        lambda f: (f.each(lambda x: frames(25.0 * x)), beside(f, units="m", rate=100)),
        5,
        (),
    ),
    "a rope of 22 m, and meters told beside the files": (
        lambda f: (
            f.each(lambda x: frames(25.0 * x)),
            [f.put(f"{part}/{k}.json", b'{"units": "m", "rate": 100}') for part in ("train", "eval") for k in TRAIN],
        ),
        5,
        (),
    ),
    "NPZ in millimeters": (
        lambda f: (f.each(lambda x: npz(1e3 * x), suffix="npz"), clamped(f)),
        5,
        ("its lengths are divided by 1000",),
    ),
    "millimeters told beside the folder": (
        lambda f: (f.each(lambda x: frames(1e3 * x)), beside(f, units="mm", rate=100)),
        5,
        (),
    ),
    "y up in one": (lambda f: f.each(lambda x: frames(x[:, :, [1, 2, 0]]), ("01",)), 4, (LEFT, "another axis")),
    "one file empty": (lambda f: f.put("train/01.pkl", b""), 4, ("01.pkl is left out: it is empty",)),
    "one file cut off": (
        lambda f: f.put("train/01.pkl", pickled(TRAIN["01"])[:5000]),
        4,
        ("01.pkl is left out: it is not a pickle, or a damaged one",),
    ),
    "one file of text": (lambda f: f.put("train/01.pkl", b"see the other folder"), 4, ("01.pkl is left out",)),
    "files of the system": (
        lambda f: [f.put(f"train/{name}", b"?") for name in (".DS_Store", "._01.pkl", "README.md", "desktop.ini")],
        5,
        (ASSUMED,),
    ),
    "a folder of MATLAB files beside them": (
        lambda f: f.put("train/all.mat", b"?"),
        5,
        ("all.mat is left out: it is of a kind that is not read",),
    ),
    "a folder between": (
        lambda f: [
            f.put(f"train/monday/{name}", path.read_bytes()) and path.unlink()
            for name in (f"{k}.pkl" for k in TRAIN)
            for path in [f.root / "train" / name]
        ],
        5,
        ("is read from monday, below the folder that is given",),
    ),
    "two files alike": (
        lambda f: f.put("train/09.pkl", pickled(TRAIN["01"])),
        5,
        ("09 is left out: it has the same positions as 01",),
    ),
    "an unseen file that was fitted": (
        lambda f: f.put("eval/09.pkl", pickled(TRAIN["01"])),
        5,
        ("09 of eval has the same positions as 01 of train",),
    ),
    "NPY": (lambda f: (f.each(npy, suffix="npy"), clamped(f)), 5, ()),
    "NPY of (frames, 3, markers)": (
        lambda f: (f.each(lambda x: npy(frames(x)), suffix="npy"), clamped(f)),
        5,
        ("its axes are",),
    ),
    "NPZ": (lambda f: (f.each(lambda x: npz(x), suffix="npz"), clamped(f)), 5, ()),
    "CSV": (lambda f: (f.each(table, suffix="csv"), clamped(f)), 5, ()),
    "dicts with times": (
        lambda f: f.each(lambda x: {"positions": x, "time": np.arange(FRAMES) / RATE, "who": "me"}),
        5,
        ("its axes are",),
    ),
    "single precision": (lambda f: f.each(lambda x: frames(x).astype(np.float32)), 5, (ASSUMED,)),
    "files of different lengths": (lambda f: f.each(lambda x: frames(x)[:170], ("01", "03")), 5, (ASSUMED,)),
    "a file of another rate": (
        lambda f: (f.each(lambda x: frames(x)[::2], ("01",)), f.put("train/01.json", b'{"rate": 50}')),
        5,
        ("00, 02, 03 and 1 more: " + ASSUMED,),
    ),
    "another origin in each file": (lambda f: f.each(lambda x: frames(x + x[0, 5, 0] * 100)), 5, (ASSUMED,)),
    "a still recording": (lambda f: f.each(lambda x: frames(x[:1].repeat(FRAMES, axis=0)), ("01",)), 5, (ASSUMED,)),
    "a recording of ten frames": (lambda f: f.each(lambda x: frames(x)[:10], ("01",)), 5, (ASSUMED,)),
    "a marker more in one file": (
        lambda f: f.each(lambda x: frames(np.concatenate([x[:, :6], x[:, 5:]], axis=1)), ("01",)),
        4,
        ("01 is left out: markers of 01 are at the same place throughout",),
    ),
    **{
        f"pickles of protocol {k}": (lambda f, k=k: f.each(lambda x: pickle.dumps(frames(x), k)), 5, (ASSUMED,))
        for k in (0, 2, 5)
    },
}


@pytest.mark.parametrize("name", READ)
def test_a_folder_is_read_with_a_note_on_what_was_done(tmp_path: Path, name: str) -> None:
    change, count, words = READ[name]
    folder = Folder(tmp_path)
    change(folder)
    rope = folder.loaded()
    assert len(rope.train) == count, rope.train.notes
    said = "\n".join([*rope.train.notes, *rope.unseen.notes])
    for word in words:
        assert word in said, said
    assert bool(said) == bool(words), said


REFUSED: dict[str, tuple[Callable[[Folder], object], str, str]] = {
    "packed": (
        lambda f: f.each(lambda x: gzip.compress(pickled(x)), suffix="pkl.gz"),
        "00.pkl.gz is of a kind that is not read",
        "gunzip",
    ),
    "MATLAB": (lambda f: f.each(lambda x: b"MATLAB 5.0", suffix="mat"), "00.mat is of a kind", "np.savez"),
    "all in one": (
        lambda f: f.each(lambda x: np.stack([frames(x)] * 3)),
        "00.pkl must have the shape (frames, 3, markers)",
        "store each in a file of its own",
    ),
    "rows of all coordinates": (
        lambda f: f.each(lambda x: x.reshape(FRAMES, -1)),
        "00.pkl must have the shape (frames, 3, markers)",
        "reshape(len(x), -1, 3)",
    ),
    "validation called test": (
        lambda f: (f.root / "eval").rename(f.root / "test"),
        "is not a folder",
        "holds test, train",
    ),
    "sessions": (
        lambda f: (
            [f.put(f"eval/{s}/00.pkl", pickled(TRAIN["00"])) for s in ("a", "b")]
            and [(f.root / f"eval/{n}.pkl").unlink() for n in EVAL]
        ),
        "holds no recording",
        '"*/*"',
    ),
    "a folder of nothing": (lambda f: f.each(lambda x: b"", suffix="txt"), "holds no recording", ".pkl"),
    "objects": (lambda f: f.each(lambda x: {"left": frames(x), "right": frames(x)}), "several arrays", '"positions"'),
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_folder_is_refused_with_its_file_and_the_fix(tmp_path: Path, name: str) -> None:
    change, problem, fix = REFUSED[name]
    folder = Folder(tmp_path)
    change(folder)
    with pytest.raises(ConfigError) as caught:
        folder.loaded()
    assert problem in f"{caught.value.field} {caught.value.problem}" and fix in caught.value.fix, caught.value
