"""How deep particles were in the shapes that they touch."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
import sheetbend as sb
from commands import last_line, run
from sheetbend.mesh import equilateral
from sheetbend.motion.depth import too_deep

RADIUS, GRAVITY = 0.005, 9.81
SOLVER = sb.Solver(h=5e-3, method="implicit", integrator="bdf1")
TIMES = np.linspace(0.0, 0.2, 21)


def rope(depth: float = 0.0, lift: float = 0.0, stiffness: float | None = None) -> sb.Scene:
    """A rope that falls 1 mm onto a table, which moves up by `lift`; with a depth every second particle is driven, and
    pressed so far into it."""
    scene = sb.rope(0.2, 8, density=0.05, EA=1e5, EI=1e-4, start=(0, 0, RADIUS + 1e-3), pinned=())
    share = np.clip(TIMES / 0.1, 0.0, 1.0)
    ease = share**2 * (3 - 2 * share)
    if depth:
        hand = scene.ropes["rope"].particles[::2]
        path = np.repeat(scene.positions[hand][None], len(TIMES), axis=0)
        path[:, :, 2] -= (depth + 1e-3) * ease[:, None]
        scene.drive(hand, TIMES, path)
    table = sb.Plane(name="table").moving(TIMES, lift * ease[:, None] * [0.0, 0.0, 1.0])
    scene.add_contact(scene.ropes["rope"], table, friction=0.3, radius=RADIUS, stiffness=stiffness)
    return scene


def deepest(scene: sb.Scene, solver: sb.Solver = SOLVER) -> float:
    found = sb.simulate(scene, TIMES, solver).contacts["table"].deepest
    assert found is not None
    return found


@pytest.mark.parametrize("integrator", ["bdf1", "bdf2"])
@pytest.mark.parametrize("lift", [0.0, 0.02])
def test_a_rope_at_rest_lies_as_deep_as_its_contact_is_stiff(integrator: Literal["bdf1", "bdf2"], lift: float) -> None:
    scene, solver = rope(lift=lift), replace(SOLVER, integrator=integrator)
    end = sb.simulate(scene, TIMES, solver).positions[-1, :, 2]
    rest = GRAVITY * SOLVER.h**2 / 1000  # docs/contact_law.md
    assert RADIUS + lift - end == pytest.approx(rest, rel=1e-2)
    assert rest < deepest(scene, solver) < 20 * rest + 2 * lift / 0.1 * SOLVER.h / 1000


def falling(what: str, speed: float) -> tuple[sb.Scene, float]:
    """A rope, a cloth or a box that falls on a table, and its mass over that of the lightest point that touches."""
    scene = sb.Scene("falling")
    thing: object
    if what == "box":
        sides, turn = (0.1, 0.1, 0.12), (0.5, 0.3, 0.0)
        inertia = sb.Inertia.box(0.4, sides)
        thing = scene.add_body(
            "box", of=inertia, at=(0, 0, 0.12), rotation=turn, velocity=(1, 0, -speed), spin=(3, 5, 1)
        )
        scene.add_contact(thing, sb.Plane(name="table"), friction=0.3, points=sb.box_corners(sides))
        moments = 0.4 / 12 * np.array([0.1**2 + 0.12**2, 0.1**2 + 0.12**2, 0.1**2 + 0.1**2])
        axes = moments.sum() / 2 - moments  # masses
        return scene, 0.4 * (1 / 0.4 + (np.array([0.05, 0.05, 0.06]) ** 2 / axes).sum())
    if what == "cloth":
        mesh = equilateral(0.2, 0.2, 6)
        x, y = np.asarray(mesh.vertices)[:, :2].T
        places = np.column_stack([x, y * np.cos(1.0), 0.0201 + y * np.sin(1.0)])
        down = np.outer(np.ones(len(x)), [0, 0, -speed])
        cloth = sb.add_cloth(
            scene, mesh, "cloth", positions=places, density=0.2, warp=400.0, shear=100.0, bending=1e-5, velocity=down
        )
        scene.add_contact(cloth, sb.Plane(name="table"), friction=0.3, radius=0.001)
        masses = scene.compiled.inputs()[scene.compiled.layout["mass"][0] + cloth.particles]
        return scene, float(masses.sum() / masses.min())
    way = {"rope": (1, 0, 0), "leaning rope": (1, 0, 1), "upright rope": (0, 0, 1)}[what]
    rope = sb.add_rope(
        scene, length=0.4, segments=20, density=0.05, EA=1e4, EI=1e-4, start=(0, 0, 0.0241), direction=way,
        velocity=np.outer(np.ones(21), [1, 0, -speed]),
    )  # fmt: skip
    scene.add_contact(rope, sb.Plane(name="table"), friction=0.3, radius=0.004)
    return scene, 1.0 if what == "rope" else 40.0


@pytest.mark.parametrize("integrator", ["bdf1", "bdf2"])
@pytest.mark.parametrize("what", ["rope", "leaning rope", "upright rope", "cloth", "box"])
def test_an_impact_goes_in_no_deeper_than_the_mass_that_it_stops(
    what: str, integrator: Literal["bdf1", "bdf2"]
) -> None:
    h, speed = 1e-3, 5.0
    scene, share = falling(what, speed)
    motion = sb.simulate(scene, h * np.arange(40), sb.Solver(h=h, method="implicit", integrator=integrator))
    found = motion.contacts["table"].deepest
    assert found is not None
    assert 0.9 * speed * h / 1000 < found < (speed + 5 * h * GRAVITY) * h / 1000 * share  # docs/contact_law.md


def test_a_soft_contact_gives_way_by_weight_over_stiffness() -> None:
    depth, mass = 1e-3, 0.05 * 0.2 / 8
    scene = rope(stiffness=mass * GRAVITY / depth)
    end = sb.simulate(scene, TIMES, SOLVER).positions[..., 2]
    assert deepest(scene) == pytest.approx(RADIUS - end.min(), rel=1e-9)
    assert depth < deepest(scene) < 2.5 * depth


def test_what_is_driven_touches_nothing_and_what_it_presses_in_counts() -> None:
    scene = rope(depth=3e-3)
    x = sb.simulate(scene, TIMES, SOLVER).positions[..., 2]
    assert RADIUS - x[:, ::2].min() == pytest.approx(3e-3)
    assert deepest(scene) == pytest.approx(RADIUS - x[:, 1::2].min(), rel=1e-9)
    assert 0.5e-3 < deepest(scene) < 2e-3


def test_runs_that_are_combined_tell_the_depth_of_the_one_at_h() -> None:
    scene = rope()
    assert deepest(scene, replace(SOLVER, extrapolate=2)) == deepest(scene)


def warned(scene: sb.Scene, solver: sb.Solver = SOLVER, **values: float) -> tuple[str, ...]:
    found = sb.simulate(scene, TIMES, solver, values).contacts
    return too_deep(scene, values, {name: counts.deepest for name, counts in found.items()})


def test_a_rigid_contact_that_does_not_hold_is_told_with_its_depth() -> None:
    (words,) = warned(rope(depth=3e-3))
    assert "'table' does not hold" in words and "up to 1 mm deep, where 0.5 mm are allowed" in words
    (words,) = warned(rope(depth=3e-3), table_contact_radius=1e-2)  # 8 mm deep
    assert "where 1 mm are allowed" in words


def test_what_a_contact_is_made_for_is_not_told() -> None:
    assert warned(rope()) == ()
    assert warned(rope(lift=0.02)) == ()
    assert warned(rope(depth=3e-3), replace(SOLVER, h=1e-3)) == ()  # a stiffer spring
    assert warned(rope(depth=3e-3, stiffness=100.0)) == ()  # is to yield


def falling_box(h: float) -> tuple[str, ...]:
    """On its corners, at 3 m/s, with a radius of 0."""
    sides = (0.1, 0.1, 0.12)
    scene = sb.Scene("toss")
    box = scene.add_body("box", of=sb.Inertia.box(0.4, sides), at=(0, 0, 0.2), velocity=(0.8, 0, -3), spin=(1, -3, 2))
    scene.add_contact(box, sb.Plane(name="table"), friction=0.2, points=sb.box_corners(sides))
    return warned(scene, replace(SOLVER, h=h, integrator="bdf2"))


@pytest.mark.parametrize("h", [1e-3, 5e-3])
def test_impacts_are_not_told(h: float) -> None:
    assert falling_box(h) == ()


@pytest.mark.parametrize("depth", [0.0, 3e-3])
def test_a_fit_warns_of_what_was_pressed_in(depth: float) -> None:
    scene = rope(depth=depth)
    particles = scene.ropes["rope"].particles
    x = sb.simulate(scene, TIMES, SOLVER).positions[:, particles]
    seen = x + 1e-3 * np.random.default_rng(0).standard_normal(x.shape)
    recording = sb.Recording(positions=seen, times=TIMES, name="press")
    places = [sb.on_particle(int(p)) for p in particles]
    result = sb.fit(scene, recording, ["table_z"], markers=places, solver=SOLVER, sigma=1e-3, refine=False).result
    told = [w for w in result.warnings if "in the motion of press the contact 'table' does not hold" in w]
    assert len(told) == (depth > 0)
    (touch,) = result.contacts
    assert touch.deepest is not None and (touch.deepest > 0.5e-3) == (depth > 0)


CONFIGURATION = """\
[experiment]
name = "press"

