"""Rigid bodies and joints in configurations."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
from sheetbend import config

TEXT = """
[experiment]
name = "plug"

[solver]
h = 2e-3

[[scene.body]]
name = "plug"
mass = 0.08
inertia = [2e-5, 3e-5, 4e-5]
center = [0.003, 0.0, 0.0]
at = [0.52, 0.0, 0.0]

[[scene.body]]
name = "flap"
mass = 0.01
box = [0.02, 0.01, 0.002]
at = [0.55, 0.0, 0.0]

[[scene.joint]]
kind = "hinge"
name = "hinge"
upper = "plug"
lower = "flap"
at = [0.54, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
stiffness = 1e-3

[[scene.rod]]
name = "cable"
length = 0.5
segments = 8
density = 0.05
EI = 4e-3
GJ = 2e-3
EA = 2e3
clamp_start = [1.0, 0.0, 0.0]

[[scene.rod.grip]]
at = "end"
body = "plug"
position = [-0.02, 0.0, 0.0]
direction = [1.0, 0.0, 0.0]

[[recording]]
file = "plug.npz"
sigma = 1e-4

[[marker]]
marker = "m0"
body = "plug"
point = [0.0, 0.0, 0.01]

[[marker]]
marker = "m1"
body = "flap"
point = [0.01, 0.0, 0.0]

[parameters.cable_EI]
initial = 5e-3

[parameters.plug_center_x]
initial = 0.0
"""


def written(folder: Path, text: str = TEXT) -> Path:
    scene = sb.Scene("plug")
    plug = scene.add_body("plug", mass=0.08, inertia=(2e-5, 3e-5, 4e-5), center=(0.003, 0.0, 0.0), at=(0.52, 0.0, 0.0))
    flap = scene.add_body("flap", of=sb.Inertia.box(0.01, (0.02, 0.01, 0.002)), at=(0.55, 0.0, 0.0))
    sb.hinge(plug, flap, at=(0.54, 0.0, 0.0), axis=(0.0, 1.0, 0.0), stiffness=1e-3)
    start, end = sb.Grip.fixed((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)), plug.point((-0.02, 0.0, 0.0), along=(1.0, 0.0, 0.0))
    size = {"length": 0.5, "segments": 8, "density": 0.05, "EI": 4e-3, "GJ": 2e-3, "EA": 2e3}
    sb.add_rod(scene, "cable", **size, start=start, end=end)  # type: ignore[arg-type]
    motion = sb.simulate(scene, np.arange(16) * 0.02, sb.Solver(h=2e-3))
    seen = []
    for body, point in ((plug, [0.0, 0.0, 0.01]), (flap, [0.01, 0.0, 0.0])):
        origin, frame = body.pose(motion)
        seen.append(origin + frame @ point)
    sb.Recording(np.stack(seen, axis=1), motion.times).save(folder / "plug.npz")
    (folder / "plug.toml").write_text(text)
    return folder / "plug.toml"


def test_configured_cable_with_plug_and_flap_is_fitted(tmp_path: Path) -> None:
    study = config.load(written(tmp_path))
    found = sb.fit(study.experiments, parameters=study.parameters, refine=False)
    assert found.values["cable_EI"] == pytest.approx(4e-3, rel=1e-5)
    assert found.values["plug_center_x"] == pytest.approx(3e-3, rel=1e-4)


@pytest.mark.parametrize(
    ("old", "new", "match"),
    [
        ('upper = "plug"', 'upper = "plgu"', "no body of the scene"),
        ('body = "plug"\nposition', 'body = "plgu"\nposition', "no body of the scene"),
        ("axis = [0.0, 1.0, 0.0]\n", "", "without axis"),
        ("stiffness = 1e-3", "compliance = 1e-3", "hinge with compliance"),
        ("box = [0.02, 0.01, 0.002]\n", "", "one of inertia and box"),
        ("[2e-5, 3e-5, 4e-5]", "[2e-5, 3e-5, 6e-5]", "that of no body"),
        ('name = "flap"', 'name = "plug"', "is taken"),
    ],
)
def test_mistakes_in_bodies_and_joints_are_told(tmp_path: Path, old: str, new: str, match: str) -> None:
    assert old in TEXT
    with pytest.raises(sb.ConfigError, match=match):
        config.load(written(tmp_path, TEXT.replace(old, new)))
