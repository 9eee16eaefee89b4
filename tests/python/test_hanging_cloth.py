"""A cloth that is first seen hanging, its markers in no order: the layout finds their places, the shape its start."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.config import load
from sheetbend.errors import ConfigError, MeshError

WIDTH, HEIGHT = 0.4, 0.3
LAYOUT = np.array([(x, y) for y in (0.03, 0.15, 0.27) for x in (0.03, 0.15, 0.27, 0.37)])
ORDER = np.random.default_rng(2).permutation(len(LAYOUT))
CORNERS = np.array([[0.0, HEIGHT], [WIDTH, HEIGHT]])


def hanging(at: np.ndarray) -> np.ndarray:
    """(k, 3) m, y up, where material points (k, 2) hang: between hands that are nearer than the width, in a bulge."""
    u, v = at.T
    fold = 0.03 * np.sin(np.pi * u / WIDTH) * (1 - 0.5 * v / HEIGHT)
    return np.column_stack([0.2 + 0.97 * u, 1.0 + v - 0.05 * np.sin(np.pi * u / WIDTH), fold])


TOWEL = f"""
[experiment]
name = "towel"

[solver]
method = "newton"
substeps = 2

[[scene.cloth]]
density = 0.3
warp = 300.0
shear = 30.0
bending = 5e-5
membrane_damping = 3e-3
drag_linear = 0.3
origin = [0.2, 1.0, 0.0]
y_axis = [0, 1, 0]
nearest_at = 0.0
shape = "recording"
markers = {{ left = [0.0, {HEIGHT}], right = [{WIDTH}, {HEIGHT}] }}
layout = {LAYOUT.tolist()}

[scene.cloth.mesh]
kind = "grid"
width = {WIDTH}
height = {HEIGHT}
nx = 8
ny = 6

[[scene.cloth.set]]
name = "left_hand"
markers = ["left"]

[[scene.cloth.set]]
name = "right_hand"
markers = ["right"]

[[scene.cloth.grip]]
set = "left_hand"
markers = ["left"]

[[scene.cloth.grip]]
set = "right_hand"
markers = ["right"]

[[recording]]
file = "towel.csv"
start = "equilibrium"

[parameters.cloth_warp]
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Markers in no order, a stranger's among them, three frames of a cloth at rest."""
    x = np.concatenate([hanging(LAYOUT)[ORDER], [[0.3, 1.6, 0.4]], hanging(CORNERS)])
    names = (*(f"Unlabeled {k}" for k in range(len(LAYOUT) + 1)), "left", "right")
    positions = np.repeat(x[None], 3, axis=0)
    sb.Recording(positions, np.arange(3) / 50, names, gravity=(0, -9.81, 0)).save(tmp_path / "towel.csv")
    return tmp_path


def configured(folder: Path, *edits: tuple[str, str]) -> Path:
    text = TOWEL
    for old, new in edits:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    (folder / "towel.toml").write_text(text)
    return folder / "towel.toml"


def test_a_layout_in_no_order_finds_its_markers(folder: Path) -> None:
    (e,) = load(configured(folder)).experiments
    cloth = e.scene.cloths["cloth"]
    assert e.names == tuple(f"Unlabeled {k}" for k in range(len(LAYOUT)))
    found = [np.array(p.weights[:3]) @ cloth.mesh.material[list(p.particles)] for p in e.compared_places]
    assert np.array(found) == pytest.approx(LAYOUT[ORDER])


def test_the_cloth_starts_through_its_markers(folder: Path) -> None:
    (e,) = load(configured(folder)).experiments
    cloth = e.scene.cloths["cloth"]
    where = [np.array(p.weights) @ e.scene.positions[list(p.particles)] for p in e.compared_places]
    assert np.array(where) == pytest.approx(hanging(LAYOUT)[ORDER], abs=2.5e-3)  # the chords of a bulge
    inside = ((cloth.mesh.material > 0.03) & (cloth.mesh.material < [0.37, 0.27])).all(axis=1)
    off = np.linalg.norm(e.scene.positions[cloth.particles] - hanging(cloth.mesh.material), axis=1)
    assert off[inside].max() < 3e-3 and off.max() < 1.5e-2
    hands = cloth.particles[[cloth.mesh.sets[f"{side}_hand"][0] for side in ("left", "right")]]
    assert e.scene.positions[hands] == pytest.approx(hanging(CORNERS), abs=1e-9)
    (finer,) = load(configured(folder, ("nx = 8", "nx = 16"), ("ny = 6", "ny = 12"))).experiments
    assert finer.scene.positions[finer.scene.cloths["cloth"].particles[-1]] == pytest.approx(hanging(CORNERS)[1])


BAR = """[[scene.cloth.bar]]
set = "bottom"
marker = "Unlabeled 12"
direction = [2, 0, 0.5]

[[scene.cloth.set]]
name = "left_hand"
"""


