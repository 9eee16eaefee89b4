"""The synthetic rope: its data are what its script writes, and the intervals of a coarser fit hold the true values."""

from __future__ import annotations

import runpy
from dataclasses import replace
from pathlib import Path

import pytest
import sheetbend as sb
from sheetbend.config import build, parse
from sheetbend.config.build import Study

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "twin"


def study() -> Study:
    return build(parse(FOLDER / "twin.toml"), FOLDER)


@pytest.fixture(scope="module")
def found() -> sb.Fit:
    s = study()
    return sb.fit(s.experiments, parameters=s.parameters, **s.options)


def test_the_data_come_from_a_finer_discretization(tmp_path: Path) -> None:
    runpy.run_path(str(FOLDER / "make_data.py"))["main"](tmp_path)
    shipped, again = (sb.Recording.load(folder / "twin.npz") for folder in (FOLDER / "data", tmp_path))
    assert again.positions == pytest.approx(shipped.positions, abs=1e-9)
    assert again.metadata == shipped.metadata and "SYNTHETIC" in shipped.metadata["what"]
    (e,) = study().experiments
    assert shipped.metadata["made_with"]["segments"] >= 4 * (len(e.scene.ropes["rope"].particles) - 1)
    assert shipped.metadata["made_with"]["substep"] <= e.solver.h / 8 * (1.0 + 1e-9)


@pytest.mark.parametrize("name", ["rope_EI", "rope_bend_damping", "rope_drag_linear"])
def test_the_interval_holds_the_truth(found: sb.Fit, name: str) -> None:
    truth = sb.Recording.load(FOLDER / "data" / "twin.npz").metadata["true"][name]
    estimate = found[name]
    assert estimate.verdict == "identified"
    assert estimate.lower <= truth <= estimate.upper
    assert 0.0 < estimate.discretization <= estimate.half_width


def test_statistics_alone_would_be_overconfident(found: sb.Fit) -> None:
    truth = sb.Recording.load(FOLDER / "data" / "twin.npz").metadata["true"]["rope_EI"]
    assert abs(found["rope_EI"].value - truth) > 2.0 * found["rope_EI"].statistical


@pytest.mark.parametrize("finer", ["segments", "substep"])
def test_stiffness_moves_less_than_2_percent_and_less_than_its_interval(found: sb.Fit, finer: str) -> None:
    s = study()
    experiments = build(s.config, FOLDER, finer=2).experiments if finer == "segments" else s.experiments
    if finer == "substep":
        experiments = [replace(e, solver=e.solver.with_h(e.solver.h / 2)) for e in experiments]
    start = {name: {**given, "initial": found.values[name]} for name, given in s.parameters.items()}
    moved = abs(sb.fit(experiments, parameters=start)["rope_EI"].value - found["rope_EI"].value)
    assert moved < 0.02 * found["rope_EI"].value and moved <= found["rope_EI"].half_width


def test_the_unseen_half_second_is_predicted(found: sb.Fit) -> None:
    (recording,) = found.result.recordings
    assert recording.held_out < 0.02 * recording.baseline
