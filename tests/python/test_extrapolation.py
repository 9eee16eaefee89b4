"""Runs at h, h/2 and h/4 combined at the frames: how near they come, their derivatives, and where they are refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import sheetbend as sb
from pytest import approx
from sheetbend.experiment.wanted import as_parameters
from sheetbend.motion.extrapolation import weights
from sheetbend.objects.arm import add_pendulum
from sheetbend.problem.problem import FitProblem

FRAMES = np.arange(5) * 0.25


def falling() -> sb.Scene:
    """A rope clamped at one end, let go from the horizontal."""
    return sb.rope(0.6, 30, density=0.05, EI=1e-3, bend_damping=3e-3, drag_linear=5e-3, clamp_start=(1, 0, 0))


def driven(rate: float, interpolation: str = "cubic") -> sb.Scene:
    """A hanging rope of 20 links whose upper end follows smooth motion, told at `rate` knots per second."""
    scene = sb.rope(
        0.5, 20, density=0.05, EI=1e-3, bend_damping=3e-3, drag_linear=5e-3, direction=(0, 0, -1), pinned=()
    )
    t = np.arange(-3, int(1.2 * rate)) / rate
    x = np.zeros((len(t), 1, 3))
    x[:, 0, 0] = 0.05 * (1 - np.cos(2 * np.pi * 1.3 * np.maximum(t, 0.0)))
    x[:, 0, 2] = 0.03 * np.sin(2 * np.pi * 0.7 * np.maximum(t, 0.0)) ** 2
    scene.drive([0], t, x, interpolation)
    return scene


def farthest(scene: sb.Scene, solver: sb.Solver, limit: np.ndarray) -> float:
    """Largest distance from the limit in any frame, mm."""
    return 1e3 * float(np.linalg.norm(sb.simulate(scene, FRAMES, solver).positions - limit, axis=-1).max())


def limit(scene: sb.Scene, fine: float = 1 / 7680) -> np.ndarray:
    coarse, finer = (sb.simulate(scene, FRAMES, sb.Solver(h=h)).positions for h in (fine, fine / 2))
    return (4 * finer - coarse) / 3


def test_weights_leave_a_constant_and_cancel_the_leading_errors():
    assert weights("bdf2", 2) == approx((-1 / 3, 4 / 3))
    assert weights("bdf2", 3) == approx((1 / 21, -12 / 21, 32 / 21))
    assert weights("bdf1", 3) == approx((1 / 3, -2, 8 / 3))
    assert weights("bdf2", 1) == (1.0,)


def test_three_runs_from_1_240_are_within_five_micrometers():
    """One run at 1/1920, with more substeps, is off by 0.05 mm."""
    scene = falling()
    exact = limit(scene)
    assert farthest(scene, sb.Solver(h=1 / 240, extrapolate=3), exact) < 0.005
    assert farthest(scene, sb.Solver(h=1 / 1920), exact) > 0.04


@pytest.mark.parametrize(("runs", "order"), [(2, 3), (3, 4)])
def test_the_order_is_one_more_with_every_run(runs, order):
    scene = falling()
    exact = limit(scene)
    coarse, fine = (farthest(scene, sb.Solver(h=h, extrapolate=runs), exact) for h in (1 / 480, 1 / 960))
    assert np.log2(coarse / fine) == approx(order, abs=0.4)


@pytest.mark.parametrize("rate", [60, 100])
def test_a_rope_driven_by_cubic_knots(rate):
    """Knots need not lie on substeps."""
    scene = driven(rate)
    assert farthest(scene, sb.Solver(h=1 / 240, extrapolate=3), limit(scene)) < 0.003


def test_the_gradient_is_that_of_the_combination():
    """The adjoint against complex step and differences of the same weighted sum."""
    report = sb.check_gradients(falling(), [0.0, 0.05, 0.1], sb.Solver(h=1 / 240, extrapolate=3), samples=2)
    assert report.passed, str(report)
    assert max(row.complex_step for row in report.rows if not row.unfelt) < 1e-8


def test_a_budget_holds_for_all_runs_together():
    scene, solver = falling(), sb.Solver(h=1 / 240, extrapolate=3)
    weight = np.zeros((2, scene.particle_count, 3))
    weight[1, -1, 2] = 1.0
    times = [0.0, 0.2]
    free = sb.rollout(scene, times, solver)
    least = sb.tape_plan(scene, times, solver).least
    tight = sb.rollout(scene, times, replace(solver, memory=least + 20_000))
    assert tight.plan.total <= least + 20_000 < free.plan.total
    np.testing.assert_array_equal(tight.positions, free.positions)
    assert tight.gradient(weight).quantities == free.gradient(weight).quantities
    with pytest.raises(sb.InputError, match="too small"):
        sb.rollout(scene, times, replace(solver, memory=least - 1))


def test_torch_combines_the_same_runs():
    torch = pytest.importorskip("torch")
    import sheetbend.torch

    scene, solver, times = falling(), sb.Solver(h=1 / 240, extrapolate=2), [0.0, 0.1]
    EI = torch.tensor([1e-3, 2e-3], dtype=torch.float64, requires_grad=True)
    x = sheetbend.torch.simulate(scene, times, solver, values={"rope_EI": EI})
    np.testing.assert_array_equal(x[0].detach(), sb.simulate(scene, times, solver).positions)
    x[:, 1, -1, 2].sum().backward()
    weight = np.zeros((2, scene.particle_count, 3))
    weight[1, -1, 2] = 1.0
    for value, found in zip((1e-3, 2e-3), EI.grad.tolist(), strict=True):
        by_adjoint = sb.rollout(scene, times, solver, {"rope_EI": value}).gradient(weight).quantities["rope_EI"]
        assert found == approx(by_adjoint, rel=1e-12)
    tangent = torch.func.jvp(
        lambda v: sheetbend.torch.simulate(scene, times, solver, values={"rope_EI": v})[1, -1, 2],
        (torch.tensor(1e-3, dtype=torch.float64),),
        (torch.tensor(1.0, dtype=torch.float64),),
    )[1]
    assert float(tangent) == approx(EI.grad[0].item(), rel=1e-9)


def recorded(solver: sb.Solver, scene: sb.Scene | None = None) -> sb.Recording:
    scene = scene or falling()
    t = np.arange(1, 13) / 60
    return sb.Recording(positions=sb.simulate(scene, t, solver).positions[:, 11:31], times=t, name="falling")


def experiment(solver: sb.Solver, recording: sb.Recording, **fields: object) -> sb.Experiment:
    scene = falling()
    scene.quantities["rope_EI"] = replace(scene.quantities["rope_EI"], value=1.2e-3)
    places = [sb.on_particle(n) for n in range(11, 31)]
    return sb.Experiment(scene=scene, recording=recording, markers=places, solver=solver, start_time=0.0, **fields)


@pytest.mark.parametrize("loss", ["squares", "huber"])
def test_a_fit_sees_the_combination_of_its_markers(loss):
    """Residuals and Jacobian of the compiled problem, against simulate's combination and differences."""
    solver = sb.Solver(h=1 / 240, extrapolate=3)
    e = experiment(solver, recorded(sb.Solver(h=1 / 240)), loss=loss, loss_scale=0.1)
    problem = FitProblem([e], as_parameters(["rope_EI", "rope_bend_damping"], [e]))
    u = problem.parameters.initial()
    combined = sb.simulate(e.scene, e.recording.times, solver).positions[:, 11:31]
    np.testing.assert_allclose(problem.simulate(u)[0], combined, rtol=0, atol=1e-14)
    ok, r, J = problem.evaluate(u)
    assert ok
    np.testing.assert_array_equal(problem.evaluate(u, jacobian=False)[1], r)
    for k, direction in enumerate(np.eye(2)):
        coarse, fine = (
            (problem.evaluate(u + s * direction, False)[1] - problem.evaluate(u - s * direction, False)[1]) / (2 * s)
            for s in (2e-4, 1e-4)
        )
        np.testing.assert_allclose(J[:, k], (4 * fine - coarse) / 3, rtol=0, atol=1e-7 * np.abs(J[:, k]).max())


