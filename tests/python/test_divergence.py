"""Finite states and gradients that mean nothing end in DivergenceError; motions that are only wild do not."""

from __future__ import annotations

import warnings
from collections.abc import Callable

import numpy as np
import pytest
import sheetbend as sb
from sheetbend import _core


def cloth(pinned: bool = True, stiffness: float = 300.0) -> sb.Scene:
    mesh = sb.mesh.equilateral(0.3, 0.3, 6)
    scene = sb.Scene("flag")
    made = sb.add_cloth(
        scene, mesh, density=0.2, warp=stiffness, weft=stiffness, shear=0.1 * stiffness, poisson=0.2, bending=3e-5
    )
    if pinned:
        scene.pin(made.particles[mesh.sets["corners"][2:]])
    return scene


@pytest.mark.parametrize("h", [10.0, 1.0, 0.1])
@pytest.mark.parametrize("method", ["direct", "newton", "gauss_seidel"])
def test_a_pinned_cloth_far_away_is_refused(method: str, h: float) -> None:
    """With substeps of seconds it is hundreds of meters away, and finite."""
    with pytest.raises(sb.DivergenceError) as caught:
        sb.simulate(cloth(), h * np.arange(5), sb.Solver(h=h, method=method))
    error = caught.value
    assert "stretched" in error.seen or "m/s" in error.seen or "not finite" in error.seen
    assert error.time == pytest.approx(error.substep * h) and error.particle >= 0
    for part in (f"particle {error.particle}", error.seen, f"substep {error.substep}", "flag", "smaller substep"):
        assert part in str(error)


def test_lanes_and_tangents_see_what_the_rollout_sees() -> None:
    compiled = cloth().compiled
    core = sb.Solver(h=1.0, method="newton").core(compiled)
    bad, steps = compiled.inputs(), [0, 4]
    sound = compiled.inputs()
    offset, size = compiled.layout["gravity"]
    sound[offset : offset + size] = 0.0
    along = np.zeros_like(bad)
    runs: list[Callable[[], object]] = [
        lambda: core.simulate(bad, steps, 0.0),
        lambda: core.states(bad, steps, 0.0),
        lambda: core.record(bad, steps, 0.0),
        lambda: core.simulate_batch(np.stack([sound] * 5 + [bad] + [sound] * 4), steps, 0.0),
        lambda: core.jvp(bad, along[None], steps, 0.0),
        lambda: core.complex_step(bad, along, steps, 0.0),
    ]
    seen = set()
    for run in runs:
        with pytest.raises(_core.Diverged) as caught:
            run()
        seen.add((caught.value.substep, caught.value.particle, caught.value.seen))
    assert len(seen) == 1
    core.simulate_batch(np.stack([sound] * 10), steps, 0.0)


def test_wind_that_substeps_do_not_resolve_is_refused() -> None:
    """h k |u| = 4 area densities: speeds grow tenfold in a substep."""
    scene = cloth()
    scene.add_air(np.array(scene.cloths["cloth"].mesh.triangles), 0.6, 0.1, wind=(60.0, 10.0, 0.0))
    with pytest.raises(sb.DivergenceError, match=r"m/s|stretched|finite"):
        sb.simulate(scene, [0.0, 1.0], sb.Solver(h=1 / 40, method="newton"))


def fall() -> sb.Scene:
    """Nothing holds it: 44 m down."""
    return cloth(pinned=False)


def whip() -> sb.Scene:
    """The handle turns back within 20 ms; the tip is many times faster."""
    scene = sb.Scene("whip")
    sb.add_rope(scene, length=1.0, segments=30, density=0.05, EI=1e-5, EA=2e3)
    knots = np.array([0.0, 0.1, 0.12, 3.0])
    scene.drive([0], knots, scene.positions[0] + np.array([[[0, 0, 0]], [[0, 0, 1.0]], [[0, 0, 0.9]], [[0, 0, 0.9]]]))
    return scene


def towed() -> sb.Scene:
    """A rope carried 300 m away, at 100 m/s, by both of its ends."""
    scene = sb.Scene("towed")
    sb.add_rope(scene, length=1.0, segments=20, density=0.05, EI=1e-4, EA=1e3)
    ends = [0, 20]
    motion = scene.positions[ends] + np.array([[[0, 0, 0]], [[0, 0, 0]], [[300.0, 0, 0]]])
    motion[:, 1] -= [0.1, 0, 0]
    scene.drive(ends, [0.0, 0.1, 3.0], motion)
    return scene


