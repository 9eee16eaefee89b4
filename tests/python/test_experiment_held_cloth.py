"""The synthetic cloth on a robot's bar: its log is what the script writes, the configuration holds the truth, and the
study counts what it says."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.config import build, parse
from sheetbend.experiment.wanted import as_parameters
from sheetbend.problem.problem import FitProblem

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "held_cloth"
sys.path.insert(0, str(FOLDER))
import camera  # noqa: E402
import seeds  # noqa: E402

EXPECTED = json.loads((FOLDER / "expected" / "study.json").read_text())


def test_the_log_is_what_the_script_writes() -> None:
    tool = sb.Tool.load(FOLDER / "data" / "poses.csv")
    t, x, q = camera.poses()
    assert tool.times == pytest.approx(t, abs=1e-6)
    assert tool.positions == pytest.approx(x, abs=1e-6)
    assert np.abs(np.abs((tool.quaternions * q).sum(axis=1)) - 1).max() < 1e-6


def test_the_configuration_holds_the_truth() -> None:
    """At the true values residuals are the camera's, and one Gauss-Newton step stays within a few half-widths: it goes
    to where the coarser mesh and step want the numbers."""
    made = build(parse(FOLDER / "held_cloth.toml"), FOLDER)
    problem = FitProblem(made.experiments, as_parameters(made.parameters, made.experiments))
    u = problem.parameters.to_internal(camera.TRUTH)
    ok, r, J = problem.evaluate(u)
    assert ok
    rms = 4.0 * np.sqrt(np.mean(r[: problem.core.data_rows] ** 2))
    assert 3.0 < rms < 6.5  # mm per coordinate; the camera's noise and slip make 3.8
    step = np.linalg.lstsq(J, -r, rcond=None)[0]
    moved = problem.parameters.to_physical(u + step)
    for name in ("clock", "robot_x", "robot_y", "robot_turn_x", "robot_turn_z"):
        lower, upper = EXPECTED["0"]["parameters"][name]["interval"]
        assert abs(moved[name] - camera.TRUTH[name]) < 2.0 * (upper - lower), name


def test_the_study_held_what_its_page_says() -> None:
    """The stored results of 50 seeds: which intervals hold the truth, and the errors beside the rigid carry."""
    held = {
        name: sum(seeds.inside(one, name, true) for one in EXPECTED.values()) for name, true in camera.TRUTH.items()
    }
    assert len(EXPECTED) == 50
    assert min(held.values()) >= 44, held  # 95 % of 50, less two standard deviations
    assert sum(held.values()) >= 0.95 * 50 * len(held)
    for one in EXPECTED.values():
        assert one["against_truth"] < 0.05 * min(one["without_physics"].values())
        assert one["held_out"] < 1.3 * one["noise"]
