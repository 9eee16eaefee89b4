"""Air on triangles: falling sheets against closed forms, symmetries, gradients, a fit, and bad input."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import sheetbend as sb
from oracles import drag
from oracles.calculus import derivative
from pytest import approx
from scipy.spatial.transform import Rotation
from sheetbend.mesh import grid
from support import observed_orders, place, refitted, refusal, sensitivity, steps, twice

G = 9.81
X, Y, Z = 0, 1, 2
AREA_DENSITY, DRAG, AIR = 0.2, 1.2, 1.225
NORMAL = 0.5 * AIR * DRAG
MESH = grid(0.4, 0.3, 4, 3)
FALLEN = 1.8  # s: at terminal velocity to 1e-9; a flat sheet of loose particles is unstable, later its rounding shows


def sheet(
    normal: Any = NORMAL,
    tangential: Any = 0.0,
    turn: Rotation | None = None,
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0),
    gravity: tuple[float, float, float] = (0.0, 0.0, -G),
    **air: Any,
) -> sb.Scene:
    """Loose particles on a flat grid, each with a third of the mass of its triangles, in air."""
    scene = sb.Scene("sheet", gravity=gravity)
    x = MESH.vertices if turn is None else turn.apply(np.array(MESH.vertices))
    edges = x[MESH.triangles[:, 1:]] - x[MESH.triangles[:, :1]]
    third = AREA_DENSITY * np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1) / 6.0
    mass = np.bincount(MESH.triangles.ravel(), np.repeat(third, 3), len(x))
    scene.add_particles(x, mass, velocity=np.tile(velocity, (len(x), 1)))
    scene.add_air(MESH.triangles, normal, tangential, name="sheet", **air)
    return scene


def flag(turn: Rotation | None = None, drift: Any = (0.0, 0.0, 0.0), **air: Any) -> sb.Scene:
    """A sheet of springs, stretched and moving, in a wind that changes; seen from elsewhere, or from a moving frame."""
    turn = turn or Rotation.identity()
    rng = np.random.default_rng(4)
    x = MESH.vertices + 0.02 * rng.standard_normal(MESH.vertices.shape)
    v = 0.5 * rng.standard_normal(x.shape)
    wind = turn.apply(rng.standard_normal((3, 3)) + np.array([3.0, 1.0, 0.0]) + drift)
    given = {"triangles": MESH.triangles, "normal": 0.7, "tangential": 0.05, "wind": wind, "times": [0.0, 0.05, 0.2]}
    scene = sb.Scene("flag", gravity=turn.apply([0.0, 0.0, -G]))
    scene.add_particles(turn.apply(x), 0.005, velocity=turn.apply(v + drift))
    pairs = np.unique(np.sort(np.concatenate([MESH.triangles[:, p] for p in ([0, 1], [1, 2], [2, 0])]), axis=1), axis=0)
    scene.add_constraints("distance", pairs, name="springs", compliance=1e-2)
    scene.add_air(**(given | air))
    return scene


# --- O-11


def test_falling_sheet_reaches_terminal_velocity():
    fall = sb.simulate(sheet(), [0.0, FALLEN], sb.Solver(h=1 / 500))
    assert fall.velocities[-1, :, Z] == approx(-1.633826, rel=1e-6)
    assert drag.terminal_velocity(AREA_DENSITY, G, DRAG, AIR) == approx(1.633826, rel=1e-6)


@pytest.mark.parametrize(("integrator", "order"), [("bdf1", 1), ("bdf2", 2)])
def test_falling_broadside(integrator, order):
    """Distance fallen and its derivative with respect to the coefficient converge to the tanh law with the
    integrator's order."""
    end = 0.5

    def distance(coefficient):
        return drag.quadratic_drag_distance(end, G, math.sqrt(AREA_DENSITY * G / coefficient))

    by_drag = derivative(distance, NORMAL)
    errors = []
    for count in (1600, 3200, 6400):
        scene, s = sheet(), sb.Solver(h=end / count, integrator=integrator)
        fall = sb.simulate(scene, [0.0, end], s)
        law = drag.quadratic_drag_velocity(end, G, math.sqrt(AREA_DENSITY * G / NORMAL))
        assert -fall.velocities[-1, :, Z] == approx(law, rel=1e-3)
        weights = place(2, scene, 1, 7, Z, -1.0)
        forward, backward = sensitivity(scene, [0.0, end], s, weights, "sheet_air_normal")
        assert forward == approx(backward, rel=1e-10)
        errors.append([-fall.positions[-1, 7, Z] - distance(NORMAL), backward - by_drag])
    for column in np.transpose(errors):
        assert observed_orders(column) == approx(order, abs=0.1)


