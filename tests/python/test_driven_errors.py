"""Noise of what drives a scene is an error that all parts of the data share: it is named, and is no contradiction."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import sheetbend as sb
from pytest import approx
from sheetbend.doubts import driven_errors as module
from sheetbend.doubts.driven_errors import _KNOWN, driven_errors
from sheetbend.experiment.wanted import as_parameters
from sheetbend.problem.problem import FitProblem
from sheetbend.statistics.blocks import contradiction
from sheetbend.statistics.linearized import Linearized
from sheetbend.statistics.shared_errors import moved_by
from test_blocks import LAYOUT, SPLITS, fitted, jacobian

Array = np.ndarray
TRUE = {"EI": 2e-3, "bend_damping": 0.02, "drag_linear": 5e-3}
START = {"rope_EI": {"initial": 3e-3}, "rope_bend_damping": {"initial": 0.03}, "rope_drag_linear": {"initial": 4e-3}}
NOISE = 3e-4  # m
SOLVER = sb.Solver(h=1 / 300)
SEEN = (2, 4, 6, 8)
CASE = 0


def slow(rng: np.random.Generator, draws: int) -> Array:
    """(rows, draws): one slow error that moves all channels, each by its own weight."""
    frame, channel = LAYOUT.frame / (LAYOUT.frame.max() + 1), LAYOUT.channel
    waves = np.stack([np.sin(np.pi * k * frame) for k in range(1, 9)], axis=1) * (1 + channel)[:, None]
    return np.asarray(0.1 * waves @ rng.standard_normal((8, draws)))


def test_errors_of_known_size_that_all_parts_share_are_no_contradiction() -> None:
    """Of 20 draws of a slow shared error, hardly one is a contradiction where its size is known, and a real difference
    still is one."""
    rng, J = np.random.default_rng(6), jacobian()
    known = slow(np.random.default_rng(7), 64)
    draws = [fitted(J, 0.02 * rng.standard_normal(len(J)) + slow(rng, 1)[:, 0]) for _ in range(20)]
    found = [
        sum(contradiction(Linearized(r, J, LAYOUT, errors=e), SPLITS) is not None for r in draws) for e in (None, known)
    ]
    assert found[0] >= 4 and found[1] <= 1, found
    part = np.where(SPLITS[0].part == 0, -20.0, 20.0) * J[:, 1]
    assert contradiction(Linearized(fitted(J, draws[0] + part), J, LAYOUT, errors=known), SPLITS) is not None


def test_what_errors_move_is_the_least_squares_step() -> None:
    J = np.vstack([jacobian(), np.eye(4)])  # with priors
    e = slow(np.random.default_rng(8), 3)
    there = np.linalg.lstsq(J, -np.vstack([e, np.zeros((4, 3))]), rcond=None)[0]
    assert moved_by(J, e) == approx(there, rel=1e-9)


def swung(
    seed: int, markers: int, driven: float = NOISE, own: float = NOISE, smoothing: float = 0.0, **true: float
) -> sb.Experiment:
    """A rope that hangs from a hand, of which one marker or two are recorded, at 100 Hz for 1.2 s."""
    rng, t = np.random.default_rng(1000 + seed), np.arange(121) / 100
    ease = 1 - np.exp(-((t / 0.3) ** 2))
    a, w, p = rng.uniform(0.02, 0.08, 3), 2 * np.pi * rng.uniform(0.5, 1.6, 3), rng.uniform(0, 6, 3)
    inner = ease[:, None] * a * (np.sin(w * t[:, None] + p) - np.sin(p))
    angle = 0.4 * ease * np.sin(4 * t)
    outer = inner + 0.05 * np.stack([-np.sin(angle), 0 * angle, np.cos(angle)], axis=1)
    hand = np.stack([outer, inner], axis=1)[:, 2 - markers :]

    def scene(hand: Array, values: dict[str, float], smooth: float = 0.0) -> sb.Scene:
        made, end = sb.Scene("hand"), inner[0]
        grip = sb.Grip.from_markers(t, hand[:, 0], hand[:, 1]).smoothed(smooth) if markers == 2 else None
        line = [end, end - [0, 0, 0.4]]
        rope = sb.add_rope(made, "rope", points=line, segments=8, density=0.05, grip_start=grip, **values)
        if grip is None:
            made.follow(rope.particles[:1], t, hand, ["hand"])
        return made

    of_truth = scene(hand, {**TRUE, **true})
    at = of_truth.ropes["rope"].particles[list(SEEN)]
    x = np.concatenate([hand, sb.simulate(of_truth, t, SOLVER).positions[:, at]], axis=1)
    size = np.array([driven] * markers + [own] * 4)[:, None]
    x = x + size * np.random.default_rng(seed).standard_normal(x.shape)
    names = (*("outer", "hand")[2 - markers :], "a", "b", "c", "d")
    model = scene(x[:, :markers], TRUE, smoothing)
    places = [None] * markers + [sb.on_particle(int(k)) for k in at]
    recording = sb.Recording(positions=x, times=t, markers=names, name="swing")
    return sb.Experiment(scene=model, recording=recording, markers=places, solver=SOLVER, sigma=NOISE)


@pytest.mark.parametrize("smoothing", [0.0, 0.1])
def test_noise_of_a_grip_counts_and_contradicts_nothing(smoothing: float) -> None:
    """The model is right but for the noise of the hand's two markers. Parts of the data "contradict each other", or the
    beginnings ask for other values: so it was said."""
    found = sb.fit(swung(CASE, 2, smoothing=smoothing), parameters=START, profiles=False, refine=False)
    for e in found.result.estimates:
        assert e.verdict in ("identified", "weak") and e.driven > e.statistical
    assert any(
        "swing: noise of its driven motion (0.3" in w and "hold the grip's pose" in w for w in found.result.warnings
    )


def test_a_missing_loss_contradicts_beside_noise_of_a_grip() -> None:
    """Drag grows with the square of the speed, and is fitted as linear; the hand has the markers' noise / 10."""
    e = swung(0, 2, NOISE / 10, drag_linear=1e-4, drag_quadratic=0.05)
    found = sb.fit(e, parameters=START, profiles=False, refine=False)
    drag = found["rope_drag_linear"]
    assert drag.verdict == "doubtful" and "alone ask for" in drag.words and "noise of" not in drag.words


