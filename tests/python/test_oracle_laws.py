"""The oracles against independent computations: their own equations, other solvers, refinement."""

import math

import numpy as np
import pytest
from oracles import bending, drag, integration, modes, pendulums, ropes
from oracles.calculus import derivative
from scipy.integrate import solve_bvp, solve_ivp

G = 9.81


def test_derivative_is_accurate_for_scalars_and_arrays():
    assert derivative(math.exp, 1.0) == pytest.approx(math.e, rel=1e-12)
    assert derivative(lambda x: [x**3, math.sin(x), 5.0], 0.0, 0.5) == pytest.approx([0.0, 1.0, 0.0], abs=1e-12)
    with pytest.raises(ValueError, match="step"):
        derivative(math.exp, 1.0, -0.1)


@pytest.mark.parametrize("order", [1, 2])
def test_free_fall_is_a_loose_spring(order):
    recurrence = integration.damped_spring(
        1e30, 0.0, 2.0, 0.01, 50, stretch=0.3, velocity=-1.0, force=2 * G, order=order
    )
    closed = [integration.free_fall(n, 0.01, G, 0.3, -1.0, order) for n in range(51)]
    assert recurrence == pytest.approx(closed, rel=1e-12)


def test_spring_derivatives_agree_with_differences():
    by_compliance = integration.spring_stretch_dcompliance(2e-3, 3.0, 0.01, 25, 0.5)
    assert derivative(lambda a: integration.spring_stretch(a, 3.0, 0.01, 25, 0.5), 2e-3) == pytest.approx(
        by_compliance, rel=1e-9
    )
    assert derivative(lambda m: integration.spring_stretch(2e-3, m, 0.01, 25, 0.5), 3.0) == pytest.approx(
        by_compliance * 2e-3 / 3.0, rel=1e-9
    )


def test_damped_spring_follows_the_three_term_recurrence():
    alpha, beta, mass, h, velocity, force = 1e-3, 5.0, 0.7, 1 / 240, 2.0, 3.0
    u = integration.damped_spring(alpha, beta, mass, h, 20, stretch=0.5, velocity=velocity, force=force)
    past = np.concatenate([[0.5 - h * velocity], u])
    divisor = 1 + h * h / (alpha * mass) + h * beta / mass
    expected = ((2 + h * beta / mass) * past[1:-1] - past[:-2] + h * h * force / mass) / divisor
    assert u[1:] == pytest.approx(expected, rel=1e-13)


def test_damped_spring_reaches_its_exact_solution_with_the_integrators_order():
    alpha, beta, mass, t = 1e-2, 1.5, 1.0, 0.5
    decay, omega = beta / (2 * mass), math.sqrt(1 / (alpha * mass) - (beta / (2 * mass)) ** 2)
    exact = math.exp(-decay * t) * (math.cos(omega * t) + decay / omega * math.sin(omega * t))
    for order in (1, 2):
        errors = [
            integration.damped_spring(alpha, beta, mass, t / n, n, stretch=1.0, order=order)[-1] - exact
            for n in (4000, 8000)
        ]
        assert math.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.02)


@pytest.mark.parametrize("order", [1, 2])
def test_spring_sag_and_static_multiplier(order):
    h = 1 / 240
    u = integration.damped_spring(1e-3, 50.0, 1.0, h, 2000, force=G, order=order)
    assert u[-1] == pytest.approx(integration.spring_sag(1e-3, 1.0, G), rel=1e-12)
    # C + a lambda = 0 at rest, with a = alpha/h^2 or 9 alpha/(4 h^2)
    scale = 1.0 if order == 1 else 4.0 / 9.0
    assert integration.static_multiplier(G, h, order) == pytest.approx(-u[-1] * scale * h * h / 1e-3, rel=1e-12)


def test_amplification_factors_are_roots_of_the_schemes():
    for omega_h in (0.05, 0.3, 2.0):
        z1, z2 = integration.amplification(omega_h, 1), integration.amplification(omega_h, 2)
        assert abs((1 - 1 / z1) - 1j * omega_h) < 1e-14
        assert abs((3 - 4 / z2 + 1 / z2**2) / 2 - 1j * omega_h) < 1e-14
        assert abs(z2) < 1


def test_rotor_agrees_with_a_projected_pair():
    x, v, angle = np.array([1.0, 0.0]), np.array([0.0, 0.1]), 0.0
    for advanced, momentum in zip(integration.rotor_angles(0.1, 30), integration.rotor_momentum(0.1, 30), strict=True):
        new = (x + v) / np.hypot(*(x + v))  # h = 1; the other particle is at -x
        v, x, angle = new - x, new, angle + advanced
        assert x == pytest.approx([math.cos(angle), math.sin(angle)], abs=1e-13)
        assert (x[0] * v[1] - x[1] * v[0]) / 0.1 == pytest.approx(momentum, rel=1e-12)


