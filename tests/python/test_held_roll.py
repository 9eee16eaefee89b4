"""Ends of rods that turn in every direction, and do or do not spin about the rod's own axis."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sheetbend as sb
import tomli_w
from sheetbend.config import build, parse
from sheetbend.doubts.spin import spins_otherwise
from sheetbend.experiment.wanted import as_parameters
from sheetbend.problem.problem import FitProblem
from sheetbend.statistics.identifiability import Identifiability

Array = np.ndarray
STRAND: dict[str, Any] = {"length": 0.5, "segments": 16, "density": 0.05, "EI": 5e-3, "drag_linear": 0.4}


def whirled(kind: str, damping: float, hold_roll: tuple[str, ...] = ()) -> Array:
    """(particles, 3) m, a rope or rod whose upper end goes round a circle, when it has settled."""
    t = np.arange(201) / 100
    out = 0.05 * (1.0 - np.exp(-((t / 0.3) ** 3)))
    hand = np.stack([out * np.cos(6 * t), out * np.sin(6 * t), np.ones_like(t)], axis=1)
    scene = sb.Scene("whirl")
    strand = STRAND | {"bend_damping": damping, "points": [hand[0], hand[0] - [0, 0, 0.5]]}
    if kind == "rope":
        one: sb.Rope = sb.add_rope(scene, **strand)
    else:
        one = sb.add_rod(scene, GJ=5e-3, twist_damping=damping, hold_roll=hold_roll, **strand)
    scene.drive(one.particles[:1], t, hand[:, None])
    return sb.simulate(scene, t, sb.Solver(h=1 / 500)).positions[-1]


def test_only_a_held_roll_damps_a_bend_that_goes_round() -> None:
    """A rod that spins with its bend keeps its shape, so that damping does nothing. One that may not spin bends
    back and forth in every section, and loses what a rope's damping of a vector does."""
    free, held, rope = whirled("rod", 0.05), whirled("rod", 0.05, ("start",)), whirled("rope", 0.05)
    undamped = whirled("rod", 1e-6)
    apart = np.abs(held - free).max()
    assert apart > 5e-4
    assert np.abs(free - undamped).max() < 0.02 * apart
    assert np.abs(held - rope).max() < 0.04 * apart


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        ({"hold_roll": ("top",)}, "names no end (got 'top')"),
        ({"hold_roll": ("start",), "start": sb.Grip.fixed((0, 0, 0), (0, 0, -1))}, "whose roll is held already"),
    ],
)
def test_what_holds_no_roll_is_refused(options: dict[str, Any], problem: str) -> None:
    with pytest.raises(sb.SceneError, match="hold_roll") as caught:
        sb.rod(0.5, 4, density=0.05, EI=1e-3, GJ=1e-3, points=[[0, 0, 0], [0, 0, -0.5]], **options)
    assert problem in str(caught.value)


@pytest.mark.parametrize("held", [True, False])
def test_a_held_roll_in_a_configuration(tmp_path: Path, held: bool) -> None:
    """The same scene as from Python, and a sentence of what is assumed."""
    times = np.arange(11) / 100
    markers = np.tile([[0.0, 0.0, 1.0], [0.0, 0.0, 0.5]], (11, 1, 1))
    sb.Recording(markers, times, name="take").save(tmp_path / "take.csv")
    file = tmp_path / "roll.toml"
    rod: dict[str, Any] = {"name": "rod", "length": 0.5, "segments": 4, "density": 0.05, "EI": 1e-3, "GJ": 1e-3}
    rod |= {"direction": [0, 0, -1], "markers": {"m1": 0.5}, "grip": [{"at": "start", "markers": ["m0"]}]}
    rod |= {"hold_roll": ["start"]} if held else {}
    head = {"experiment": {"name": "roll"}, "scene": {"rod": [rod]}}
    file.write_text(tomli_w.dumps(head | {"recording": [{"file": "take.csv"}], "parameters": {"rod_EI": {}}}))
    study = build(parse(file), tmp_path)
    assert ("but it does not spin" if held else "and it spins freely") in study.assumptions[0]
    scene = study.experiments[0].scene
    assert (scene.ropes["rod"].directors[0] in scene.pinned) == held


