"""What `fuzz.py` feeds to which reader: small files of every format, as tests write and experiments ship them."""

from __future__ import annotations

import random
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import fuzz_seeds
import numpy as np
import sheetbend as sb
from fuzz_seeds import Files
from mutations import database, json_tree, mutated, packed, toml_tree
from sheetbend import config
from sheetbend.cli.gripped import load_ropes
from sheetbend.config.fabric_tests import load_fabric_tests
from sheetbend.files.door import reading
from sheetbend.files.names import flaw
from sheetbend.problem import journal
from sheetbend.scene.scene_reader import MAGIC, PREFIX, VERSION
from sheetbend.textile import read_curves, read_outline


@dataclass(frozen=True)
class Target:
    """A reader, what is fed to it (the first file of each seed is mutated), and how."""

    seeds: Callable[[Path], list[Files]]
    read: Callable[[Path], object]
    mutate: Callable[[random.Random, bytes, list[bytes]], bytes]


def _recording(path: Path) -> None:
    found = sb.Recording.load(path)
    assert flaw(found.name) is None and np.isfinite(found.times).all()
    found.summary()


def _beside(path: Path) -> None:
    _recording(next(p for p in path.parent.iterdir() if p.suffix in (".npz", ".pkl")))


def _configuration(path: Path) -> None:
    found = config.parse_any(path)
    if isinstance(found, config.GrippedConfig):
        with reading(path, sb.ConfigError):
            load_ropes(found, path.parent)
    elif config.load(path).experiments == ():
        with reading(path, sb.ConfigError):
            config.scene_alone(found, path.parent)


def _fit(path: Path) -> None:
    sb.FitResult.load(path).report()


def _curve(path: Path) -> None:
    read_curves(path, length=0.2, width="Width")


def _cloud(path: Path) -> None:
    sb.Cloud.load(path).summary()


def _many(path: Path) -> None:
    sb.ManyFit.load(path.with_suffix(".json")).report()


def _outline(path: Path) -> None:
    found = read_outline(path, units="mm", width=0.3)
    assert found.area >= 0.0 and found.nodes >= 2


def _scene_with_fabric(path: Path) -> None:
    config.parse(path.with_name("flag.toml"))


def _scene(path: Path) -> None:
    assert sb.load_scene(path).compiled


def _journal(path: Path) -> None:
    """What it holds counts only with its bits."""
    try:
        with journal.Journal(path, {"[fit]": "abc"}):
            assert fuzz_seeds.evaluated() == _evaluated_without()
    finally:
        for end in ("-wal", "-shm"):
            path.with_name(path.name + end).unlink(missing_ok=True)


@cache
def _evaluated_without() -> list[bytes]:
    kept = journal._current.set(None)
    try:
        return fuzz_seeds.evaluated()
    finally:
        journal._current.reset(kept)


def sealed(rng: random.Random, content: bytes, others: list[bytes]) -> bytes:
    """A scene file changed anywhere or, with its checksum and length right again, in its header or its arrays."""
    if rng.random() < 0.3:
        return mutated(rng, content, others)
    end = PREFIX.size + PREFIX.unpack_from(content)[-1]
    header, arrays = content[PREFIX.size : end], content[end:]
    if rng.random() < 0.6:
        header = json_tree(rng, header, [header])
        header += b" " * (-len(header) % 8)
    else:
        arrays = mutated(rng, arrays, [arrays])
    return PREFIX.pack(MAGIC, VERSION, zlib.crc32(header + arrays), len(header)) + header + arrays


TARGETS: dict[str, Target] = {
    "csv": Target(fuzz_seeds.csv, _recording, mutated),
    "mocap": Target(fuzz_seeds.mocap, _recording, mutated),
    "trc": Target(fuzz_seeds.trc, _recording, mutated),
    "npz": Target(fuzz_seeds.npz, _recording, packed),
    "npy": Target(fuzz_seeds.npy, _recording, mutated),
    "pickle": Target(fuzz_seeds.pickles, _recording, mutated),
    "c3d": Target(fuzz_seeds.c3d, _recording, mutated),
    "json": Target(fuzz_seeds.sidecar, _beside, json_tree),
    "toml": Target(fuzz_seeds.toml, _configuration, toml_tree),
    "fit": Target(fuzz_seeds.fits, _fit, json_tree),
    "mesh": Target(fuzz_seeds.meshes, sb.read_mesh, mutated),
    "curve": Target(fuzz_seeds.curves, _curve, mutated),
    "cloud": Target(fuzz_seeds.clouds, _cloud, packed),
    "solid": Target(fuzz_seeds.solids, sb.mesh.read_solid, mutated),
    "outline": Target(fuzz_seeds.outlines, _outline, mutated),
    "fabric": Target(fuzz_seeds.fabrics, _scene_with_fabric, toml_tree),
    "fabric_tests": Target(fuzz_seeds.fabric_tests, load_fabric_tests, toml_tree),
    "many": Target(fuzz_seeds.many, _many, json_tree),
    "many_table": Target(fuzz_seeds.tables_of_many, _many, mutated),
    "poses": Target(fuzz_seeds.poses, sb.Tool.load, mutated),
    "scene": Target(fuzz_seeds.scenes, _scene, sealed),
    "forces": Target(fuzz_seeds.forces, sb.ForceRecording.load, mutated),
    "journal": Target(fuzz_seeds.journals, _journal, database),
}
