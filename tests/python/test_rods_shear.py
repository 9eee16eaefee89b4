"""Rods that shear against closed forms: Timoshenko's cantilever and vibration, Engesser's column, and the rod without
shear. Momentum and other places of the same scene are with those of all rods in test_rods_invariance.py."""

import math

import numpy as np
import pytest
import sheetbend as sb
from oracles import rods
from pytest import approx
from scipy.spatial.transform import Rotation
from support import observed_orders, shown_frequency, static_sensitivity, steps

LENGTH, DENSITY, EI, GJ = 0.5, 0.05, 1e-3, 0.8e-3
UNIT = EI / LENGTH**2  # of forces, N
ALONG, FIRST, SECOND = Rotation.from_rotvec([0.5, -0.9, 1.3]).as_matrix().T
DOWN = 0.6 * FIRST - 0.8 * SECOND  # in a plane that is no frame's
NO_GRAVITY = (0.0, 0.0, 0.0)


def cantilever(segments: int, force: np.ndarray, **options) -> sb.Scene:
    """Clamped at the origin, a dead force (3,) N on its tip."""
    given = {"density": DENSITY, "EI": EI, "GJ": GJ, "start": sb.Grip.fixed((0, 0, 0), ALONG, FIRST)}
    scene = sb.rod(LENGTH, segments, gravity=NO_GRAVITY, **(given | options))
    scene.add_force([segments], np.reshape(force, (1, 1, 3)))
    return scene


def at_tip(scene: sb.Scene, direction: np.ndarray) -> np.ndarray:
    """Weights (particles, 3) that pick the tip's coordinate along a direction."""
    weights = np.zeros((scene.particle_count, 3))
    weights[scene.ropes["rod"].particles[-1]] = direction
    return weights


# --- bending and shear of a cantilever


@pytest.mark.parametrize("slenderness", [10.0, 30.0])  # GA L^2/EI
def test_timoshenkos_cantilever(slenderness):
    load, GA, gaps = 1e-3 * UNIT, slenderness * UNIT, []
    for segments in (10, 20, 40):
        scene = cantilever(segments, load * DOWN, GA=GA)
        rest = sb.equilibrium(scene)
        deflection = rods.sheared_tip(load, LENGTH, EI, GA)
        gaps.append(float((at_tip(scene, DOWN) * rest.positions).sum()) / deflection - 1)
        assert rest.unstable_modes == 0
    assert abs(gaps[1]) < 2e-3
    assert observed_orders(gaps) == approx(2.0, abs=0.1)

    by_bending, by_shear = load * LENGTH**3 / (3 * EI**2), load * LENGTH / GA**2
    assert static_sensitivity(rest, "rod_EI", at_tip(scene, -DOWN)) == approx((by_bending,) * 2, rel=1e-3)
    assert static_sensitivity(rest, "rod_GA", at_tip(scene, -DOWN)) == approx((by_shear,) * 2, rel=1e-5)
    assert static_sensitivity(rest, "rod_GJ", at_tip(scene, -DOWN)) == approx((0.0, 0.0), abs=1e-9 * by_shear)


def test_sections_turn_as_the_moment_says_and_edges_lean_by_the_force():
    """Slope of the section at s: P (L s - s^2/2)/EI; the edge's is steeper by P/GA, next to the clamp too."""
    segments, load, GA = 40, 1e-3 * UNIT, 10 * UNIT
    scene = cantilever(segments, load * DOWN, GA=GA)
    x, rod = sb.equilibrium(scene).nodes, scene.ropes["rod"]
    s = (np.arange(segments) + 0.5) / segments * LENGTH
    sections = x[rod.normals[1:]] @ DOWN
    edges = np.diff(x[rod.particles], axis=0) @ DOWN * segments / LENGTH
    assert sections == approx(load * (LENGTH * s - s**2 / 2) / EI, abs=1e-3 * load * LENGTH**2 / EI)
    assert edges - sections == approx(load / GA, rel=1e-5)


def test_stiff_shear_goes_over_into_none():
    """Of a bent and twisted rod; what is left falls like 1/GA."""
    options = {"EI2": 3e-3, "curvature_modes": (0,), "twist_modes": (0,)}
    values, force = {"rod_curvature_1_0": 2.0, "rod_twist_0": 4.0}, 3.0 * UNIT * DOWN
    nodes = slice(0, 21)
    plain = sb.equilibrium(cantilever(20, force, **options), values=values).positions[nodes]
    gaps = []
    for slenderness in (1e3, 1e4, 1e5):
        rest = sb.equilibrium(cantilever(20, force, GA=slenderness * UNIT, **options), values=values)
        gaps.append(float(np.abs(rest.positions[nodes] - plain).max()) / LENGTH)
    assert gaps[0] < 5e-3
    assert np.divide(gaps[:-1], gaps[1:]) == approx(10.0, rel=0.02)


# --- buckling


@pytest.mark.parametrize("slenderness", [5.0, 20.0])
def test_a_column_that_shears_falls_at_engessers_load(slenderness):
    """Clamped-free, in any of two directions."""
    GA = slenderness * UNIT
    euler = rods.euler_load(2 * LENGTH, EI)
    load = rods.engesser_load(euler, GA)
    assert load < 0.9 * euler
    for share, expected in ((0.998, 0), (1.002, 2)):
        rest = sb.equilibrium(cantilever(40, -share * load * ALONG, GA=GA), stable=False)
        assert rest.unstable_modes == expected


# --- motion


@pytest.mark.parametrize("slenderness", [20.0, 100.0])
def test_a_hinged_beam_vibrates_as_timoshenkos(slenderness):
    segments, GA = 20, slenderness * UNIT
    omega = rods.sheared_frequency(1, LENGTH, DENSITY, EI, GA)
    assert omega < 0.96 * rods.sheared_frequency(1, LENGTH, DENSITY, EI, math.inf)
    h, s = 0.02 / omega, np.linspace(0.0, 1.0, segments + 1)
    points = LENGTH * (np.outer(s, ALONG) + 1e-5 * np.outer(np.sin(np.pi * s), DOWN))
    options = {"density": DENSITY, "EI": EI, "GJ": GJ, "EA": 1e4 * UNIT, "GA": GA}
    scene = sb.rod(LENGTH, segments, points=points, gravity=NO_GRAVITY, **options)
    scene.pin([0, segments])
    motion = sb.simulate(scene, steps(h, 600), sb.Solver(h=h)).positions[25:, segments // 2] @ DOWN
    assert shown_frequency(h, 2)(motion) == approx(omega, rel=5e-3)
