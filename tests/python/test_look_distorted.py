"""Drafts of recordings that are distorted as those of laboratories are: the same draft, or the word that tells."""

from __future__ import annotations

import re
import tomllib
import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sheetbend as sb
import takes
from commands import run
from sheetbend.look import Take, draft, seen
from sheetbend.look.draft import _repeated

Array = np.ndarray
Table = tuple[Array, Array, list[str]]
EXPERIMENTS = Path(__file__).parents[2] / "experiments"
SHIPPED = {
    "beam": "beam/data/beam_gravity_b.npz",
    "two arms": "double_pendulum/data/pendulum_double_fit.npz",
    "pendulum": "pendulum/data/pendulum_single_fit.npz",
    "cloth": "cloth_in_wind/data/cloth_in_wind.npz",
    "two ends": "twin/data/twin.npz",
}
TAKES: dict[str, Callable[[], sb.Recording]] = {
    "hand": lambda: takes.rope_in_hand("body", seconds=2.0),
    "let go": lambda: takes.let_go(True),
    "toss": lambda: takes.toss(),
    "towel": lambda: takes.towel(True),
}


def size(r: sb.Recording) -> float:
    return float(np.linalg.norm(np.ptp(r.positions.reshape(-1, 3), axis=0)))


def room(r: sb.Recording, rng: np.random.Generator) -> Table:
    """Four marks of the room, which stay in place."""
    places = np.array([[1.5, 0.5, -0.5], [-1.2, 1.0, 0.3], [0.5, -1.5, 0.6], [2.0, 2.0, -0.8]])
    marks = r.positions.mean(axis=(0, 1)) + max(size(r), 0.5) * places
    x = np.broadcast_to(marks, (len(r.times), 4, 3)) + rng.normal(0.0, 3e-4, (len(r.times), 4, 3))
    return np.concatenate([r.positions, x], axis=1), r.times, [*r.markers, "floor", "wall", "camera", "table"]


def reflection(r: sb.Recording, rng: np.random.Generator) -> Table:
    """A marker that is somewhere else in every frame."""
    x = r.positions.mean(axis=(0, 1)) + size(r) * rng.normal(size=(len(r.times), 1, 3))
    return np.concatenate([r.positions, x], axis=1), r.times, [*r.markers, "ghost"]


