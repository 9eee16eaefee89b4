"""`check_gradients` judges each path by its own noise: no false alarm, and no blind eye."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.mesh import icosphere
from sheetbend.motion.gradient_probe import Probe
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


@pytest.mark.parametrize("method", ["direct", "implicit", "newton"])
def test_joints_that_fall_freely_are_no_alarm(method: str) -> None:
    """Their forces are rounding, and so is the gradient with respect to their compliance (4e-10)."""
    scene = sb.Scene("dropped")
    box = sb.Inertia.box(0.2, (0.2, 0.02, 0.02))
    upper = scene.add_body("upper", of=box, at=(0.0, 0.0, 0.5))
    lower = scene.add_body("lower", of=box, at=(0.15, 0.0, 0.4), rotation=(0.0, 0.7, 0.0))
    sb.slider(None, upper, at=(0.0, 0.0, 0.5), axis=(0.0, 0.0, 1.0), name="rail")
    sb.hinge(upper, lower, at=(0.08, 0.01, 0.47), axis=(0.0, 1.0, 0.0), stiffness=8.0)
    report = sb.check_gradients(scene, np.arange(4) * 5e-4, sb.Solver(h=5e-4, method=method))
    assert report.passed, str(report)
    rows = {row.name: row for row in report.rows}
    assert rows["compliance"].unfelt and not rows["position"].unfelt


@pytest.mark.parametrize("range_", [1e-9, 1e-8, 3e-7])
def test_a_loss_that_stops_to_change_is_no_alarm(range_: float) -> None:
    """A compliance of zero of a hinge on a drum: beyond 1e-6 the loss changed no more, and differences there were zero
    with hardly an error, which passed for the best."""
    slope = 10.0

    def simulate(inputs: np.ndarray, *_: object) -> dict[str, np.ndarray]:
        return {"positions": np.array([1.0, slope * range_ * math.tanh(inputs[0] / range_)])}

    probe = Probe(SimpleNamespace(simulate=simulate), np.zeros(1), [1], np.ones(2), np.array([slope]))
    found, error = probe.differences(np.ones(1), 1e-4 * probe.size(0.0, 1e-3, True, slope), slope)
    assert abs(found - slope) < error < 0.3 * slope


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
