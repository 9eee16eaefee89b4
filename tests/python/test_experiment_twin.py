"""The synthetic rope: its data are what its script writes, and the intervals of a coarser fit hold the true values."""

from __future__ import annotations

import runpy
from dataclasses import replace
from pathlib import Path

import pytest
import sheetbend as sb
from sheetbend.config import build, parse
from sheetbend.config.build import Study

pytestmark = pytest.mark.slow

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


def test_the_mesh_of_the_fit_alone_would_be_overconfident(found: sb.Fit) -> None:
    truth = sb.Recording.load(FOLDER / "data" / "twin.npz").metadata["true"]["rope_EI"]
    EI = found["rope_EI"]
    assert abs(found.on_mesh["rope_EI"] - truth) > 2.0 * EI.statistical
    assert abs(EI.value - truth) < EI.statistical  # at the limit of fine meshes


@pytest.mark.parametrize("finer", ["segments", "substep"])
def test_stiffness_moves_less_than_2_percent_and_less_than_its_interval(found: sb.Fit, finer: str) -> None:
    s = study()
    EI, start = found["rope_EI"], {n: {**given, "initial": found.values[n]} for n, given in s.parameters.items()}
    if finer == "segments":
        other = build(s.config, FOLDER, finer=2)
        again = sb.fit(other.experiments, parameters=start, **other.options)
        assert abs(again["rope_EI"].value - EI.value) <= EI.half_width
    else:
        again = sb.fit([replace(e, solver=e.solver.with_h(e.solver.h / 2)) for e in s.experiments], parameters=start)
        assert abs(again.on_mesh["rope_EI"] - found.on_mesh["rope_EI"]) <= EI.half_width
    assert abs(again.on_mesh["rope_EI"] - found.on_mesh["rope_EI"]) < 0.02 * EI.value


def test_the_unseen_half_second_is_predicted(found: sb.Fit) -> None:
    (recording,) = found.result.recordings
    assert recording.held_out < 0.02 * recording.baseline