def flash(r: sb.Recording, rng: np.random.Generator) -> Table:
    """A marker that is there for a tenth of the time, in one place."""
    x = np.full((len(r.times), 1, 3), np.nan)
    x[len(x) // 3 :][: len(x) // 10] = r.positions.mean(axis=(0, 1)) + 0.3 * size(r)
    return np.concatenate([r.positions, x], axis=1), r.times, [*r.markers, "ghost"]


def twice(r: sb.Recording, rng: np.random.Generator) -> Table:
    """A twentieth of the rows is written twice."""
    k = np.sort(np.concatenate([np.arange(len(r.times)), rng.choice(len(r.times), len(r.times) // 20, replace=False)]))
    return r.positions[k], r.times[k], list(r.markers)


def lost(r: sb.Recording, rng: np.random.Generator) -> Table:
    """All markers are lost for a twentieth of the time."""
    x = r.positions.copy()
    x[len(x) // 2 :][: max(3, len(x) // 20)] = np.nan
    return x, r.times, list(r.markers)


def dropped(r: sb.Recording, rng: np.random.Generator) -> Table:
    """A fifth of the frames is missing."""
    kept = np.flatnonzero(rng.random(len(r.times)) > 0.2)
    return r.positions[kept], r.times[kept], list(r.markers)


def unseen(r: sb.Recording, rng: np.random.Generator) -> Table:
    """A fifth of the samples is missing."""
    x = r.positions.copy()
    x[rng.random(x.shape[:2]) < 0.2] = np.nan
    return x, r.times, list(r.markers)


def shuffled(r: sb.Recording, rng: np.random.Generator) -> Table:
    """Markers without names, in another order."""
    k = rng.permutation(len(r.markers))
    return r.positions[:, k], r.times, [f"Marker_{j}" for j in range(len(k))]


def turned_over(r: sb.Recording, rng: np.random.Generator) -> Table:
    """z points down."""
    return r.positions * [1, 1, -1], r.times, list(r.markers)


def beside_another(r: sb.Recording, rng: np.random.Generator) -> Table:
    """Two of a kind in one file, which move differently."""
    other = r.positions[::-1] + np.array([0.0, 2.0 * size(r), 0.0]) + rng.normal(0.0, 2e-4, r.positions.shape)
    names = [f"{which}_{name}" for which in "ab" for name in r.markers]
    return np.concatenate([r.positions, other], axis=1), r.times, names


def outcome(folder: Path, table: Table) -> tuple[str, dict[str, Any]]:
    """What the command says of a table, and what it writes; nothing where it refuses."""
    x, t, names = table
    folder.mkdir()
    frames = [[s, *frame.ravel()] for s, frame in zip(t, x, strict=True)]
    rows = [",".join("" if np.isnan(cell) else f"{cell:.9g}" for cell in cells) for cells in frames]
    header = ",".join(["time", *(f"{name}_{axis}" for name in names for axis in "xyz")])
    (folder / "take.csv").write_text("\n".join([header, *rows]) + "\n")
    result = run("new", folder / "take.csv", "--output", folder / "draft.toml")
    assert result.exit_code in (0, 2), result.output
    found = folder / "draft.toml"
    return result.output, tomllib.loads(found.read_text()) if result.exit_code == 0 else {}


def object_in(content: dict[str, Any]) -> tuple[str, dict[str, Any]]:
    """The kind and the keys of what a draft describes."""
    kinds = ("rope", "rod", "cloth", "arm", "pendulum", "body")
    (kind,) = (kind for kind in kinds if kind in content["scene"])
    return kind, content["scene"][kind][0]


def lengths(own: dict[str, Any]) -> list[float]:
    mesh = own.get("mesh", {})
    return [own[k] for k in ("length",) if k in own] + [mesh[k] for k in ("width", "height") if k in mesh]


CASES = [
    *(
        (name, room)
        for name in ("beam", "cloth", "two ends", "hand", "let go", "toss", "towel", "pendulum", "two arms")
    ),
    *((name, reflection) for name in ("pendulum", "beam", "two ends", "hand", "let go", "toss", "towel")),
    *((name, flash) for name in ("beam", "hand")),
    *((name, twice) for name in ("beam", "pendulum", "two ends")),
    *((name, lost) for name in ("beam", "two ends", "let go")),
    *((name, dropped) for name in ("beam", "hand", "let go")),
    *((name, unseen) for name in ("beam", "two ends", "hand", "towel")),
    *((name, shuffled) for name in ("beam", "two ends", "let go")),
]


@pytest.mark.parametrize(("name", "distorted"), CASES, ids=[f"{name}, {d.__name__}" for name, d in CASES])
def test_a_distorted_recording_makes_the_same_draft(
    tmp_path: Path, name: str, distorted: Callable[[sb.Recording, np.random.Generator], Table]
) -> None:
    """Marks of the room made ropes of 3 m, and a reflection ropes of 4 m, without a word. A row that was there twice
    was refused, and frames without a marker made a rope of a beam."""
    recording = TAKES[name]() if name in TAKES else sb.Recording.load(EXPERIMENTS / SHIPPED[name])
    _, content = outcome(tmp_path / "plain", (recording.positions, recording.times, list(recording.markers)))
    said, other = outcome(tmp_path / "distorted", distorted(recording, np.random.default_rng(3)))
    assert other, said
    (kind, own), (other_kind, others) = object_in(content), object_in(other)
    assert other_kind == kind and len(others.get("markers", [])) == len(own.get("markers", []))
    assert lengths(others) == pytest.approx(lengths(own), rel=0.01)
    left_out = {room: "far from what moves, and left out", reflection: "left out", flash: "left out"}
    assert (left_out[distorted] in said) if distorted in left_out else "left out" not in said.split("not known")[0]


def test_frames_that_repeat_the_one_before_are_told(tmp_path: Path) -> None:
    """With times that count on, a pendulum's arm came out 12 % shorter, without a word."""
    r = sb.Recording.load(EXPERIMENTS / SHIPPED["two ends"])
    k = np.sort(np.concatenate([np.arange(len(r.times)), np.arange(20, len(r.times) - 10, 20)]))
    said, content = outcome(
        tmp_path / "again", (r.positions[k], r.times[0] + r.times[1] * np.arange(len(k)), [*r.markers])
    )
    told = re.search(r"(\d+) frames repeat the one before", said)
    assert content and told and 5 <= int(told[1]) <= len(k) - len(r.times)  # of a rope that hardly moves it is no sign
    said, _ = outcome(tmp_path / "plain", (r.positions, r.times, list(r.markers)))
    assert "repeat the one before" not in said


@pytest.mark.parametrize(("digit", "noise"), [(1e-4, 0.0), (1e-3, 0.0), (1e-3, 3e-4)])
def test_rounded_places_are_no_frames_that_repeat(digit: float, noise: float) -> None:
    """Slow motions that are written to the millimeter were said to have up to 90 frames of 600 twice."""
    t = np.arange(600) / 100
    for count, width in ((1, 0.003), (3, 0.003), (1, 0.02), (3, 0.02), (8, 0.02)):
        x = np.zeros((len(t), count, 3))
        x[..., 2] = -0.1 * np.arange(count)
        x[..., 0] = width * np.arange(1, count + 1) / count * np.sin(6.0 * t)[:, None]
        x[..., 0] += np.random.default_rng(1).normal(0.0, noise, x.shape[:2])
        assert not _repeated(seen(sb.Recording(digit * np.round(x / digit), t)))


def test_one_frame_is_looked_at_without_a_warning(tmp_path: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = draft([Take(seen(sb.Recording.load(EXPERIMENTS / "wires/data/black_1.npz")), "wire.npz")], "wire")
    assert found.kind == "a rope at rest"


def test_a_marker_that_jumps_is_no_exchange_with_an_end_of_the_line() -> None:
    """Nothing but its neighbor was near an end of the line, so the place to which a marker jumps fitted there."""
    t = np.arange(120) / 10
    x = np.zeros((120, 6, 3))
    x[..., 0] = 0.1 * np.arange(6) + 0.05 * np.sin(2.0 * t)[:, None]
    x += np.random.default_rng(1).normal(0.0, 1e-3, x.shape)
    x[40:45, 4] += 0.3
    assert not any("label" in words for words in sb.Recording(x, t).mended().mends)


def test_what_hangs_or_falls_tells_which_way_is_up(tmp_path: Path) -> None:
    """With z down, a rope in a hand stood on its hand, and a body that was tossed was taken for a rope."""
    rng = np.random.default_rng(3)
    for name in ("hand", "toss"):
        said, content = outcome(tmp_path / name, turned_over(TAKES[name](), rng))
        assert content["scene"]["gravity"] == [0.0, 0.0, 9.81] and "-z points up, as the motion shows" in said
        assert ("give --up z if it stands there" in said) == (name == "hand")
    ropes = [takes.let_go(False), takes.let_go(True), takes.rope_in_hand("one", 1.5)]
    for k, rope in enumerate([*ropes, sb.Recording.load(EXPERIMENTS / SHIPPED["two ends"])]):
        x, t, names = dropped(rope, rng)
        x, t, names = turned_over(sb.Recording(x, t, tuple(names)), rng)
        x[rng.random(x.shape[:2]) < 0.1] = np.nan
        said, content = outcome(tmp_path / f"rope {k}", (x, t, names))
        assert content["scene"]["gravity"] == [0.0, 0.0, 9.81] and "-z points up, as the motion shows" in said
        (held,) = content["scene"].get("rod", []) + content["scene"].get("rope", [])
        assert held.get("pinned") == [0] or "clamp_start" in held or held["grip"][0]["markers"] == names[:1]
    said, content = outcome(tmp_path / "cloth", turned_over(replace(takes.cloth(1.0), gravity=None), rng))
    assert content["scene"]["gravity"] == [0.0, 0.0, 9.81] and content["scene"]["cloth"][0]["pinned"] == ["top"]
    pendulum = sb.Recording.load(EXPERIMENTS / SHIPPED["pendulum"])
    said, content = outcome(tmp_path / "pendulum", turned_over(pendulum, rng))
    assert not content and "hang upward" in said and "r.positions * [1, -1, -1]" in said


@pytest.mark.parametrize("name", ["two ends", "hand", "let go"])
def test_two_ropes_in_one_file_are_refused_with_the_markers_of_one(tmp_path: Path, name: str) -> None:
    """Where both swing in parallel planes far from each other, they were one rope of 4 m, without a word."""
    recording = TAKES[name]() if name in TAKES else sb.Recording.load(EXPERIMENTS / SHIPPED[name])
    said, content = outcome(tmp_path / "two", beside_another(recording, np.random.default_rng(3)))
    assert not content and "two ropes" in said and "--markers" in said


def side_by_side(one: sb.Recording, other: sb.Recording, off: tuple[float, float, float]) -> Table:
    """Two recordings as one, the second one's markers beside those of the first."""
    count = min(len(one.times), len(other.times))
    noise = np.random.default_rng(3).normal(0.0, 1e-5, other.positions[:count].shape)
    x = np.concatenate([one.positions[:count], other.positions[:count] + noise + off], axis=1)
    return x, one.times[:count], [*(f"a_{name}" for name in one.markers), *(f"b_{name}" for name in other.markers)]


@pytest.mark.parametrize(
    ("one", "other", "off", "what"),
    [
        ("toss", "toss", (0.5, 0.3, 0.0), "two rigid bodies"),
        ("beam", "beam", (0.0, 0.2, 0.0), "two rigid bodies"),
        ("toss", "beam", (1.0, 0.0, 0.0), "two rigid bodies"),
        ("hand", "hand", (0.0, 0.3, 0.0), "two ropes"),
        ("let go", "let go", (0.0, 0.2, 0.0), "two ropes"),
        ("towel", "let go", (1.0, 0.0, 0.0), "two objects: ropes and cloths"),
        ("let go", "beam", (0.0, 0.6, 0.0), "two objects: ropes and beams"),
    ],
)
def test_two_objects_are_refused_with_the_patterns_of_each(
    tmp_path: Path, one: str, other: str, off: tuple[float, float, float], what: str
) -> None:
    """Two tosses and two ropes in one hand were drafted as one rope. Two beams were no sheet "with neighbors on all
    sides"."""
    recordings = {name: made() for name, made in (TAKES | {"beam": takes.beam}).items() if name in (one, other)}
    said, content = outcome(tmp_path / "two", side_by_side(recordings[one], recordings[other], off))
    said = " ".join(said.split())
    assert not content and f"are those of {what}" in said
    assert "'a*'" in said and "'b*'" in said
    result = run("new", tmp_path / "two/take.csv", "--output", tmp_path / "one.toml", "--markers", "a*")
    assert result.exit_code == 0, result.output


def test_holders_of_a_cloth_without_names_are_no_part_of_it(tmp_path: Path) -> None:
    """A marker on each of two grippers was taken for the upper row of a cloth that is 0.075 m too wide."""
    towel = takes.towel(True)
    _, content = outcome(tmp_path / "towel", (towel.positions, towel.times, [f"m{k}" for k in range(27)]))
    (cloth,) = content["scene"]["cloth"]
    assert cloth["mesh"]["width"] == pytest.approx(0.4, rel=0.01) and len(cloth["markers"]) == 25
    assert {name for grip in cloth["grip"] for name in grip["markers"]} == {"m25", "m26"}


def test_a_beam_in_noise_of_3_mm_is_a_beam(tmp_path: Path) -> None:
    """The noise of its distance from the clamp was taken for motion: the clamp was left out, and its end was a rope."""
    beam = takes.beam()
    x = beam.positions + np.random.default_rng(1).normal(0.0, 3e-3, beam.positions.shape)
    said, content = outcome(tmp_path / "noisy", (x, beam.times, list(beam.markers)))
    assert "a beam clamped at one end" in said and content["scene"]["rope"][0]["name"] == "beam"


def test_a_beam_that_is_seen_too_late_is_no_rope(tmp_path: Path) -> None:
    """Its last second was drafted as a rope through the markers of its clamp."""
    beam = takes.beam()
    said, content = outcome(tmp_path / "late", (beam.positions[400:], beam.times[:-400], list(beam.markers)))
    assert not content and "do not move like a rope, beam" in said
