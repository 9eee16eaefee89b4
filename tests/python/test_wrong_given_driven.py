"""Wrong given numbers of motions that follow a noisy marker."""

from __future__ import annotations

import numpy as np
import pytest
import sheetbend as sb
from pytest import approx
from sheetbend.doubts.driven_errors import MOST_NUMBERS, driven_errors, driven_span
from sheetbend.doubts.told import told_numbers
from sheetbend.doubts.wrong_given import wrong_given
from test_contact_fit import SOLVER, TIMES, dragged
from test_driven_errors import NOISE, START, swung
from test_misread import SIGMA
from test_wrong_given import asked, minimum

NAMES = ("table_friction", "rope_EI")


def following(hand: np.ndarray, slope: float = 0.0) -> sb.Scene:
    scene = dragged(friction=0.3, aside=0.0, slope=slope)
    scene.follow(scene.ropes["rope"].particles[:1], TIMES, hand, ["hand"])
    return scene


def drawn_by_hand(degrees: float, seed: int, noise: float = 2.2) -> sb.Experiment:
    """A rope that is drawn over a turned table by a hand, told level. It follows the hand's marker, whose noise is so
    many times that of the others."""
    start = dragged(friction=0.3, aside=0.0)
    share = np.clip((TIMES - 0.04) / 0.3, 0.0, 1.0)
    hand = np.repeat(start.positions[start.ropes["rope"].particles[:1]][None], len(TIMES), axis=0)
    hand[:, 0, 1] += 0.15 * share**2 * (3 - 2 * share)
    true = following(hand, float(np.tan(np.deg2rad(degrees))))
    at = [int(p) for p in true.ropes["rope"].particles[1:]]
    x = np.concatenate([hand, sb.simulate(true, TIMES, SOLVER).positions[:, at]], axis=1)
    size = np.array([noise] + [1.0] * len(at))[:, None] * SIGMA
    x = x + size * np.random.default_rng(seed).standard_normal(x.shape)
    names = ("hand", *(f"m{k}" for k in at))
    recording = sb.Recording(positions=x, times=TIMES, markers=names, name="drag")
    places = [None, *map(sb.on_particle, at)]
    return sb.Experiment(scene=following(x[:, :1]), recording=recording, markers=places, solver=SOLVER, sigma=SIGMA)


@pytest.mark.parametrize(("degrees", "words"), [(0.8, "turned by 0.71 degrees"), (1.1, "turned by 0.98 degrees")])
def test_noise_of_a_hand_hides_no_turned_table(degrees: float, words: str) -> None:
    """Of 2.2 sigma: the table explains 9 and 27 % of all that is left, and 88 and 92 % of what no other motion of the
    hand explains. Friction was 0.365 +/- 0.048 and 0.394 +/- 0.052, "identified"."""
    (found,) = asked(drawn_by_hand(degrees, 0), names=NAMES)
    assert found.sure and found.driven and 0.85 < found.explained < 1.1
    assert any(f"table were {words} about -x" in one for one in found.words), found.words


def test_a_turned_table_makes_the_friction_under_a_noisy_hand_doubtful() -> None:
    result = sb.fit(drawn_by_hand(0.8, 0), parameters=NAMES, profiles=False, refine=False).result
    friction = result["table_friction"]
    assert friction.verdict == "doubtful" and friction.lower > 0.3  # type: ignore[operator]
    assert "With that it would be 0.299 +/- 0.035" in friction.words and "what drives it included" in friction.words
    assert any("table were turned by 0.71 degrees" in w for w in result.warnings), result.warnings


def test_a_level_table_under_a_noisy_hand_is_right() -> None:
    for seed in (3, 14, 15, 20):
        assert asked(drawn_by_hand(0.0, seed), names=NAMES) == []


def test_motions_of_the_hand_excuse_no_candidate() -> None:
    """Drag that grows with the square of the speed. Motions of the hand of any size would explain that as well:
    linear drag, which it moves, was "identified" when they did."""
    e = swung(0, 1, driven=2 * NOISE, drag_linear=1e-4, drag_quadratic=0.05)
    problem, u = minimum(e, names=START)
    told, _ = told_numbers(problem, u)
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("sheetbend.doubts.driven_errors.MOST_NUMBERS", 384)
        assert driven_span(problem, u).shape[1] == 363
        (found,) = wrong_given(problem, u, told)
    assert not found.sure and not found.driven and "drag_quadratic" in found.words[0]
    (drag,) = [k for k, name in enumerate(problem.parameters.free) if name == "rope_drag_linear"]
    assert abs(found.steps[0][drag]) > 0.1


def test_the_span_holds_what_noise_of_the_hand_does() -> None:
    problem, u = minimum(drawn_by_hand(0.0, 3), names=NAMES)
    span, errors = driven_span(problem, u), driven_errors(problem, u, 8)
    assert span.shape == (problem.core.data_rows, 3 * len(TIMES)) and span.shape[1] <= MOST_NUMBERS
    size = np.maximum(np.linalg.norm(span, axis=0), 1e-300)
    left = errors - span / size @ np.linalg.lstsq(span / size, errors, rcond=None)[0]
    assert np.linalg.norm(left) == approx(0.0, abs=1e-6 * np.linalg.norm(errors))
    other = driven_errors(problem, u, MOST_NUMBERS)[:, 3 * len(TIMES) :]  # draws that are not among its columns
    left = other - span / size @ np.linalg.lstsq(span / size, other, rcond=None)[0]
    assert np.linalg.norm(left) < 1e-6 * np.linalg.norm(other)


def test_motions_of_too_many_numbers_or_none_have_no_span(monkeypatch: pytest.MonkeyPatch) -> None:
    problem, u = minimum(drawn_by_hand(0.0, 3), names=NAMES)
    monkeypatch.setattr("sheetbend.doubts.driven_errors.MOST_NUMBERS", 3 * len(TIMES) - 1)
    assert driven_span(problem, u).shape == (problem.core.data_rows, 0)
