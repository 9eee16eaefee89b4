"""Bending against closed forms: large deflections, pure moments, vibrations. Values, and derivatives by tangents and
by the adjoint."""

import math

import numpy as np
import pytest
import sheetbend as sb
from oracles import bending, modes
from oracles.calculus import derivative
from pytest import approx
from support import observed_orders, pick, shown_frequency, slope_along, static_sensitivity, steps, tangents, twice

G = 9.81
X, Y, Z = 0, 1, 2
LENGTH, DENSITY, EI = 0.5, 0.05, 1e-3
NO_GRAVITY = (0.0, 0.0, 0.0)


def cantilever(segments: int, load: float = 0.0, weight: bool = False, **options) -> sb.Scene:
    """Clamped level at the origin along x; a dead load [N] pulls the tip down, or the rope's own weight."""
    gravity = (0.0, 0.0, -G) if weight else NO_GRAVITY
    scene = sb.rope(LENGTH, segments, density=DENSITY, EI=EI, clamp_start=(1, 0, 0), gravity=gravity, **options)
    if load:
        scene.add_force([segments], [[[0.0, 0.0, -load]]])
    return scene


def chain(segments: int, weights: np.ndarray, stiffness: float = EI) -> np.ndarray:
    """The same at rest by the closed form of its law; the clamp is a direction, half a joint."""
    return bending.bend_chain(segments, LENGTH, stiffness, LENGTH / (2 * segments), weights)


# --- O-15: tip load


@pytest.mark.parametrize("segments", [20, 40])
@pytest.mark.parametrize("load", [0.25, 1.0, 3.0, 10.0])
def test_tip_load(segments, load):
    force = load * EI / LENGTH**2
    weights = np.append(np.zeros(segments), force)
    scene = cantilever(segments, force)
    rest = sb.equilibrium(scene)
    assert rest.positions[: segments + 1, [X, Z]] * (1, -1) == approx(chain(segments, weights), abs=1e-9)

    elastica = bending.tip_load_elastica(load)
    tip = rest.positions[segments]
    assert (-tip[Z] / LENGTH, tip[X] / LENGTH) == approx((elastica.drop, elastica.reach), abs=3e-3)

    expected = derivative(lambda stiffness: chain(segments, weights, stiffness)[-1, 1], EI)
    assert static_sensitivity(rest, "rope_EI", pick(scene, segments, Z, -1.0)) == approx(twice(expected), rel=1e-7)
    continuous = -(LENGTH / EI) * load * derivative(lambda a: bending.tip_load_elastica(a).drop, load)
    assert expected == approx(float(continuous), rel=2e-2)


def test_tip_load_converges_with_the_mesh():
    """n = 160 is within 3e-4 L; half end segments make it O(1/n^2)."""
    load = 2.0
    elastica, gaps = bending.tip_load_elastica(load), []
    for segments in (80, 160, 320):
        tip = sb.equilibrium(cantilever(segments, load * EI / LENGTH**2)).positions[segments]
        gaps.append([-tip[Z] / LENGTH - elastica.drop, tip[X] / LENGTH - elastica.reach])
    assert np.abs(gaps[1]).max() < 3e-4
    for column in np.transpose(gaps):
        assert observed_orders(column) == approx(2.0, abs=0.1)


# --- O-17: own weight


@pytest.mark.parametrize("gamma", [1.0, 4.0, 8.0])
def test_heavy_elastica(gamma):
    segments, density = 100, gamma * EI / (G * LENGTH**3)
    scene = sb.rope(LENGTH, segments, density=density, EI=EI, clamp_start=(1, 0, 0))
    rest = sb.equilibrium(scene)
    share = np.full(segments + 1, density * LENGTH / segments * G)
    share[-1] /= 2
    assert rest.positions[: segments + 1, [X, Z]] * (1, -1) == approx(chain(segments, share), abs=1e-8)

    elastica = bending.heavy_elastica(gamma)
    tip = rest.positions[segments]
    assert (-tip[Z] / LENGTH, tip[X] / LENGTH) == approx((elastica.drop, elastica.reach), abs=1e-3)
    assert rest.unstable_modes == 0

    drop = pick(scene, segments, Z, -1.0)
    by_stiffness = derivative(lambda stiffness: chain(segments, share, stiffness)[-1, 1], EI)
    assert static_sensitivity(rest, "rope_EI", drop) == approx(twice(by_stiffness), rel=1e-6)
    assert static_sensitivity(rest, "rope_density", drop) == approx(twice(-by_stiffness * EI / density), rel=1e-6)
    continuous = -LENGTH * gamma / EI * derivative(lambda a: bending.heavy_elastica(a).drop, gamma)
    assert by_stiffness == approx(float(continuous), rel=2e-3)


def test_planar_bend_is_bend_in_its_plane():
    rest = sb.equilibrium(cantilever(20, weight=True))
    planar = sb.equilibrium(cantilever(20, weight=True, plane=(0, 1, 0), set_modes=(0,)))
    assert planar.positions == approx(rest.positions, abs=1e-10)


