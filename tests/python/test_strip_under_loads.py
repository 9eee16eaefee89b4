"""Force against extension by a configuration: a still recording per load, the force given, places measured."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.config import load

TRUE = {"warp": 600.0, "weft": 400.0, "poisson": 0.25}
KNOWN = {"density": 0.2, "shear": 60.0, "bending": 1e-4}
POINTS = {"ahead": (0.15, 0.025), "side": (0.1, 0.0), "other": (0.1, 0.05)}
LOADS = (1.0, 2.0, 3.0)  # N
STRIP = """\
[experiment]
name = "strip"

[scene]
gravity = [0, 0, 0]

[[scene.cloth]]
density = 0.2
warp = 300.0
weft = 400.0
shear = 60.0
poisson = 0.1
bending = 1e-4
pinned = ["left"]
markers = { ahead = [0.15, 0.025], side = [0.1, 0.0], other = [0.1, 0.05] }

[scene.cloth.mesh]
kind = "grid"
width = 0.2
height = 0.05
nx = 8
ny = 2

[[scene.force]]
name = "pull"
particles = ["cloth:right:0", "cloth:right:1", "cloth:right:2"]
force = [0.1, 0, 0]

[parameters]
cloth_warp = { lower = 10, upper = 1e5 }
cloth_poisson = {}
"""


@pytest.fixture
def config(tmp_path: Path) -> Path:
    """Twenty noisy stills per load, in mm."""
    rng = np.random.default_rng(1)
    mesh = sb.mesh.grid(0.2, 0.05, 8, 2, pattern="one_way")
    text = STRIP
    for newton in LOADS:
        scene = sb.Scene("strip", gravity=(0.0, 0.0, 0.0))
        cloth = sb.add_cloth(scene, mesh, held=mesh.sets["left"], **TRUE, **KNOWN)
        scene.pin(cloth.particles[mesh.sets["left"]])
        scene.add_force(cloth.particles[mesh.sets["right"]], np.tile([newton / 3, 0.0, 0.0], (1, 3, 1)))
        seen = mesh.at(list(POINTS.values())).positions(sb.equilibrium(scene).positions[cloth.particles])
        stills = 1e3 * (seen + 1e-4 * rng.standard_normal((20, *seen.shape)))
        name = f"pull_{newton:g}N.npz"
        sb.Recording(stills, np.arange(20.0), markers=tuple(POINTS)).save(tmp_path / name)
        text += f'\n[[recording]]\nfile = "{name}"\nunits = "mm"\nstatic = true\naxes = "xy"\nsigma = 1e-4\n'
        text += f"values = {{ pull_x = {newton / 3} }}\n"
    path = tmp_path / "strip.toml"
    path.write_text(text)
    return path


def test_stiffness_and_narrowing_of_a_strip_are_found(config: Path) -> None:
    study = load(config)
    assert [e.name for e in study.experiments] == ["pull_1N", "pull_2N", "pull_3N"]
    found = sb.fit(study.experiments, parameters=study.parameters, **study.options | {"refine": False})
    for name, share in (("warp", 0.01), ("poisson", 0.1)):
        estimate = found[f"cloth_{name}"]
        assert estimate.verdict == "identified" and estimate.half_width < share * estimate.value
        assert estimate.lower < TRUE[name] < estimate.upper
