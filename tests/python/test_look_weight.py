"""`sheetbend new --weight`: a cable in a clamp with a weight at its end, which swings, or hangs still."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sheetbend as sb
import takes
from commands import last_line, run
from pytest import approx
from scipy.integrate import solve_ivp
from sheetbend.look import Take, draft, seen
from takes import noisy

EI, DENSITY, LENGTH, WEIGHT = 0.02, 0.08, 0.5, 0.02
SEGMENTS, MARKERS = 32, 9


def cable(pull: float = 0.0) -> tuple[sb.Scene, sb.Rope]:
    scene = sb.Scene("cable")
    rope = sb.add_rope(
        scene,
        length=LENGTH,
        segments=SEGMENTS,
        density=DENSITY,
        EI=EI,
        bend_damping=4e-3,
        drag_linear=5e-3,
        start=(0, 0, 0.8),
        clamp_start=(1, 0, 0),
    )
    scene.pin(rope.particles[:1])
    scene.add_point_mass(int(rope.particles[-1]), WEIGHT, "weight")
    if pull:
        scene.add_force(rope.particles[-1:], [[[0.0, 0.0, -pull]]])
    return scene, rope


def recorded(folder: Path, moves: bool, first: int = 0) -> Path:
    """A table of markers, m, from number `first` on: pulled for 0.5 s and let go, or at rest without a pull."""
    scene, rope = cable()
    some = rope.particles[:: SEGMENTS // (MARKERS - 1)][first:]
    if moves:
        pulled = sb.equilibrium(cable(0.25)[0]).nodes
        x = sb.simulate(scene, np.arange(301) / 100, sb.Solver(h=1 / 600), start=pulled).positions[:, some]
        x = np.concatenate([np.repeat(x[:1], 50, axis=0), x])
    else:
        x = np.repeat(sb.equilibrium(scene).positions[None, some], 40, axis=0)
    names = [f"P{k}" for k in range(first, MARKERS)]
    recording = sb.Recording(noisy(x, 0), np.arange(len(x)) / 100, markers=names, name="cable")
    recording.save(folder / "cable.csv")
    (folder / "cable.json").unlink()
    return folder / "cable.csv"


def drafted(file: Path, *options: object) -> tuple[dict[str, Any], dict[str, Any]]:
    """What the command says, and the configuration."""
    target = file.parent / f"draft_{len(list(file.parent.iterdir()))}.toml"
    result = run("new", file, "--output", target, "--density", DENSITY, "--json", *options)
    assert result.exit_code == 0, result.output
    return last_line(result), tomllib.loads(target.read_text())


def test_a_cable_with_a_weight_that_is_let_go(tmp_path: Path) -> None:
    """The draft had nothing at the free end, and its EI was a third of the true one."""
    file = recorded(tmp_path, moves=True)
    said, draft = drafted(file)
    assert "point_mass" not in draft["scene"] and any("give its mass in kg with --weight" in u for u in said["unknown"])
    said, draft = drafted(file, "--weight", WEIGHT)
    (mass,) = draft["scene"]["point_mass"]
    assert mass["mass"] == WEIGHT and mass["particle"] == "rope:end" and "end_mass" not in draft["parameters"]
    assert any("0.02 kg, as given" in s for s in said["seen"]) and "--weight" not in " ".join(said["unknown"])
    said, draft = drafted(file, "--weight", 0)
    assert "point_mass" not in draft["scene"] and "--weight" not in " ".join(said["unknown"])


def test_a_cable_whose_clamp_no_marker_shows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The free end, which moves first when it is let go, was taken for a hand."""
    said, draft = drafted(recorded(tmp_path, moves=True, first=1))
    assert draft["scene"]["rope"][0]["pinned"] == [0]  # its first marker stays within 0.5 mm of noise
    assert any("whether P1 is where the rope is held" in u for u in said["unknown"])
    monkeypatch.setattr(takes, "NOISE", 1e-4)
    said, draft = drafted(recorded(tmp_path, moves=True, first=1))
    (grip,) = draft["scene"]["rope"][0]["grip"]
    assert grip["markers"] == ["P1"] and grip["at"] == "start"
    assert any("P1, which moves by only" in u and "Put a marker where the clamp ends" in u for u in said["unknown"])


