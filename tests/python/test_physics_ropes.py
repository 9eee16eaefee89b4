"""Ropes against closed forms: at rest, vibrating, falling against air. Values, and derivatives by tangents and by the
adjoint."""

import math

import numpy as np
import pytest
import sheetbend as sb
from oracles import drag, modes, ropes
from oracles.calculus import derivative
from pytest import approx
from scipy.linalg import eigh
from support import (
    observed_orders,
    pick,
    place,
    sensitivity,
    shown_frequency,
    slope_along,
    static_sensitivity,
    steps,
    tangents,
    twice,
)

G = 9.81
X, Y, Z = 0, 1, 2
DOWN = (0.0, 0.0, -1.0)
DENSITY = 0.05


def hanging(segments: int, EA: float | None, **options) -> sb.Scene:
    return sb.rope(1.0, segments, density=DENSITY, EA=EA, direction=DOWN, **options)


def between_levels(span: float, length: float, segments: int, EA: float | None = None) -> sb.Scene:
    """A rope hung between level points, from a V a little off its plane's symmetry."""
    depth = 0.5 * math.sqrt(length**2 - span**2)
    return sb.rope(
        length,
        segments,
        density=DENSITY,
        EA=EA,
        points=[(0, 0, 0), (span / 2, 0, -depth), (span, 0, 0)],
        pinned=(0, -1),
    )


# --- O-8, 9: hanging straight


@pytest.mark.parametrize("segments", [1, 10, 40])
@pytest.mark.parametrize("EA", [10.0, 1e4])
def test_hanging_rope_at_rest(segments, EA):
    scene = hanging(segments, EA)
    rest = sb.equilibrium(scene)
    extension = ropes.hanging_extension(1.0, DENSITY, G, EA)
    assert -rest.positions[-1, Z] - 1.0 == approx(extension, abs=1e-12)
    tension = -rest.forces["rope_stretch"][:, 0]
    assert tension == approx(DENSITY * G * (1.0 - (np.arange(segments) + 0.5) / segments), rel=1e-9)
    tip = pick(scene, segments, Z, -1.0)
    assert static_sensitivity(rest, "rope_EA", tip) == approx(twice(-extension / EA), rel=1e-8)
    assert static_sensitivity(rest, "rope_density", tip) == approx(twice(extension / DENSITY), rel=1e-8)
    assert static_sensitivity(rest, "rope_length", tip) == approx(twice(1.0 + 2.0 * extension), rel=1e-10)


@pytest.mark.parametrize("order", ["bdf1", "bdf2"])
def test_hanging_rope_swings_to_rest_directly(order):
    """The direct solver adds no compliance: the rollout ends where the closed form says, with its derivatives."""
    scene, s, times = hanging(20, 10.0, stretch_damping=0.05), sb.Solver(h=1 / 240, integrator=order), [0.0, 5.0]
    extension = ropes.hanging_extension(1.0, DENSITY, G, 10.0)
    assert -sb.simulate(scene, times, s).positions[-1, -1, Z] - 1.0 == approx(extension, abs=1e-10)
    tip = place(2, scene, 1, 20, Z, -1.0)
    assert sensitivity(scene, times, s, tip, "rope_EA") == approx(twice(-extension / 10.0), rel=1e-8)
    assert sensitivity(scene, times, s, tip, "rope_density") == approx(twice(extension / DENSITY), rel=1e-8)
    assert sensitivity(scene, times, s, tip, "rope_length") == approx(twice(1.0 + 2.0 * extension), rel=1e-8)
    assert sensitivity(scene, times, s, tip, "rope_stretch_damping") == approx((0.0, 0.0), abs=1e-10)


