"""Where rods buckle, against closed forms: columns, Michell's ring, and the localized helix of a twisted rod."""

import math

import numpy as np
import pytest
import sheetbend as sb
from oracles import rods
from oracles.calculus import derivative
from pytest import approx
from support import observed_orders

EI = 1e-3


# --- O-16b: columns


def column(length: float, load: float = 0.0, weight: float = 0.0, stiffness: float = EI) -> sb.Scene:
    """A rod clamped upright at its foot, under a dead load [N] on its top or a weight [N/m]."""
    foot = sb.Grip.fixed((0, 0, 0), (0, 0, 1), (1, 0, 0))
    scene = sb.rod(length, 40, density=0.05, EI=stiffness, GJ=EI, start=foot, gravity=(0, 0, -weight / 0.05))
    if load:
        scene.add_force([40], [[[0.0, 0.0, -load]]])
    return scene


def ways_to_fall(scene: sb.Scene) -> int:
    return sb.equilibrium(scene, stable=False).unstable_modes


@pytest.mark.parametrize("stiffness", [0.5 * EI, EI])
def test_a_column_falls_at_eulers_load(stiffness):
    """A clamped-free column is half of a pinned one of twice its length; it may fall in two directions."""
    load = rods.euler_load(2 * 0.4, stiffness)
    assert ways_to_fall(column(0.4, load=0.98 * load, stiffness=stiffness)) == 0
    assert ways_to_fall(column(0.4, load=1.02 * load, stiffness=stiffness)) == 2


@pytest.mark.parametrize("stiffness", [0.5 * EI, EI])
def test_a_pinned_column_falls_at_eulers_load(stiffness):
    """Its top is held on the axis by two level links to far points, its roll by the director of the first edge."""
    length, segments = 0.5, 40
    for share, expected in ((0.98, 0), (1.02, 2)):
        scene = sb.Scene("pinned", (0, 0, 0))
        points = [[0, 0, 0], [0, 0, length]]
        options = {"density": 0.05, "EI": stiffness, "GJ": EI, "points": points, "director": (1, 0, 0)}
        rod = sb.add_rod(scene, length=length, segments=segments, **options)
        far = scene.add_particles([[100.0, 0, length], [0, 100.0, length]], 1.0)
        top = rod.particles[-1]
        scene.add_constraints("distance", [[top, far[0]], [top, far[1]]], name="level", rest=100.0)
        scene.pin([rod.particles[0], rod.directors[0], *far])
        scene.add_force([top], [[[0.0, 0.0, -share * rods.euler_load(length, stiffness)]]])
        assert ways_to_fall(scene) == expected


@pytest.mark.parametrize("stiffness", [0.5 * EI, EI])
def test_a_column_falls_under_its_own_weight(stiffness):
    """Greenhill's length; 0.2519 m for EI = 1e-3 N m^2 and 0.4905 N/m. It grows like EI^(1/3)."""
    weight = 0.4905
    length = rods.self_buckling_length(weight, stiffness)
    assert ways_to_fall(column(0.98 * length, weight=weight, stiffness=stiffness)) == 0
    assert ways_to_fall(column(1.02 * length, weight=weight, stiffness=stiffness)) == 2
    by_stiffness = derivative(lambda s: rods.self_buckling_length(weight, s), stiffness)
    assert by_stiffness == approx(length / (3 * stiffness), rel=1e-9)
    if stiffness == EI:
        assert length == approx(0.2519, abs=5e-5)


# --- O-22: Michell's ring


