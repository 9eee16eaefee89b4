"""The oracles against the printed values, computed beforehand by other code.

A printed value is given as text: the oracle must round to it, within half a unit of the last printed digit.
"""

import math
from decimal import Decimal

import numpy as np
import pytest
from oracles import bending, drag, integration, modes, pendulums, ropes
from oracles.calculus import derivative

G = 9.81


def assert_prints(values, *printed: str) -> None:
    """Fail unless each value rounds to its printed decimal."""
    for value, text in zip(np.ravel(values), printed, strict=True):
        half_unit = 0.5 * 10.0 ** Decimal(text).as_tuple().exponent
        assert abs(value - float(text)) <= half_unit * (1.0 + 1e-6), f"{value!r} does not print as {text}"


def test_free_fall():
    assert_prints(integration.free_fall(100, 0.01, G), "4.95405")
    assert_prints(integration.free_fall_dg(100, 0.01), "0.505")
    assert derivative(lambda v: integration.free_fall(7, 0.1, G, v0=v), 2.0) == pytest.approx(0.7, rel=1e-12)


@pytest.mark.parametrize(
    ("h", "position", "period", "damping", "slope"),
    [
        (1 / 60, "1.02020847", ".215895", ".244978", "-277.88262"),
        (1 / 240, "1.11826307", ".199836", ".065550", "297.13323"),
        (1 / 1000, "1.47285501", ".198758", ".015807", "26.792459"),
    ],
)
def test_spring(h, position, period, damping, slope):
    omega = math.sqrt(1.0 / 1e-3)
    assert_prints(1.0 + integration.spring_stretch(1e-3, 1.0, h, 10, 0.5), position)
    assert_prints(2 * math.pi / integration.numerical_frequency(omega, h), period)
    assert_prints(integration.numerical_damping(omega * h), damping)
    assert_prints(integration.spring_stretch_dcompliance(1e-3, 1.0, h, 10, 0.5), slope)


def test_spring_sag():
    assert_prints(1e3 * integration.spring_sag(1e-3, 1.0, G), "9.81")


def test_damped_spring():
    u = integration.damped_spring(1e-3, 5.0, 1.0, 1 / 240, 10, stretch=0.5)
    assert_prints(1.0 + u[-1], "1.1454167601")
    undamped = integration.damped_spring(1e-3, 0.0, 1.0, 1 / 240, 10, stretch=0.5)
    assert undamped[-1] == pytest.approx(integration.spring_stretch(1e-3, 1.0, 1 / 240, 10, 0.5), rel=1e-13)


@pytest.mark.parametrize(
    ("order", "omega_h", "modulus", "angle", "damping"),
    [
        (1, 0.1, ".995037", ".0996687", ".04985"),
        (2, 0.1, ".9999756", ".0996711", "2.447e-4"),
        (1, 0.05, None, None, ".02498"),
        (2, 0.05, None, None, "3.108e-5"),
        (1, 0.5, None, None, ".2340"),
        (2, 0.5, None, None, ".02062"),
    ],
)
def test_amplification(order, omega_h, modulus, angle, damping):
    z = integration.amplification(omega_h, order)
    if modulus:
        assert_prints([abs(z), math.atan2(z.imag, z.real)], modulus, angle)
    assert_prints(integration.numerical_damping(omega_h, order), damping)


def test_rotor():
    assert_prints(integration.rotor_angles(0.1, 3), ".0996687", ".0986907", ".0977410")
    assert_prints(integration.rotor_momentum(0.1, 1), ".9950372")
    h, omega = 0.01, 10.0
    slope = derivative(lambda w: integration.rotor_angles(w * h, 1), omega)
    assert slope == pytest.approx(h / (1 + (omega * h) ** 2), rel=1e-10)


@pytest.mark.parametrize(
    ("degrees", "ratio"),
    [
        (5, "1.00047617"),
        (10, "1.00190719"),
        (30, "1.01740880"),
        (45, "1.03997334"),
        (60, "1.07318201"),
        (90, "1.18034060"),
        (120, "1.37288050"),
        (150, "1.76220373"),
    ],
)
def test_pendulum_period_ratio(degrees, ratio):
    assert_prints(pendulums.period_ratio(math.radians(degrees)), ratio)


