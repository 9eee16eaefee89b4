"""`sheetbend new` of a rope of rubber that carries a weight: EA is fitted beside the length without load."""

from __future__ import annotations

import json
import tomllib
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
import takes
from commands import run
from sheetbend.look.held import parts
from sheetbend.look.seen import seen
from sheetbend.look.stretching import stretching

LENGTH, DENSITY, EA, LOAD, NOISE = 0.5, 0.02, 3.0, 0.06, 3e-4


@cache
def bungee(seconds: float = 3.0) -> sb.Recording:
    """A rope of rubber that is let go aside with a weight at its end, which stretches it by up to a half."""
    t = np.arange(round(60 * seconds)) / 60
    scene = sb.Scene("bungee")
    own = {"density": DENSITY, "EA": EA, "EI": 2e-5, "stretch_damping": 0.01, "drag_linear": 0.02}
    rope = sb.add_rope(scene, length=LENGTH, segments=30, start=(0, 0, 1.2), direction=(0.6, 0, -0.8), **own)
    scene.pin(rope.particles[:1])
    scene.add_point_mass(rope.particles[-1], LOAD, name="weight")
    x = sb.simulate(scene, t, sb.Solver(h=1 / 960)).positions[:, rope.particles[::5]]
    x = x + NOISE * np.random.default_rng(8).standard_normal(x.shape)
    return sb.Recording(x, t, tuple(f"b{k}" for k in range(7)), name="bungee", gravity=(0, 0, -9.81))


def drafted(folder: Path, *options: object) -> tuple[Path, str]:
    bungee().save(folder / "bungee.csv")
    result = run("new", folder / "bungee.csv", "--output", folder / "bungee.toml", *options)
    assert result.exit_code == 0 and "it stretches" in result.output, result.output
    return folder / "bungee.toml", result.output


def test_a_rope_of_rubber_has_its_stiffness_fitted(tmp_path: Path) -> None:
    """It was drafted as one that does not stretch, as long as it was at its longest."""
    config, said = drafted(tmp_path, "--density", DENSITY, "--weight", LOAD)
    content = tomllib.loads(config.read_text())
    (rope,) = content["scene"]["rope"]
    assert rope["length"] == pytest.approx(LENGTH, rel=0.12) and rope["EA"] == pytest.approx(EA, rel=0.5)
    assert {"rope_EA", "rope_stretch_damping"} < set(content["parameters"]) and "0.06 kg, as given" in said
    assert "end_mass" not in content["parameters"] and content["parameters"]["rope_length"]["prior"][1] > 0.05
    places = np.array(list(rope["markers"].values()))
    np.testing.assert_allclose(places / places[-1], np.arange(7) / 6, atol=4e-3)


@pytest.mark.parametrize("which", ["hand", "pinned", "clamped", "table"])
def test_other_ropes_do_not_stretch(which: str) -> None:
    makers = {
        "hand": lambda: takes.rope_in_hand("one", 2.0),
        "pinned": lambda: takes.let_go(False),
        "clamped": lambda: takes.let_go(True),
        "table": lambda: takes.rope_on_table("one"),
    }
    s = seen(makers[which]())
    assert stretching(s, parts(s)[1]) is None


@pytest.mark.parametrize("markers", [3, 4, 5, 7])
def test_a_soft_rope_that_bends_between_few_markers_does_not_stretch(markers: int) -> None:
    """The line through 3 to 5 markers was 2 to 8 % shorter where the rope was bent: EA and a mass were fitted."""
    t = np.arange(300) / 100
    scene = sb.Scene("soft")
    own = {"density": 0.05, "EI": 1e-5, "bend_damping": 0.01, "drag_linear": 0.02}
    rope = sb.add_rope(scene, length=0.6, segments=24, start=(0, 0, 1.2), direction=(1, 0, 0), **own)  # type: ignore[arg-type]
    scene.pin(rope.particles[:1])
    x = sb.simulate(scene, t, sb.Solver(h=1e-3)).positions[:, rope.particles[:: 24 // (markers - 1)]]
    s = seen(sb.Recording(x + 2e-4 * np.random.default_rng(0).standard_normal(x.shape), t))
    assert parts(s)[1] == tuple(range(markers)) and stretching(s, parts(s)[1]) is None


@pytest.mark.slow
def test_the_fit_of_a_rope_of_rubber_with_an_unknown_weight(tmp_path: Path) -> None:
    """A model that does not stretch and carries nothing missed unseen motion by 153 mm of 162, and all was doubtful."""
    config, said = drafted(tmp_path)
    assert "its free end carries a mass, some" in said
    quick = "\n[fit]\nhalve_step = false\ndouble_segments = false\nprofiles = false\n"
    config.write_text(config.read_text() + quick)
    run("fit", config, "--output", tmp_path / "out")
    found = json.loads((tmp_path / "out/fit.json").read_text())
    values = {name: parameter["value"] for name, parameter in found["parameters"].items()}
    right = {"rope_EA": EA / DENSITY, "end_mass": LOAD / DENSITY, "rope_length": LENGTH}
    assert {name: values[name] for name in right} == pytest.approx(right, rel=0.01)
    assert values["rope_drag_linear"] == pytest.approx(0.02 / DENSITY, rel=0.1)
    assert values["rope_stretch_damping"] == pytest.approx(0.01, rel=0.12)