def test_terminal_velocity_by_drag_coefficient():
    """dv_t/dC_d = -v_t/(2 C_d) = -0.680761, read off two positions."""
    scene, h = sheet(), 1 / 200
    times, s = [0.0, FALLEN, FALLEN + h], sb.Solver(h=h, integrator="bdf1")
    weights = place(3, scene, 1, 7, Z, 1.0 / h) + place(3, scene, 2, 7, Z, -1.0 / h)
    both = sensitivity(scene, times, s, weights, "sheet_air_normal")
    assert both == approx(twice(-0.680761 / (0.5 * AIR)), rel=1e-6)


def test_edge_on_without_tangential_drag_falls_freely():
    """Upright in the plane y = 0: no air along its normal."""
    upright, times, s = Rotation.from_euler("x", 90, degrees=True), steps(1 / 200, 100), sb.Solver(h=1 / 200)
    in_air, in_vacuum = (sheet(k, turn=upright, velocity=(0.3, 0.0, 0.0)) for k in (NORMAL, 0.0))
    a, b = (sb.simulate(scene, times, s).positions for scene in (in_air, in_vacuum))
    fallen = a - upright.apply(np.array(MESH.vertices))
    assert np.abs(fallen[..., Y]).max() < 1e-12
    assert a == approx(b, abs=1e-12)
    assert fallen[-1, :, Z] == approx(-G * 0.5**2 / 2.0, rel=1e-2)


def test_edge_on_with_tangential_drag_has_its_own_terminal_velocity():
    upright = Rotation.from_euler("x", 90, degrees=True)
    fall = sb.simulate(sheet(NORMAL, NORMAL, turn=upright), [0.0, FALLEN], sb.Solver(h=1 / 200))
    assert fall.velocities[-1, :, Z] == approx(-math.sqrt(AREA_DENSITY * G / NORMAL), rel=1e-6)


def test_a_sheet_takes_on_the_wind():
    scene = sheet(2.0, 2.0, gravity=(0, 0, 0), wind=(0.0, 0.0, 3.0))
    end = 4.0
    v = sb.simulate(scene, [0.0, end], sb.Solver(h=1 / 400)).velocities[-1, :, Z]
    assert v == approx(3.0 - 3.0 / (1.0 + 2.0 / AREA_DENSITY * 3.0 * end), rel=1e-4)  # u' = -(k/m) u^2


# --- symmetries


def test_turns_with_the_scene():
    turn, times, s = Rotation.from_rotvec([0.4, -1.1, 0.7]), steps(1 / 400, 60), sb.Solver(h=1 / 400)
    here, there = (sb.simulate(flag(t), times, s).positions for t in (None, turn))
    assert there == approx(turn.apply(here.reshape(-1, 3)).reshape(here.shape), abs=1e-10)
    weights = np.random.default_rng(0).standard_normal(here.shape)
    bars = []
    for scene, seed in ((flag(), weights), (flag(turn), turn.apply(weights.reshape(-1, 3)).reshape(here.shape))):
        core, inputs, every = s.core(scene.compiled), scene.compiled.inputs(), list(range(61))
        bar = core.vjp(inputs, core.record(inputs, every, 0.0)[1], every, seed.reshape(61, -1), 0.0)
        bars.append(scene.compiled.unpack(bar))
    a, b = bars
    for name in ("air_normal", "air_tangential", "mass"):
        assert b[name] == approx(a[name], abs=1e-8 * np.abs(a[name]).max()), name
    for name in ("wind", "velocity", "position"):
        assert b[name] == approx(turn.apply(a[name]), abs=1e-8 * np.abs(a[name]).max()), name


def test_is_the_same_in_a_moving_frame():
    drift, times, s = np.array([2.0, -1.0, 0.5]), steps(1 / 400, 60), sb.Solver(h=1 / 400)
    here, there = (sb.simulate(flag(drift=d), times, s).positions for d in (np.zeros(3), drift))
    assert there - times[:, None, None] * drift == approx(here, abs=1e-10)