def test_pendulum_period_and_derivatives():
    assert_prints(pendulums.pendulum_period(1.0, G), "2.0060667")
    amplitude = math.radians(30)
    assert_prints(derivative(lambda x: pendulums.pendulum_period(x, G, amplitude), 1.0), "1.0204949")
    assert_prints(derivative(lambda x: pendulums.pendulum_period(1.0, x, amplitude), G), "-.104026")


@pytest.mark.parametrize(
    ("order", "rate", "error"),
    [
        (1, 60, "-2.2e-3"),
        (1, 600, "-3.3e-4"),
        (1, 6000, "-3.4e-5"),
        (2, 60, "1.2e-3"),
        (2, 240, "7.3e-5"),
        (2, 600, "1.2e-5"),
    ],
)
def test_pendulum_period_under_the_integrators(order, rate, error):
    """Twice the time between the first two passages through the bottom, interpolated linearly."""
    amplitude = math.radians(30)
    x, _ = pendulums.pendulum_steps(1.0, G, amplitude, 1 / rate, 2 * rate, order)
    angle = np.arctan2(x[:, 0], -x[:, 1])
    before = np.flatnonzero(angle[:-1] * angle[1:] < 0)
    first, second = (before + angle[before] / (angle[before] - angle[before + 1])) / rate
    assert_prints(2 * (second - first) / pendulums.pendulum_period(1.0, G, amplitude) - 1, error)


@pytest.mark.parametrize(
    ("order", "rate", "retained"),
    [
        (1, 60, ".468"),
        (1, 600, ".924"),
        (1, 6000, ".992"),
        (2, 60, ".9944"),
        (2, 240, ".99973"),
        (2, 600, ".99996"),
    ],
)
def test_pendulum_energy_retained(order, rate, retained):
    # A float-summed clock printed .467 for BDF1 at 1/60 s: it stops at step 253, one past 4.2 s.
    steps = round(4.2 * rate)
    x, v = pendulums.pendulum_steps(1.0, G, math.radians(30), 1 / rate, steps, order)
    energy = pendulums.energy_retained(x, v, 1.0, G)
    assert_prints(energy[-1], retained)
    assert np.hypot(*x.T) == pytest.approx(1.0, abs=1e-14)
    if order == 1:
        assert np.all(np.diff(energy) <= 1e-14)


def test_dumbbell():
    period = pendulums.dumbbell_period(1e-6, 1e5, 1e-3, 0.1)
    assert_prints([2 * math.pi / period, period], "44.7214", ".1404963")
    by_charge = derivative(lambda q: pendulums.dumbbell_period(q, 1e5, 1e-3, 0.1), 1e-6)
    by_length = derivative(lambda x: pendulums.dumbbell_period(1e-6, 1e5, 1e-3, x), 0.1)
    assert by_charge == pytest.approx(-period / 2e-6, rel=1e-9)
    assert by_length == pytest.approx(period / 0.2, rel=1e-9)


@pytest.mark.parametrize(
    ("t", "x", "z"),
    [
        (0.25, "1.95516698", "-.30650021"),
        (0.5, "1.47346567", "-1.20038944"),
        (1.0, "-1.44481885", "-1.32179446"),
    ],
)
def test_double_pendulum_tip(t, x, z):
    assert_prints(pendulums.double_pendulum_tip(t, G), x, z)


@pytest.mark.parametrize(
    ("t", "by_length", "by_mass"),
    [
        (0.5, ("1.293252", "-.046539"), (".078039", ".001718")),
        (1.0, (".315998", "-1.769778"), (".310842", "-.632639")),
    ],
)
def test_double_pendulum_derivatives(t, by_length, by_mass):
    assert_prints(derivative(lambda x: pendulums.double_pendulum_tip(t, G, lengths=(x, 1.0)), 1.0), *by_length)
    assert_prints(derivative(lambda x: pendulums.double_pendulum_tip(t, G, masses=(1.0, x)), 1.0), *by_mass)