@pytest.mark.parametrize(("markers", "smoothing"), [(1, 0.0), (2, 0.0), (2, 0.1)])
def test_what_noise_does_to_residuals_is_what_it_does(markers: int, smoothing: float) -> None:
    """Against the residuals at the truth, where the compared markers have no noise of their own. What is left of
    smoothed noise is less than the bound."""
    squares, told = [], []
    for seed in range(5):
        e = swung(seed, markers, smoothing=smoothing, own=0.0)
        problem = FitProblem([e], as_parameters(START, [e]))
        u = problem.parameters.to_internal({f"rope_{name}": value for name, value in TRUE.items()})
        squares.append(np.mean(problem.evaluate(u)[1] ** 2))
        errors = driven_errors(problem, u, 16)
        assert errors.shape == (problem.core.data_rows, 16)
        told.append(np.mean(errors**2))
    ratio = np.sqrt(np.mean(told) / np.mean(squares))
    assert 0.75 < ratio < 1.33 if smoothing == 0.0 else 0.9 < ratio < 2.0, ratio


def test_what_is_not_driven_has_no_such_errors() -> None:
    scene = sb.rope(0.4, 8, density=0.05, EI=2e-3, pinned=(0,))
    recording = sb.Recording(positions=np.zeros((20, 1, 3)), times=np.arange(20) / 60, name="still")
    e = sb.Experiment(scene=scene, recording=recording, markers=[sb.on_particle(4)], solver=sb.Solver(h=1 / 240))
    problem = FitProblem([e], as_parameters(["rope_EI"], [e]))
    u = problem.parameters.initial()
    assert driven_errors(problem, u).shape == (problem.core.data_rows, 0)


def test_noise_that_no_interval_feels_costs_eight_draws() -> None:
    """A hand whose noise is 10 nm: 24 draws of it, and 64 more for parts, took half of a fit's time. Where it is felt,
    draws that were made once are the first of more."""
    for e, felt in ((swung(CASE, 1, driven=1e-8), False), (swung(CASE, 1), True)):
        problem = FitProblem([e], as_parameters(START, [e]))
        u = problem.parameters.to_internal({f"rope_{name}": value for name, value in TRUE.items()})
        assert driven_errors(problem, u, 8).shape[1] == 8 * felt
        (first,) = _KNOWN[problem].values()
        assert driven_errors(problem, u, 24).shape[1] == 24 * felt
        (more,) = _KNOWN[problem].values()
        assert len(more) == 24 * felt
        np.testing.assert_array_equal(more[:8], first)


def test_what_the_parameters_span_is_found_once_for_all_experiments(monkeypatch: pytest.MonkeyPatch) -> None:
    """Once for each: of 56 windows of a rope that took as long as ten of their derivatives."""
    made: list[int] = []
    found = module.spanned
    monkeypatch.setattr(module, "spanned", lambda J: made.append(len(J)) or found(J))
    experiments = [replace(swung(CASE, 1), name=f"{k}") for k in range(3)]
    problem = FitProblem(experiments, as_parameters(START, experiments))
    u = problem.parameters.to_internal({f"rope_{name}": value for name, value in TRUE.items()})
    together = driven_errors(problem, u, 8)
    assert made == [problem.core.rows] and (together != 0.0).any(axis=0).all()