def test_does_not_depend_on_threads_or_on_which_side_is_up():
    times = steps(1 / 400, 60)
    one = sb.simulate(flag(), times, sb.Solver(h=1 / 400)).positions
    for threads in (2, 3):
        assert (sb.simulate(flag(), times, sb.Solver(h=1 / 400, threads=threads)).positions == one).all()
    turned = flag(triangles=MESH.triangles[:, ::-1])
    assert sb.simulate(turned, times, sb.Solver(h=1 / 400)).positions == approx(one, abs=1e-10)


# --- gradients and fits


@pytest.mark.parametrize("method", ["direct", "gauss_seidel"])
@pytest.mark.parametrize("integrator", ["bdf1", "bdf2"])
def test_gradients(integrator, method):
    scene = flag()
    report = sb.check_gradients(scene, steps(1 / 200, 20), sb.Solver(h=1 / 200, integrator=integrator, method=method))
    assert report.passed, str(report)
    shown = {row.name: row.gradient for row in report.rows}
    for name in ("wind", "air_normal", "air_tangential", "cloth_air_normal", "cloth_air_tangential"):
        assert shown[name] > 0.0, name


def test_gradients_of_a_constant_wind_and_of_still_air():
    s, times = sb.Solver(h=1 / 200), steps(1 / 200, 20)
    report = sb.check_gradients(flag(wind=(2.0, 1.0, 0.5), times=None), times, s)
    assert report.passed, str(report)
    assert {"wind_x", "wind_y", "wind_z"} <= {row.name for row in report.rows if row.gradient > 0.0}
    scene = sheet(tangential=0.1, gravity=(0, 0, 0))  # nothing moves
    core, inputs = s.core(scene.compiled), scene.compiled.inputs()
    every = list(range(21))
    bar = core.vjp(inputs, core.record(inputs, every, 0.0)[1], every, np.ones((21, scene.compiled.core.dofs)), 0.0)
    assert np.isfinite(bar).all()


def test_wind_and_drag_of_a_fluttering_sheet_are_recovered():
    values = {"cloth_air_normal": 0.7, "cloth_air_tangential": 0.2, "wind_x": 2.0}
    scene, s = flag(wind=(2.0, 1.0, 0.5), times=None, tangential=0.2), sb.Solver(h=1 / 240)
    found = refitted(scene, np.arange(25) / 60, s, [0, 4, 12, 15, 19], {k: 1.3 * v for k, v in values.items()})
    for name, value in values.items():
        assert found[name].value == approx(value, rel=1e-4), name


def gusts(tail: float = 0.0) -> sb.Scene:
    """A flag on two corners in a wind of three knots along x; `tail` of calm knots after the motion."""
    calm = [0.2 + 0.01 * k for k in range(1, 60)] if tail else []
    wind = [[1.0, 0.5, 0.0], [3.0, 0.5, 0.2], [0.5, 0.0, 0.0], *[[tail, 0.0, 0.0]] * len(calm)]
    scene = flag(wind=wind, times=[0.0, 0.1, 0.2, *calm])
    scene.pin([0, 15])
    return scene


def test_a_changing_wind_has_a_strength_and_a_number_per_knot():
    """Of a product the derivative with respect to the common factor is the sum of the numbers' own, each times its
    number."""
    scene, s = gusts(), sb.Solver(h=1 / 200)
    named = {name: q.value for name, q in scene.quantities.items() if name.startswith("wind_")}
    assert list(named)[:5] == ["wind_strength", "wind_x_0", "wind_y_0", "wind_z_0", "wind_x_1"]
    assert named["wind_strength"] == 1.0 and named["wind_x_1"] == 3.0 and len(named) == 10
    weights = np.random.default_rng(5).standard_normal((1, scene.particle_count, 3))
    by = {name: sensitivity(scene, [0.15], s, weights, name)[1] for name in named}
    assert by["wind_x_2"] != 0.0
    knots = sum(value * by[name] for name, value in named.items() if name != "wind_strength")
    assert by["wind_strength"] == approx(knots, rel=1e-10)