[solver]
h = 5e-3
method = "implicit"

[[scene.rope]]
length = 0.2
segments = 4
density = 0.05
EA = 1e5
EI = 1e-4
start = [0.0, 0.0, 0.006]

[[scene.drive]]
particles = ["rope:0", "rope:2", "rope:4"]
markers = ["a", "b", "c"]

[[scene.collider]]
name = "table"
shape = "plane"

[[scene.contact]]
of = "rope"
collider = "table"
friction = 0.3
radius = 0.005

[[recording]]
file = "press.npz"
sigma = 1e-3

[parameters.rope_EI]
"""


@pytest.mark.parametrize("depth", [0.0, 10e-3])
def test_the_command_that_simulates_warns(depth: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    x = np.zeros((len(TIMES), 5, 3))
    x[:, :, 0] = np.linspace(0.0, 0.2, 5)
    x[:, :, 2] = RADIUS + 1e-3 - (depth + 1e-3) * np.clip(TIMES / 0.1, 0.0, 1.0)[:, None] ** 2
    sb.Recording(positions=x, times=TIMES, markers=("a", "d", "b", "e", "c"), name="press").save("press.npz")
    Path("press.toml").write_text(CONFIGURATION)
    told = run("simulate", "press.toml").stdout
    assert "Contacts" in told and "sliding" in told and "of 5" in told
    result = run("simulate", "press.toml", "--json")
    found = last_line(result)["simulated"]["press"]["contacts"]["table"]["deepest"]
    assert ("contact 'table' does not hold what it touches" in " ".join(result.stderr.split())) == (depth > 0)
    assert (found > 0.5e-3) == (depth > 0)
