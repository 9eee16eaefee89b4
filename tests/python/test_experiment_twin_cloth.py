"""The synthetic cloth: its data are what its script writes, its estimates hold on another mesh, step and solver, and a
drape says what it does not tell."""

from __future__ import annotations

import runpy
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.config import build, parse
from sheetbend.config.build import Study
from sheetbend.config.values import with_values
from sheetbend.experiment.wanted import as_parameters
from sheetbend.problem.problem import FitProblem

pytestmark = pytest.mark.slow

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "twin_cloth"
SCRIPT = runpy.run_path(str(FOLDER / "make_data.py"))
PORTABILITY = runpy.run_path(str(FOLDER / "portability.py"))
STIFFNESSES = PORTABILITY["STIFFNESSES"]
MEMBRANE = ("cloth_warp", "cloth_weft", "cloth_shear")


def study(finer: int = 1) -> Study:
    return build(parse(FOLDER / "twin_cloth.toml"), FOLDER, finer)


class AtTruth:
    """The fit's problem at the true values, and where its minimum would go if the residuals changed: one Gauss-Newton
    step, right to first order."""

    def __init__(self) -> None:
        self.study = study()
        self.problem = self.of(self.study.experiments)
        self.u = self.problem.parameters.to_internal(SCRIPT["TRUE"])
        ok, self.r, self.J = self.problem.evaluate(self.u)
        assert ok

    def of(self, experiments: Sequence[sb.Experiment]) -> FitProblem:
        return FitProblem(experiments, as_parameters(self.study.parameters, experiments))

    def residuals(self, experiments: Sequence[sb.Experiment]) -> np.ndarray:
        ok, r, _ = self.of(experiments).evaluate(self.u, jacobian=False)
        assert ok
        return r

    def moved(self, change: np.ndarray) -> dict[str, float]:
        """Relative change of each stiffness (they are fitted by their logarithms)."""
        step = np.linalg.lstsq(self.J, -change, rcond=None)[0]
        return {name: s for name, s in zip(self.problem.parameters.free, step, strict=True) if name in STIFFNESSES}


@pytest.fixture(scope="module")
def truth() -> AtTruth:
    return AtTruth()


def test_the_data_are_what_the_script_writes() -> None:
    bias = {"bias_cut": SCRIPT["SWINGING"]["bias_cut"]}
    for again in (SCRIPT["swinging"](2, bias), SCRIPT["draped"]()):
        shipped = sb.Recording.load(FOLDER / "data" / f"{again.name}.npz")
        same = shipped.select(again.markers).positions[: len(again.times)]
        assert again.positions == pytest.approx(same, abs=1e-8)
        assert again.metadata == shipped.metadata and "SYNTHETIC" in shipped.metadata["what"]


def test_the_fit_has_the_same_pieces_on_coarser_meshes_and_longer_steps() -> None:
    pieces = SCRIPT["SWINGING"] | SCRIPT["DRAPED"]
    for e in study().experiments:
        for name, cloth in e.scene.cloths.items():
            mesh = pieces[name].mesh(1)
            np.testing.assert_allclose(cloth.mesh.vertices, mesh.vertices, atol=1e-12)
            np.testing.assert_allclose(cloth.mesh.material, mesh.material, atol=1e-12)
            seen = mesh.at(pieces[name].markers()).positions(mesh.vertices)
            placed = [p for p, m in zip(e.places, e.recording.markers, strict=True) if p and m.startswith(f"{name}_")]
            there = [np.array(p.weights) @ e.scene.positions[list(p.particles)] for p in placed]
            np.testing.assert_allclose(there, seen, atol=1e-6)
        assert e.static or e.solver.h == pytest.approx(4 * SCRIPT["H"])
    assert SCRIPT["FINER"] == 4


def test_the_truth_is_found_within_3_percent(truth: AtTruth) -> None:
    for name, moved in truth.moved(truth.r).items():
        assert abs(moved) < 0.03, name


@pytest.mark.parametrize("change", ["finer mesh", "half the step", "Gauss-Seidel"])
def test_stiffness_moves_less_than_3_percent(truth: AtTruth, change: str) -> None:
    other: Sequence[sb.Experiment] = truth.study.experiments
    if change == "finer mesh":
        other = study(finer=2).experiments
    elif change == "half the step":
        other = [replace(e, solver=e.solver.with_h(e.solver.h / 2)) for e in other]
    else:
        other = [PORTABILITY["by_gauss_seidel"](e, PORTABILITY["SWEEPS"]) for e in other]
    for name, moved in truth.moved(truth.residuals(other) - truth.r).items():
        assert 0.0 < abs(moved) < 0.03, name


def test_a_drape_alone_tells_one_bending_rigidity_and_says_so() -> None:
    config = parse(FOLDER / "twin_cloth.toml")
    fit = PORTABILITY["draped"](with_values(config, config.published))
    assert fit["cloth_bending_weft"].verdict == "identified"
    assert fit["cloth_bending_weft"].value == pytest.approx(SCRIPT["TRUE"]["cloth_bending_weft"], rel=0.03)
    assert fit["cloth_bending_weft"].lower <= SCRIPT["TRUE"]["cloth_bending_weft"] <= fit["cloth_bending_weft"].upper
    for name in MEMBRANE:
        assert fit[name].verdict not in ("identified", "at its floor"), name
