"""Substeps that are solved until forces balance: what is left of the forces, the motion they give, its derivatives, a
fit where incremental iterations are lost, and errors in words."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import sheetbend as sb
from sheetbend import _core
from support import steps

STRAIN, LENGTH, WIDTH = 0.15, 0.4, 0.1
IMPLICIT = sb.Solver(h=1 / 60, method="implicit")


def strip(stiffening: float, end: float = 0.5, **fabric: float) -> sb.Scene:
    """A strip pulled along its warp to a Green strain of 0.15, where b e^2 is `stiffening`, under its weight."""
    mesh = sb.mesh.equilateral(LENGTH, WIDTH, 8)
    fabric = {"density": 0.2, "warp": 600.0, "weft": 500.0, "shear": 60.0, "poisson": 0.2, "bending": 1e-5} | fabric
    law = sb.laws.Exponential(*3 * (stiffening / STRAIN**2,)) if stiffening else sb.laws.Linear()
    scene = sb.Scene("strip")
    cloth = sb.add_cloth(scene, mesh, law=law, **fabric)
    scene.pin(cloth.particles[mesh.sets["left"]])
    right = mesh.sets["right"]
    knots = np.linspace(0.0, end, 31)
    path = np.repeat(mesh.vertices[right][None], 31, axis=0)
    path[:, :, 0] += LENGTH * (math.sqrt(1.0 + 2.0 * STRAIN) - 1.0) * np.sin(np.pi / 2 * knots / end)[:, None] ** 2
    scene.drive(cloth.particles[right], knots, path)
    return scene


def inputs_of(scene: sb.Scene) -> tuple[np.ndarray, ...]:
    """All inputs; masses (particles, 1); compliance of each constraint; gravity (3,)."""
    compiled = scene.compiled
    inputs = compiled.inputs(compiled.values(None))

    def part(name: str) -> np.ndarray:
        offset, size = compiled.layout[name]
        return inputs[offset : offset + size]

    return inputs, part("mass")[:, None], part("compliance"), part("gravity")


def imbalance(scene: sb.Scene, solver: sb.Solver, count: int) -> np.ndarray:
    """What is left of m (dv/dt - g) - J^T lambda on free particles after every substep, over the largest net force of
    the fabric on a particle, held ones included; and of C + alpha lambda, over the largest C."""
    found = sb.simulate(scene, steps(solver.h, count), solver)
    inputs, mass, compliance, gravity = inputs_of(scene)
    rows = np.concatenate([np.full(len(g.particles), sb.KINDS[g.kind]["rows"]) for g in scene.groups])
    left = []
    for n in range(count):
        first = n == 0 or solver.integrator == "bdf1"
        eta = solver.h if first else 2.0 * solver.h / 3.0
        v = found.velocities
        history = v[n] if first else (4.0 * v[n] - v[n - 1]) / 3.0
        lam = np.concatenate([found.forces[g.name][n + 1].ravel() for g in scene.groups])
        C, force = _core.evaluate_constraints(scene.compiled.core, inputs, found.positions[n + 1].ravel(), lam)
        force = force.reshape(-1, 3)
        force_left = mass * ((v[n + 1] - history) / eta - gravity) - force
        value_left = C + np.repeat(compliance, rows) * lam
        left.append(
            [np.abs(force_left[scene.free]).max() / np.abs(force).max(), np.abs(value_left).max() / np.abs(C).max()]
        )
    return np.array(left)


@pytest.mark.parametrize("integrator", ["bdf1", "bdf2"])
@pytest.mark.parametrize("h", [1 / 60, 1 / 240])
@pytest.mark.parametrize("stiffening", [0.0, 0.45, 2.0, 5.0, 10.0])
def test_forces_balance(stiffening: float, h: float, integrator: str) -> None:
    solver = sb.Solver(h=h, integrator=integrator, method="implicit")
    force, value = imbalance(strip(stiffening), solver, round(0.5 / h)).T
    assert force.max() < 1e-8
    assert value.max() < 1e-12


def test_incremental_iterations_leave_forces() -> None:
    """For comparison: of a linear fabric as much as there is, and motions of fabrics that stiffen are lost."""
    incremental = replace(IMPLICIT, method="newton", iterations=10)
    assert imbalance(strip(0.0), incremental, 30)[:, 0].max() > 0.1
    with pytest.raises(sb.DivergenceError):
        sb.simulate(strip(0.45), steps(1 / 60, 30), incremental)


def test_the_motion_is_of_second_order() -> None:
    """Halving the substep leaves a quarter of the error where the strip is pulled taut, at b e^2 = 5.

    While it wrinkles on the way, finer substeps follow other wrinkles.
    """
    scene = strip(5.0, membrane_damping=0.02, bend_damping=0.02)
    ends = [
        sb.simulate(scene, [0.0, 0.5], sb.Solver(h=1 / rate, method="implicit")).positions[-1]
        for rate in (120, 240, 480, 960)
    ]
    errors = [np.abs(a - b).max() for a, b in pairwise(ends)]
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.2)
    assert errors[1] / errors[2] == pytest.approx(4.0, rel=0.2)


def test_a_linear_fabric_moves_as_with_newton() -> None:
    """Their difference is the force that incremental iterations leave behind, which vanishes with the substep."""
    scene = strip(0.0)
    apart = []
    for rate in (960, 3840):
        runs = [
            sb.simulate(scene, [0.0, 0.25], sb.Solver(h=1 / rate, method=method, iterations=most)).positions[-1]
            for method, most in (("implicit", None), ("newton", 10))
        ]
        apart.append(np.abs(runs[0] - runs[1]).max())
    assert apart[1] < apart[0] / 4.0
    assert apart[1] < 2e-4


def damped(stiffening: float = 5.0) -> sb.Scene:
    scene = strip(stiffening, end=0.2, membrane_damping=0.02, bend_damping=0.02)
    cloth = scene.cloths["cloth"]
    scene.add_air(cloth.particles[cloth.mesh.triangles], 0.7, 0.05, (0.8, 1.6, 0.3))
    return scene


@pytest.mark.slow
@pytest.mark.parametrize("integrator", ["bdf1", "bdf2"])
def test_gradients_are_the_program_s(integrator: str) -> None:
    report = sb.check_gradients(damped(), steps(1 / 60, 4), replace(IMPLICIT, integrator=integrator), samples=2)
    assert report.passed, str(report)


def test_adjoint_and_tangents_and_complex_steps_agree() -> None:
    """By every named quantity and by random directions of all inputs, over the motion at b e^2 = 5."""
    scene = damped()
    compiled = scene.compiled
    core, grid_steps = IMPLICIT.core(compiled), list(range(13))
    theta = compiled.values(None)
    inputs = compiled.inputs(theta)
    rng = np.random.default_rng(0)
    directions = [compiled.inputs_dot(theta, e) for e in np.diag(theta) if e.any()]
    directions += [inputs * rng.uniform(-1.0, 1.0, len(inputs)) for _ in range(4)]
    x, tangents = core.jvp(inputs, np.stack(directions), grid_steps, 0.0)
    np.testing.assert_array_equal(x, core.states(inputs, grid_steps, 0.0))
    x, tape = core.record(inputs, grid_steps, 0.0)
    np.testing.assert_array_equal(x, core.states(inputs, grid_steps, 0.0))
    bar = rng.standard_normal(x.shape)
    adjoint = core.vjp(inputs, tape, grid_steps, bar, 0.0)
    for direction, along in zip(directions, tangents, strict=True):
        expected = (bar * core.complex_step(inputs, direction, grid_steps, 0.0).reshape(x.shape)).sum()
        scale = np.abs(adjoint * direction).sum()
        assert abs((bar * along.reshape(x.shape)).sum() - expected) < 1e-10 * scale
        assert abs(adjoint @ direction - expected) < 1e-10 * scale


def test_scenes_in_lanes_have_the_bits_that_they_have_alone() -> None:
    inputs = np.stack([inputs_of(strip(b))[0] for b in np.linspace(0.5, 8.0, 9)])
    core, grid_steps = IMPLICIT.core(strip(1.0).compiled), [1, 12, 24]
    together = core.simulate_batch(inputs, grid_steps, 0.0)
    for own, found in zip(inputs, together, strict=True):
        np.testing.assert_array_equal(found, core.states(own, grid_steps, 0.0))


def test_a_stiffening_twin_in_motion_gives_its_numbers() -> None:
    """Stiffness and stiffening of a strip that swings while it is pulled to b e^2 = 5, with noise; two iterations of
    `newton` lose the same motion."""
    scene = strip(5.0, end=0.3)
    truth = {name: scene.quantities[name].value for name in ("cloth_warp", "cloth_warp_stiffening")}
    times = steps(1 / 60, 18)
    fine = sb.simulate(scene, times, sb.Solver(h=1 / 960, method="implicit")).positions
    free = np.flatnonzero(scene.free)
    noise = 1e-4
    seen = fine[:, free] + noise * np.random.default_rng(4).standard_normal((len(times), len(free), 3))
    recording = sb.Recording(positions=seen, times=times, name="pulled")
    solver = sb.Solver(h=1 / 240, method="implicit")
    markers = [sb.on_particle(int(k)) for k in free]
    experiment = sb.Experiment(scene=scene, recording=recording, markers=markers, solver=solver, sigma=noise)
    start = {name: {"initial": factor * truth[name]} for name, factor in zip(truth, (1.4, 0.6), strict=True)}
    found = sb.fit(experiment, parameters=start)
    for name, value in truth.items():
        assert found[name].verdict == "identified"
        assert found[name].lower < value < found[name].upper
        assert found[name].upper - found[name].lower < 0.5 * value
    lost = replace(solver, method="newton")
    try:
        motion = sb.simulate(scene, times, lost).positions
    except sb.DivergenceError:
        return
    assert np.abs(motion - fine).max() > 100 * noise


def test_a_flat_sheet_pressed_in_its_plane_buckles_or_waits() -> None:
    """Without weight nothing pushes it aside. In short substeps its inertia holds it flat; in long ones flat is no
    minimum, and it goes where forces balance."""
    mesh = sb.mesh.equilateral(0.2, 0.1, 6)
    scene = sb.Scene("pressed", gravity=(0.0, 0.0, 0.0))
    cloth = sb.add_cloth(scene, mesh, density=0.2, warp=600.0, shear=60.0, poisson=0.2, bending=1e-5)
    scene.pin(cloth.particles[mesh.sets["left"]])
    right = mesh.sets["right"]
    path = np.repeat(mesh.vertices[right][None], 2, axis=0)
    path[1, :, 0] -= 0.02
    scene.drive(cloth.particles[right], [0.0, 0.1], path)
    short, long = (sb.simulate(scene, [0.0, 0.1], replace(IMPLICIT, h=h)).positions[-1] for h in (1 / 4000, 1 / 50))
    assert np.abs(short[:, 2]).max() < 1e-12
    assert np.abs(long[:, 2]).max() > 1e-2
    assert imbalance(scene, replace(IMPLICIT, h=1 / 50), 5)[:, 0].max() < 1e-8


@pytest.mark.parametrize("warp", [600.0, 1e5])
def test_stiff_cloth_stops_where_rounding_does(warp: float) -> None:
    """At 1e5 N/m rounding the coordinates moves more than 1e-10 of the force."""
    mesh = sb.mesh.equilateral(0.3, 0.3, 8)
    scene = sb.Scene("stiff")
    cloth = sb.add_cloth(scene, mesh, density=0.15, warp=warp, shear=warp / 10, poisson=0.3, bending=3e-5)
    scene.pin(cloth.particles[mesh.sets["top"]])
    for h in (1 / 60, 1 / 720):
        found = sb.force_balance(scene, 4 / 60, replace(IMPLICIT, h=h))
        assert found.newton_steps.max() <= 30
        assert max(np.nanmin(blocks) for blocks in found.left) < 1e-6


def test_the_balance_of_every_newton_step_is_shown() -> None:
    found = sb.force_balance(strip(5.0), 0.5, IMPLICIT)
    assert found.left.shape[:2] == (30, 1)
    assert found.newton_steps.max() >= 2
    ends = [blocks[0][np.isfinite(blocks[0])][-1] for blocks in found.left]
    assert max(ends) <= 1e-10
    assert found.report().count("\n") == 30
    with pytest.raises(sb.InputError, match=r"solver\.method"):
        sb.force_balance(strip(5.0), 0.5, replace(IMPLICIT, method="newton"))
    with pytest.raises(sb.InputError, match=r"write sb\.Solver\(h=0\.01\)"):
        sb.force_balance(strip(5.0), 0.5, 0.01)  # type: ignore[arg-type]


def test_forces_that_do_not_balance_are_told() -> None:
    scene = strip(5.0)
    for run in (sb.simulate, sb.rollout):
        with pytest.raises(sb.UnbalancedError, match=r"after 1 Newton matrices .* of strip\. Fix: use a smaller") as e:
            run(scene, steps(1 / 60, 4), replace(IMPLICIT, iterations=1))
        assert e.value.substep == 1
        assert e.value.residual > 1e-10


def test_forces_balance_as_far_as_they_are_asked_to() -> None:
    """Fewer matrices, and the force that is left is between the two tolerances."""
    exact, rough = (
        sb.force_balance(strip(5.0), 0.5, replace(IMPLICIT, force_tolerance=tolerance)) for tolerance in (1e-10, 1e-4)
    )
    assert rough.newton_steps.sum() < 0.8 * exact.newton_steps.sum()
    ends = [blocks[0][np.isfinite(blocks[0])][-1] for blocks in rough.left]
    assert 1e-10 < max(ends) <= 1e-4


@pytest.mark.parametrize("given", [0.0, 0.1, 1, float("nan")])
def test_a_tolerance_that_is_none_is_named(given: float) -> None:
    with pytest.raises(sb.InputError, match=r"solver\.force_tolerance: must be a share .* such as 1e-10"):
        replace(IMPLICIT, force_tolerance=given)


@pytest.mark.parametrize("integrator", ["bdf1", "bdf2"])
def test_a_rod_that_yields_moves_as_in_direct_and_has_exact_gradients(integrator: str) -> None:
    """Cloth and solids: test_cloth_yield.py, test_solid_yield.py; hinges: test_joint_friction.py, test_pivot.py."""
    own = {"bend_damping": 1e-3, "twist_damping": 1e-3, "stretch_damping": 1e-3}
    start = sb.Grip.fixed((0, 0, 0), (1, 0, 0))
    yields = {"yield_curvature": 1.0, "yield_share": 0.5}
    scene = sb.rod(0.3, 6, density=0.05, EI=1e-3, GJ=1e-3, EA=1e2, start=start, **own, **yields)
    times, solver = [0.0, 0.02, 0.04], sb.Solver(h=2e-3, method="implicit", integrator=integrator)
    found = sb.simulate(scene, times, solver)
    slid = found.nodes[-1][scene.group("rod_bend")[0].particles[:, -1]]
    assert np.abs(slid).max() > 0.01
    exact = sb.simulate(scene, times, replace(solver, method="direct", iterations=40))
    assert np.abs(found.positions - exact.positions).max() < 1e-6  # of 9 mm: iterations leave second derivatives out
    report = sb.check_gradients(scene, times, solver)
    assert report.passed, str(report)
    assert not {row.name: row for row in report.rows}["rod_yield_curvature"].unfelt