def test_pendulum_period_is_four_times_the_quarter_swing():
    amplitude = 2.0
    run = solve_ivp(
        lambda _, y: [y[1], -G * math.sin(y[0])],
        (0.0, 5.0),
        [amplitude, 0.0],
        method="DOP853",
        rtol=1e-12,
        atol=1e-13,
        events=lambda _, y: y[0],
    )
    assert 4 * run.t_events[0][0] == pytest.approx(pendulums.pendulum_period(1.0, G, amplitude), rel=1e-10)


def test_pendulum_steps_converge_with_the_integrators_order():
    def swing(_, y):
        return [y[1], -G * math.sin(y[0])]

    angle = solve_ivp(swing, (0.0, 1.0), [1.0, 0.0], method="DOP853", rtol=1e-12, atol=1e-13).y[0, -1]
    exact = np.array([math.sin(angle), -math.cos(angle)])
    for order in (1, 2):
        errors = [
            np.hypot(*(pendulums.pendulum_steps(1.0, G, 1.0, 1 / n, n, order)[0][-1] - exact)) for n in (1000, 2000)
        ]
        assert math.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.02)


def test_double_pendulum_agrees_with_links_as_multipliers():
    """Cartesian equations of motion, M a = f + J^T lambda with J a = -dJ/dt v: a second way to the tip."""
    masses, lengths, start = (1.3, 0.6), (0.9, 0.7), (1.4, 0.5)

    def rate(_, y):
        p, v = y[:4].reshape(2, 2), y[4:].reshape(2, 2)
        jacobian = np.zeros((2, 4))
        jacobian[0, :2] = p[0]
        jacobian[1, :2], jacobian[1, 2:] = p[0] - p[1], p[1] - p[0]
        mass = np.repeat(masses, 2)
        rhs = -np.array([v[0] @ v[0], (v[1] - v[0]) @ (v[1] - v[0])]) - jacobian @ [0, -G, 0, -G]
        multiplier = np.linalg.solve(jacobian / mass @ jacobian.T, rhs)
        return np.concatenate([y[4:], [0, -G, 0, -G] + jacobian.T @ multiplier / mass])

    q1, q2 = start
    first = np.array([lengths[0] * math.sin(q1), -lengths[0] * math.cos(q1)])
    second = first + np.array([lengths[1] * math.sin(q2), -lengths[1] * math.cos(q2)])
    y0 = np.concatenate([first, second, np.zeros(4)])
    end = solve_ivp(rate, (0.0, 0.6), y0, method="DOP853", rtol=1e-12, atol=1e-13).y[2:4, -1]
    assert pendulums.double_pendulum_tip(0.6, G, lengths, masses, start) == pytest.approx(end, abs=1e-9)


@pytest.mark.parametrize(
    ("velocity", "distance", "deceleration"),
    [
        (drag.quadratic_drag_velocity, drag.quadratic_drag_distance, lambda v: G * (v / 3.0) ** 2),
        (drag.linear_drag_velocity, drag.linear_drag_distance, lambda v: 3.0 * v),
    ],
    ids=["quadratic", "linear"],
)
def test_drag_laws_solve_their_equation(velocity, distance, deceleration):
    run = solve_ivp(
        lambda _, y: [y[1], G - deceleration(y[1])],
        (0.0, 0.4),
        [0.0, 0.0],
        method="DOP853",
        rtol=1e-12,
        atol=1e-13,
    )
    assert [distance(0.4, G, 3.0), velocity(0.4, G, 3.0)] == pytest.approx(run.y[:, -1], rel=1e-10)