def test_a_side_starts_on_a_straight_bar(folder: Path) -> None:
    """One marker of the bar shows where all of the side is; what the other markers show of the cloth stays."""
    (e,) = load(configured(folder, ('[[scene.cloth.set]]\nname = "left_hand"\n', BAR))).experiments
    cloth = e.scene.cloths["cloth"]
    x = e.scene.positions[cloth.particles[cloth.mesh.sets["bottom"]]]
    along = (x - [0.3, 1.6, 0.4]) @ [2, 0, 0.5] / np.hypot(2, 0.5)
    assert x == pytest.approx([0.3, 1.6, 0.4] + np.outer(along, [2, 0, 0.5]) / np.hypot(2, 0.5), abs=1e-9)
    assert along == pytest.approx(along[0] + np.linspace(0, WIDTH, 9) * 2 / np.hypot(2, 0.5))
    hands = cloth.particles[[cloth.mesh.sets[f"{side}_hand"][0] for side in ("left", "right")]]
    assert e.scene.positions[hands] == pytest.approx(hanging(CORNERS), abs=1e-9)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("[2, 0, 0.5]", "[0, 0, 0]", r"direction.*no length"),
        ('"bottom"', '"rim"', r"bar\[0\]\.set.*rim.*left, right"),
        ('"Unlabeled 12"', '"Unlabeled 99"', r"bar\[0\]\.marker.*Unlabeled 99"),
    ],
)
def test_a_bar_that_is_none_is_refused(folder: Path, old: str, new: str, said: str) -> None:
    bar = BAR.replace(old, new)
    with pytest.raises(ConfigError, match=f"(?s){said}"):
        load(configured(folder, ('[[scene.cloth.set]]\nname = "left_hand"\n', bar)))


def test_a_bar_wants_a_shape_from_the_recording(folder: Path) -> None:
    edits = (('[[scene.cloth.set]]\nname = "left_hand"\n', BAR), ('shape = "recording"\n', ""))
    with pytest.raises(ConfigError, match=r'(?s)sides on bars.*shape = "recording"'):
        load(configured(folder, *edits))


def held_apart(share: float) -> tuple[sb.Scene, np.ndarray]:
    """A sheet hung from two corners, `share` of its width apart; its particles in a plane and in a bulge."""
    mesh = sb.mesh.grid(0.5, 0.4, 12, 10, pattern="one_way")
    u, v = mesh.vertices[:, 0], mesh.vertices[:, 1]
    flat = np.column_stack([share * u, 0 * u, v])
    built = sb.Scene("towel")
    cloth = sb.add_cloth(built, mesh, density=0.3, warp=400, weft=250, shear=30, bending=8e-5, positions=flat)
    built.pin(cloth.particles[[mesh.nearest([[x, 0.4, 0.0]])[0] for x in (0.0, 0.5)]])
    return built, flat + np.outer(0.01 * np.sin(np.pi * u / 0.5) * (1 - v / 0.4), [0.0, 1.0, 0.0])


@pytest.mark.slow
def test_a_bent_start_rests_where_a_flat_one_is_told_to_bend() -> None:
    built, bent = held_apart(0.96)
    rest = sb.equilibrium(built, bent)
    assert rest.unstable_modes == 0
    assert np.abs(rest.positions[:, 1]).max() > 0.02
    with pytest.raises(sb.NoEquilibriumError, match="start with cloth bent a little") as caught:
        sb.equilibrium(built)
    assert "iterations, or" not in str(caught.value)


@pytest.mark.parametrize(
    ("edits", "words"),
    [
        ([("nearest_at = 0.0\n", "")], "give nearest_at too"),
        ([("origin = [0.2, 1.0, 0.0]", "origin = [0.5, 1.0, 0.0]")], "places that no marker is nearest to"),
        ([("nearest_at = 0.0\n", ""), (f"layout = {LAYOUT.tolist()}\n", "")], "three points off a line"),
        ([("0.03, 0.03", "0.5, 0.03")], "layout.*lie outside of the material"),
        ([("nearest_at = 0.0", "nearest_at = 9.0")], "lies outside of the recording"),
        ([('set = "left_hand"\nmarkers = ["left"]', 'set = "left_hand"\nmarkers = [40]')], "out of range"),
    ],
)
def test_what_tells_too_little_is_refused(folder: Path, edits: list, words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        load(configured(folder, *edits))


def test_the_surface_is_exact_for_rigid_and_affine_motion() -> None:
    mesh = sb.mesh.grid(0.3, 0.2, 6, 4, pattern="one_way")
    places = mesh.at([[0.02, 0.03], [0.25, 0.05], [0.1, 0.18], [0.2, 0.1]])
    turn = np.linalg.qr(np.random.default_rng(1).standard_normal((3, 3)))[0] * [1.1, 0.9, 1.0]
    moved = mesh.vertices @ turn.T + [1.0, 2.0, 3.0]
    to = places.positions(moved)
    assert mesh.through(places, to) == pytest.approx(moved, abs=1e-12)
    to[1] = np.nan
    assert mesh.through(places, to) == pytest.approx(moved, abs=1e-12)
    with pytest.raises(MeshError, match="three points off a line"):
        mesh.through(mesh.at([[0.1, 0.1], [0.2, 0.1], [0.3, 0.1]]), np.zeros((3, 3)))
    with pytest.raises(MeshError, match="coincide"):
        mesh.through(mesh.at([[0.1, 0.1], [0.1, 0.1], [0.3, 0.1], [0.2, 0.2]]), np.zeros((4, 3)))
    with pytest.raises(MeshError, match="do not match"):
        mesh.through(places, np.zeros((3, 3)))