def test_terminal_velocity():
    assert_prints(drag.terminal_velocity(0.2, G, 1.2, 1.225), "1.633826")
    assert_prints(drag.terminal_velocity(0.05 / 8e-3, G, 1.2, 1.225), "9.133366")
    assert_prints(derivative(lambda c: drag.terminal_velocity(0.2, G, c, 1.225), 1.2), "-.680761")


def test_catenary():
    rope = ropes.catenary(0.6, 1.0, 0.05, G)
    assert_prints(rope, ".080034038", ".362782185")
    assert_prints(rope.horizontal_force / (0.05 * G), ".163168274")
    by_length = derivative(lambda x: ropes.catenary(0.6, x, 0.05, G).horizontal_force / (0.05 * G), 1.0)
    assert_prints(by_length, "-.174695118")
    assert_prints(derivative(lambda x: ropes.catenary(0.6, x, 0.05, G).sag, 1.0), ".595828507")
    assert_prints(derivative(lambda x: ropes.catenary(x, 1.0, 0.05, G).sag, 0.6), "-.388410536")


@pytest.mark.parametrize(
    ("links", "force", "sag"),
    [
        (10, ".0799083227", ".3655450363"),
        (20, ".0800018257", ".3634526161"),
        (40, ".0800259751", ".3629487104"),
    ],
)
def test_polygon_catenary(links, force, sag):
    assert_prints(ropes.polygon_catenary(0.6, 1.0, links, 0.05, G), force, sag)


@pytest.mark.parametrize(
    ("axial_stiffness", "force", "sag"),
    [
        (1.0, ".06403948", ".44751766"),
        (10.0, ".07790974", ".37191688"),
        (100.0, ".07981388", ".36370508"),
        (1e4, ".08003183", ".36279142"),
    ],
)
def test_elastic_catenary(axial_stiffness, force, sag):
    rope = ropes.elastic_catenary(0.6, 1.0, 0.05, G, axial_stiffness)
    assert_prints(rope, force, sag)
    errors = [np.subtract(ropes.polygon_catenary(0.6, 1.0, n, 0.05, G, axial_stiffness), rope) for n in (40, 80)]
    assert np.log2(errors[0] / errors[1]) == pytest.approx([2.0, 2.0], abs=0.02)


def test_hanging_extension():
    assert_prints(1e3 * ropes.hanging_extension(1.0, 0.05, G, 10.0), "24.525")
    assert_prints(1e6 * ropes.hanging_extension(1.0, 0.05, G, 1e4), "24.525")
    assert_prints(1e3 * ropes.hanging_extension_with_mass(1.0, 1.0, G, 1e4), ".981")
    forces = (np.arange(20) + 0.5) * 0.05 / 20 * G  # link forces of the lumped chain, from the free end
    assert np.sum(forces) / 20 / 10.0 == pytest.approx(ropes.hanging_extension(1.0, 0.05, G, 10.0), rel=1e-13)


@pytest.mark.parametrize(("links", "sweeps", "extension"), [(20, 1, "30.741"), (20, 4, "7.621"), (40, 1, "129.5")])
def test_gauss_seidel_extension(links, sweeps, extension):
    exact = ropes.gauss_seidel_extension(1.0, 0.05, G, math.inf, 1 / 240, sweeps, range(links))
    assert_prints(1e3 * exact, extension)
    estimate = ropes.gauss_seidel_extension_estimate(links, 1 / 240, G, sweeps)
    assert estimate == pytest.approx(exact, rel=1e-12 if sweeps == 1 else 0.01)


def test_hanging_rope_frequencies():
    assert_prints(modes.hanging_rope_frequencies(1.0, G, 3), "3.766067", "8.644696", "13.552136")


@pytest.mark.parametrize(
    ("links", "printed"),
    [
        (10, ("3.676621", "8.459284", "13.319101")),
        (20, ("3.720205", "8.544664", "13.410198")),
        (50, ("3.747435", "8.602795", "13.488898")),
    ],
)
def test_hanging_beads_frequencies(links, printed):
    omega = modes.hanging_beads_frequencies(1.0, links, G)
    assert_prints(omega[:3], *printed)
    assert modes.chain_frequencies([0.1] * links, 1.0 / links, G) == pytest.approx(omega, rel=1e-9)


