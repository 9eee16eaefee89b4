"""Wrong given numbers of motions that follow a noisy marker."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import sheetbend as sb
from pytest import approx
from sheetbend.doubts.driven_errors import MOST_NUMBERS, driven_errors, driven_span
from sheetbend.doubts.told import told_numbers
from sheetbend.doubts.told_inputs import FARTHER
from sheetbend.doubts.wrong_given import wrong_given
from sheetbend.experiment.wanted import as_parameters
from sheetbend.problem.problem import FitProblem
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


LOSSES = {"bend_damping": 0.02, "drag_linear": 0.02}
HAND = np.linspace(0.0, 1.0, 61)


def carried(far: float = 1.0, aside: float = 0.0, EI: float = 1e-3, nodes: int = 1, **options: float) -> sb.Scene:
    """A rope below a hand that swings by 8 cm, so many times as far and so many m aside."""
    down = {"start": (aside, 0.0, 0.0), "direction": (0.0, 0.0, -1.0), "pinned": ()}
    scene = sb.rope(0.4, 10, density=0.05, EI=EI, **LOSSES, **down, **options)
    held, path = scene.ropes["rope"].particles[[0, -1][:nodes]], np.zeros((len(HAND), nodes, 3))
    path[..., 0] = (far * 0.08 * np.sin(7.5 * HAND) * np.minimum(HAND / 0.2, 1.0))[:, None]
    scene.drive(held, HAND, scene.positions[held] + path)
    return scene


def carried_recording(true: sb.Scene, model: sb.Scene, noise: float = 3e-4) -> sb.Experiment:
    at = [int(p) for p in true.ropes["rope"].particles[2::2]]
    solver = sb.Solver(h=1 / 240)
    x = sb.simulate(true, HAND, solver).positions[:, at]
    recording = sb.Recording(positions=x + noise * np.random.default_rng(0).standard_normal(x.shape), times=HAND)
    return sb.Experiment(
        scene=model, recording=recording, markers=[sb.on_particle(p) for p in at], solver=solver, sigma=3e-4
    )


def test_a_hand_that_moves_farther_than_it_is_told_is_named() -> None:
    """By 5 %. Drag was "weak", 4.5 half-widths off, and by 0.5 % without noise "identified", 2.4 off; nothing named."""
    names = ("rope_EI", "rope_bend_damping", "rope_drag_linear")
    e = carried_recording(carried(1.05), carried(EI=1.3e-3))
    result = sb.fit(e, parameters=names, profiles=False, refine=False, beginnings=False).result
    drag = result["rope_drag_linear"]
    assert abs(drag.value - 0.02) > 4 * drag.half_width  # type: ignore[operator]
    assert drag.verdict == "doubtful" and "what drives the scene moved 4.9 % farther" in drag.words
    little = carried_recording(carried(1.005), carried(EI=1.3e-3))
    drag = sb.fit(little, parameters=names, profiles=False, refine=False, beginnings=False)["rope_drag_linear"]
    assert drag.verdict == "identified"  # noise hides it
    assert 2 * drag.half_width < abs(drag.value - 0.02) < drag.in_all  # type: ignore[operator]


def test_a_hand_that_is_elsewhere_than_it_is_told_is_named() -> None:
    """Told 5 mm too far along x; nothing was named at residuals of 10 sigma."""
    (found,) = asked(carried_recording(carried(), carried(aside=5e-3)), names=("rope_EI", "rope_drag_linear"))
    assert found.sure and any("what drives the scene were 5 mm farther along -x" in one for one in found.words)


def test_a_path_that_is_longer_changes_what_a_simulation_along_it_does() -> None:
    both = {"nodes": 2, "EA": 20.0}  # a taut rope that keeps its length cannot follow both ends
    e = carried_recording(carried(**both), carried(**both))
    problem = FitProblem([e], as_parameters(["rope_EI"], [e]))
    u, little = problem.parameters.initial(), 1e-5
    (path,) = [one for one in told_numbers(problem, u)[0] if one.label == FARTHER]
    ends = [problem.of([replace(e, scene=carried(1 + d, **both))]).evaluate(u)[1] for d in (little, -little)]
    difference = (ends[0] - ends[1]) / (2 * little)
    assert np.linalg.norm(difference - path.column) < 1e-5 * np.linalg.norm(difference)
