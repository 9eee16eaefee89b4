"""Rods at rest against closed forms: bending in any direction, rest shape, torsion. Values, and derivatives by tangents
and by the adjoint."""

import math

import numpy as np
import pytest
import sheetbend as sb
from oracles import bending, rods
from oracles.calculus import derivative
from pytest import approx
from scipy.linalg import expm
from scipy.spatial.transform import Rotation
from support import observed_orders, static_sensitivity, twice

G = 9.81
LENGTH, DENSITY, EI, GJ = 0.5, 0.05, 1e-3, 0.8e-3
SEEN = Rotation.from_rotvec([0.5, -0.9, 1.3])  # no axis of the world is one of the rod's
ALONG, FIRST, SECOND = SEEN.as_matrix().T  # t, m1 and m2 at the clamp


def clamped(segments: int, load: np.ndarray | None = None, weight: float = 0.0, **options) -> sb.Scene:
    """Clamped at the origin; a dead load [N] on the tip, or the weight of an acceleration `weight` against m1."""
    start = sb.Grip.fixed((0, 0, 0), ALONG, FIRST)
    given = {"density": DENSITY, "EI": EI, "GJ": GJ, "gravity": -weight * FIRST} | options
    scene = sb.rod(LENGTH, segments, start=start, **given)
    if load is not None:
        scene.add_force([segments], np.reshape(load, (1, 1, 3)))
    return scene


def nodes(rest: sb.Equilibrium) -> np.ndarray:
    """(n + 1, 3) in the clamp's axes t, m1, m2."""
    rod = rest.scene.ropes["rod"]
    return rest.positions[rod.particles] @ np.stack([ALONG, FIRST, SECOND], axis=1)


def tip(scene: sb.Scene, direction: np.ndarray) -> np.ndarray:
    """Weights (particles, 3) that pick the tip's coordinate along a direction."""
    weights = np.zeros((scene.particle_count, 3))
    weights[scene.ropes["rod"].particles[-1]] = direction
    return weights


def chain(segments: int, weights: np.ndarray, stiffness: float = EI) -> np.ndarray:
    """(n + 1, 2) along and down, by the closed form of the joint's law; the clamp is half a joint."""
    return bending.bend_chain(segments, LENGTH, stiffness, LENGTH / (2 * segments), weights)


# --- what varies along the rod

UNEVEN = {"rod_density_1": -0.5, "rod_density_2": 0.3}


def test_a_rod_that_is_heavier_in_places_sags_under_the_weight_of_each_piece():
    """The chain's closed form, loaded by the integral of the density over every node's Voronoi cell."""
    segments, weight = 80, 2.0
    ends = LENGTH * np.clip((np.arange(segments + 2) - 0.5) / segments, 0.0, 1.0)
    mass = DENSITY * ends
    for name, share in UNEVEN.items():
        k = int(name[-1]) * np.pi / LENGTH
        mass = mass + DENSITY * share * np.sin(k * ends) / k
    closed = chain(segments, weight * np.diff(mass))
    scene = clamped(segments, weight=weight, density_modes=(1, 2))
    sag = nodes(sb.equilibrium(scene, values=UNEVEN))
    even = nodes(sb.equilibrium(scene))
    expected = np.stack([closed[:, 0], -closed[:, 1], 0 * closed[:, 0]], axis=1)
    assert sag == approx(expected, abs=1e-5 * LENGTH)
    assert np.abs(even - expected).max() > 0.02 * LENGTH


def test_modes_of_the_density_leave_the_weight():
    scene = clamped(12, density_modes=(1, 2, 5))
    values = UNEVEN | {"rod_density_5": 0.1}
    inputs = scene.compiled.unpack(scene.compiled.inputs(scene.compiled.values(values)))
    mass = inputs["mass"][scene.ropes["rod"].particles]
    assert mass.sum() == approx(DENSITY * LENGTH) and np.ptp(mass[1:-1]) > 0.5 * mass.mean()


# --- O-15: tip load


@pytest.mark.parametrize("load", [0.25, 1.0, 3.0, 10.0, 20.0])
def test_tip_load(load):
    segments, force = 40, load * EI / LENGTH**2
    weights = np.append(np.zeros(segments), force)
    scene = clamped(segments, -force * FIRST)
    rest = sb.equilibrium(scene)
    closed = chain(segments, weights)
    assert nodes(rest) == approx(np.stack([closed[:, 0], -closed[:, 1], 0 * closed[:, 0]], axis=1), abs=1e-9)
    assert rest.unstable_modes == 0

    elastica, end = bending.tip_load_elastica(load), nodes(rest)[-1]
    assert (-end[1] / LENGTH, end[0] / LENGTH) == approx((elastica.drop, elastica.reach), abs=3e-3)
    by_stiffness = derivative(lambda stiffness: chain(segments, weights, stiffness)[-1, 1], EI)
    assert static_sensitivity(rest, "rod_EI", tip(scene, -FIRST)) == approx(twice(by_stiffness), rel=1e-7)
    assert static_sensitivity(rest, "rod_GJ", tip(scene, -FIRST)) == approx((0.0, 0.0), abs=1e-9)
    continuous = -(LENGTH / EI) * load * derivative(lambda a: bending.tip_load_elastica(a).drop, load)
    assert by_stiffness == approx(float(continuous), rel=2e-2)