def thread(stiffness: float) -> sb.Scene:
    """A weight on a thread without bending: it hangs at m g / stiffness."""
    scene = sb.Scene("spring")
    scene.add_particles([[0, 0, 0], [0, 0, -0.1], [0, 0, -0.2]], 0.1)
    scene.add_constraints("distance", [[0, 1], [1, 2]], name="thread", compliance=1 / stiffness)
    scene.pin([0])
    return scene


def bungee() -> sb.Scene:
    """Springs that gravity stretches to 100 times their length."""
    return thread(0.2)


def pulled() -> sb.Scene:
    """A stiff band whose ends are drawn apart to eight times its length."""
    scene = thread(1e5)
    scene.drive([2], [0.0, 0.5, 3.0], [[[0, 0, -0.2]], [[0, 0, -1.6]], [[0, 0, -1.6]]])
    return scene


def catapult() -> sb.Scene:
    """A spring that starts at ten times its length throws a light weight."""
    scene = sb.Scene("catapult", gravity=(0, 0, 0))
    scene.add_particles([[0, 0, 0], [1, 0, 0]], 1e-4)
    scene.add_constraints("distance", [[0, 1]], name="spring", compliance=1e-4, rest=0.1)
    scene.pin([0])
    return scene


def unfolded() -> sb.Scene:
    """A chain that starts in a heap a hundredth of its size."""
    scene = sb.Scene("heap")
    x = 1e-3 * np.random.default_rng(0).standard_normal((12, 3))
    scene.add_particles(x, 0.01)
    pairs = np.stack([np.arange(11), np.arange(1, 12)], axis=1)
    scene.add_constraints("distance", pairs, name="links", compliance=1e-4, rest=np.full(11, 0.1))
    scene.pin([0])
    return scene


def unconverged() -> sb.Scene:
    """One sweep per substep leaves a rope of 1e5 N as soft as rubber."""
    return sb.rope(0.5, 50, density=0.05, EI=1e-5, EA=1e5, clamp_start=(1, 0, 0))


SOUND = {
    fall: sb.Solver(h=1 / 60, method="newton"),
    whip: sb.Solver(h=1 / 2000),
    towed: sb.Solver(h=1 / 1000),
    bungee: sb.Solver(h=1 / 100),
    pulled: sb.Solver(h=1 / 100),
    catapult: sb.Solver(h=1 / 10_000, integrator="bdf1"),
    unfolded: sb.Solver(h=1 / 1000),
    unconverged: sb.Solver(h=1 / 600, method="gauss_seidel", iterations=1),
}


@pytest.mark.parametrize("make", SOUND)
def test_wild_motions_pass(make: Callable[[], sb.Scene]) -> None:
    scene, solver = make(), SOUND[make]
    found = sb.simulate(scene, solver.h * np.arange(0, round(3 / solver.h) + 1, 10), solver)
    assert np.isfinite(found.positions).all()


def pendulum() -> sb.Scene:
    """A double pendulum let go near the top: errors grow e^4 times a second."""
    scene = sb.Scene("double pendulum")
    scene.add_particles([[0, 0, 0], [0.01, 0, 0.15], [0.0, 0, 0.3]], 0.1)
    scene.add_constraints("distance", [[0, 1], [1, 2]], name="arms", compliance=1e-6)
    scene.pin([0])
    return scene


def test_a_gradient_through_chaos_is_refused_with_its_time() -> None:
    solver = sb.Solver(h=1 / 500, iterations=3)
    short = sb.rollout(pendulum(), [1.0], solver)
    assert np.isfinite(short.gradient(np.ones_like(short.positions)).inputs["position"]).all()
    long = sb.rollout(pendulum(), [30.0], solver)
    with pytest.raises(sb.DivergenceError, match=r"gradient that grew 1e1[56].*end the motion earlier") as caught:
        long.gradient(np.ones_like(long.positions))
    assert 0.0 < caught.value.time < 25.0
    bars = np.ones((3, *long.positions.shape)).reshape(3, 1, -1)
    compiled = pendulum().compiled
    with pytest.raises(_core.Diverged, match="gradient"):
        solver.core(compiled).vjp_batch(np.stack([compiled.inputs()] * 3), [15_000], bars, 0.0)


def test_a_gradient_of_nothing_is_zero() -> None:
    run = sb.rollout(pendulum(), [0.1], sb.Solver(h=1 / 500))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert not np.any(run.gradient(np.zeros_like(run.positions)).inputs["position"])