@pytest.mark.parametrize("axial_stiffness", [math.inf, 2.0])
@pytest.mark.parametrize("links", [7, 8])
def test_polygon_is_in_equilibrium(links, axial_stiffness):
    nodes, tension = ropes.polygon_nodes(0.6, 1.0, links, 0.05, G, axial_stiffness)
    edges = np.diff(nodes, axis=0)
    lengths = np.hypot(*edges.T)
    pull = (tension / lengths)[:, None] * edges
    assert np.diff(pull, axis=0) == pytest.approx(np.tile([0.0, 0.05 * G / links], (links - 1, 1)), abs=1e-14)
    assert lengths == pytest.approx((1 + tension / axial_stiffness) / links, rel=1e-12)
    assert nodes[-1] == pytest.approx([0.6, 0.0], abs=1e-12)
    rope = ropes.polygon_catenary(0.6, 1.0, links, 0.05, G, axial_stiffness)
    assert rope == pytest.approx([pull[0, 0], -nodes[links // 2, 1]], rel=1e-12)


@pytest.mark.parametrize("sweeps", [1, 3])
@pytest.mark.parametrize("order", [range(8), range(7, -1, -1), [0, 2, 4, 6, 1, 3, 5, 7]], ids=["down", "up", "colored"])
def test_gauss_seidel_extension_agrees_with_time_stepping(order, sweeps):
    links, length, density, axial_stiffness, h = 8, 0.5, 0.1, 30.0, 1 / 100
    w = np.full(links + 1, links / (density * length))
    w[0], w[-1] = 0.0, 2.0 * w[-1]
    link, a = length / links, length / links / axial_stiffness / h**2
    x, v = -link * np.arange(links + 1), np.zeros(links + 1)
    for _ in range(4000):
        new = x + h * v - h * h * G * (w > 0)
        multiplier = np.zeros(links)
        for _ in range(sweeps):
            for j in order:
                change = -(new[j] - new[j + 1] - link + a * multiplier[j]) / (w[j] + w[j + 1] + a)
                multiplier[j] += change
                new[j : j + 2] += change * w[j : j + 2] * [1.0, -1.0]
        x, v = new, 0.99 * (new - x) / h  # the rest state does not depend on the decay
    exact = ropes.gauss_seidel_extension(length, density, G, axial_stiffness, h, sweeps, order)
    assert -x[-1] - length == pytest.approx(exact, rel=1e-10)


def test_gauss_seidel_extension_converges_to_the_ropes_own():
    converged = ropes.gauss_seidel_extension(1.0, 0.05, G, 10.0, 1 / 240, 5000, range(10))
    assert converged == pytest.approx(ropes.hanging_extension(1.0, 0.05, G, 10.0), rel=1e-10)


def test_hanging_lumped_rope_converges_to_the_continuous_one():
    exact = modes.hanging_rope_frequencies(1.0, G, 1)[0]
    errors = [modes.chain_frequencies([1.0] * (n - 1) + [0.5], 1.0 / n, G)[0] / exact - 1.0 for n in (40, 80)]
    assert math.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.05)


@pytest.mark.parametrize(("tip_load", "weight"), [(3.0, 0.0), (0.0, 6.0)])
def test_elastica_agrees_with_a_boundary_value_solver(tip_load, weight):
    run = solve_bvp(
        lambda s, y: [y[1], -(tip_load + weight * (1 - s)) * np.cos(y[0]), np.sin(y[0])],
        lambda a, b: np.array([a[0], b[1], a[2]]),
        np.linspace(0, 1, 200),
        np.stack([np.linspace(0, 1, 200), np.linspace(1, 0, 200), np.linspace(0, 0.5, 200)]),
        tol=1e-9,
        max_nodes=100000,
    )
    shape = bending.tip_load_elastica(tip_load) if tip_load else bending.heavy_elastica(weight)
    assert run.success
    assert [shape.tip_angle, shape.drop] == pytest.approx([run.y[0, -1], run.y[2, -1]], rel=1e-8)


def test_bend_moment_is_the_slope_of_the_bend_energy():
    moment = derivative(lambda phi: 0.5 * 1e-3 / 0.05 * (2 * math.tan(phi / 2)) ** 2, 0.6)
    assert bending.bend_moment(0.6, 1e-3, 0.05) == pytest.approx(moment, rel=1e-10)


@pytest.mark.parametrize("clamp_voronoi", [0.05, 0.025])
def test_bend_chain_is_in_equilibrium(clamp_voronoi):
    """Each joint's moment by the bend law balances the weights beyond it."""
    weights = np.linspace(0.01, 0.05, 21)
    nodes = bending.bend_chain(20, 1.0, 0.1, clamp_voronoi, weights)
    edges = np.diff(nodes, axis=0)
    assert np.hypot(*edges.T) == pytest.approx(0.05, rel=1e-12)
    turning = -np.diff(np.arctan2(edges[:, 1], edges[:, 0]), prepend=0.0)
    for j, phi in enumerate(turning):
        voronoi = clamp_voronoi if j == 0 else 0.05
        applied = np.sum(weights[j + 1 :] * (nodes[j + 1 :, 0] - nodes[j, 0]))
        assert -bending.bend_moment(phi, 0.1, voronoi) == pytest.approx(applied, rel=1e-9)


@pytest.mark.parametrize(("clamp_share", "order"), [(1.0, 1.0), (0.5, 2.0)])
def test_bend_chain_converges_to_the_elastica(clamp_share, order):
    def drops(n):
        tip = np.append(np.zeros(n), 1.0)
        own = np.append(np.full(n, 6.0 / n), 3.0 / n)
        return [bending.bend_chain(n, 1.0, 1.0, clamp_share / n, w)[-1, 1] for w in (tip, own)]

    exact = [bending.tip_load_elastica(1.0).drop, bending.heavy_elastica(6.0).drop]
    errors = [np.subtract(drops(n), exact) for n in (640, 1280)]
    assert np.log2(errors[0] / errors[1]) == pytest.approx([order, order], abs=0.05)
