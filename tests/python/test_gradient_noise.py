"""`check_gradients` judges each path by its own noise: no false alarm, and no blind eye."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.mesh import icosphere
from sheetbend.motion.gradient_report import GradientReport
from sheetbend.scene.compiled import CompiledScene

SOLVER = sb.Solver(h=1 / 400, method="gauss_seidel")
TIMES = np.arange(5) / 400
BALL = icosphere(0.1, 1)


def ball(compliance: float) -> sb.Scene:
    """A skin that keeps its volume."""
    scene = sb.Scene("ball")
    cloth = sb.add_cloth(scene, BALL, density=0.3, warp=50.0, shear=20.0)
    scene.pin(cloth.particles[:1])
    scene.add_volume(cloth.particles[BALL.triangles], compliance=compliance)
    return scene


def bubble() -> sb.Scene:
    """Loose particles that nothing but the volume of their surface holds."""
    rng = np.random.default_rng(1)
    x = BALL.vertices + 0.01 * rng.standard_normal(BALL.vertices.shape)
    scene = sb.Scene("bubble", gravity=(0.0, 0.0, 0.0))
    scene.add_particles(x, rng.uniform(0.01, 0.02, len(x)), velocity=0.5 * rng.standard_normal(x.shape))
    scene.add_volume(BALL.triangles)
    return scene


def test_a_kept_volume_without_compliance_is_no_alarm() -> None:
    """No unit tells how large a step of a compliance of zero may be."""
    report = sb.check_gradients(bubble(), np.arange(13) / 400, SOLVER)
    assert report.passed, str(report)
    row = {r.name: r for r in report.rows}["volume_compliance"]
    assert row.gradient > 0
    assert row.differences < 1e-4


@pytest.mark.parametrize("density", [1e-3, 1e-9])
def test_what_is_hardly_felt_is_no_alarm(density: float) -> None:
    """The air drag of a heavy rope, down to a trillionth of its weight."""
    scene = sb.rope(0.5, 5, density=1.0, EI=1e-3, EA=1e3, drag_linear=density, clamp_start=(1, 0, 0))
    report = sb.check_gradients(scene, TIMES, sb.Solver(h=1 / 400))
    assert report.passed, str(report)


def mistaken(monkeypatch: pytest.MonkeyPatch, name: str, factor: float) -> None:
    """The adjoint by one array off by a factor."""
    core = sb.Solver.core

    def wrong(self: sb.Solver, scene: CompiledScene):
        inner = core(self, scene)
        offset, size = scene.layout[name]

        def vjp(*arguments):
            bar = np.array(inner.vjp(*arguments))
            bar[offset : offset + size] *= factor
            return bar

        kept = ("simulate", "record", "complex_step", "jvp", "redundant_constraints")
        others = {n: getattr(inner, n) for n in kept}
        return SimpleNamespace(vjp=vjp, **others)

    monkeypatch.setattr(sb.Solver, "core", wrong)


@pytest.mark.parametrize("seconds", [None, 1e-9], ids=["entries", "sampled"])
@pytest.mark.parametrize("name", ["volume_compliance", "mass", "position", "rest"])
def test_a_wrong_gradient_is_found(monkeypatch: pytest.MonkeyPatch, name: str, seconds: float | None) -> None:
    mistaken(monkeypatch, name, 1.0 + 1e-6)
    report = sb.check_gradients(ball(0.0), TIMES, SOLVER, seconds=seconds)
    assert not {r.name: r for r in report.rows}[name].passed


def test_a_limit_samples_and_says_so() -> None:
    scene, times = ball(1e-6), np.arange(0, 17, 4) / 400
    whole = sb.check_gradients(scene, times, SOLVER, seconds=1e6)
    assert (whole.steps, whole.sampled) == (16, "")
    short = sb.check_gradients(scene, times, SOLVER, seconds=1e-9)
    assert short.passed, str(short)
    assert short.steps == 2
    assert "over 2 of 16 substeps, all entries of an array along one direction" in short.sampled
    assert short.sampled in str(short)
    assert short.to_dict()["sampled"] == short.sampled


def test_noise_is_told_and_kept() -> None:
    row = sb.check_gradients(ball(0.0), TIMES, SOLVER).to_dict()["gradients"]["volume"]
    assert row["noise"] is not None
    assert math.isfinite(row["noise"])
    assert isinstance(GradientReport("s", 1, (), 0.0).sampled, str)
