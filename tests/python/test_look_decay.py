"""What a draft of one arm takes for the losses of its swing: those that the decay shows."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from test_look_strangers import drafted

LENGTH, RATE = 0.6, 100


def swing(friction: float, viscosity: float, drag: float, seconds: float = 25.0) -> np.ndarray:
    """A pivot and a bob of 1 kg at `LENGTH`, with torques N m over a power of rad/s."""
    a, b, c = np.array([friction, viscosity, drag]) / LENGTH**2

    def slope(_: float, y: np.ndarray) -> list[float]:
        return [y[1], -9.81 / LENGTH * np.sin(y[0]) - a * np.tanh(y[1] / 2e-3) - b * y[1] - c * y[1] * abs(y[1])]

    t = np.arange(round(seconds * RATE)) / RATE
    q = solve_ivp(slope, (0.0, seconds), [0.8, 0.0], t_eval=t, rtol=1e-8, atol=1e-9, method="LSODA").y[0]
    bob = LENGTH * np.stack([np.sin(q), 0.0 * q, -np.cos(q)], axis=1)
    return np.stack([0.0 * bob, bob], axis=1) + np.array([0.1, 0.0, 1.0])


LOSSES = {
    "friction": (7e-3, 0.0, 0.0),
    "viscosity": (0.0, 0.02, 0.0),
    "drag": (0.0, 0.0, 0.03),
    "friction and viscosity": (5e-3, 0.01, 0.0),
    "friction and drag": (5e-3, 0.0, 0.02),
}


@pytest.mark.parametrize("lost", list(LOSSES))
def test_a_draft_fits_the_losses_that_a_decay_shows(tmp_path: Path, lost: str) -> None:
    """Dry friction and drag were fitted to a viscous hinge: the friction was 2.7 times too large, "identified"."""
    true = dict(zip(("friction", "viscosity", "drag"), LOSSES[lost], strict=True))
    for seed in range(3):
        x = swing(**true) + np.random.default_rng(seed).normal(0.0, 3e-4, (2500, 2, 3))
        x[400:420, 1] = np.nan  # a gap
        found, content = drafted(tmp_path, x, RATE, 0.0)
        assert found.kind == "a pendulum"
        (arm,) = content["scene"]["pendulum"]
        wanted = {key: value for key, value in true.items() if value}
        assert {key: arm[key] for key in true if key in arm} == pytest.approx(wanted, rel=0.1)
        names = {f"arm_{'hinge_viscosity' if key == 'viscosity' else key}" for key in wanted}
        assert set(content["parameters"]) == {"arm_length", "arm_zero", "arm_angle", "arm_rate"} | names
        (words,) = (words for words in found.unknown if words.startswith("how it loses energy"))
        assert (words.split(" explain")[0].count(" and ") == 1) == (len(wanted) == 2)


def test_an_arm_that_is_held_before_it_swings_and_rests_after_it(tmp_path: Path) -> None:
    """Places that do not change by a bit, as of an encoder, had all the weight: no loss was fitted."""
    x = swing(0.03, 0.0, 0.0)
    x = np.concatenate([np.repeat(x[:1], 200, axis=0), x, np.repeat(x[-1:], 500, axis=0)])
    _, content = drafted(tmp_path, np.round(x, 4), RATE, 0.0)
    (arm,) = content["scene"]["pendulum"]
    assert arm["friction"] == pytest.approx(0.03, rel=0.1)
    assert "viscosity" not in arm and "drag" not in arm


def test_what_is_lost_in_a_long_gap_is_not_guessed(tmp_path: Path) -> None:
    x = swing(0.0, 0.02, 0.0) + np.random.default_rng(0).normal(0.0, 3e-4, (2500, 2, 3))
    x[500:1200, 1] = np.nan
    _, content = drafted(tmp_path, x, RATE, 0.0)
    (arm,) = content["scene"]["pendulum"]
    assert arm["viscosity"] == pytest.approx(0.02, rel=0.1)
    assert "friction" not in arm and "drag" not in arm


def test_a_swing_that_shows_no_loss_and_one_that_two_explain(tmp_path: Path) -> None:
    x = swing(0.0, 0.0, 0.0) + np.random.default_rng(0).normal(0.0, 3e-4, (2500, 2, 3))
    found, content = drafted(tmp_path, x, RATE, 0.0)
    assert set(content["parameters"]) == {"arm_length", "arm_zero", "arm_angle", "arm_rate"}
    assert any("does not decay within its noise, and no loss is fitted" in words for words in found.unknown)
    short = swing(0.0, 0.02, 0.0, seconds=4.0) + np.random.default_rng(0).normal(0.0, 1e-3, (400, 2, 3))
    found, _ = drafted(tmp_path, short, RATE, 0.0)
    assert any("about as well, with other values" in words for words in found.unknown)
