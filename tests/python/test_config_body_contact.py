"""Contacts of rigid bodies in configurations."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
from sheetbend import config
from sheetbend.config.build import scene_alone
from sheetbend.config.file import parse

TEXT = """
[experiment]
name = "slide"

[solver]
h = 2e-3
method = "implicit"
integrator = "bdf1"

[[scene.body]]
name = "box"
mass = 0.4
box = [0.1, 0.08, 0.06]
center = [0.002, 0.0, 0.0]
at = [0.0, 0.0, 0.03]
velocity = [0.6, 0.0, 0.0]

[[scene.rope]]
name = "cord"
length = 0.1
segments = 4
density = 0.05
EA = 1e3
EI = 1e-4
start = [1.0, 0.0, 0.3]

[[scene.collider]]
name = "table"
shape = "plane"

[[scene.contact]]
of = "box"
collider = "table"
friction = 0.2

[[recording]]
file = "slide.npz"
sigma = 1e-4

[[marker]]
marker = "m0"
body = "box"
point = [0.0, 0.0, 0.02]

[parameters.table_friction]
initial = 0.1
lower = 0.01
upper = 1.0
"""
CONTACT = 'of = "box"\ncollider = "table"\nfriction = 0.2\n'
SOLVER = sb.Solver(h=2e-3, method="implicit", integrator="bdf1")
SIDES, CENTER = (0.1, 0.08, 0.06), (0.002, 0.0, 0.0)  # the box is around its center of mass


def in_python(**contact) -> tuple[sb.Scene, sb.Body]:
    scene = sb.Scene("slide")
    inertia = sb.Inertia(0.4, np.diag(sb.Inertia.box(0.4, SIDES).matrix), center=CENTER)
    body = scene.add_body("box", of=inertia, at=(0.0, 0.0, 0.03), velocity=(0.6, 0.0, 0.0))
    sb.add_rope(scene, "cord", length=0.1, segments=4, density=0.05, EA=1e3, EI=1e-4, start=(1.0, 0.0, 0.3))
    options = {"friction": 0.2, "points": sb.box_corners(SIDES, CENTER)} | contact
    scene.add_contact(body, sb.Plane(name="table"), **options)
    return scene, body


def ends(*scenes: sb.Scene) -> list[np.ndarray]:
    return [sb.simulate(scene, [0.0, 0.1], SOLVER).positions[-1] for scene in scenes]


def built(folder: Path, text: str) -> sb.Scene:
    (folder / "slide.toml").write_text(text.partition("[parameters")[0])
    return scene_alone(parse(folder / "slide.toml"), folder)[0]


def test_corners_of_a_box_touch_unless_points_are_given(tmp_path: Path) -> None:
    given = [[0.05, 0.0, -0.03], [-0.05, 0.03, -0.03], [-0.05, -0.03, -0.03]]
    own = {"points": given, "radius": 1e-3, "restitution": 0.1}
    keys = f"points = {given}\nradius = 1e-3\nrestitution = 0.1\nname = 'feet'\nsettle = true\n"
    np.testing.assert_array_equal(*ends(built(tmp_path, TEXT), in_python()[0]))
    scene = built(tmp_path, TEXT.replace(CONTACT, CONTACT + keys))
    assert "feet_restitution" in scene.quantities
    np.testing.assert_array_equal(*ends(scene, in_python(**own, name="feet", settle=True)[0]))
    assert scene.compiled.settled["feet"].farthest == pytest.approx(1e-3)
    soft = {"stiffness": 4e3, "dissipation": 0.5}
    scene = built(tmp_path, TEXT.replace(CONTACT, CONTACT + "stiffness = 4e3\ndissipation = 0.5\n"))
    np.testing.assert_array_equal(*ends(scene, in_python(**soft)[0]))
    assert scene.quantities["table_contact_dissipation"].value == 0.5


def test_a_box_that_slides_tells_its_friction(tmp_path: Path) -> None:
    scene, body = in_python()
    motion = sb.simulate(scene, np.arange(7) * 0.02, SOLVER)
    place, frame = body.pose(motion)
    sb.Recording((place + frame @ [0.0, 0.0, 0.02])[:, None], motion.times).save(tmp_path / "slide.npz")
    (tmp_path / "slide.toml").write_text(TEXT)
    study = config.load(tmp_path / "slide.toml")
    found = sb.fit(study.experiments, parameters=study.parameters, refine=False)
    assert found.values["table_friction"] == pytest.approx(0.2, rel=1e-4)


@pytest.mark.parametrize(
    ("old", "new", "match"),
    [
        ('of = "box"', 'of = "bxo"', "contact.0..of: names no rope, cloth, set of particles or body"),
        ('of = "box"', 'of = ["box", "cord"]', "contact.0..of: names a body beside others"),
        ('of = "box"', 'of = "cord"\npoints = [[0.0, 0.0, 0.0]]', "contact.0..points: are given.*not a body"),
        (CONTACT, CONTACT + "points = [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]\n", "at one place twice"),
        (
            "box = [0.1, 0.08, 0.06]",
            "inertia = [3e-4, 4e-4, 5e-4]",
            "contact.0..points: are missing: the body has no box",
        ),
        ('collider = "table"', 'collider = "floor"', "is not a collider"),
        ("0.0, 0.03]", "0.0, 0.02]", "inside 'table', which is 0.01 m deep.*settle = true"),
        ('method = "implicit"\n', 'method = "direct"\n', "solver.method"),
    ],
)
def test_mistakes_in_contacts_of_bodies_are_told(tmp_path: Path, old: str, new: str, match: str) -> None:
    sb.Recording(np.zeros((3, 1, 3)), np.arange(3) * 0.1).save(tmp_path / "slide.npz")
    assert old in TEXT
    (tmp_path / "slide.toml").write_text(TEXT.replace(old, new, 1))
    with pytest.raises(sb.SheetbendError, match=match):
        [e.scene.compiled for e in config.load(tmp_path / "slide.toml").experiments]
