"""[[scene.solid]]: boxes and files, sets, markers, and what is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sheetbend as sb
import tomli_w
from pytest import approx
from sheetbend import config

BOX: dict[str, Any] = {
    "name": "bar",
    "size": [0.1, 0.02, 0.02],
    "cells": [4, 1, 1],
    "origin": [0.0, 0.0, 0.5],
    "density": 1000.0,
    "E": 1e5,
    "poisson": 0.45,
    "damping": 5e-3,
    "pinned": ["x_min"],
}
SOLVER = {"method": "newton", "substeps": 2}


def study(folder: Path, solid: dict[str, Any], scene_more: dict[str, Any] | None = None, **more: Any) -> Any:
    scene = {"solid": [solid], **(scene_more or {})}
    folder.joinpath("bar.toml").write_text(
        tomli_w.dumps({"experiment": {"name": "bar"}, "solver": SOLVER, "scene": scene, **more})
    )
    return config.load(folder / "bar.toml")


def recorded(folder: Path) -> None:
    """A bar that falls, seen at its tip and on its upper face."""
    mesh = sb.mesh.bricks(BOX["size"], BOX["cells"], at=BOX["origin"])
    numbers = {name: BOX[name] for name in ("density", "E", "poisson", "damping")}
    scene = sb.solid(mesh, name="bar", pinned=mesh.sets["x_min"], **numbers)
    times = np.arange(20) / 100
    x = sb.simulate(scene, times, sb.Solver(h=5e-3, method="newton")).positions
    places = sb.on_solid(scene.solids["bar"], [[0.1, 0.01, 0.52], [0.06, 0.005, 0.52], [0.05, 0.01, 0.51]])
    seen = np.stack([np.einsum("k,fkx->fx", p.weights, x[:, list(p.particles)]) for p in places], axis=1)
    seen = seen + 1e-4 * np.random.default_rng(0).standard_normal(seen.shape)
    sb.Recording(positions=seen, times=times, markers=("tip", "top", "inside"), name="bar").save(folder / "bar.npz")


def test_a_bar_is_fitted_from_a_configuration(tmp_path: Path) -> None:
    recorded(tmp_path)
    loaded = study(
        tmp_path,
        BOX | {"E": 1.4e5},
        marker=[
            {"marker": "tip", "solid": "bar", "place": [0.1, 0.01, 0.52]},
            {"marker": "top", "solid": "bar", "place": [0.06, 0.005, 0.52]},
            {"marker": "inside", "solid": "bar", "place": [0.05, 0.01, 0.51]},
        ],
        recording=[{"file": "bar.npz", "sigma": 1e-4}],
        parameters={"bar_E": {}, "bar_damping": {}},
    )
    found = sb.fit(list(loaded.experiments), parameters=loaded.parameters, refine=False, profiles=False)
    for name, truth in (("bar_E", 1e5), ("bar_damping", 5e-3)):
        assert found[name].lower < truth < found[name].upper
        assert found[name].value == approx(truth, rel=0.02)


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"cells": None}, "no mesh"),
        ({"file": "bar.msh"}, "box of another mesh"),
        ({"pinned": ["left"]}, "not a set"),
        ({"poisson": 0.5}, "poisson"),
        ({"set": [{"name": "far", "lower": [1, 1, 1], "upper": [2, 2, 2]}]}, "no vertex"),
        ({"size": None, "cells": None, "origin": None, "file": "missing.msh"}, "not a file"),
    ],
)
def test_what_is_refused(tmp_path: Path, change: dict[str, Any], match: str) -> None:
    recorded(tmp_path)
    given = {name: value for name, value in (BOX | change).items() if value is not None}
    place = {"marker": "tip", "solid": "bar", "place": [0.1, 0.01, 0.52]}
    with pytest.raises(sb.ConfigError, match=match):
        study(tmp_path, given, marker=[place], recording=[{"file": "bar.npz"}])


def test_clusters(tmp_path: Path) -> None:
    """Boxes of shape matching: their frames are in the scene, and one stiffness for all."""
    recorded(tmp_path)
    place = {"marker": "tip", "solid": "bar", "place": [0.1, 0.01, 0.52]}
    given = {name: value for name, value in (BOX | {"clusters": 0.05}).items() if name != "poisson"}
    scene = study(tmp_path, given, marker=[place], recording=[{"file": "bar.npz"}]).experiments[0].scene
    assert len(scene.rotors) == 3
    assert "bar_E" in scene.quantities and "bar_poisson" not in scene.quantities
    with pytest.raises(sb.ConfigError, match="poisson"):
        study(tmp_path, BOX | {"clusters": 0.05}, marker=[place], recording=[{"file": "bar.npz"}])


def test_sets_of_a_box(tmp_path: Path) -> None:
    """Its faces, and boxes of space; particles of a set are "bar:SET:0" and so on."""
    recorded(tmp_path)
    own = {"name": "end", "lower": [0.09, -1.0, 0.51], "upper": [1.0, 0.005, 1.0]}
    loaded = study(
        tmp_path,
        BOX | {"set": [own]},
        marker=[{"marker": "tip", "solid": "bar", "place": [0.1, 0.01, 0.52]}],
        recording=[{"file": "bar.npz"}],
        scene_more={"point_mass": [{"name": "hung", "particle": "bar:end", "mass": 0.01}]},
    )
    scene = loaded.experiments[0].scene
    assert len(scene.solids["bar"].mesh.sets["end"]) == 1
    assert len(scene.pinned) == 4
    assert scene.quantities["hung_mass"].value == 0.01


def test_a_face_is_fixed_to_a_body(tmp_path: Path) -> None:
    """A plate on a hinge carries the bar, which swings with it; `held` leaves out the elements between its vertices."""
    given = {name: value for name, value in BOX.items() if name != "pinned"} | {
        "grip": [{"set": "x_min", "body": "plate"}]
    }
    more: dict[str, Any] = {
        "body": [{"name": "plate", "mass": 0.01, "box": [0.01, 0.02, 0.02], "at": [0.0, 0.01, 0.51]}],
        "joint": [
            {"kind": "hinge", "name": "hinge", "lower": "plate", "at": [0.0, 0.01, 0.51], "axis": [0.0, 1.0, 0.0]}
        ],
    }

    def made(solid: dict[str, Any]) -> sb.Scene:
        content = {"experiment": {"name": "bar"}, "solver": SOLVER, "scene": {"solid": [solid], **more}}
        (tmp_path / "bar.toml").write_text(tomli_w.dumps(content))
        return config.scene_alone(config.parse(tmp_path / "bar.toml"))[0]

    scene = made(given)
    bar, plate = scene.solids["bar"], scene.bodies["plate"]
    face = bar.particles[bar.mesh.sets["x_min"]]
    assert list(plate.attached) == face.tolist() and "bar_x_min_on_plate" in {g.name for g in scene.groups}
    motion = sb.simulate(scene, [0.0, 0.1], sb.Solver(h=2e-3, method="newton"))
    origin, frame = plate.pose(motion)
    kept = scene.positions[face] - [0.0, 0.01, 0.51]
    assert motion.positions[1, face] == approx(origin[1] + kept @ frame[1].T, abs=1e-9)
    assert frame[1, 2, 0] < -0.2  # it swings down
    for wrong, match in (({"set": "left"}, "not a set"), ({"body": "none"}, "not a body")):
        with pytest.raises(sb.ConfigError, match=match):
            made(given | {"grip": [given["grip"][0] | wrong]})


def test_a_weight_hangs_on_the_mean_of_a_face(tmp_path: Path) -> None:
    given = BOX | {"mean": [{"name": "tip", "set": "x_max"}]}
    scene_more: dict[str, Any] = {"point_mass": [{"name": "hung", "particle": "tip", "mass": 0.01}]}
    marker = [{"marker": "tip", "particle": "tip"}]
    recorded(tmp_path)
    loaded = study(tmp_path, given, scene_more, marker=marker, recording=[{"file": "bar.npz"}])
    scene = loaded.experiments[0].scene
    bar = scene.solids["bar"]
    motion = sb.simulate(scene, [0.0, 0.1], sb.Solver(h=2e-3, method="newton"))
    face = motion.positions[1, bar.particles[bar.mesh.sets["x_max"]]]
    (place,) = loaded.experiments[0].markers.values()
    assert motion.positions[1, list(place.particles)][0] == approx(face.mean(axis=0), abs=1e-9)
    for wrong, match in (({"set": "left"}, "not a set"), ({"name": "bar"}, "is taken")):
        own = BOX | {"mean": [{"name": "tip", "set": "x_max"} | wrong]}
        with pytest.raises(sb.ConfigError, match=match):
            study(tmp_path, own, scene_more, marker=marker, recording=[{"file": "bar.npz"}])


def test_yield(tmp_path: Path) -> None:
    """Its quantities and its kind; what add_solid refuses is refused with the key's name."""
    recorded(tmp_path)
    more: dict[str, Any] = {
        "marker": [{"marker": "tip", "solid": "bar", "place": [0.1, 0.01, 0.52]}],
        "recording": [{"file": "bar.npz"}],
    }
    scene = study(tmp_path, BOX | {"yield_stress": 500.0, "hardening": 2e4}, **more).experiments[0].scene
    assert scene.quantities["bar_yield_stress"].value == 500.0 and scene.quantities["bar_hardening"].value == 2e4
    assert scene.group("bar_strain")[0].kind == "yielding_brick_strain"
    for wrong, match in (({"hardening": 2e4}, "hardening"), ({"yield_stress": -1.0}, "yield_stress")):
        with pytest.raises(sb.ConfigError, match=match):
            study(tmp_path, BOX | wrong, **more)