def test_what_is_not_smooth_is_refused():
    yielding = sb.rod(0.3, 6, density=0.05, EI=1e-3, GJ=1e-3, yield_curvature=3.0, yield_share=0.5)
    sliding = sb.Scene("pendulum")
    add_pendulum(sliding, length=0.2, mass=0.1, angle=1.0, friction=1e-3)
    for scene, cause in ((yielding, "yield"), (sliding, "dry friction"), (driven(60, "linear"), "linear knots")):
        with pytest.raises(sb.InputError, match=cause):
            sb.simulate(scene, FRAMES, sb.Solver(h=1 / 240, extrapolate=2))
        assert np.isfinite(sb.simulate(scene, FRAMES, sb.Solver(h=1 / 240)).positions).all()
    with pytest.raises(sb.InputError, match="sweeps"):
        sb.Solver(method="gauss_seidel", extrapolate=2)
    for runs in (0, 4, 2.0, True):
        with pytest.raises(sb.InputError, match="extrapolate"):
            sb.Solver(extrapolate=runs)
    followed = sb.Experiment(
        scene=driven(60, "linear"),
        recording=recorded(sb.Solver(h=1 / 240)),
        markers=[sb.on_particle(n) for n in range(20)],
        solver=sb.Solver(h=1 / 240, extrapolate=2),
    )
    with pytest.raises(sb.InputError, match="linear knots"):
        followed.core(followed.fitted())
