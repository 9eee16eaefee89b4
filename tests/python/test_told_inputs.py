"""Given directions of grips, given loads and given speeds: what an error of each moves, and that it is named."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.doubts.given import premises
from sheetbend.doubts.told import Told, told_numbers
from sheetbend.doubts.told_words import words_of
from sheetbend.experiment.wanted import as_parameters
from sheetbend.problem.problem import FitProblem

Array = np.ndarray
SOLVER, TIMES = sb.Solver(h=1 / 300), np.arange(0, 46) / 50
DEGREE, LITTLE = math.pi / 180.0, 1e-5
KNOTS = np.linspace(0.0, 1.0, 51)
FITTED = ["rope_EI", "rope_bend_damping"]


def quaternions(rolls: bool) -> Array:
    """A hand that swings about y, and about its own z if it `rolls`."""
    swing, roll = 0.25 * np.sin(5 * KNOTS), 0.2 * np.sin(4 * KNOTS) * rolls
    half = [np.sin(swing / 2), np.cos(swing / 2), np.sin(roll / 2), np.cos(roll / 2)]
    sy, cy, sz, cz = half
    return np.stack([sy * sz, sy * cz, cy * sz, cy * cz], axis=1)


def turn(about: str, angle: float) -> Array:
    """A rotation vector as a matrix, of first order beyond nothing that matters here."""
    axis = np.eye(3)["xyz".index(about)]
    skew = np.cross(np.eye(3), axis)
    return np.eye(3) + math.sin(angle) * skew + (1.0 - math.cos(angle)) * skew @ skew


def hand(about: str = "y", angle: float = 0.0, rolls: bool = False) -> sb.Grip:
    """Its axes are those of the world at the start; the tool is turned in them."""
    by = turn(about, angle)
    path = np.stack([0.05 * np.sin(4 * KNOTS), 0 * KNOTS, 0.02 * np.sin(5 * KNOTS)], axis=1)
    return sb.Grip.from_poses(KNOTS, path, quaternions(rolls), by @ [1.0, 0.0, 0.0], by @ [0.0, 0.0, 1.0])


LINE = [[0.0, 0.0, 0.0], [0.4, 0.0, 0.0]]


def swung_rope(about: str = "y", angle: float = 0.0) -> sb.Scene:
    own = {"density": 0.05, "EI": 1e-3, "bend_damping": 0.02, "drag_linear": 0.02}
    return sb.rope(0.4, 8, grip_start=hand(about, angle), points=LINE, pinned=(), **own)


def swung_rod(about: str = "y", angle: float = 0.0) -> sb.Scene:
    points = [[0, 0, 0], [0.1, 0, 0], [0.2, 0.08, 0], [0.3, 0.12, 0]]
    own = {"density": 0.05, "EI": 1e-3, "GJ": 1e-3, "bend_damping": 0.02, "twist_damping": 0.02, "name": "rope"}
    return sb.rod(0.34, 8, start=hand(about, angle, rolls=True), points=points, EI2=2e-3, **own)


def between(about: str = "y", angle: float = 0.0) -> sb.Scene:
    """Two clamps that stay."""
    by = turn(about, angle) @ [1.0, 0.0, 0.0]
    x = np.linspace(0.0, 0.35, 30)
    points = np.stack([x, 0 * x, -0.08 * np.sin(np.pi * x / 0.35) ** 2], axis=1)
    grips = {"grip_start": sb.Grip.fixed(points[0], by), "grip_end": sb.Grip.fixed(points[-1], [1.0, 0.0, 0.0])}
    return sb.rope(0.4, 10, density=0.05, EI=1e-3, bend_damping=0.02, points=points, pinned=(), **grips)


def loaded(size: float = 1.0, about: str = "y", angle: float = 0.0) -> sb.Scene:
    scene = sb.rope(0.4, 8, density=0.05, EI=1e-3, bend_damping=0.02, clamp_start=(1, 0, 0))
    force = np.stack([0.05 * np.sin(8 * KNOTS), 0.02 * KNOTS, 0.1 * np.cos(6 * KNOTS)], axis=1)
    scene.add_force([8], (size * force @ turn(about, angle).T)[:, None], KNOTS)
    return scene


def thrown(speed: float = 1.0) -> sb.Scene:
    own = {"density": 0.05, "EI": 1e-3, "bend_damping": 0.02, "drag_linear": 0.03, "pinned": ()}
    v = speed * np.array([[0.0, 0.4, 1.0], [0.2, -0.3, 0.6]])
    return sb.rope(0.4, 8, points=LINE, velocity=v, **own)


def simulated(scene: sb.Scene, times: Array = TIMES) -> Array:
    return sb.simulate(scene, times, SOLVER).positions[:, scene.ropes["rope"].particles[2:-1]]


def problem_of(scene: sb.Scene, measured: Array, times: Array = TIMES, sigma: float = 1e-3) -> FitProblem:
    recording = sb.Recording(positions=measured, times=times, name="seen")
    places = [sb.on_particle(int(p)) for p in scene.ropes["rope"].particles[2:-1]]
    e = sb.Experiment(scene=scene, recording=recording, markers=places, solver=SOLVER, sigma=sigma)
    return FitProblem([e], as_parameters(FITTED, [e]))


def told_of(problem: FitProblem, name: str) -> dict[str, Told]:
    told, why = told_numbers(problem, problem.parameters.initial())
    assert not why
    return {one.label: one for one in told if one.name == name}


TURNED = [
    *((swung_rope, "rope_start", about) for about in "yz"),
    *((swung_rod, "rope_start", about) for about in "xyz"),
    *((between, "rope_start", about) for about in "yz"),
    (lambda about, angle: loaded(1.0, about, angle), "loads", "x"),
    (lambda about, angle: loaded(1.0, about, angle), "loads", "y"),
]


@pytest.mark.parametrize(("scene", "who", "about"), TURNED)
def test_a_turn_changes_residuals_as_a_scene_that_is_turned(scene: Any, who: str, about: str) -> None:
    base = scene(about, 0.0)
    shown = simulated(base)
    name = "load_direction" if who == "loads" else "grip_direction"
    one = told_of(problem_of(base, shown), name)[f"{who} about {about}"]
    ends = [simulated(scene(about, sign * LITTLE)) for sign in (1, -1)]
    wanted = (ends[0] - ends[1]).ravel() / (2 * LITTLE) / 1e-3
    assert np.abs(wanted).max() > 1.0
    assert one.column == pytest.approx(wanted, abs=1e-4 * np.abs(wanted).max())


@pytest.mark.parametrize(("scene", "name", "label"), [(loaded, "load_size", "loads"), (thrown, "start_speed", "speed")])
def test_a_size_changes_residuals_as_another_scene(scene: Any, name: str, label: str) -> None:
    base = scene(1.0)
    (one,) = told_of(problem_of(base, simulated(base)), name).values()
    ends = [simulated(scene(1.0 + sign * LITTLE)) for sign in (1, -1)]
    wanted = (ends[0] - ends[1]).ravel() / (2 * LITTLE) / 1e-3
    assert one.label.startswith(("size of the " + label, label)) and one.relative
    assert one.column == pytest.approx(wanted, abs=1e-4 * np.abs(wanted).max())


def test_what_is_a_quantity_is_told_as_that() -> None:
    """Forces with a name, a clamp whose angle is a quantity, a grip with tilts, and one clamp that holds all."""
    scene = sb.Scene("thrown")
    body = scene.add_body("block", mass=0.1, inertia=[1e-3, 1e-3, 1.5e-3])
    scene.add_force(body.point((0.1, 0, 0)), (0.0, 0.0, 1.0), name="push")
    recording = sb.Recording(positions=np.zeros((len(TIMES), 1, 3)), times=TIMES, name="seen")
    e = sb.Experiment(scene=scene, recording=recording, markers=sb.on_body(body, [(0, 0, 0)]), solver=SOLVER)
    problem = FitProblem([e], as_parameters(["block_mass"], [e]))
    names = {one.name for one in told_numbers(problem, problem.parameters.initial())[0]}
    assert "push_z" in names and "load_direction" in names and "load_size" not in names
    clamped = sb.rope(0.4, 8, density=0.05, EI=1e-3, bend_damping=0.02, clamp_start=(1, 0, 0))
    assert not told_of(problem_of(clamped, simulated(clamped)), "grip_direction")
    own = {"density": 0.05, "EI": 1e-3, "bend_damping": 0.02, "tilts": True}
    tilted = sb.rope(0.4, 8, grip_start=hand(), points=LINE, pinned=(), **own)
    assert not told_of(problem_of(tilted, simulated(tilted)), "grip_direction")


def test_standard_deviations_count() -> None:
    base = loaded()
    problem = problem_of(base, simulated(base))
    u = problem.parameters.initial()
    told, _ = told_numbers(problem, u)
    found = premises(problem, u, {"load_direction": 0.01, "load_size": 0.02}, told)
    by = {p.name: p for p in found}
    assert by["loads about y"].sd == 0.01 and by["size of the loads"].sd == 0.02
    assert by["loads about y"].words == "1 degree" and by["size of the loads"].words == "1 %"
    exact = premises(problem, u, {"load_direction": 0.0, "load_size": 0.0}, told)
    assert not {p.name for p in exact} & {"loads about y", "size of the loads"}


def test_a_tool_that_is_turned_against_its_poses_is_named() -> None:
    """Bend damping was 18 % off, 1.8 half-widths, and "identified"."""
    times = np.arange(0, 46) / 50
    shown = simulated(swung_rope("y", 2.0 * DEGREE), times)
    shown += 5e-4 * np.random.default_rng(1).standard_normal(shown.shape)
    scene = swung_rope()
    recording = sb.Recording(positions=shown, times=times, name="seen")
    places = [sb.on_particle(int(p)) for p in scene.ropes["rope"].particles[2:-1]]
    e = sb.Experiment(scene=scene, recording=recording, markers=places, solver=SOLVER, sigma=5e-4)
    found = sb.fit(e, parameters=FITTED, profiles=False)
    assert any("the grip at rope_start were turned by" in words for words in found.result.warnings)
    assert any(p.name == "rope_start about y" for p in found.result.premises)


def test_words() -> None:
    problem = problem_of(thrown(), simulated(thrown()))
    (speed,) = told_of(problem, "start_speed").values()
    assert words_of(speed, 0.03, problem, [0]) == "the motion had started 3 % faster"
    problem = problem_of(loaded(), simulated(loaded()))
    (size,) = told_of(problem, "load_size").values()
    assert words_of(size, -0.02, problem, [0]) == "the loads were 2 % smaller"
    about = told_of(problem, "load_direction")["loads about y"]
    assert words_of(about, -DEGREE, problem, [0]) == "the loads were turned by 1 degrees about -y"


def test_a_rope_that_sticks_out_farther_is_named_to_the_millimeter() -> None:
    """5 mm left EI 10 % and bend damping 19 % off, 1.3 half-widths in all, "identified", without a warning."""

    def held(more: float) -> sb.Scene:
        own = {"density": 0.05, "EI": 8e-4, "bend_damping": 0.02, "drag_linear": 0.02, "clamp_start": (1, 0, 0)}
        return sb.rope(0.5 + more, 16, start=(-more, 0.0, 0.0), **own)

    def seen(more: float) -> Array:
        scene = held(more)
        x = sb.simulate(scene, TIMES, SOLVER).nodes
        places = [sb.on_rope(scene.ropes["rope"], s + more) for s in PLACES]
        return np.stack([np.einsum("fka,k->fa", x[:, list(p.particles)], p.weights) for p in places], axis=1)

    def compared(scene: sb.Scene, x: Array) -> sb.Experiment:
        recording = sb.Recording(positions=x, times=TIMES, name="seen")
        places = [sb.on_rope(scene.ropes["rope"], s) for s in PLACES]
        return sb.Experiment(scene=scene, recording=recording, markers=places, solver=SOLVER, sigma=5e-4)

    base = FitProblem([e := compared(held(0.0), seen(0.0))], as_parameters(FITTED, [e]))
    (one,) = told_of(base, "lead").values()
    wanted = (seen(LITTLE) - seen(-LITTLE)).ravel() / (2 * LITTLE) / 5e-4
    assert one.column == pytest.approx(wanted, abs=2e-3 * np.abs(wanted).max())

    noise = 5e-4 * np.random.default_rng(1).standard_normal((len(TIMES), len(PLACES), 3))
    found = sb.fit(compared(held(0.0), seen(0.005) + noise), parameters=FITTED, profiles=False)
    named = "rope stuck out of what holds it at rope_start by 5.1 mm more"
    assert any(named in words for words in found.result.warnings)
    assert found["rope_EI"].verdict == "doubtful"


PLACES = (0.12, 0.21, 0.31, 0.4, 0.49)


def hung(weft: float | None, warp: float = 60.0, shear: float = 8.0) -> sb.Scene:
    """A cloth that falls from two corners."""
    mesh = sb.mesh.grid(0.3, 0.3, 6, 6, pattern="alternating")
    scene = sb.Scene("cloth")
    own = {"density": 0.12, "warp": warp, "weft": weft, "shear": shear, "membrane_damping": 0.004}
    cloth = sb.add_cloth(scene, mesh, positions=mesh.vertices[:, [0, 2, 1]], **own)
    top = cloth.particles[mesh.sets["top"]]
    scene.pin(top[[0, -1]])
    return scene


def test_a_wrong_frame_rate_looks_like_gravity_where_the_same_recording_drives() -> None:
    """Times that are 1 % too short make all forces look 2 % larger: stiffness, damping and drag take that up, gravity
    does not."""
    line = np.linspace(0.0, 1.0, 7)[:, None] * [0.0, 0.0, -0.3]
    scene = sb.rope(0.3, 6, density=0.05, EI=1e-3, bend_damping=0.02, drag_linear=0.01, points=line, pinned=())
    at = np.zeros((len(TIMES), 1, 3))
    at[:, 0, 0] = 0.02 * np.sin(6.0 * TIMES)
    scene.follow(scene.ropes["rope"].particles[:1], TIMES, at, ["hand"])
    shown = sb.simulate(scene, TIMES, SOLVER).positions
    recording = sb.Recording(np.concatenate([at, shown[:, [6]]], axis=1), TIMES, markers=("hand", "end"), name="seen")
    places = {"end": sb.on_particle(int(scene.ropes["rope"].particles[-1]))}
    e = sb.Experiment(scene=scene, recording=recording, markers=places, solver=SOLVER)
    problem = FitProblem([e], as_parameters(["rope_EI"], [e]))
    told, _ = told_numbers(problem, problem.parameters.initial())
    (size,) = (one for one in told if one.label == "size of gravity")
    said = words_of(size, 0.02, problem, [0])
    alike = "times of the recording that are 1 % too short have the same effect: its frame rate"
    assert said == f"gravity were 2 % larger ({alike})"
    assert not any(one.label in ("frame rate", "recording delay") for one in told)  # both are the drive's too


@pytest.mark.parametrize("weft", [20.0, 60.0])
def test_a_cloth_with_one_stiffness_for_both_directions_is_named(weft: float) -> None:
    """Warp was 22 for 60 N/m, 12 half-widths in all, "identified", with residuals of 1.04 sigma and without a warning:
    two causes explained more than one, chance explained the second, and none was named."""
    times, solver = np.arange(37) / 60, sb.Solver(h=1 / 240, method="newton")
    true, told = hung(weft), hung(None, warp=40.0, shear=12.0)
    seen = [p for p in true.cloths["cloth"].particles.tolist() if p not in true.pinned][::2]
    x = sb.simulate(true, times, solver).positions[:, seen]
    x = x + 5e-4 * np.random.default_rng(1).standard_normal(x.shape)
    recording = sb.Recording(positions=x, times=times, name="seen")
    places = [sb.on_particle(p) for p in seen]
    e = sb.Experiment(scene=told, recording=recording, markers=places, solver=solver, sigma=5e-4)
    found = sb.fit(e, parameters=["cloth_warp", "cloth_shear"], profiles=False, refine=False)
    named = [words for words in found.result.warnings if "smaller than cloth_warp" in words]
    assert bool(named) == (weft < 60.0)
    assert (found["cloth_warp"].verdict == "doubtful") == (weft < 60.0)


def test_cuts_of_one_fabric_share_its_second_stiffnesses() -> None:
    """A fit of two cloths of one fabric ended with an error after its work."""
    scene, mesh = sb.Scene("two"), sb.mesh.grid(0.3, 0.3, 3, 3, pattern="one_way")
    own = {"density": 0.12, "warp": 60.0, "shear": 8.0, "bending": 1e-5, "fabric": "twill"}
    for k in range(2):
        x = mesh.vertices[:, [0, 2, 1]] + [float(k), 0.0, 0.0]
        scene.pin(sb.add_cloth(scene, mesh, f"cut{k}", positions=x, **own).particles[mesh.sets["top"]])
    seen = [int(c.particles[mesh.sets["bottom"][0]]) for c in scene.cloths.values()]
    recording = sb.Recording(positions=np.tile(scene.positions[seen], (5, 1, 1)), times=TIMES[:5], name="seen")
    places = [sb.on_particle(p) for p in seen]
    e = sb.Experiment(scene=scene, recording=recording, markers=places, solver=sb.Solver(h=1 / 200))
    told = told_of(FitProblem([e], as_parameters(["twill_warp"], [e])), "isotropy")
    assert {"twill_weft/twill_warp", "twill_bending_weft/twill_bending", "twill_bending_twist/twill_bending"} == set(
        told
    )


def test_a_rod_with_one_stiffness_for_both_directions_tells_the_second() -> None:
    """What the ratio's logarithm changes, as a rod with two stiffnesses has it."""

    def rod(EI2: float | None) -> sb.Scene:
        own = {"density": 0.05, "EI": 1e-3, "GJ": 1e-3, "bend_damping": 0.02, "twist_damping": 0.02, "name": "rope"}
        points = [[0, 0, 0], [0.1, 0.02, 0], [0.2, 0.08, 0], [0.3, 0.12, 0]]
        return sb.rod(0.34, 8, EI2=EI2, start=sb.Grip.fixed([0, 0, 0], [1, 0, 0]), points=points, **own)

    base = rod(None)
    (one,) = told_of(problem_of(base, simulated(base)), "isotropy").values()
    assert one.label == "rope_EI2/rope_EI"
    ends = [simulated(rod(1e-3 * math.exp(sign * LITTLE))) for sign in (1, -1)]
    wanted = (ends[0] - ends[1]).ravel() / (2 * LITTLE) / 1e-3
    assert one.column == pytest.approx(wanted, abs=1e-3 * np.abs(wanted).max())
