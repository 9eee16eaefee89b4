"""Drag is against the air: in a wind, a motion is that of still air seen by who moves with it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sheetbend as sb
from oracles import ropes
from sheetbend.config import load

WIND = np.array([1.5, -0.7, 0.4])
TIMES = np.arange(13) / 60
G, DENSITY = 9.81, 0.05


def thrown(velocity: np.ndarray, wind: np.ndarray | None, times: Any = None) -> sb.Scene:
    """A slack rope in space, whose nodes begin at different speeds, with drag that grows with the speed."""
    rng = np.random.default_rng(2)
    scene = sb.Scene("thrown", gravity=(0.0, 0.0, 0.0))
    places = np.cumsum(0.05 + 0.01 * rng.standard_normal((5, 3)), axis=0)
    scene.add_particles(places, 0.01 + 0.01 * rng.random(5), velocity + rng.standard_normal((5, 3)))
    scene.add_constraints("distance", [[k, k + 1] for k in range(4)], compliance=1e-3)
    scene.set_drag(0.02 + 0.01 * rng.random(5), 0.02 + 0.01 * rng.random(5))
    if wind is not None:
        scene.set_wind(wind, times)
    return scene


@pytest.mark.parametrize("integrator", ["bdf1", "bdf2"])
def test_a_motion_in_a_wind_is_that_of_still_air_carried_along(integrator: Any) -> None:
    solver = sb.Solver(h=1 / 240, integrator=integrator)
    still = sb.simulate(thrown(np.zeros(3), None), TIMES, solver).positions
    blown = sb.simulate(thrown(WIND, WIND), TIMES, solver).positions
    assert np.abs(still - still[0]).max() > 0.1
    assert blown == pytest.approx(still + TIMES[:, None, None] * WIND, abs=1e-12)


@pytest.mark.parametrize(("linear", "quadratic"), [(0.05, 0.0), (0.0, 0.03), (0.02, 0.03)])
def test_what_falls_in_a_wind_ends_at_its_terminal_velocity(linear: float, quadratic: float) -> None:
    """Relative to the wind: m g = c1 s + c2 s^2 at the speed s."""
    scene = sb.Scene("drop", gravity=(0.0, 0.0, -G))
    scene.add_particles([[0.0, 0.0, 0.0]], 0.01)
    scene.set_drag([linear], [quadratic])
    scene.set_wind([[0.0, 0.0, 0.0], [2.0, 0.0, 0.5]], [0.0, 0.1])
    v = sb.simulate(scene, np.array([0.0, 10.0]), sb.Solver(h=0.01)).velocities[-1, 0]
    speed = max(np.roots([quadratic, linear, -0.01 * G] if quadratic else [linear, -0.01 * G]).real)
    assert v == pytest.approx([2.0, 0.0, 0.5 - speed], abs=1e-9)


def hanging(links: int = 12, **drag: float) -> sb.Scene:
    """A rope of 1 m that no wind blows on yet, between supports 0.6 m apart."""
    scene = sb.Scene("catenary", gravity=(0.0, 0.0, -G))
    nodes = ropes.polygon_nodes(0.6, 1.0, links, DENSITY, G)[0]
    points = np.column_stack([nodes[:, 0], np.zeros(len(nodes)), nodes[:, 1]])
    built = sb.add_rope(scene, length=1.0, segments=links, density=DENSITY, points=points, **drag)
    scene.pin(built.particles[[0, -1]])
    return scene


@pytest.mark.parametrize(("linear", "quadratic"), [(0.05, 0.0), (0.02, 0.03)])
def test_a_catenary_hangs_along_the_sum_of_weight_and_wind(linear: float, quadratic: float) -> None:
    """Both are forces per length, so it lies in a tilted plane, with the pull of a rope of that weight."""
    links, speed = 12, 3.0
    scene = hanging(links, drag_linear=linear, drag_quadratic=quadratic)
    scene.set_wind((0.0, speed, 0.0))
    load = np.array([0.0, (linear + quadratic * speed) * speed, -DENSITY * G])
    heavy = float(np.linalg.norm(load)) / DENSITY
    nodes = ropes.polygon_nodes(0.6, 1.0, links, DENSITY, heavy)[0]
    expected = nodes[:, :1] * [1.0, 0.0, 0.0] - nodes[:, 1:] * load / np.linalg.norm(load)
    assert sb.equilibrium(scene).positions == pytest.approx(expected, abs=1e-8)
    assert np.abs(expected[:, 1]).max() > 0.05
    pull = ropes.polygon_catenary(0.6, 1.0, links, DENSITY, heavy).horizontal_force
    solver = sb.Solver(h=5e-4)
    ends = [
        sb.simulate_forces(scene, [0.02], ("rope", end), solver, start="equilibrium").forces[0]
        for end in ("start", "end")
    ]
    for sign, force in zip((-1.0, 1.0), ends, strict=True):
        assert force == pytest.approx([sign * pull, -load[1] / 2, -load[2] / 2], rel=1e-3)
    assert ends[0] + ends[1] == pytest.approx(-load, rel=1e-4, abs=1e-6)


def test_a_state_of_rest_stays_at_rest_in_its_wind() -> None:
    scene = hanging(drag_linear=0.05, drag_quadratic=0.02)
    scene.set_wind(WIND)
    rest = sb.equilibrium(scene)
    moved = sb.simulate(scene, TIMES, sb.Solver(h=1 / 960, method="direct"), start=rest.positions).positions
    assert moved == pytest.approx(np.broadcast_to(rest.positions, moved.shape), abs=3e-6)  # as without wind


def test_a_state_of_rest_has_its_derivatives_with_respect_to_wind_and_drag() -> None:
    scene = hanging(drag_linear=0.05, drag_quadratic=0.02)
    scene.set_wind(WIND)
    at = sb.equilibrium(scene)
    bar = np.random.default_rng(3).standard_normal(at.positions.shape)
    found = at.gradient(bar)
    for name in ("wind_x", "wind_y", "wind_z", "rope_drag_linear", "rope_drag_quadratic"):
        value = scene.quantities[name].value
        ends = [sb.equilibrium(scene, values={name: value + step}).positions for step in (1e-4, -1e-4)]
        assert found[name] == pytest.approx(float((bar * (ends[0] - ends[1])).sum()) / 2e-4, rel=1e-5), name


def test_gradients_with_respect_to_the_wind_are_exact() -> None:
    report = sb.check_gradients(thrown(np.zeros(3), WIND), TIMES[:7], sb.Solver(h=1 / 240))
    assert report.passed and {"wind_x", "wind_y", "wind_z"} <= {row.name for row in report.rows}
    changing = thrown(np.zeros(3), np.array([WIND, -WIND, 2 * WIND]), [0.0, 0.03, 0.1])
    assert sb.check_gradients(changing, TIMES[:7], sb.Solver(h=1 / 240)).passed


def test_a_motion_in_a_wind_has_the_same_bits_on_threads_on_the_tape_and_in_lanes() -> None:
    scene, solver = thrown(np.zeros(3), np.array([WIND, -WIND]), [0.0, 0.1]), sb.Solver(h=1 / 240)
    alone = sb.simulate(scene, TIMES, solver).positions
    assert (sb.simulate(scene, TIMES, sb.Solver(h=1 / 240, threads=2)).positions == alone).all()
    assert (sb.rollout(scene, TIMES, solver).positions == alone).all()
    compiled, steps = scene.compiled, (240 * TIMES[1:]).astype(int).tolist()
    inputs = np.stack([compiled.inputs(compiled.values({"wind_strength": k})) for k in np.linspace(0.6, 1.4, 9)])
    together = solver.core(compiled).simulate_batch(inputs, steps, 0.0)
    apart = [solver.core(compiled).simulate_batch(one[None], steps, 0.0)[0] for one in inputs]
    assert (together == np.stack(apart)).all()


def test_an_unknown_wind_along_a_rope_is_found() -> None:
    def hung() -> sb.Scene:
        own = {"density": 0.05, "EI": 1e-3, "bend_damping": 0.02, "drag_linear": 0.05}
        scene = sb.rope(0.4, 8, pinned=(), clamp_start=(1.0, 0.0, 0.0), **own)
        sb.add_unknown_wind(scene, scale=1.0, spacing=0.1, duration=0.5)
        return scene

    times, solver, rng = np.arange(31) / 60, sb.Solver(h=1 / 240), np.random.default_rng(4)
    (own,) = hung().over_time.values()
    q = own.deviations(1.0, 0.15) * rng.standard_normal(len(own.modes))
    x = sb.simulate(hung(), times, solver, values=dict(zip(own.modes, q, strict=True))).positions
    recording = sb.Recording(x + 3e-4 * rng.standard_normal(x.shape), times, name="swing")
    places = [sb.on_particle(i) for i in range(x.shape[1])]
    smooth = {"gust": sb.Smooth(size=1.0, length=0.15)}
    alone: dict[str, Any] = {"refine": False, "profiles": False, "beginnings": False, "smooth": smooth}
    fit = sb.fit(hung(), recording, ["rope_EI"], markers=places, solver=solver, sigma=3e-4, **alone)
    (found,) = fit.result.over_time
    inside = np.abs(np.array(found.values) - (own.shapes @ q).reshape(-1, 3)) < np.array(found.half_widths)
    assert inside.mean() > 0.85 and np.mean(found.left) < 0.5
    assert fit["rope_EI"].lower < 1e-3 < fit["rope_EI"].upper


def test_a_wind_that_blows_on_nothing_is_refused() -> None:
    scene = hanging()
    scene.set_wind(WIND)
    with pytest.raises(sb.SceneError, match="wind: blows on nothing"):
        sb.simulate(scene, TIMES, sb.Solver(h=1 / 240))
    sheet = sb.cloth(sb.mesh.grid(0.2, 0.2, 2, 2), density=0.2, warp=100.0, shear=30.0)
    sheet.add_pressure(sheet.cloths["cloth"].mesh.triangles, 1.0)
    sheet.set_wind(WIND)
    with pytest.raises(sb.SceneError, match="wind: blows on nothing"):
        sb.simulate(sheet, TIMES, sb.Solver(h=1 / 240))


CONFIG = """
[experiment]
name = "rope"

[solver]
h = 0.005

[[scene.rope]]
name = "rope"
length = 0.4
segments = 4
density = 0.05
EI = 1e-3
{drag}
clamp_start = [1, 0, 0]
pinned = [0]

[scene.wind]
velocity = [0.5, 0.0, 0.0]

[[recording]]
file = "rope.npz"

[parameters.wind_x]
"""


def test_a_configuration_blows_on_a_rope_with_drag(tmp_path: Path) -> None:
    sb.Recording(np.zeros((9, 5, 3)), np.arange(9) / 50, name="rope").save(tmp_path / "rope.npz")
    file = tmp_path / "rope.toml"
    file.write_text(CONFIG.format(drag="drag_linear = 0.02"))
    (e,) = load(file).experiments
    assert e.scene.quantities["wind_x"].value == 0.5
    file.write_text(CONFIG.format(drag=""))
    with pytest.raises(sb.ConfigError, match=r"scene.wind: blows on nothing"):
        load(file)