def taken(held: bool) -> sb.Recording:
    """A rod that a hand whirls in space for 1.2 s, and holds against a spin or not; nine markers with little noise."""
    t = np.arange(121) / 100
    out = 0.06 * (1.0 - np.exp(-((t / 0.2) ** 3)))
    hand = np.stack([out * np.cos(9 * t), out * np.sin(9 * t), np.ones_like(t)], axis=1)
    x = sb.simulate(whirling(t, hand, held), t, sb.Solver(h=1 / 500)).positions[:, ::2]
    x = x + 2e-4 * np.random.default_rng(0).standard_normal(x.shape)
    x[:, 0] = hand
    return sb.Recording(x, t, name="take")


def whirling(times: Array, hand: Array, held: bool, marker: str | None = None) -> sb.Scene:
    """The model of it; with a marker the hand's motion is a recorded one, which a fit may correct."""
    scene = sb.Scene("whirl")
    sb.add_rod(
        scene,
        "rod",
        GJ=2e-3,
        bend_damping=0.03,
        twist_damping=0.03,
        points=[hand[0], hand[0] - [0, 0, 0.5]],
        hold_roll=("start",) if held else (),
        **STRAND | {"EI": 2e-3, "drag_linear": 0.01},
    )
    particles = scene.ropes["rod"].particles[:1]
    if marker is None:
        scene.drive(particles, times, hand[:, None])
    else:
        scene.follow(particles, times, hand[:, None], [marker])
    return scene


@pytest.mark.parametrize(("true", "told"), [(True, True), (True, False), (False, True), (False, False)])
def test_a_spin_that_is_told_wrong_makes_the_damping_doubtful(true: bool, told: bool) -> None:
    """A right one does not, and the interval holds the truth."""
    recording = taken(true)
    scene = whirling(recording.times, recording.positions[:, 0], told)
    markers = [None, *map(sb.on_particle, scene.ropes["rod"].particles[2::2])]
    e = sb.Experiment(scene=scene, recording=recording, markers=markers, solver=sb.Solver(h=1 / 500), sigma=2e-4)
    fit = sb.fit(e, parameters=["rod_EI", "rod_bend_damping"], refine=False, beginnings=False)
    found = fit["rod_bend_damping"]
    if true == told:
        assert found.verdict == "identified"
        assert found.lower is not None and found.upper is not None
        assert found.lower < 0.03 < found.upper
    else:
        assert found.verdict == "doubtful"
        assert "seems to be held otherwise at its start" in found.words
        assert ("give it hold_roll" if true else "remove it from hold_roll") in found.words


@pytest.mark.parametrize(("held", "words"), [(True, "does not spin (hold_roll)"), (False, "may spin")])
def test_a_spin_that_is_not_asked_beside_corrections_is_a_warning(held: bool, words: str) -> None:
    recording = taken(held)
    scene = whirling(recording.times, recording.positions[:, 0], held, recording.markers[0])
    markers = [None, *map(sb.on_particle, scene.ropes["rod"].particles[2::2])]
    solver = sb.Solver(h=1 / 500)
    e = sb.Experiment(scene=scene, recording=recording, markers=markers, solver=solver, sigma=2e-4, driven_sigma=2e-4)
    nothing = Identifiability((), (), 0, np.zeros(0), (), 1.0)
    problem = FitProblem([e], as_parameters(["rod_EI"], [e]))
    doubts, warnings = spins_otherwise(problem, problem.parameters.initial(), nothing)
    assert doubts == {}
    assert len(warnings) == 1 and words in warnings[0] and "rod" in warnings[0] and "at its start" in warnings[0]
