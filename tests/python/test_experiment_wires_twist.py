"""The wires as rods: EI as of ropes, and the twist at which the hanging loop snaps, as experiments/wires claims it."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from pytest import approx

pytestmark = pytest.mark.slow

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "wires"
EI_ALONE = {"white": (7.93e-5, 1.002), "black": (8.94e-4, 1.616), "red": (6.83e-4, 1.802)}  # of the README: EI, GJ/EI


@pytest.fixture(scope="module")
def script() -> Iterator[ModuleType]:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(FOLDER))
        yield importlib.import_module("twist")
        del sys.modules["twist"]


def loop(script: ModuleType, wire: str, links: int = 100):
    EI, ratio = EI_ALONE[wire]
    return script.Loop(wire, script.hanging(wire, 0, EI, ratio, links), {})


def test_EI_as_a_rod_is_that_as_a_rope(script: ModuleType) -> None:
    """7.93e-5 of 200 rope links without angles and set, as study.py has it."""
    fit = script.fitted("white", angles=False, set_=False)
    assert fit["white_EI"].value == approx(7.93e-5, rel=0.01)


@pytest.mark.parametrize("wire", EI_ALONE)
def test_the_loop_snaps_at_the_measured_twist(script: ModuleType, wire: str) -> None:
    measured = np.mean(script.recording(wire, 0).metadata["published"]["critical_twist_deg"])
    (roll,) = script.critical([loop(script, wire)], *EI_ALONE[wire])
    assert roll == approx(measured, rel=0.01)


def test_a_stiffer_wire_snaps_earlier(script: ModuleType) -> None:
    EI, ratio = EI_ALONE["black"]
    one, stiffer = (script.critical([loop(script, "black")], EI, r)[0] for r in (ratio, 1.1 * ratio))
    assert np.log(stiffer / one) / np.log(1.1) == approx(-0.62, abs=0.03)


def test_the_way_to_the_snap(script: ModuleType) -> None:
    """A torque just below a straight rod's while the turn is small, and a loop far out of its plane before the snap."""
    path = loop(script, "black").path(*EI_ALONE["black"])
    roll, rest = path[1]
    EI, ratio = EI_ALONE["black"]
    assert 0.8 < -rest.forces["black_twist"][-1, 0] / (ratio * EI * roll / 1.5) < 1.0
    assert all(rest.unstable_modes == 0 for _, rest in path)
    x = path[-1][1].positions[rest.scene.ropes["black"].particles]
    assert np.ptp(x[:, 1]) > 0.1


def test_the_snap_does_not_depend_on_the_mesh(script: ModuleType) -> None:
    coarse, fine = (script.critical([loop(script, "red", links)], *EI_ALONE["red"])[0] for links in (100, 200))
    assert fine == approx(coarse, rel=0.01)