def test_beaded_string():
    hertz = modes.beaded_string_frequencies(20, 10.0, 0.05, 1.0) / (2 * math.pi)
    assert_prints(hertz[:3], "7.064476", "14.089444", "21.035619")
    many = modes.beaded_string_frequencies(20000, 10.0, 0.05, 1.0)[:3]
    assert many == pytest.approx(math.pi * np.arange(1, 4) * math.sqrt(10.0 / 0.05), rel=1e-7)


def test_cantilever_frequencies():
    assert_prints(modes.cantilever_frequencies(1.0, 1.0, 1.0, 3), "3.516015", "22.034492", "61.697214")
    assert_prints(modes.cantilever_frequencies(0.5, 0.05, 1e-3, 1), "1.98896")


@pytest.mark.parametrize(
    ("load", "degrees", "drop", "shortening", "slope"),
    [
        (0.25, "7.1214", ".08275", ".00412", ".326346"),
        (0.5, "14.0107", ".16214", ".01592", ".307092"),
        (1, "26.4335", ".30172", ".05643", ".248876"),
        (2, "44.7910", ".49346", ".16064", ".142546"),
        (3, "56.4946", ".60325", ".25442", ".083584"),
        (4, "64.2423", ".66996", ".32894", ".053027"),
        (5, "69.6355", ".71379", ".38763", ".036180"),
        (6, "73.5504", ".74457", ".43459", ".026186"),
        (8, "78.7491", ".78498", ".50483", ".015633"),
        (10, "81.9493", ".81061", ".55500", ".010536"),
        (20, "87.8307", ".86870", ".68389", ".003345"),
    ],
)
def test_tip_load_elastica(load, degrees, drop, shortening, slope):
    shape = bending.tip_load_elastica(load)
    assert_prints([math.degrees(shape.tip_angle), shape.drop, 1 - shape.reach], degrees, drop, shortening)
    assert_prints(derivative(lambda a: bending.tip_load_elastica(a).drop, load), slope)


@pytest.mark.parametrize(
    ("weight", "degrees", "drop", "reach", "chord"),
    [
        (0.5, "4.7634", ".06231", ".99778", "3.5732"),
        (1, "9.4604", ".12347", ".99125", "7.1003"),
        (2, "18.4260", ".23851", ".96689", "13.8567"),
        (3, "26.5590", ".33965", ".93151", "20.0329"),
        (4, "33.7239", ".42516", ".89011", "25.5314"),
        (5, "39.9354", ".49591", ".84666", "30.3584"),
        (6, "45.2854", ".55392", ".80373", "34.5744"),
        (8, "53.8650", ".64063", ".72442", "41.4873"),
        (10, "60.3120", ".70020", ".65635", "46.8512"),
        (15, "70.7501", ".78604", ".52957", "56.0314"),
        (20, "76.7478", ".82988", ".44523", "61.7864"),
        (30, "82.9721", ".87309", ".34276", "68.5657"),
        (50, "87.4593", ".90792", ".24501", "74.8977"),
        (100, "89.6167", ".93752", ".15922", "80.3612"),
    ],
)
def test_heavy_elastica(weight, degrees, drop, reach, chord):
    shape = bending.heavy_elastica(weight)
    assert_prints([math.degrees(shape.tip_angle), shape.drop, shape.reach], degrees, drop, reach)
    assert_prints(math.degrees(shape.chord_angle), chord)


@pytest.mark.parametrize(("weight", "slope"), [(1, ".120480"), (4, ".077845"), (8, ".035546"), (20, ".006543")])
def test_heavy_elastica_derivative(weight, slope):
    assert_prints(derivative(lambda x: bending.heavy_elastica(x).drop, weight), slope)


@pytest.mark.parametrize(
    ("links", "ratio", "sine_ratio"),
    [(10, "1.1434", ".935489"), (20, "1.0336", ".983632"), (40, "1.0083", ".995893")],
)
def test_roll_up(links, ratio, sine_ratio):
    assert_prints(bending.roll_up_ratio(links), ratio)
    assert_prints(bending.sine_roll_up_ratio(links), sine_ratio)