def test_a_cable_that_hangs_still(tmp_path: Path) -> None:
    """Both ends of a shape at rest were in clamps, and EI was not known within a factor of ten."""
    file = recorded(tmp_path, moves=False)
    said, draft = drafted(file)
    assert {"clamp_start", "clamp_end"} <= set(draft["scene"]["rope"][0])
    assert any("If the lower one hangs free" in u for u in said["unknown"])
    said, draft = drafted(file, "--weight", WEIGHT)
    rope = draft["scene"]["rope"][0]
    assert "clamp_start" in rope and "clamp_end" not in rope and "rope_end_angle" not in draft["parameters"]
    assert draft["scene"]["point_mass"][0]["mass"] == WEIGHT
    target = max(tmp_path.glob("*.toml"), key=lambda p: p.stat().st_mtime_ns)
    text = "\n".join(line for line in target.read_text().splitlines() if "set_modes" not in line)
    kept = [part for part in text.split("\n\n") if "rope_set_" not in part]  # it is straight without load
    target.write_text("\n\n".join(kept) + '\n[output]\nfigures = "none"\n')
    assert run("fit", target, "--output", tmp_path / "out").exit_code == 0
    found = sb.FitResult.load(tmp_path / "out/fit.json")["rope_EI"]
    assert found.lower < EI < found.upper and found.value == approx(EI, rel=0.05)
    assert found.verdict == "identified"


@pytest.mark.parametrize(
    ("weight", "words"), [(-1, "--weight: must be zero or more"), ("nan", "--weight: must be zero or more")]
)
def test_weights_that_are_none(tmp_path: Path, weight: object, words: str) -> None:
    result = run("new", recorded(tmp_path, moves=False), "--output", tmp_path / "x.toml", "--weight", weight)
    assert result.exit_code == 2 and words in result.output


def test_a_weight_where_both_ends_are_held(tmp_path: Path) -> None:
    scene = sb.rope(0.6, 24, density=0.05, EI=1e-3, points=[(0, 0, 1), (0.6, 0, 1)], drag_linear=0.1, pinned=(0, -1))
    x = np.array(scene.positions)
    swing = 0.1 * np.sin(np.pi * x[:, 0] / 0.6) * np.cos(9.0 * np.arange(101) / 100)[:, None]
    x = np.repeat(x[None], 101, axis=0)[:, ::3]
    x[:, :, 2] += swing[:, ::3]
    sb.Recording(noisy(x, 0), np.arange(101) / 100, name="slack").save(tmp_path / "slack.csv")
    result = run("new", tmp_path / "slack.csv", "--output", tmp_path / "x.toml", "--weight", 0.1)
    assert result.exit_code == 2 and "--weight: hangs at a free end, and both ends are held" in result.output


@pytest.mark.parametrize("loaded", [True, False])
def test_a_load_on_a_light_cable_below_a_drone(loaded: bool) -> None:
    """Four markers were too few. With a load of five cables and none in the draft, the fit missed by two thirds of the
    motion."""
    t, length = np.arange(401) / 100, 0.8
    since = np.maximum(t - 0.4, 0.0)
    x = 0.3 * (1.0 - np.exp(-((since / 0.4) ** 2))) * np.sin(2.5 * since)
    if not loaded:
        scene = sb.Scene("drone")
        own = {"length": length, "segments": 40, "density": 0.01, "EI": 1e-6, "drag_linear": 2e-3}
        rope = sb.add_rope(scene, **own, direction=(0, 0, -1))
        scene.drive(rope.particles[:1], t, np.stack([x, 0 * t, 0 * t], axis=1)[:, None])
        on = sb.simulate(scene, t, sb.Solver(h=1 / 800)).positions[:, rope.particles[10::10]]
    else:  # massless, and the load at its end
        pull = np.gradient(np.gradient(x, t), t)

        def slope(s: float, y: list[float]) -> list[float]:
            return [y[1], -(9.81 * np.sin(y[0]) + np.interp(s, t, pull) * np.cos(y[0])) / length - 0.2 * y[1]]

        q = solve_ivp(slope, (0.0, 4.0), [0.0, 0.0], t_eval=t, max_step=0.01).y[0]
        way = length * np.stack([np.sin(q), 0 * t, -np.cos(q)], axis=1)
        on = np.stack([x, 0 * t, 0 * t], axis=1)[:, None] + np.linspace(0.25, 1.0, 4)[:, None] * way[:, None]
    body = np.array([[0.12, 0.12, 0.03], [-0.12, 0.12, 0.03], [-0.12, -0.1, 0.03], [0.1, -0.12, 0.05]])
    markers = np.concatenate([np.stack([x, 0 * t, 0 * t], axis=1)[:, None] + body, on], axis=1)
    names = [*(f"drone{k}" for k in range(4)), *(f"c{k}" for k in range(4))]
    found = draft([Take(seen(sb.Recording(noisy(markers, 0), t, names)), "take.csv")], "take")
    masses = tomllib.loads(found.text)["scene"].get("point_mass", [])
    assert len(masses) == loaded
    if loaded:
        assert masses[0]["particle"] == "rope:end" and masses[0]["mass"] > 3.0 * length  # kg, below 1 kg/m