def ring(ratio: float, twist: float, links: int = 60, radius: float = 0.15) -> sb.Scene:
    """A rod that is straight at rest, bent to a ring and twisted, its two ends gripped at one place; GJ/EI = `ratio`.

    It may swing about the tangent of the grips without any work. What holds the node across at its height, a rigid
    link to a far point, ends that; the ring's rest needs no force there.
    """
    angle = 2 * np.pi / links
    around = angle * (np.arange(links) + 0.5)
    link = 2 * np.pi * radius / links
    steps = link * np.stack([np.cos(around), np.sin(around), 0 * around], axis=1)
    points = np.vstack([np.zeros(3), np.cumsum(steps, axis=0)])
    start, end = (sb.Grip.fixed((0, 0, 0), (1, 0, 0), (0, -math.sin(a), math.cos(a))) for a in (0.0, twist))
    scene = sb.Scene("ring", gravity=(0, 0, 0))
    options = {"density": 0.05, "EI": EI, "GJ": ratio * EI, "points": points, "start": start, "end": end, "roll": True}
    sb.add_rod(scene, "rod", length=links * link, segments=links, turns=round(twist / (2 * np.pi)), **options)
    far = int(scene.add_particles([points[links // 2] + (0, 0, 1.0)], 1.0)[0])
    scene.add_constraints("distance", [[links // 2, far]], name="level", rest=1.0)
    scene.pin([far])
    return scene


@pytest.mark.parametrize(("ratio", "degrees"), [(1.0, 623.5383), (0.8232, 757.46), (1.4619, 426.53)])
def test_michells_ring(ratio, degrees):
    critical = rods.ring_critical_twist(ratio)
    assert math.degrees(critical) == approx(degrees, abs=0.02)
    below, above = (sb.equilibrium(ring(ratio, share * critical), stable=False) for share in (0.97, 1.03))
    assert (below.unstable_modes, above.unstable_modes) == (0, 2)  # any phase of the mode around the ring
    for rest in (below, above):
        assert np.abs(rest.positions[rest.scene.ropes["rod"].particles, 2]).max() < 1e-3
        assert np.abs(rest.forces["level"]).max() < 1e-9


@pytest.mark.parametrize("ratio", [1.0, 0.8232, 1.4619])
def test_michells_ring_by_gradient(ratio):
    """A small flaw (the ends' half joints) grows like 1/(critical - twist), so that a/(da/dtwist) is what is missing.

    The same from the derivatives with respect to GJ and EI: the shape knows the twist times GJ/EI only.
    """
    critical = rods.ring_critical_twist(ratio)
    angle = 0.98 * critical
    scene = ring(ratio, angle)
    rest = sb.equilibrium(scene, stable=False)
    around = scene.ropes["rod"].particles[:-1]
    phase = 4 * np.pi * np.arange(len(around)) / len(around)
    bars = []
    for wave in (np.cos(phase), np.sin(phase)):  # the mode that falls has two waves around the ring
        bars.append(np.zeros_like(rest.positions))
        bars[-1][around, 2] = wave
    flaw, bar = max(((float((bar * rest.positions).sum()), bar) for bar in bars), key=lambda pair: abs(pair[0]))
    slopes = rest.gradient(bar)
    assert angle + flaw / slopes["rod_roll"] == approx(critical, rel=0.03)
    assert slopes["rod_GJ"] * ratio * EI == approx(slopes["rod_roll"] * angle, rel=0.01)
    assert slopes["rod_EI"] * EI == approx(-slopes["rod_roll"] * angle, rel=0.01)


# --- O-22c: the localized helix


LENGTH, STIFF, TORSIONAL, ROTATION, SLACK = 100.0, 1.345, 0.789, 54 * math.pi, 3.0


def buckled(segments: int) -> tuple[rods.HelicalBuckling, sb.Equilibrium, np.ndarray]:
    """Clamped ends turned by 27 turns and moved together by 3 of 100: the closed form, the rod at rest, and the cosine
    of its edges' slope.

    The helix may turn about the axis without any work, and slide along the rod with next to none. Two links from its
    middle node to far points end that; they bear nothing.
    """
    closed = rods.helical_buckling(LENGTH, STIFF, TORSIONAL, ROTATION, SLACK)
    half = 0.5 * (LENGTH - SLACK)
    start, end = (sb.Grip.fixed((0, 0, z), (0, 0, 1), (1, 0, 0)) for z in (-half, half))
    points = closed.places(np.linspace(-0.5, 0.5, segments + 1) * LENGTH)
    scene = sb.Scene("helix", gravity=(0, 0, 0))
    options = {"density": 1.0, "EI": STIFF, "GJ": TORSIONAL, "points": points, "start": start, "end": end, "turns": 27}
    rod = sb.add_rod(scene, length=LENGTH, segments=segments, roll=True, **options)
    middle = int(rod.particles[segments // 2])
    far = scene.add_particles(scene.positions[middle] + 1e3 * np.array([[1.0, 0, 0], [0, 0, 1.0]]), 1.0)
    scene.add_constraints("distance", [[middle, far[0]], [middle, far[1]]], name="centered", rest=1e3)
    scene.pin(far)
    rest = sb.equilibrium(scene)
    edges = np.diff(rest.positions[rod.particles], axis=0)
    return closed, rest, edges[:, 2] / np.linalg.norm(edges, axis=1)


def envelope_errors(closed: rods.HelicalBuckling, cosine: np.ndarray) -> np.ndarray:
    """(cos phi - cos phi_0)/(1 - cos phi_0) of the edges, less tanh^2(s/s*)."""
    s = ((np.arange(len(cosine)) + 0.5) / len(cosine) - 0.5) * LENGTH
    return (cosine - closed.cosine(s)) / (1 - closed.min_cosine)


def test_localized_helical_buckling():
    """180 segments, each edge's error in the norm |error|_2/n of the published convergence study."""
    closed, rest, cosine = buckled(180)
    assert rest.unstable_modes == 0
    assert np.abs(rest.forces["centered"]).max() < 1e-9
    assert np.linalg.norm(envelope_errors(closed, cosine)) / 180 < 1.9e-3
    torque = -rest.forces["rod_twist"]
    assert np.ptp(torque) < 1e-9
    assert torque == approx(closed.torque, rel=1e-3)
    assert -rest.forces["rod_stretch"].min() == approx(closed.tension, rel=0.05)


def test_localized_helical_buckling_converges_with_the_mesh():
    errors = []
    for segments in (180, 360, 720):
        closed, _, cosine = buckled(segments)
        errors.append(float(np.sqrt(np.mean(envelope_errors(closed, cosine) ** 2))))
    assert errors[-1] < 2e-3
    assert observed_orders(errors) == approx(2.0, abs=0.2)


def test_localized_helical_buckling_derivatives():
    """The torque at rest by EI, GJ and the end's rotation."""
    _, rest, _ = buckled(360)
    bar = np.zeros_like(rest.forces["rod_twist"])
    bar[0] = -1.0
    slopes = rest.gradient(None, {"rod_twist": bar})

    def torque(stiffness: float = STIFF, torsional: float = TORSIONAL, rotation: float = ROTATION) -> float:
        return rods.helical_buckling(LENGTH, stiffness, torsional, rotation, SLACK).torque

    by_stiffness = float(derivative(lambda x: torque(stiffness=x), STIFF, 0.02))
    assert slopes["rod_EI"] == approx(by_stiffness, abs=1e-3 * torque() / STIFF)
    assert slopes["rod_GJ"] == approx(float(derivative(lambda x: torque(torsional=x), TORSIONAL, 0.02)), rel=5e-3)
    assert slopes["rod_roll"] == approx(float(derivative(lambda x: torque(rotation=x), ROTATION, 1.0)), rel=5e-3)
    both = slopes["rod_EI"] * STIFF + slopes["rod_GJ"] * TORSIONAL  # twice as stiff, twice the torque
    assert both == approx(-rest.forces["rod_twist"][0, 0], rel=1e-6)
