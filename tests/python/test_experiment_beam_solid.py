"""The silicone beam as a solid of bricks: E beside the rod's, and frequencies."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest
from pytest import approx
from sheetbend.config import load

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "beam"
MESH = (7, 2, 2)
BARE = {"beam_E": 276.1e3, "beam_damping": 2.15e-3, "beam_tilt": 0.1183}


@pytest.fixture(scope="module")
def script() -> Iterator[ModuleType]:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(FOLDER))
        sys.modules.pop("solid", None)
        yield importlib.import_module("solid")
        del sys.modules["solid"]


def test_the_loaded_runs_frequency_from_the_bare_run(script: ModuleType) -> None:
    """4.35 Hz were measured; with the stiffness that the bare run gives on this mesh."""
    assert script.loaded_frequency(load(script.CONFIG), MESH, BARE) == approx(4.35, rel=0.02)


def test_the_bare_beams_frequency_is_that_of_linear_elasticity(script: ModuleType) -> None:
    """7.607 Hz is the lowest eigenvalue of the same mesh's linear stiffness and lumped masses, computed apart."""
    values = BARE | {"beam_E": 264e3, "beam_damping": 1e-4}
    assert script.loaded_frequency(load(script.CONFIG), MESH, values, hung=0.0) == approx(7.607, rel=6e-3)


def test_a_face_that_may_narrow_makes_the_beam_softer(script: ModuleType) -> None:
    """By 10 % of the stiffness that the bare beam's frequency shows: 1.008 over 1.125 of Timoshenko's (clamps.py)."""
    values = BARE | {"beam_E": 264e3, "beam_damping": 1e-4}
    study = load(script.CONFIG)
    pinned, narrows = (script.loaded_frequency(study, MESH, values, clamp, hung=0.0) for clamp in script.CLAMPS)
    assert (narrows / pinned) ** 2 == approx(1.008 / 1.125, abs=0.006)


def test_the_loaded_runs_frequency_where_the_face_may_narrow(script: ModuleType) -> None:
    """With what the bare run gives for this clamp; 4.35 Hz were measured."""
    values = BARE | {"beam_E": 307e3}
    assert script.loaded_frequency(load(script.CONFIG), MESH, values, "narrows") == approx(4.35, rel=0.02)


@pytest.mark.slow
def test_the_solid_explains_the_bare_beam(script: ModuleType) -> None:
    """README: 276 kPa on this mesh, and errors as the rod's."""
    found = script.fitted(load(script.CONFIG), MESH)
    assert found["beam_E"].value == approx(276.1e3, rel=3e-3)
    assert found["beam_E"].lower > 270e3 and found["beam_E"].upper < 282e3
    rest, fall = (next(r for r in found.result.recordings if r.name == part) for part in ("rest", "fall"))
    assert rest.rms < 2.7e-4 and fall.rms < 3.0e-4 and fall.held_out < 1.8e-4