# --- O-21: pure moment


def rolled(links: int, stiffness: float, moment: float) -> tuple[sb.Scene, np.ndarray]:
    """A chain whose first link is fixed, rolled into a regular polygon, with a couple on its last link; and the
    polygon's nodes."""
    link = LENGTH / links
    angle = 2.0 * math.pi / links * np.arange(links + 1)
    ends = np.cumsum(link * np.stack([np.cos(angle), 0 * angle, np.sin(angle)], axis=1), axis=0)
    nodes = np.concatenate([np.zeros((1, 3)), ends])
    scene = sb.Scene("roll-up", gravity=NO_GRAVITY)
    scene.add_particles(nodes, DENSITY * link)
    scene.add_constraints(
        "distance", np.stack([np.arange(1, links + 1), np.arange(2, links + 2)], axis=1), name="links", rest=link
    )
    triples = np.stack([np.arange(links), np.arange(1, links + 1), np.arange(2, links + 2)], axis=1)
    scene.add_constraints("bend", triples, name="joints", compliance=np.full(links, link / stiffness))
    scene.pin([0, 1])
    couple = moment / link * np.array([0.0, 0.0, 1.0])  # the last link points along x again
    scene.add_force([links, links + 1], [[-couple, couple]])
    return scene, nodes


@pytest.mark.parametrize(("links", "ratio"), [(10, 1.1434), (20, 1.0336), (40, 1.0083)])
def test_roll_up(links, ratio):
    """The moment that closes the polygon over the continuous 2 pi EI/L, by bend's own law; no other closes it."""
    assert bending.roll_up_ratio(links) == approx(ratio, abs=5e-5)
    moment = bending.roll_up_ratio(links) * 2.0 * math.pi * EI / LENGTH
    scene, nodes = rolled(links, EI, moment)
    rest = sb.equilibrium(scene, stable=False)
    assert rest.positions == approx(nodes, abs=1e-9)
    assert rest.forces["links"][:, 0] == approx(0.0, abs=1e-9 * moment / LENGTH)  # bending alone
    # The multiplier is EI/l |kappa b|; the moment has another 1/cos^2 of half the angle.
    half = math.pi / links
    assert np.linalg.norm(rest.forces["joints"], axis=1) == approx(moment * math.cos(half) ** 2, rel=1e-8)

    by_compliance = {"compliance": np.concatenate([np.zeros(links), np.full(links, -LENGTH / links / EI**2)])}
    force = scene.base_arrays()["force"].ravel()
    tip = pick(scene, links + 1, X)
    by_stiffness = static_sensitivity(rest, by_compliance, tip)
    by_moment = static_sensitivity(rest, {"force": force / moment}, tip)
    assert by_stiffness == approx(
        twice(-by_moment[0] * moment / EI), rel=1e-7
    )  # the shape knows M/EI only: dM/dEI = M/EI
    assert abs(by_moment[0]) > 1e-2 * LENGTH / moment

    elsewhere = sb.equilibrium(rolled(links, EI, 0.999 * moment)[0], stable=False)
    assert np.abs(elsewhere.positions - nodes).max() > 1e-5


# --- O-16a: vibration


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("mode", [0, 1])
def test_cantilever_vibration(order, mode):
    segments = 20 * (mode + 1)
    omega, shape = modes.cantilever_chain_mode(segments, mode, LENGTH, DENSITY, EI)
    continuous = modes.cantilever_frequencies(LENGTH, DENSITY, EI, 2)[mode]
    assert omega == approx(continuous, rel=5e-3)

    h = 0.02 / omega
    heights = np.concatenate([[0.0], 1e-5 * LENGTH * shape])
    along = np.concatenate([[0.0], np.cumsum(np.sqrt((LENGTH / segments) ** 2 - np.diff(heights) ** 2))])
    points = np.stack([along, 0 * along, heights], axis=1)
    scene = sb.rope(LENGTH, segments, density=DENSITY, EI=EI, points=points, clamp_start=(1, 0, 0), gravity=NO_GRAVITY)
    times, s = steps(h, 800), sb.Solver(h=h, integrator=f"bdf{order}")
    motion = sb.simulate(scene, times, s).positions
    mass = np.append(np.ones(segments - 1), 0.5)

    def series(positions):
        return (positions[:, 1 : segments + 1, Z] @ (mass * shape))[25:]

    estimate = shown_frequency(h, order)
    assert estimate(series(motion)) == approx(omega, rel=1e-5)
    by_stiffness = slope_along(estimate, series(motion), series(tangents(scene, times, s, "rope_EI")))
    assert by_stiffness == approx(omega / (2 * EI), rel=1e-5)
    by_density = slope_along(estimate, series(motion), series(tangents(scene, times, s, "rope_density")))
    assert by_density == approx(-omega / (2 * DENSITY), rel=1e-5)
