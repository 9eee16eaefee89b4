"""What had slid inside a rope before a recording begins shows in its first frames, and predictions start with it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.gripped import GrippedMotion, RopeModel
from sheetbend.gripped import slid as slid_before
from sheetbend.gripped.judging import predict
from sheetbend.gripped.slid import MODES, MORE, STEPS, noise, slid, window_of
from sheetbend.problem.problem import FitProblem
from sheetbend.report.scores import coordinate_error
from test_gripped_motion import carried_about, model_of, simulated

MOTION = GrippedMotion.of(carried_about(), 0.08)
YIELDS = {"EI": 0.05, "yield_curvature": 1.5, "yield_share": 0.5}
MODEL = model_of(MOTION).with_values(**YIELDS)
HISTORY = {"rope_slid_1_0": 2.0, "rope_slid_2_1": 2.5}  # 1/m


def recorded(history: dict[str, float], sd: float = 3e-4) -> GrippedMotion:
    """A recording of the model, in which this had slid before it began."""
    e = replace(MODEL, slid_modes=MODES).experiment(MOTION)
    positions = simulated(e, MOTION, history)
    positions += sd * np.random.default_rng(0).standard_normal(positions.shape)
    return GrippedMotion.of(replace(e.recording, positions=positions), 0.08)


def error(motion: GrippedMotion, x: np.ndarray) -> float:
    """Mean error of a coordinate, m."""
    return coordinate_error(motion.recording, x)


def forgetful(motion: GrippedMotion) -> float:
    """The error of the model whose friction remembers nothing at the start."""
    return error(motion, simulated(MODEL.experiment(motion), motion))


def test_a_history_is_seen_in_the_first_frames() -> None:
    motion = recorded(HISTORY)
    (x,) = predict(MODEL, [motion], {})
    assert error(motion, x) < 0.7 * forgetful(motion)  # noise is a fifth of it
    found = slid(replace(MODEL, slid_modes=MODES), motion, 0.0, {})
    assert set(found) == {f"rope_slid_{axis}_{k}" for axis in (1, 2) for k in MODES}
    assert max(abs(value) for value in found.values()) > 0.5


def test_noise_is_no_history() -> None:
    motion = recorded({})
    (x,) = predict(MODEL, [motion], {})
    assert error(motion, x) < 1.1 * forgetful(motion)
    found = slid(replace(MODEL, slid_modes=MODES), motion, 0.0, {})
    assert max(abs(value) for value in found.values()) < 0.5 * YIELDS["yield_curvature"]


def test_an_elastic_rope_remembers_nothing() -> None:
    elastic = model_of(MOTION)
    e = window_of(elastic, MOTION, (0.2, 0.6), {})
    assert not any("slid" in name for name in e.scene.quantities)
    assert e.start_time == pytest.approx(0.2)


def test_too_few_frames_tell_nothing() -> None:
    short = replace(MODEL, slid_modes=MODES, smoothing=0.03)
    assert set(slid(short, recorded(HISTORY), 0.0, {}).values()) == {0.0}


def test_a_fit_starts_with_it_too() -> None:
    motion = recorded(HISTORY)
    e = window_of(MODEL, motion, (0.0, 0.6), {})
    assert max(abs(e.scene.quantities[f"rope_slid_{axis}_{k}"].value) for axis in (1, 2) for k in MODES) > 0.5


def test_the_noise_of_markers_is_that_beside_a_smooth_motion() -> None:
    x = carried_about().positions
    assert noise(x) == 1e-4  # the least
    noisy = x + 5e-4 * np.random.default_rng(1).standard_normal(x.shape)
    assert noise(noisy) == pytest.approx(5e-4, rel=0.05)
    noisy[3:20, 2] = np.nan
    assert noise(noisy) == pytest.approx(5e-4, rel=0.05)


def test_modes_need_a_rod_that_yields() -> None:
    with pytest.raises(sb.SceneError, match="slid_modes: need a rod that yields"):
        sb.rod(0.3, 6, density=0.05, EI=1e-3, GJ=1e-3, slid_modes=(0,))


def test_a_rod_that_slid_is_bent_until_it_is_let_go() -> None:
    """What slid shifts the rest shape by the share of EI that slides."""
    options = {"density": 0.05, "EI": 1e-3, "GJ": 1e-3, "gravity": (0.0, 0.0, 0.0), "yield_curvature": 50.0}
    start = sb.Grip.fixed((0, 0, 0), (1, 0, 0))
    rod = sb.rod(0.3, 12, yield_share=0.4, slid_modes=(0,), bend_damping=0.05, drag_linear=0.05, start=start, **options)
    x = sb.simulate(rod, [3.0], sb.Solver(h=1e-2), {"rod_slid_1_0": 2.0}).positions[-1][rod.ropes["rod"].particles]
    turned = x[-1] - x[-2]
    along = np.arccos(turned @ (1.0, 0.0, 0.0) / np.linalg.norm(turned))
    assert along == pytest.approx(0.4 * 2.0 * 0.3 * (1 - 0.5 / 12), rel=0.03)


def test_what_had_slid_is_looked_for_once_for_each_start_and_rope(monkeypatch: pytest.MonkeyPatch) -> None:
    """A rung's first step, its fit and the prediction before it start from the same values."""
    motion, asked = recorded(HISTORY), list[tuple[float, float]]()

    def counted(model: RopeModel, motion: GrippedMotion, first: float, values: Mapping[str, float]) -> dict[str, float]:
        asked.append((first, values.get("rope_EI", 0.0)))
        return slid(model, motion, first, values)

    monkeypatch.setattr(slid_before, "slid", counted)
    (x,) = predict(MODEL, [motion], {})
    larger = replace(MODEL, tilts=True, places=True, curvature_modes=(0, 1))
    (same,) = predict(larger, [motion], {})
    assert len(asked) == 1 and np.array_equal(same, x)
    changed = {"rope_EI": 0.06}, {"rope_EI": 0.06, "rope_curvature_1_0": 0.1}
    for values in changed:
        assert not np.array_equal(predict(larger, [motion], values)[0], x)
    window_of(MODEL, motion, (0.1, 0.6), {})
    window_of(replace(MODEL, gravity=(0.0, -9.81, 0.0)), motion, (0.1, 0.6), {})
    window_of(MODEL, replace(motion), (0.1, 0.6), {})
    assert asked == [(0.0, 0.0), (0.0, 0.06), (0.0, 0.06), (0.1, 0.0), (0.1, 0.0), (0.1, 0.0)]


def test_what_a_rung_adds_at_zero_leaves_what_had_slid_as_it_is() -> None:
    """To the last bit, so that the order in which models ask does not matter."""
    motion, remembering = recorded(HISTORY), replace(MODEL, slid_modes=MODES)
    larger = replace(remembering, tilts=True, shifts=True, places=True, curvature_modes=(0, 3), softness_modes=(1, 2))
    assert slid(larger, motion, 0.0, {}) == slid(remembering, motion, 0.0, {})


def test_each_step_takes_one_derivative(monkeypatch: pytest.MonkeyPatch) -> None:
    """One more was made after the last step, and not used."""
    asked: list[bool] = []
    evaluate = FitProblem.evaluate

    def counted(problem: FitProblem, u: np.ndarray, jacobian: bool = True) -> tuple[bool, np.ndarray, np.ndarray]:
        asked.append(jacobian)
        return evaluate(problem, u, jacobian)

    monkeypatch.setattr(FitProblem, "evaluate", counted)
    slid(replace(MODEL, slid_modes=MODES), recorded(HISTORY), 0.0, {})
    assert 1 <= asked.count(True) <= STEPS + MORE and not asked[-1]
