"""The silicone beam as a rod: what shear does to its stiffness, and that its motion does not show GA."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest
from pytest import approx
from sheetbend.config import load
from sheetbend.fitting.fit import Fit

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "beam"


@pytest.fixture(scope="module")
def script() -> Iterator[ModuleType]:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(FOLDER))
        sys.modules.pop("shear", None)
        yield importlib.import_module("shear")
        del sys.modules["shear"]


@pytest.fixture(scope="module")
def fits(script: ModuleType) -> dict[str, Fit]:
    study = load(script.CONFIG)
    return {name: script.fitted(study, shear, refine=False) for name, shear in script.MODELS.items()}


def test_the_rod_without_shear_is_the_chain(fits: dict[str, Fit]) -> None:
    """README: the chain gives 0.0186 N m^2, and 1 % more with a free clamp's angle."""
    assert fits["no shear"]["beam_EI"].value == approx(0.0188, rel=5e-3)


def test_shear_takes_its_share_of_the_softness(script: ModuleType, fits: dict[str, Fit]) -> None:
    """Sag under the own weight: q L^4/(8 EI) + q L^2/(2 GA)."""
    share = 4 / (script.SHEAR * 0.1**2)
    stiffer = fits["GA by the section"]["beam_EI"].value / fits["no shear"]["beam_EI"].value
    assert stiffer == approx(1 + share, abs=0.03)
    assert fits["GA by the section"]["beam_EI"].lower > fits["no shear"]["beam_EI"].upper


def test_the_motion_does_not_show_GA(fits: dict[str, Fit]) -> None:
    assert fits["GA free"]["beam_GA"].verdict == "not identifiable"
    assert fits["GA free"].result.cost == approx(fits["no shear"].result.cost, rel=1e-3)
