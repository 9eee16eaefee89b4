"""Losses that the model of a motion with contacts does not have: which one it is, and what becomes of friction."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.doubts.absent_bounce import has_no_bounce, with_bounce
from sheetbend.doubts.causes import Wrong
from sheetbend.doubts.directions import score
from sheetbend.doubts.losses_at_zero import is_loss
from sheetbend.doubts.missing_parts import missing_parts
from sheetbend.doubts.other_losses import other_losses
from sheetbend.doubts.told import told_numbers
from sheetbend.doubts.wrong_given import wrong_given
from sheetbend.experiment.wanted import as_parameters
from sheetbend.minimum.discretization import AUTO
from sheetbend.minimum.optimizers import minimize
from sheetbend.minimum.time_step import settle
from sheetbend.problem.problem import FitProblem
from sheetbend.statistics.layout import Layout
from test_contact_fit import SIGMA, SOLVER, TIMES

WORLD = sb.Solver(h=2e-4, method="implicit", integrator="bdf1", extrapolate=2)
NAMES = ("table_friction", "rope_EI")


def dragged(
    friction: float = 0.3, EI: float = 1e-4, height: float = 0.006, restitution: float | None = None, **losses: Any
) -> sb.Scene:
    """A rope whose start is drawn aside by 15 cm, on a table or above it."""
    scene = sb.rope(0.3, 11, density=0.05, EA=200.0, EI=EI, start=(0, 0, height), pinned=(), **losses)
    rope, share = scene.ropes["rope"], np.clip((TIMES - 0.04) / 0.3, 0.0, 1.0)
    path = np.zeros((len(TIMES), 1, 3))
    path[:, 0, 1] = 0.15 * share**2 * (3 - 2 * share)
    scene.drive(rope.particles[:1], TIMES, scene.positions[rope.particles[:1]] + path)
    scene.add_contact(rope, sb.Plane(name="table"), friction=friction, radius=0.005, restitution=restitution)
    return scene


def thrown(friction: float = 0.3, EI: float = 1e-4, **losses: Any) -> sb.Scene:
    """A rope that falls on a table at 0.6 m/s along it, slides and comes to rest."""
    scene, line = sb.Scene("rope"), [[0.0, 0.0, 0.015], [0.3, 0.0, 0.015]]
    along = [[0.0, 0.6, 0.0], [0.0, 0.3, 0.0]]
    rope = sb.add_rope(
        scene,
        "rope",
        points=line,
        segments=11,
        density=0.05,
        EA=200.0,
        EI=EI,
        velocity=along,
        **losses,
    )
    scene.add_contact(rope, sb.Plane(name="table"), friction=friction, radius=0.005)
    return scene


def seen(true: sb.Scene, model: sb.Scene, seed: int, whole: bool = True) -> sb.Experiment:
    """A recording of the true scene with noise, explained by the model; without its driven particle, whose noise would
    count, unless it is whole."""
    particles = true.ropes["rope"].particles[0 if whole else 1 :]
    x = sb.simulate(true, TIMES, WORLD).positions[:, particles]
    x = x + SIGMA * np.random.default_rng(seed).standard_normal(x.shape)
    recording = sb.Recording(positions=x, times=TIMES, name="drag")
    places = [sb.on_particle(int(p)) for p in particles]
    return sb.Experiment(scene=model, recording=recording, markers=places, solver=SOLVER, sigma=SIGMA)


def minimum(e: sb.Experiment) -> tuple[FitProblem, np.ndarray]:
    """In the limit of short substeps."""
    problem = FitProblem([e], as_parameters(NAMES, [e]))
    at = settle(problem, minimize(problem, problem.parameters.initial())[0].u)
    return at.problem, at.u


def asked(e: sb.Experiment) -> list[Wrong]:
    problem, u = minimum(e)
    return wrong_given(problem, u, told_numbers(problem, u)[0], AUTO)


@pytest.mark.parametrize(("drag", "off"), [(0.2, 3.5), (0.05, 2.5)])
def test_a_drag_that_is_missing_makes_the_friction_doubtful(drag: float, off: float) -> None:
    """It was "identified" 3.8 and 2.9 half-widths off, at a reduced chi-square of 1.10 and 1.01."""
    e = seen(dragged(drag_linear=drag), dragged(0.2, 2e-4), 0)
    result = sb.fit(replace(e, fit=(0.0, 0.45)), parameters=NAMES, profiles=False, beginnings=False).result
    friction = result["table_friction"]
    assert friction.half_width is not None and friction.value - 0.3 > off * friction.half_width
    assert friction.verdict == "doubtful" and "it had a drag_linear of" in friction.words
    assert any("N s/m per kg, which the model lacks" in words for words in result.warnings)


def test_a_damping_that_is_missing_is_named_with_its_size() -> None:
    """10 ms of bending, at a reduced chi-square of 1.03."""
    (found,) = asked(seen(dragged(bend_damping=0.01), dragged(0.2, 2e-4), 0))
    assert found.words == ("rope_bend had a damping of 8.5 ms, which the model lacks",)


def test_a_given_drag_that_is_too_small_is_named() -> None:
    (found,) = asked(seen(dragged(drag_linear=0.2), dragged(0.2, 2e-4, drag_linear=0.05), 0))
    assert any("rope_drag_linear were" in words and "more" in words for words in found.words)


def test_a_restitution_that_is_missing_is_named() -> None:
    """Friction and EI were "identified", at a reduced chi-square of 1.5. Of the sizes that are tried, 0.3 and 0.4 leave
    too much to be named."""
    problem, u = minimum(seen(dragged(height=0.03, restitution=0.35), dragged(0.3, 1e-4, height=0.03), 0))
    said = other_losses(problem, u)
    assert set(said) == set(NAMES)
    assert "drag bounces where the model comes to rest: with a restitution of 0.33 the fit" in said["rope_EI"]


def test_contacts_with_a_stiffness_get_no_restitution() -> None:
    """The scene refuses it, and that ended the fit of a rope on a soft table, after its work."""

    def onto(*stiffness: float | None) -> sb.Experiment:
        scene = sb.rope(0.3, 11, density=0.05, EA=200.0, EI=1e-4, start=(0, 0, 0.006), pinned=())
        for k, each in enumerate(stiffness):
            plane = sb.Plane((0, 0, -k), name=f"table {k}")
            scene.add_contact(scene.ropes["rope"], plane, friction=0.3, radius=0.005, stiffness=each)
        return seen(scene, scene, 0)

    assert not has_no_bounce(onto(2e4))
    mixed = onto(2e4, None)
    assert has_no_bounce(mixed)
    problem = FitProblem([mixed], as_parameters(["rope_EI"], [mixed]))
    (bouncing,) = with_bounce(problem, 0.5).experiments
    assert [c.bounces for c in bouncing.scene.contacts.contacts] == [False, True]
    assert bouncing.scene.compiled.inputs()[bouncing.scene.compiled.layout["restitution"][0]] == 0.5


def drawn(warp: float, friction: float, damping: float | None = None) -> tuple[sb.Scene, sb.Cloth]:
    """A cloth of 0.3 m that is drawn aside by 15 cm at one of its corners, on a table."""
    mesh = sb.mesh.grid(0.3, 0.3, 5, 5, pattern="one_way")
    numbers = {"density": 0.2, "warp": warp, "shear": 40.0, "bending": 1e-4, "bend_damping": 1e-3}
    lifted, scene = mesh.vertices + np.array([0.0, 0.0, 0.006]), sb.Scene("cloth")
    cloth = sb.add_cloth(scene, mesh, positions=lifted, membrane_damping=damping, **numbers)
    held = cloth.particles[(mesh.vertices[:, 0] < 0.01) & (mesh.vertices[:, 1] < 0.07)]
    share = np.clip((TIMES - 0.04) / 0.3, 0.0, 1.0)
    path = np.outer(0.15 * share**2 * (3 - 2 * share), (0.0, 1.0, 0.0))[:, None]
    scene.drive(held, TIMES, scene.positions[held] + path)
    scene.add_contact(cloth, sb.Plane(name="table"), friction=friction, radius=0.005)
    return scene, cloth


def drawn_fit(damping: float, h: float, warp: float, friction: float) -> tuple[FitProblem, np.ndarray]:
    """The minimum of a model without the membrane damping that a drawn cloth has."""
    (true, cloth), (model, _) = drawn(200.0, 0.3, damping), drawn(warp, friction)
    world = sb.Solver(h=1e-3, method="implicit", integrator="bdf1", extrapolate=2)
    x = sb.simulate(true, TIMES, world).positions[:, cloth.particles]
    x = x + SIGMA * np.random.default_rng(0).standard_normal(x.shape)
    places = [sb.on_particle(int(p)) for p in cloth.particles]
    recording = sb.Recording(positions=x, times=TIMES, name="drag")
    e = sb.Experiment(scene=model, recording=recording, markers=places, solver=replace(SOLVER, h=h), sigma=SIGMA)
    problem = FitProblem([e], as_parameters(("table_friction", "cloth_warp"), [e]))
    return problem, minimize(problem, problem.parameters.initial())[0].u


def test_a_membrane_damping_that_is_missing_is_named() -> None:
    """Of 20 ms. Without it friction is 0.70 for 0.3, so far off that two steps with a damping leave no less."""
    said = other_losses(*drawn_fit(0.02, 4e-3, 488.0, 0.51))
    assert set(said) == {"table_friction", "cloth_warp"}
    assert "drag loses energy that the model does not: with damping of cloth_membrane the fit" in said["cloth_warp"]


def test_a_small_membrane_damping_that_is_missing_is_named() -> None:
    """Of 5 ms, at a reduced chi-square of 1.03. What the motions of the hand take up of it once counted as noise."""
    problem, u = drawn_fit(0.005, 4e-3, 300.0, 0.4)
    (found,) = wrong_given(problem, u, told_numbers(problem, u)[0], AUTO)
    (words,) = found.words
    named = re.fullmatch(r"cloth_membrane had a damping of ([\d.]+) ms, which the model lacks", words)
    assert named is not None and float(named[1]) == pytest.approx(5.0, rel=0.4)


def test_what_known_directions_explain_is_no_noise() -> None:
    """Residuals that hold a hundred times their noise of a known direction ask as clearly for another one."""
    rng, t = np.random.default_rng(0), np.arange(400)
    known, asked = np.sin(t / 20.0)[:, None], np.sin(t / 20.0) + np.sin(t / 33.0)
    layout = Layout(np.zeros(400, dtype=int), np.zeros(400, dtype=int), t)
    r = rng.standard_normal(400) - asked
    plain, held = (score(r + size * known[:, 0], known, asked, layout) for size in (0.0, 100.0))
    assert plain is not None and held is not None and plain.chance < 1e-4
    assert held.more == pytest.approx(plain.more) and held.chance == pytest.approx(plain.chance)


@pytest.mark.parametrize(("make", "draws"), [(dragged, 2), (thrown, 1)])
def test_the_right_model_lacks_nothing(make: Callable[..., sb.Scene], draws: int) -> None:
    for seed in range(draws):
        assert asked(seen(make(), make(0.27, 1.2e-4), seed, whole=False)) == []


def test_tangents_of_losses_at_zero_are_what_a_little_of_them_changes() -> None:
    """Of contacts that begin, stick and slide; damping changes what it is given for, and nothing else."""
    e = seen(thrown(), thrown(), 0)
    problem = FitProblem([e], as_parameters(NAMES, [e]))
    u, little = problem.parameters.initial(), 1e-6
    _, r, _ = problem.evaluate(u, jacobian=False)
    losses = {part.label: part.column for part in missing_parts(problem, u, 0) if is_loss(part.label)}
    assert list(losses) == ["drag_linear", "drag_quadratic", "damping of rope_stretch", "damping of rope_bend"]
    per_kg = 0.05 * 0.3  # kg of the rope: drag_linear is that of all of it
    for label, scene in (
        ("drag_linear", thrown(drag_linear=little * per_kg / 0.3)),
        ("damping of rope_bend", thrown(bend_damping=little)),
    ):
        _, more, _ = problem.of([replace(e, scene=scene)]).evaluate(u, jacobian=False)
        difference = (more - r) / little
        assert np.linalg.norm(difference - losses[label]) < 1e-3 * np.linalg.norm(difference), label