def test_tip_load_converges_with_the_mesh():
    load, gaps = 2.0, []
    elastica = bending.tip_load_elastica(load)
    for segments in (80, 160, 320):
        end = nodes(sb.equilibrium(clamped(segments, -load * EI / LENGTH**2 * FIRST)))[-1] / LENGTH
        gaps.append([-end[1] - elastica.drop, end[0] - elastica.reach])
    assert np.abs(gaps[1]).max() < 3e-4
    for column in np.transpose(gaps):
        assert observed_orders(column) == approx(2.0, abs=0.1)


def test_a_section_bends_by_its_two_stiffnesses():
    """EI resists bending towards the first frame axis, EI2 towards the second; a skew load bends askew."""
    segments, force, second = 40, 2.0 * EI / LENGTH**2, 0.3 * EI
    weights = np.append(np.zeros(segments), force)
    for direction, axis, name, stiffness in ((FIRST, 1, "rod_EI", EI), (SECOND, 2, "rod_EI2", second)):
        scene = clamped(segments, -force * direction, EI2=second)
        rest = sb.equilibrium(scene, stable=False)
        closed = chain(segments, weights, stiffness)
        assert nodes(rest)[:, [0, axis]] * (1, -1) == approx(closed, abs=1e-8)
        by_stiffness = derivative(lambda s: chain(segments, weights, s)[-1, 1], stiffness)
        assert static_sensitivity(rest, name, tip(scene, -direction)) == approx(twice(by_stiffness), rel=1e-6)

    small = 1e-3 * EI / LENGTH**2
    end = nodes(sb.equilibrium(clamped(segments, small * (FIRST + SECOND), EI2=second)))[-1]
    assert end[2] / end[1] == approx(EI / second, rel=1e-5)


# --- O-17: own weight


@pytest.mark.parametrize("gamma", [1.0, 8.0, 50.0])
def test_heavy_elastica(gamma):
    segments, density = 100, gamma * EI / (G * LENGTH**3)
    scene = clamped(segments, weight=G, density=density)
    rest = sb.equilibrium(scene)
    share = np.full(segments + 1, density * LENGTH / segments * G)
    share[-1] /= 2
    closed = chain(segments, share)
    assert nodes(rest) == approx(np.stack([closed[:, 0], -closed[:, 1], 0 * closed[:, 0]], axis=1), abs=1e-8)

    elastica, end = bending.heavy_elastica(gamma), nodes(rest)[-1]
    assert (-end[1] / LENGTH, end[0] / LENGTH) == approx((elastica.drop, elastica.reach), abs=1e-3)
    by_stiffness = derivative(lambda stiffness: chain(segments, share, stiffness)[-1, 1], EI)
    assert static_sensitivity(rest, "rod_EI", tip(scene, -FIRST)) == approx(twice(by_stiffness), rel=1e-6)
    by_density = -by_stiffness * EI / density
    assert static_sensitivity(rest, "rod_density", tip(scene, -FIRST)) == approx(twice(by_density), rel=1e-6)
    continuous = -LENGTH * gamma / EI * derivative(lambda a: bending.heavy_elastica(a).drop, gamma)
    assert by_stiffness == approx(float(continuous), rel=5e-3)


# --- O-21: pure moment, and the same shape by rest curvature


def turned(angles: np.ndarray) -> np.ndarray:
    """(n + 1, 2) along and up, nodes of equal links that turn up by angles (n,) at the clamp and the inner nodes."""
    theta, link = np.cumsum(angles), LENGTH / len(angles)
    steps = link * np.stack([np.cos(theta), np.sin(theta)], axis=1)
    return np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])


@pytest.mark.parametrize(("links", "ratio"), [(10, 1.1434), (20, 1.0336), (40, 1.0083)])
def test_roll_up_by_a_couple(links, ratio):
    """Under the moment that rolls a polygon every inner joint turns by 2 pi/n, and the clamp's half joint as its law
    says."""
    link = LENGTH / links
    moment = bending.bend_moment(2 * math.pi / links, EI, link)
    assert moment == approx(ratio * 2 * math.pi * EI / LENGTH, rel=1e-4)

    def shape(stiffness: float) -> np.ndarray:
        voronoi = np.append(0.5 * link, np.full(links - 1, link))
        return turned(np.array([bending.turning_angle(moment * v / stiffness) for v in voronoi]))

    closed = shape(EI)
    last = (closed[-1] - closed[-2]) / link
    couple = moment / link * (last[0] * FIRST - last[1] * ALONG)
    scene = clamped(links, points=closed @ np.stack([ALONG, FIRST]))
    scene.add_force([links - 1, links], [[-couple, couple]])
    rest = sb.equilibrium(scene, stable=False)
    assert nodes(rest) == approx(np.column_stack([closed, 0 * closed[:, 0]]), abs=1e-6 * LENGTH)
    # The multiplier is EI/l |kappa b|; the moment has another 1/cos^2 of half the angle.
    felt = np.linalg.norm(rest.forces["rod_bend"][1:], axis=1) / math.cos(math.pi / links) ** 2
    assert felt == approx(moment, rel=1e-8)

    # The couple's directions stay while the stiffness changes, which to first order is no change of the moment.
    by_stiffness = derivative(lambda s: shape(s)[-1], EI)
    for expected, direction in zip(by_stiffness, (ALONG, FIRST), strict=True):
        found = static_sensitivity(rest, "rod_EI", tip(scene, direction))
        assert found == approx(twice(expected), rel=1e-6, abs=1e-6 * LENGTH / EI)


