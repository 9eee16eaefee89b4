"""Recordings of rigid things that carry more markers than they need, or fewer: arms of pendulums, and boxes."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
import takes
from commands import run
from scipy.integrate import solve_ivp
from sheetbend.look import Take, draft, seen
from test_look_strangers import bars, drafted

Array = np.ndarray
NOISE = 4e-4


def with_middles(x: Array) -> Array:
    """Joints of arms, and a marker on each arm between them, in an order that is not along the arms."""
    return np.concatenate([0.45 * x[:, 1:] + 0.55 * x[:, :-1], x], axis=1)


@pytest.mark.parametrize("arms", [1, 2, 3])
def test_arms_with_several_markers_each(tmp_path: Path, arms: int) -> None:
    """A rope was drafted through all of them."""
    joints = bars(481, 60)[:, : arms + 1]
    plain, own = drafted(tmp_path, joints, 60, NOISE)
    found, content = drafted(tmp_path, with_middles(joints), 60, NOISE)
    assert found.kind == plain.kind
    places = [[section["radius"] for section in c["marker"]] for c in (content, own)]
    np.testing.assert_allclose(*places, atol=2e-4)
    assert any("on the same arms, and not used" in words for words in found.seen)


def test_a_rope_that_swings_a_little_on_a_pin_is_no_arm(tmp_path: Path) -> None:
    """Its markers keep their distances from the pin within their noise; their angles about it differ."""
    t = np.arange(601) / 100
    down = np.linspace(0.0, 0.6, 7)
    angle = 0.04 * np.cos(1.2024 * np.sqrt(9.81 / 0.6) * t)[:, None]
    turned = np.cumsum(np.diff(down) * angle * (1.0 + 1.5 * down[1:] / 0.6), axis=1)  # more and more outward
    across = np.concatenate([np.zeros((len(t), 1)), turned], axis=1)
    x = np.stack([across, 0.0 * across, 1.0 - down + 0.0 * across], axis=2)
    assert drafted(tmp_path, x, 100, NOISE)[0].kind == "a rope"


def kind(x: Array, t: Array) -> str:
    noise = 2e-4 * np.random.default_rng(0).standard_normal(x.shape)
    return draft([Take(seen(sb.Recording(x + noise, t)), "take.csv")], "take").kind


@pytest.mark.parametrize("finger", [True, False], ids=["finger", "alone"])
def test_a_box_that_is_pushed_over_a_table_is_no_rope(finger: bool) -> None:
    """A rope was drafted from corner to corner, and on to the finger."""
    t = np.arange(301) / 100
    a = 0.3 * np.maximum(t - 0.5, 0.0)
    c, s, zero, one = np.cos(a), np.sin(a), 0.0 * t, 1.0 + 0.0 * t
    turns = np.moveaxis(np.array([[c, -s, zero], [s, c, zero], [zero, zero, one]]), 2, 0)
    corners = np.array([[0.05, 0.05, 0.03], [-0.05, 0.05, 0.03], [-0.05, -0.05, 0.03], [0.05, -0.04, 0.03]])
    place = np.stack([0.05 * np.maximum(t - 0.5, 0.0), 0.01 * np.sin(t), zero], axis=1)
    x = np.einsum("fab,kb->fka", turns, corners)
    x = np.concatenate([x, np.broadcast_to([-0.08, 0.0, 0.02], (len(t), 1, 3))], axis=1) + place[:, None]
    with pytest.raises(sb.RecordingError, match=r"do not move like a rope.*docs/bodies.md"):
        kind(x if finger else x[:, :4], t)


@pytest.mark.parametrize("what", ["door", "swing", "bar on a wire"])
def test_a_draft_of_a_body_that_turns_on_something_says_that_nothing_bends(what: str) -> None:
    """A door was drafted as a beam that swings at 3 Hz, a seat on two ropes as a cloth, a bar on a wire as a rope on a
    table, without a word."""
    t = np.arange(301) / 60
    angle = {"door": 2.0 * (1.0 - np.exp(-1.2 * t)), "swing": 0.4 * np.cos(3.5 * t)}.get(what, 1.2 * np.cos(2.2 * t))
    c, s, zero, one = np.cos(angle), np.sin(angle), 0.0 * t, 1.0 + 0.0 * t
    about_z = np.moveaxis(np.array([[c, -s, zero], [s, c, zero], [zero, zero, one]]), 2, 0)
    about_y = np.moveaxis(np.array([[c, zero, s], [zero, one, zero], [-s, zero, c]]), 2, 0)
    door = [[0.1, 0.02, 0.4], [0.7, 0.02, 0.4], [0.7, 0.02, 1.6], [0.1, 0.02, 1.6], [0.4, 0.02, 1.0]]
    frame = [[-0.05, 0.0, 0.3], [-0.05, 0.0, 1.8], [-0.06, 0.05, 1.0]]
    ropes = [[0.0, y, -z] for y in (-0.2, 0.2) for z in (0.26, 0.53, 0.8)]
    still, moving, turns = {
        "door": (frame, door, about_z),
        "swing": ([[0.0, -0.2, 0.0], [0.0, 0.2, 0.0]], [*ropes, [0.05, -0.15, -0.8], [-0.05, 0.15, -0.8]], about_y),
        "bar on a wire": ([[0.0, 0.0, 0.7]], [[0.1, 0.0, 0.0], [-0.1, 0.0, 0.0], [0.05, 0.02, 0.02]], about_z),
    }[what]
    x = np.concatenate([np.tile(still, (len(t), 1, 1)), np.einsum("fab,kb->fka", turns, np.array(moving))], axis=1)
    recording = sb.Recording(x + 2e-4 * np.random.default_rng(0).standard_normal(x.shape), t)
    found = draft([Take(seen(recording), "take.csv")], "take")
    assert found.kind != "a beam clamped at one end"
    assert any("all markers that move keep their places on one rigid body" in words for words in found.unknown)


@pytest.mark.parametrize("which", ["bob", "small", "cone"])
def test_a_pendulum_without_its_pivot_or_out_of_a_plane(which: str) -> None:
    """A stranger was told to record three markers on a rope, or to measure a beam."""
    t = np.arange(601) / 60
    swing = (0.5 if which == "bob" else 0.1) * np.cos(4.0 * t)
    end = 0.62 * np.stack([np.sin(swing), 0.0 * t, -np.cos(swing)], axis=1)
    x = end[:, None]
    if which == "cone":
        x = np.stack([0.0 * end, 0.62 * np.stack([0.5 * np.cos(4.3 * t), 0.5 * np.sin(4.3 * t), -0.866 + 0 * t], 1)], 1)
    with pytest.raises(sb.RecordingError, match="of a pendulum, give its pivot too"):
        kind(x, t)


def test_times_of_a_clock_that_began_long_ago(tmp_path: Path) -> None:
    """The draft did not run: six digits of a time in seconds since 1970 are a thousand seconds apart."""
    r = takes.rope_in_hand("one", seconds=1.0)
    own = []
    for name, begin in (("plain", 0.0), ("late", 1.73e9)):
        sb.Recording(r.positions, begin + r.times, r.markers).save(tmp_path / f"{name}.csv")
        result = run("new", tmp_path / f"{name}.csv", "--output", tmp_path / f"{name}.toml")
        assert result.exit_code == 0, result.output
        own.append(tomllib.loads((tmp_path / f"{name}.toml").read_text())["recording"][0])
    for key in ("fit", "held_out"):
        np.testing.assert_allclose(np.subtract(own[1][key], own[0][key]), 1.73e9, atol=1.1e-4)


def test_a_tool_at_the_place_of_a_marker(tmp_path: Path) -> None:
    """The draft did not run: it named the director of a rod whose first two markers are at one place."""
    r = takes.rope_in_hand("one", seconds=2.0)
    found, content = drafted(tmp_path, r.positions[:, [0, *range(9)]], 100, 0.0)
    assert "m1 is at the place of another marker in every frame, and left out" in found.seen
    assert content["scene"]["rod"][0]["hold_roll"] == ["start"]


def test_arms_whose_mass_is_at_their_ends(tmp_path: Path) -> None:
    """The first arm was no body, by noise, and both began as uniform rods: the fit ended without a minimum."""
    length, mass, viscosity = np.array([0.3, 0.25]), np.array([1.0, 0.6]), 0.002
    hung = mass[::-1].cumsum()[::-1] * length

    def slope(_: float, y: Array) -> Array:
        turn, w = y[0] - y[1], y[2:]
        inertia = np.array([[hung[0] * length[0], hung[1] * length[0] * np.cos(turn)]] * 2)
        inertia[1] = hung[1] * length[0] * np.cos(turn), hung[1] * length[1]
        pull = hung[1] * length[0] * np.sin(turn) * np.array([-(w[1] ** 2), w[0] ** 2])
        hinge = viscosity * np.array([w[0] + w[0] - w[1], w[1] - w[0]])
        return np.concatenate([w, np.linalg.solve(inertia, pull - 9.81 * hung * np.sin(y[:2]) - hinge)])

    t = np.arange(601) / 100
    q = solve_ivp(slope, (0.0, 6.0), [0.7, 0.5, 0.0, 0.0], t_eval=t, rtol=1e-9, atol=1e-10).y[:2].T
    ends = np.cumsum(length[:, None] * np.stack([np.sin(q), 0.0 * q, -np.cos(q)], axis=2), axis=1)
    _, content = drafted(tmp_path, np.concatenate([np.zeros((len(t), 1, 3)), ends], axis=1), 100, 2e-4)
    upper, lower = content["scene"]["arm"]
    whole = upper["inertia"] + length[0] ** 2 * lower["mass"]  # of the first arm with what hangs on it
    first = upper["first_moment"] + length[0] * lower["mass"]
    assert first / whole == pytest.approx(hung[0] / (hung[0] * length[0]), rel=0.03)
    assert lower["first_moment"] / whole == pytest.approx(hung[1] / (hung[0] * length[0]), rel=0.03)
    assert lower["inertia"] / whole == pytest.approx(hung[1] * length[1] / (hung[0] * length[0]), rel=0.03)
    least = content["parameters"]["upper_first_moment"]["lower"]
    assert upper["inertia"] / length[0] < least < upper["first_moment"]  # elsewhere a particle's mass is negative