@pytest.mark.parametrize(("segments", "sweeps", "printed"), [(20, 1, 30.741e-3), (20, 4, 7.621e-3), (40, 1, 129.5e-3)])
def test_gauss_seidel_makes_a_rope_longer(segments, sweeps, printed):
    """O-8: unconverged sweeps add compliance; exactly so much, in the order of the two colors."""
    EA, h = 1e4, 1 / 240
    scene, s = hanging(segments, EA), sb.Solver(h=h, integrator="bdf1", method="gauss_seidel", iterations=sweeps)
    times = [0.0, 0.1 * segments**2]  # the sweeps' own creep dies out like that
    order = [*range(0, segments, 2), *range(1, segments, 2)]

    def extension(stiffness):
        return ropes.gauss_seidel_extension(1.0, DENSITY, G, stiffness, h, sweeps, order)

    shown = -sb.simulate(scene, times, s).positions[-1, -1, Z] - 1.0
    assert shown == approx(extension(EA), abs=1e-10)
    assert shown == approx(printed, rel=0.15)  # the estimate (n-1)^2 g h^2/(2K), which knows no order
    expected = derivative(extension, EA)
    assert sensitivity(scene, times, s, place(2, scene, 1, segments, Z, -1.0), "rope_EA") == approx(
        twice(expected), rel=1e-7
    )


@pytest.mark.parametrize("mass", [1.0, 2.5])
def test_point_mass_on_a_rope(mass):
    """O-9: the heaviest hangs on nodes a thousand times lighter."""
    EA, segments = 1e4, 20
    scene = hanging(segments, EA, stretch_damping=1e-3)
    scene.add_point_mass(segments, mass, "load")
    own = ropes.hanging_extension(1.0, DENSITY, G, EA)
    drop = ropes.hanging_extension_with_mass(1.0, mass, G, EA)
    rest = sb.equilibrium(scene)
    assert -rest.positions[-1, Z] - 1.0 == approx(own + drop, rel=1e-9)
    tip = pick(scene, segments, Z, -1.0)
    assert static_sensitivity(rest, "load_mass", tip) == approx(twice(drop / mass), rel=1e-8)
    assert static_sensitivity(rest, "rope_EA", tip) == approx(twice(-(own + drop) / EA), rel=1e-8)

    s, times = sb.Solver(h=1 / 240, integrator="bdf1"), [0.0, 3.0]
    motion = sb.simulate(scene, times, s)
    assert -motion.positions[-1, -1, Z] - 1.0 == approx(own + drop, abs=1e-10)
    assert motion.forces["rope_stretch"][-1, -1, 0] == approx(-(mass + DENSITY / segments / 2) * G, rel=1e-8)
    tip = place(2, scene, 1, segments, Z, -1.0)
    assert sensitivity(scene, times, s, tip, "load_mass") == approx(twice(drop / mass), rel=1e-7)
    assert sensitivity(scene, times, s, tip, "rope_EA") == approx(twice(-(own + drop) / EA), rel=1e-7)


# --- O-5d, 6: catenaries


@pytest.mark.parametrize("EA", [None, 100.0, 1.0])
@pytest.mark.parametrize("segments", [10, 20, 40])
def test_catenary(segments, EA):
    stiffness = math.inf if EA is None else EA
    scene = between_levels(0.6, 1.0, segments, EA)
    rest = sb.equilibrium(scene)
    nodes, tension = ropes.polygon_nodes(0.6, 1.0, segments, DENSITY, G, stiffness)
    assert rest.positions[:, [X, Z]] == approx(nodes, abs=1e-8)
    assert -rest.forces["rope_stretch"][:, 0] == approx(tension, rel=1e-8)
    assert rest.unstable_modes == 0
    if segments == 40:
        continuous = (
            ropes.catenary(0.6, 1.0, DENSITY, G) if EA is None else ropes.elastic_catenary(0.6, 1.0, DENSITY, G, EA)
        )
        assert -rest.positions[:, Z].min() == approx(continuous.sag, abs=3e-4)