@pytest.mark.parametrize("axis", [1, 2])
def test_rest_curvature_closes_a_ring(axis):
    """No load, no energy: every joint has the |kappa b| = 2 tan(phi/2) that it wants, share * length * curvature."""
    ring, gaps = 2 * math.pi / LENGTH, []
    for links in (20, 40, 80):
        scene = clamped(links, curvature_modes=(0,))
        name = f"rod_curvature_{axis}_0"
        plane = np.stack([ALONG, (FIRST, SECOND)[axis - 1]])
        start = clamped(links, points=turned(np.full(links, 6.0 / links)) @ plane)
        rest = sb.equilibrium(scene, start.nodes, values={name: ring})

        def closed(curvature: float, links: int = links) -> np.ndarray:
            wanted = curvature * LENGTH / links * np.append(0.5, np.ones(links - 1))
            return turned(2 * np.arctan(wanted / 2))

        assert nodes(rest)[:, [0, axis]] == approx(closed(ring), abs=1e-8)
        assert abs(rest.energy) < 1e-15
        gaps.append(float(np.linalg.norm(nodes(rest)[-1])) / LENGTH)
        slope = rest.gradient(tip(scene, (FIRST, SECOND)[axis - 1]))[name]
        assert slope == approx(float(derivative(lambda k: closed(k)[-1, 1], ring)), rel=1e-6)
    assert gaps[0] < 0.03
    assert observed_orders(gaps) == approx(2.0, abs=0.3)


def test_rest_curvature_and_twist_make_a_helix():
    """The continuous rod's frames turn at the constant rate (-kappa2, kappa1, twist) in themselves."""
    kappa1, kappa2, twist, errors = 6.0, 3.0, 8.0, []
    rate = np.zeros((4, 4))
    rate[:3, :3] = np.cross([twist, -kappa2, kappa1], np.eye(3)).T  # axes t, m1, m2
    rate[0, 3] = 1.0
    world = np.stack([ALONG, FIRST, SECOND])
    for links in (10, 20, 40):
        scene = clamped(links, curvature_modes=(0,), twist_modes=(0,))
        rod, link, start = scene.ropes["rod"], LENGTH / links, scene.nodes
        start[rod.particles] = [expm(s * rate)[:3, 3] @ world for s in rod.arc_length]
        start[rod.directors[1:]] = [expm((k + 0.5) * link * rate)[:3, 1] @ world for k in range(links)]
        values = {"rod_curvature_1_0": kappa1, "rod_curvature_2_0": kappa2, "rod_twist_0": twist}
        rest = sb.equilibrium(scene, start, values)
        assert abs(rest.energy) < 1e-15
        errors.append(float(np.linalg.norm(nodes(rest)[-1] - expm(LENGTH * rate)[:3, 3])))
    assert errors[-1] < 2e-3
    assert observed_orders(errors) == approx(2.0, abs=0.2)


# --- O-22b: torsion


@pytest.mark.parametrize("segments", [4, 15])
def test_straight_torsion(segments):
    """A rod held taut between two grips, one of which is rolled by 1 rad."""
    length, stiffness, angle = 1.0, 1e-3, 1.0
    grips = [sb.Grip.fixed(x * ALONG, ALONG, FIRST) for x in (0.0, 1.001 * length)]
    options = {"density": DENSITY, "EI": EI, "GJ": stiffness, "EA": 100.0, "gravity": (0, 0, 0)}
    scene = sb.rod(length, segments, start=grips[0], end=grips[1], roll=True, **options)
    rest = sb.equilibrium(scene, values={"rod_roll": angle})
    torque = rods.torsion_torque(angle, length, stiffness)
    assert torque == 1e-3
    assert rest.forces["rod_twist"] == approx(-torque, rel=1e-8)

    one = np.zeros((segments + 1, 1))
    one[1] = -1.0  # a joint's torque
    slopes = rest.gradient(None, {"rod_twist": one})
    assert slopes["rod_roll"] == approx(torque / angle, rel=1e-8)  # d(angle)/d(torque) = L/GJ
    assert slopes["rod_GJ"] == approx(torque / stiffness, rel=1e-8)
    assert slopes["rod_length"] == approx(-torque / length, rel=1e-8)

    # A frame at s has turned by s/L of the roll; the edges' frames stand in the middles of the links.
    inner = rest.nodes[scene.ropes["rod"].directors[1:-1]]
    turned_by = np.arctan2(inner @ SECOND, inner @ FIRST)
    assert turned_by == approx((np.arange(segments) + 0.5) / segments * angle, abs=1e-9)
