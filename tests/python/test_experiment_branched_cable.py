"""The branched cable: its data are what its script writes, and the intervals of a coarser fit hold the true values."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest
import sheetbend as sb
from pytest import approx

pytestmark = pytest.mark.slow

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "branched_cable"
NAMES = ("trunk_EI", "left_EI", "right_EI", "trunk_bend_damping")
OWN = ("study", "make_data", "harness")


@pytest.fixture(scope="module")
def scripts() -> Iterator[dict[str, ModuleType]]:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(FOLDER))
        for name in OWN:
            sys.modules.pop(name, None)
        yield {name: importlib.import_module(name) for name in OWN}
        for name in OWN:
            del sys.modules[name]


@pytest.fixture(scope="module")
def recording() -> sb.Recording:
    return sb.Recording.load(FOLDER / "data" / "harness.npz")


@pytest.fixture(scope="module")
def found(scripts: dict[str, ModuleType], recording: sb.Recording) -> sb.Fit:
    return scripts["study"].fitted(recording)


def test_the_data_come_from_a_finer_discretization(
    scripts: dict[str, ModuleType], recording: sb.Recording, tmp_path: Path
) -> None:
    scripts["make_data"].main(tmp_path / "harness.npz")
    again = sb.Recording.load(tmp_path / "harness.npz")
    assert again.positions == approx(recording.positions, abs=1e-9)
    assert again.metadata == recording.metadata and "SYNTHETIC" in recording.metadata["what"]
    assert recording.metadata["made_with"]["links_and_steps_finer"] == 2


@pytest.mark.parametrize("name", NAMES)
def test_the_interval_holds_the_truth(found: sb.Fit, recording: sb.Recording, name: str) -> None:
    truth, estimate = recording.metadata["true"][name], found[name]
    assert estimate.verdict == "identified"
    # The data are of twice the links and steps, which leave a quarter of what the estimate moves to the limit.
    assert estimate.lower <= truth + estimate.moved / 4 <= estimate.upper
    assert estimate.value == approx(truth, rel=0.05)


def test_the_unseen_second_is_predicted(found: sb.Fit) -> None:
    (errors,) = found.result.recordings
    assert errors.held_out is not None and errors.held_out < 0.03 * errors.baseline
