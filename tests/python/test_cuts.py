"""Cuts of one fabric: one set of quantities for several cloths, in Python and in configurations."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sheetbend as sb
from pytest import approx
from sheetbend.config import parse, scene_alone
from sheetbend.config.values import with_values, write
from support import sensitivity, steps

FABRIC: dict[str, Any] = {
    "density": 0.2,
    "warp": 100.0,
    "weft": 60.0,
    "shear": 15.0,
    "poisson": 0.2,
    "law": sb.laws.Exponential(warp=2.0, weft=1.0, shear=0.5),
    "bending": 1e-3,
    "bending_weft": 5e-4,
    "membrane_damping": 4e-3,
    "bend_damping": 2e-3,
    "drag_linear": 0.2,
}
SOLVER = sb.Solver(h=1 / 240)


def hang(scene: sb.Scene, name: str, turn: float, **fabric: Any) -> None:
    """A strip that falls from its left edge, cut at an angle to the warp."""
    mesh = sb.mesh.grid(0.2, 0.1, 4, 2, "one_way")
    c, s = np.cos(turn), np.sin(turn)
    mesh = sb.TriangleMesh(mesh.vertices, mesh.triangles, mesh.material @ np.array([[c, s], [-s, c]]), mesh.sets)
    cloth = sb.add_cloth(scene, mesh, name, held=mesh.sets["left"], **fabric)
    scene.pin(cloth.particles[mesh.sets["left"]])


def test_cuts_share_the_quantities_of_their_fabric() -> None:
    """The derivative with respect to one of them is the sum of those of the cuts alone."""
    cuts = {"along": 0.0, "bias": 0.7}
    both = sb.Scene("both")
    for name, turn in cuts.items():
        hang(both, name, turn, fabric="knit", **FABRIC)
    assert [name for name in both.quantities if not name.startswith("knit_")] == []
    assert len(both.quantities) == 13
    times = steps(SOLVER.h, 24)
    weights = np.random.default_rng(1).standard_normal((len(times), both.particle_count, 3))
    parts = np.split(weights, 2, axis=1)
    for label in ("density", "warp", "weft", "shear", "poisson", "warp_stiffening", "bending", "bending_weft"):
        alone = []
        for (name, turn), part in zip(cuts.items(), parts, strict=True):
            scene = sb.Scene(name)
            hang(scene, name, turn, **FABRIC)
            alone.append(sensitivity(scene, times, SOLVER, part, f"{name}_{label}")[1])
        assert min(map(abs, alone)) > 0.0
        forward, adjoint = sensitivity(both, times, SOLVER, weights, f"knit_{label}")
        assert adjoint == approx(sum(alone), rel=1e-9), label
        assert forward == approx(adjoint, rel=1e-9), label


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"warp": 90.0}, "bias.warp"),
        ({"weft": None}, "bias.weft"),
        ({"drag_quadratic": 0.1}, "bias.drag_quadratic"),
        ({"law": None}, "bias.law"),
        ({"bending_model": "dihedral", "bending_weft": None}, "bias.bending_weft"),
    ],
)
def test_a_cut_with_other_numbers_is_refused(change: dict[str, Any], field: str) -> None:
    scene = sb.Scene("both")
    hang(scene, "along", 0.0, fabric="knit", **FABRIC)
    with pytest.raises(sb.SceneError, match=r"is not that of its fabric, knit .* give what along has") as caught:
        hang(scene, "bias", 0.7, fabric="knit", **FABRIC | change)
    assert caught.value.field == field


CONFIG = """\
[experiment]
name = "cuts"

[solver]
h = 0.004

[[scene.cloth]]
density = 0.2
warp = 100.0
weft = 60.0
shear = 15.0
bending = 1e-3
pinned = ["left"]
mesh = { kind = "grid", width = 0.2, height = 0.1, nx = 4, ny = 2 }

[scene.cloth.law]
kind = "exponential"
warp = 2.0
weft = 1.0
shear = 0.5

[[scene.cloth]]
name = "bias"
fabric = "cloth"
origin = [0, 0.5, 0]
pinned = ["left"]
mesh = { kind = "grid", width = 0.2, height = 0.1, nx = 4, ny = 2, warp = [1, 1, 0] }

[[scene.cloth]]
name = "weft"
fabric = "bias"
origin = [0, 1, 0]
pinned = ["left"]
mesh = { kind = "grid", width = 0.2, height = 0.1, nx = 4, ny = 2, warp = [0, 1, 0] }
"""


def built(file: Path) -> sb.Scene:
    return scene_alone(parse(file), file.parent)[0]


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "cuts.toml"
    path.write_text(CONFIG)
    return path


def test_a_configuration_of_cuts(file: Path, tmp_path: Path) -> None:
    scene = built(file)
    assert {cloth.fabric for cloth in scene.cloths.values()} == {"cloth"}
    assert {name.partition("_")[0] for name in scene.quantities} == {"cloth"}
    assert scene.cloths["weft"].numbers["law"] == sb.laws.Exponential(warp=2.0, weft=1.0, shear=0.5)
    write(with_values(parse(file), {}), tmp_path / "again.toml", tmp_path)
    assert built(tmp_path / "again.toml").quantities == scene.quantities


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('fabric = "cloth"', 'fabric = "silk"', r"bias, whose fabric is that of no earlier one, silk .*: cloth"),
        ('fabric = "cloth"', 'fabric = "weft"', "whose fabric is that of no earlier one, weft"),
        ('fabric = "cloth"', 'fabric = "cloth"\nwarp = 90.0', "numbers beside its fabric: warp .* leave them out"),
        (
            'fabric = "bias"',
            'fabric = "bias"\nbend_damping = 0.1',
            "weft, with numbers beside its fabric: bend_damping",
        ),
        ('fabric = "cloth"', "fabric = 1", r"scene\.cloth\[1\]"),
        ('name = "weft"', "name = [1]", r"scene\.cloth\[2\]\.name"),
    ],
)
def test_cuts_that_are_refused(file: Path, old: str, new: str, words: str) -> None:
    file.write_text(CONFIG.replace(old, new))
    with pytest.raises(sb.ConfigError, match=words):
        parse(file)