@pytest.mark.parametrize("EA", [None, 10.0])
def test_catenary_derivatives(EA):
    segments, stiffness = 20, math.inf if EA is None else EA
    scene = between_levels(0.6, 1.0, segments, EA)
    rest = sb.equilibrium(scene)

    def hung(span=0.6, length=1.0, density=DENSITY, axial=stiffness):
        nodes, tension = ropes.polygon_nodes(span, length, segments, density, G, axial)
        return np.array([-nodes[segments // 2, 1], tension[0]])

    sag = pick(scene, segments // 2, Z, -1.0)
    first = {"rope_stretch": np.eye(segments, 1) * -1.0}
    end = {"position": np.eye(3 * (segments + 1))[3 * segments]}
    cases = [
        ("rope_length", derivative(lambda a: hung(length=a), 1.0)),
        ("rope_density", derivative(lambda a: hung(density=a), DENSITY)),
        (end, derivative(lambda a: hung(span=a), 0.6)),
    ]
    if EA is not None:
        cases.append(("rope_EA", derivative(lambda a: hung(axial=a), EA)))
    for direction, (by_sag, by_tension) in cases:
        assert static_sensitivity(rest, direction, sag) == approx(twice(by_sag), rel=1e-7, abs=1e-10)
        assert static_sensitivity(rest, direction, forces=first) == approx(twice(by_tension), rel=1e-7, abs=1e-10)


def test_catenary_derivatives_near_the_continuous_ones():
    """dsag/dL = 0.5958, dsag/dd = -0.3884, none by density; the polygon approaches them like 1/n^2."""
    gaps = []
    for segments in (20, 40, 80):
        scene = between_levels(0.6, 1.0, segments)
        rest = sb.equilibrium(scene)
        sag = pick(scene, segments // 2, Z, -1.0)
        end = {"position": np.eye(3 * (segments + 1))[3 * segments]}
        gaps.append(
            [
                static_sensitivity(rest, "rope_length", sag)[1] - 0.595828507,
                static_sensitivity(rest, end, sag)[1] + 0.388410536,
            ]
        )
        assert static_sensitivity(rest, "rope_density", sag) == approx((0.0, 0.0), abs=1e-9)
    for column in np.transpose(gaps):
        assert abs(column[-1]) < 5e-4
        assert observed_orders(column) == approx(2.0, abs=0.1)


def test_rollout_stays_at_the_equilibrium():
    """A rollout from rest stays within a second-order trace of h: XPBD's fixed point is not quite that of the
    statics."""
    moved = []
    for h in (1 / 120, 1 / 240, 1 / 480):
        scene = sb.rope(
            1.0, 10, density=DENSITY, drag_linear=0.4, points=[(0, 0, 0), (0.3, 0, -0.4), (0.6, 0, 0)], pinned=(0, -1)
        )
        nodes = sb.equilibrium(scene).positions
        end = sb.simulate(scene, [0.0, 4.0], sb.Solver(h=h), start=nodes).positions[-1]
        moved.append(np.abs(end - nodes).max())
    assert moved[0] < 1e-4
    assert observed_orders(moved) == approx(2.0, abs=0.1)


# --- O-10: vibrations


def chain(masses: np.ndarray, link: float, shape: np.ndarray) -> sb.Scene:
    """Rigid links below a fixed point, pushed aside by `shape` with the links kept at their length."""
    offsets = np.concatenate([[0.0], shape])
    drops = np.concatenate([[0.0], np.cumsum(np.sqrt(link**2 - np.diff(offsets) ** 2))])
    scene = sb.Scene("chain")
    scene.add_particles(np.stack([offsets, 0 * drops, -drops], axis=1), np.concatenate([[1.0], masses]))
    count = len(masses)
    scene.add_constraints(
        "distance", np.stack([np.arange(count), np.arange(1, count + 1)], axis=1), name="links", rest=link
    )
    scene.pin([0])
    return scene


def hanging_modes(masses: np.ndarray, links: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Squared frequencies (n,) and shapes (n, n) of transverse modes: each link resists with the weight below it over
    its length."""
    tension = np.cumsum(masses[::-1])[::-1] * G / links
    stiffness = np.diag(tension + np.append(tension[1:], 0.0)) - np.diag(tension[1:], 1) - np.diag(tension[1:], -1)
    return eigh(stiffness, np.diag(masses))


def projected_frequency(squared: float, h: float, order: int) -> float:
    """Frequency whose implicit discretization is what XPBD makes of a tension's stiffness `squared` = omega^2.

    The links' directions are those of the prediction y, so that u = (1 - eta^2 omega^2) y where backward Euler has u =
    y/(1 + eta^2 omega^2): omega^2/(1 - eta^2 omega^2), with eta = h or 2h/3.
    """
    eta = h if order == 1 else 2.0 * h / 3.0
    return math.sqrt(squared / (1.0 - eta * eta * squared))


@pytest.mark.parametrize("mode", [0, 1, 2])
@pytest.mark.parametrize("order", [1, 2])
def test_hanging_chain_frequencies(mode, order):
    count, link, h = 10, 0.1, 1 / 1000
    masses = np.full(count, 0.005)

    def discrete(scale: float) -> float:
        """Of the whole chain `scale` times as long; a prediction falls freely, which stretches the first link alone."""
        links = np.full(count, scale * link)
        links[0] += G * (h if order == 1 else 2.0 * h / 3.0) ** 2
        return projected_frequency(hanging_modes(masses, links)[0][mode], h, order)

    shape = hanging_modes(masses, np.full(count, link))[1][:, mode]
    scene, s = chain(masses, link, 1e-5 * shape / np.abs(shape).max()), sb.Solver(h=h, integrator=f"bdf{order}")
    times = steps(h, 1500)
    motion = sb.simulate(scene, times, s).positions

    def series(x):
        return (x[:, 1:, X] @ (masses * shape))[25:]

    expected = modes.hanging_beads_frequencies(1.0, count, G)[mode]
    assert expected == approx(modes.chain_frequencies(masses, link, G)[mode], rel=1e-12)
    estimate = shown_frequency(h, order)
    assert estimate(series(motion)) == approx(expected, rel=1e-4)
    assert estimate(series(motion)) == approx(discrete(1.0), rel=1e-6)

    def by(direction):
        return slope_along(estimate, series(motion), series(tangents(scene, times, s, direction)))

    scaled = {"rest": np.full(count, 1.0 / count), "position": scene.positions}
    assert by(scaled) == approx(float(derivative(discrete, 1.0)), rel=1e-5)
    assert by(scaled) == approx(-expected / 2.0, rel=5e-4)
    assert np.abs(tangents(scene, times, s, {"mass": np.concatenate([[0.0], masses])})).max() < 1e-11


@pytest.mark.parametrize("mode", [0, 1, 2])
@pytest.mark.parametrize("order", [1, 2])
def test_taut_string_frequencies(mode, order):
    beads, tension, length, compliance, h = 20, 10.0, 1.0, 1e-6, 1 / 8000
    spacing = length / (beads + 1)
    shape = np.sin((mode + 1) * math.pi * np.arange(beads + 2) / (beads + 1))
    scene = sb.Scene("string", gravity=(0.0, 0.0, 0.0))
    scene.add_particles(np.stack([spacing * np.arange(beads + 2), 0 * shape, 1e-6 * shape], axis=1), DENSITY * spacing)
    pairs = np.stack([np.arange(beads + 1), np.arange(1, beads + 2)], axis=1)
    scene.add_constraints("distance", pairs, name="string", rest=spacing - tension * compliance, compliance=compliance)
    scene.pin([0, beads + 1])
    times, s = steps(h, 2400), sb.Solver(h=h, integrator=f"bdf{order}")
    motion = sb.simulate(scene, times, s)
    expected = modes.beaded_string_frequencies(beads, tension, DENSITY, length)[mode]
    estimate = shown_frequency(h, order)

    def series(positions):
        return (positions[:, :, Z] @ shape)[25:]

    assert motion.forces["string"][-1, :, 0] == approx(-tension, rel=1e-6)
    shown = estimate(series(motion.positions))
    assert shown == approx(projected_frequency(expected**2, h, order), rel=1e-6)
    assert shown == approx(expected, rel=1e-4 if order == 2 else 2e-4)

    def by(direction):
        return slope_along(estimate, series(motion.positions), series(tangents(scene, times, s, direction)))

    def discrete(factor: float) -> float:
        return projected_frequency(factor * expected**2, h, order)

    slope = float(derivative(discrete, 1.0))
    assert slope == approx(expected / 2.0, rel=5e-4)
    assert by({"rest": np.full(beads + 1, -compliance)}) == approx(slope / tension, rel=1e-5)
    assert by({"mass": np.full(beads + 2, spacing)}) == approx(-slope / DENSITY, rel=1e-5)


# --- O-11: air


def test_falling_sheet_and_rope_reach_terminal_velocity():
    air, coefficient, diameter = 1.225, 1.2, 0.008
    particle = sb.Scene("sheet")
    particle.add_particles([[0.0, 0.0, 0.0]], 0.2)
    particle.set_drag(quadratic=0.5 * air * coefficient)
    rope = sb.rope(1.0, 8, density=DENSITY, EA=1e3, pinned=(), drag_quadratic=0.5 * air * coefficient * diameter)
    for scene, expected, end in ((particle, 1.633826, 3.0), (rope, 9.133366, 12.0)):
        fall = sb.simulate(scene, [0.0, end], sb.Solver(h=1 / 500))
        assert fall.velocities[-1, :, Z] == approx(-expected, rel=1e-6)
        assert drag.terminal_velocity(0.2 if scene is particle else DENSITY / diameter, G, coefficient, air) == approx(
            expected, rel=1e-6
        )


@pytest.mark.parametrize(("integrator", "order"), [("bdf1", 1), ("bdf2", 2)])
@pytest.mark.parametrize("law", ["linear", "quadratic"])
def test_falling_against_air(integrator, order, law):
    """Distance fallen and its derivative with respect to the drag converge to the continuous law with the
    integrator's order."""
    mass, c, end = 0.2, 0.735, 0.5

    def distance(coefficient):
        if law == "linear":
            return drag.linear_drag_distance(end, G, coefficient / mass)
        return drag.quadratic_drag_distance(end, G, math.sqrt(mass * G / coefficient))

    by_drag = derivative(distance, c)
    errors = []
    for count in (1600, 3200, 6400):
        scene = sb.Scene("fall")
        scene.add_particles([[0.0, 0.0, 0.0]], mass)
        scene.set_drag(**{law: c})
        s = sb.Solver(h=end / count, integrator=integrator)
        fallen = -sb.simulate(scene, [0.0, end], s).positions[-1, 0, Z]
        forward, backward = sensitivity(scene, [0.0, end], s, place(2, scene, 1, 0, Z, -1.0), {f"drag_{law}": [1.0]})
        assert forward == approx(backward, rel=1e-10)
        errors.append([fallen - distance(c), backward - by_drag])
    assert abs(errors[-1][0]) < 1e-3 * distance(c)
    for column in np.transpose(errors):
        assert observed_orders(column) == approx(order, abs=0.1)


def test_terminal_velocity_by_drag_coefficient():
    """dv_t/dC_d = -v_t/(2 C_d) = -0.680761 of the sheet, read off two positions."""
    scene = sb.Scene("sheet")
    scene.add_particles([[0.0, 0.0, 0.0]], 0.2)
    scene.set_drag(quadratic=0.5 * 1.225 * 1.2)
    h = 1 / 200
    times, s = [0.0, 3.0, 3.0 + h], sb.Solver(h=h, integrator="bdf1")
    weights = place(3, scene, 1, 0, Z, 1.0 / h) + place(3, scene, 2, 0, Z, -1.0 / h)
    both = sensitivity(scene, times, s, weights, {"drag_quadratic": [0.5 * 1.225]})
    assert both == approx(twice(-0.680761), rel=1e-6)