def test_a_wind_of_many_knots_has_its_strength_alone():
    scene = gusts(tail=1.0)
    assert [name for name in scene.quantities if name.startswith("wind")] == ["wind_strength"]
    here, there = (sb.simulate(a, [0.1], sb.Solver(h=1 / 200)).positions for a in (scene, gusts()))
    np.testing.assert_allclose(here, there, rtol=1e-13)


def test_a_fit_finds_gusts():
    """The wind at three knots, from the motion of five particles."""
    true = {"wind_x_0": 1.0, "wind_x_1": 3.0, "wind_x_2": 0.5}
    s = sb.Solver(h=1 / 240)
    found = refitted(gusts(), np.arange(25) / 120, s, [2, 4, 12, 15, 19], dict.fromkeys(true, 0.2))
    for name, value in true.items():
        assert found[name].value == approx(value, rel=1e-6), name


# --- rest


def hanging(**air: Any) -> sb.Scene:
    """A particle on two springs, and the triangle between them in air if any is given."""
    scene = sb.Scene("hanging")
    scene.add_particles([[0.0, 0.0, 0.0], [0.4, 0.0, 0.0], [0.25, 0.05, -0.3]], 0.1)
    scene.add_constraints("distance", [[0, 2], [1, 2]], name="springs", compliance=1e-2)
    scene.pin([0, 1])
    if air:
        scene.add_air([[0, 1, 2]], 0.7, 0.1, **air)
    return scene


def test_still_air_leaves_a_scene_at_rest_as_it_is():
    rising = hanging(wind=[[0.0, 0.0, 0.0], [3.0, 0.0, 0.0]], times=[0.0, 1.0])
    in_air, in_vacuum = sb.equilibrium(rising), sb.equilibrium(hanging())
    assert in_air.positions == approx(in_vacuum.positions, abs=1e-12)
    assert in_air.gradient(np.ones((3, 3)))["cloth_air_normal"] == 0.0


def test_no_equilibrium_in_wind():
    with pytest.raises(sb.SceneError, match=r"wind: .* m/s .* Fix: let it rise from zero"):
        sb.equilibrium(hanging(wind=(3.0, 4.0, 0.0)))


# --- bad input


def add(calls: int = 1, **changes: Any) -> Callable[[], Any]:
    def run() -> None:
        scene = sb.Scene("sheet")
        scene.add_particles(MESH.vertices, 0.01)
        for _ in range(calls):
            scene.add_air(**({"triangles": MESH.triangles, "normal": 0.7, "tangential": [0.1] * 24} | changes))

    return run


def another_wind() -> None:
    flag(wind=(1.0, 0.0, 0.0), times=None).add_air([[0, 1, 2]], [0.7], [0.1], wind=(2.0, 0.0, 0.0))


REFUSED = {
    "triangles of two": ("cloth.air.triangles", add(triangles=[[0, 1]])),
    "triangles beyond the particles": ("cloth.air.triangles", add(triangles=[[0, 1, 99]])),
    "triangles with a corner twice": ("cloth.air.triangles", add(triangles=[[0, 1, 1]], tangential=0.1)),
    "normal negative": ("cloth.air.normal", add(normal=-1.0)),
    "normal not finite": ("cloth.air.normal", add(normal=math.nan)),
    "tangential of the wrong shape": ("cloth.air.tangential", add(tangential=[0.1, 0.2])),
    "name twice": ("cloth_air_normal", add(calls=2)),
    "wind of the wrong shape": ("wind", add(wind=(1.0, 0.0))),
    "wind without its knots": ("wind", add(wind=(1.0, 0.0, 0.0), times=[0.0, 1.0])),
    "wind not finite": ("wind", add(wind=(1.0, 0.0, math.inf))),
    "wind missing": ("wind", add(times=[0.0, 1.0])),
    "times not increasing": ("wind.times", add(wind=np.zeros((2, 3)), times=[1.0, 0.0])),
    "another wind": ("wind", another_wind),
}


@pytest.mark.parametrize("case", REFUSED)
def test_refused(case):
    field, run = REFUSED[case]
    with refusal(field):
        run()


def test_frozen_scene_takes_no_air():
    scene = flag().freeze()
    with pytest.raises(sb.SceneError, match="frozen"):
        scene.add_air(MESH.triangles, 0.7, 0.1, name="more")
