"""Fits whose model lacks a loss of the recording, or has one too many."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.doubts.directions import EXPLAINS, LEVEL, asked_for
from sheetbend.doubts.held_losses import held_losses
from sheetbend.doubts.missing_loss import missing_loss, of_more_loss
from sheetbend.doubts.other_losses import other_losses
from sheetbend.experiment.wanted import as_parameters
from sheetbend.minimum.optimizers import minimize
from sheetbend.problem.problem import FitProblem
from test_unexplained import between_hands

SIGMA = 3e-4
SOLVER = sb.Solver(h=1 / 400)
AT = [2, 4, 6, 8]


def rope(**losses: float) -> sb.Scene:
    return sb.rope(0.5, 8, density=0.05, EI=2e-3, clamp_start=(1, 0, 0), **losses)


def fall(model: sb.Scene, **losses: float) -> sb.Experiment:
    """A model and the recording of a clamped rope that falls for 1.5 s, with noise."""
    times = np.arange(151) / 100
    x = sb.simulate(rope(**losses), times, SOLVER).positions[:, AT]
    x = x + SIGMA * np.random.default_rng(0).standard_normal(x.shape)
    recording = sb.Recording(positions=x, times=times, name="fall")
    places = [sb.on_particle(i) for i in AT]
    return sb.Experiment(scene=model, recording=recording, markers=places, solver=SOLVER, sigma=SIGMA)


def fitted(e: sb.Experiment | list[sb.Experiment], *names: str) -> sb.Fit:
    return sb.fit(e, parameters=names, profiles=False, beginnings=False)


@pytest.mark.parametrize("told", [SIGMA, 0.01])
def test_a_model_without_a_damping_of_its_recording_is_doubtful(told: float) -> None:
    """EI was "identified", 1.5 half-widths off, at a reduced chi-square of 357. What was told of the noise does not
    matter."""
    e = replace(fall(rope(drag_linear=0.01), drag_linear=0.005, bend_damping=0.003), sigma=told)
    found = fitted(e, "rope_EI", "rope_drag_linear")
    EI = found["rope_EI"]
    assert EI.half_width is not None and abs(EI.value - 2e-3) > EI.half_width
    for one in found.result.estimates:
        assert one.verdict == "doubtful" and "fall loses energy that the model does not" in one.words
        assert "a damping would explain 63 % of what the fit leaves" in one.words


def test_a_model_that_loses_more_than_its_recording_is_doubtful() -> None:
    """Backward Euler damps the model by itself."""
    e = fall(rope())
    found = fitted(replace(e, solver=replace(SOLVER, integrator="bdf1")), "rope_EI")
    EI = found["rope_EI"]
    assert EI.verdict == "doubtful" and "the model loses more energy than fall" in EI.words


@pytest.mark.parametrize("times", [1 / 3, 3.0])
def test_a_given_loss_of_another_size_is_named(times: float) -> None:
    """A damping that is told three times too large explained 11 % of what the fit leaves, and EI was "identified"
    beside it, 1.1 half-widths off."""
    e = fall(rope(drag_linear=0.01, bend_damping=0.003 * times), drag_linear=0.005, bend_damping=0.003)
    found = fitted(e, "rope_EI", "rope_drag_linear")
    for one in found.result.estimates:
        size = "large" if times > 1.0 else "small"
        assert one.verdict == "doubtful" and f"the given rope_bend_damping is too {size}" in one.words


@pytest.mark.parametrize("EI", [5e-4, 2e-3, 8e-3])
def test_a_large_damping_that_is_given_as_three_times_larger_is_named(EI: float) -> None:
    """90 ms instead of 30 leave errors as slow as the motion: 1,800 to 6,600 times the noise, and EI was "identified"
    7 % off at 2e-3. The drag runs off to nothing, from where it must come back."""
    times = np.arange(151) / 100
    model, true = ({"drag_linear": 0.01, "bend_damping": 0.09}, {"drag_linear": 0.005, "bend_damping": 0.03})
    scenes = [sb.rope(0.5, 8, density=0.05, EI=EI, clamp_start=(1, 0, 0), **losses) for losses in (model, true)]
    x = sb.simulate(scenes[1], times, SOLVER).positions[:, AT]
    x = x + SIGMA * np.random.default_rng(0).standard_normal(x.shape)
    recording = sb.Recording(positions=x, times=times, name="fall")
    e = replace(fall(scenes[0], **true), recording=recording)
    problem = FitProblem([e], as_parameters(["rope_EI", "rope_drag_linear"], [e]))
    u = minimize(problem, problem.parameters.initial())[0].u
    said = other_losses(problem, u)
    assert set(said) == {"rope_EI", "rope_drag_linear"}
    assert "the given rope_bend_damping is too large: with a third of it" in said["rope_EI"]


def test_a_damping_that_one_kind_of_elements_lacks_is_named() -> None:
    """A flap whose membrane has 10 ms and its bending none: damping of both leaves more than none of either, and the
    bending was "identified" 3.2 half-widths off."""
    mesh, times = sb.mesh.grid(0.3, 0.3, 4, 4, pattern="one_way"), np.arange(49) / 60

    def flap(damping: float | None) -> tuple[sb.Scene, list[int]]:
        scene, given = sb.Scene("flap"), {"warp": 40.0, "weft": 20.0, "shear": 10.0, "bending": 1e-3}
        made = sb.add_cloth(scene, mesh, density=0.1, drag_linear=0.1, membrane_damping=damping, **given)  # type: ignore[arg-type]
        scene.pin(made.particles[mesh.sets["top"]])
        return scene, [int(made.particles[k]) for k in range(0, 15, 2)]

    true, at = flap(0.01)
    model, _ = flap(None)
    x = sb.simulate(true, times, sb.Solver(h=1 / 480, method="newton")).positions[:, at]
    x = x + SIGMA * np.random.default_rng(0).standard_normal(x.shape)
    recording, places = sb.Recording(positions=x, times=times, name="flap"), [sb.on_particle(k) for k in at]
    newton = sb.Solver(h=1 / 240, method="newton")
    e = sb.Experiment(scene=model, recording=recording, markers=places, solver=newton, sigma=SIGMA)
    wanted = ["cloth_warp", "cloth_shear", "cloth_bending", "cloth_drag_linear"]
    problem = FitProblem([e], as_parameters(wanted, [e]))
    near = dict(zip(wanted, (19.0, 16.25, 1.019e-3, 0.101), strict=True))
    u = minimize(problem, problem.parameters.to_internal(near), max_iterations=5)[0].u
    said = other_losses(problem, u)
    assert set(said) == set(wanted)
    assert "with damping of cloth_membrane the fit would leave 92 % less" in said["cloth_bending"]


def test_a_fit_with_a_large_damping_three_times_too_large_is_doubtful() -> None:
    e = fall(rope(drag_linear=0.01, bend_damping=0.09), drag_linear=0.005, bend_damping=0.03)
    EI = fitted(e, "rope_EI", "rope_drag_linear")["rope_EI"]
    assert EI.verdict == "doubtful" and "the given rope_bend_damping is too large" in EI.words


def arm(drag: float, inertia: float = 3e-3) -> tuple[sb.Scene, sb.Arm]:
    scene = sb.Scene()
    numbers = {"mass": 0.14, "first_moment": 0.016, "length": 0.25, "viscosity": 1e-4, "angle": 1.0, "rate": 0.5}
    return scene, sb.add_arm(scene, inertia=inertia, drag=drag, **numbers)


def test_a_drag_of_an_arm_is_named_where_the_fitted_loss_ran_off_to_nothing() -> None:
    """The drag is given twice too large, so the viscosity goes to its limit. Beyond it, it would take what shows that
    the drag is too large."""
    scene, true = arm(2e-5)
    times, solver = np.arange(201) / 50, sb.Solver(h=1 / 400)
    recording = sb.Recording(np.zeros((len(times), 1, 3)), times, markers=("m",), name="swing")
    places, fine = {"m": true.place(0.2)}, sb.Solver(h=1 / 1600)
    e = sb.Experiment(scene=scene, recording=recording, markers=places, solver=fine, axes="xz", sigma=2e-4)
    known = FitProblem([e], as_parameters(["arm_inertia"], [e]))
    x = known.simulate(known.parameters.initial())[0]
    x = x + 2e-4 * np.random.default_rng(0).standard_normal(x.shape)
    model, own = arm(4e-5, 3.3e-3)
    e = replace(e, scene=model, markers={"m": own.place(0.2)}, solver=solver, recording=replace(recording, positions=x))
    found = fitted(e, "arm_inertia", "arm_hinge_viscosity", "arm_angle", "arm_rate")
    assert found["arm_hinge_viscosity"].value < 1e-9
    for name in ("arm_inertia", "arm_angle", "arm_rate"):
        assert found[name].words.startswith("the given arm_drag is too large: less of it would explain 100 %")


def test_a_drag_of_another_size_is_named_and_not_the_damping_that_is_right() -> None:
    losses = {"drag_linear": 0.005, "bend_damping": 0.01}
    e = fall(rope(drag_linear=0.015, bend_damping=0.01), **losses)
    assert "the given rope_drag_linear is too large" in fitted(e, "rope_EI")["rope_EI"].words


@pytest.mark.parametrize("corrected", [False, True])
@pytest.mark.slow
def test_a_driven_rope_without_its_large_damping_is_doubtful(corrected: bool) -> None:
    """30 ms change the motion in another way than a little damping does, and corrections of the hand take up most of
    it: 13 % was left to be explained."""
    e = shaken({"drag_linear": 0.005}, drag_linear=0.005, bend_damping=0.03)
    found = fitted(e if corrected else replace(e, driven_sigma=None), "rope_EI")
    assert found["rope_EI"].verdict == "doubtful" and "shaken loses energy" in found["rope_EI"].words


def test_a_stiff_driven_rope_without_its_large_damping_is_doubtful() -> None:
    """EI was "identified", 4.9 half-widths off: noise of the hand hid what the damping would explain."""
    e = replace(shaken({"drag_linear": 0.005}, EI=8e-3, drag_linear=0.005, bend_damping=0.03), driven_sigma=None)
    EI = fitted(e, "rope_EI")["rope_EI"]
    assert EI.half_width is not None and EI.value - 8e-3 > 4 * EI.half_width
    assert EI.verdict == "doubtful" and "shaken loses energy" in EI.words
    whole = replace(shaken({"bend_damping": 0.03}, EI=8e-3, bend_damping=0.03), driven_sigma=None)
    assert fitted(whole, "rope_EI")["rope_EI"].verdict == "identified"


def test_noise_of_what_drives_a_rope_is_not_taken_for_a_loss() -> None:
    """Its part of the residuals lay along the derivative with respect to the damping by 89 %, which was right."""
    e = between_hands(0.02, 0.12, turns=True)
    found = sb.fit(e, parameters={"rope_EI": {}}, profiles=False, refine=False, beginnings=False)
    assert found["rope_EI"].verdict == "identified"


@pytest.mark.parametrize("change", [{"clamp_start": (1, 0, 0.1)}, {"length": 0.49}, {"gravity": (0.5, 0, -9.8)}])
def test_other_errors_ask_for_no_damping(change: dict[str, object]) -> None:
    """They leave 200 to 1,600 times the noise's variance."""
    given = {"length": 0.5, "clamp_start": (1, 0, 0)} | change
    model = sb.rope(given.pop("length"), 8, density=0.05, EI=2e-3, drag_linear=0.01, **given)  # type: ignore[arg-type]
    e = fall(model, drag_linear=0.005)
    problem = FitProblem([e], as_parameters(["rope_EI", "rope_drag_linear"], [e]))
    u = minimize(problem, problem.parameters.initial())[0].u
    assert other_losses(problem, u) == {} and held_losses(problem, u) == {}


@pytest.mark.parametrize("losses", [{}, {"bend_damping": 0.01}])
def test_a_model_with_the_losses_of_its_recording_is_not(losses: dict[str, float]) -> None:
    e = fall(rope(drag_linear=0.01, **losses), drag_linear=0.005, **losses)
    found = fitted(e, "rope_EI", "rope_drag_linear")
    assert [one.verdict for one in found.result.estimates] == ["identified", "identified"]


def test_another_error_of_the_model_is_not_taken_for_a_loss() -> None:
    """A clamp that is turned by 6 degrees leaves more than a missing damping does, but not in its direction."""
    e = fall(rope(drag_linear=0.01, bend_damping=0.01), drag_linear=0.005, bend_damping=0.01)
    turned = sb.rope(0.5, 8, density=0.05, EI=2e-3, clamp_start=(1, 0, 0.1), drag_linear=0.01, bend_damping=0.01)
    found = fitted(replace(e, scene=turned), "rope_EI", "rope_drag_linear")
    assert found.result.misfit is not None and found.result.misfit.reduced_chi_square > 100
    assert not any("energy" in one.words for one in found.result.estimates)


def test_a_coarse_mesh_is_not_taken_for_a_loss() -> None:
    """20 links under a hand; data of 120. A damping explains 53 % of what is left, and no mesh was asked."""
    times = np.arange(151) / 100
    ease = np.clip(times / 0.3, 0.0, 1.0)
    path = np.array([0.08, 0.05, 0.02]) * np.sin(2 * np.pi * np.array([1.1, 1.6, 0.9]) * times[:, None])
    path *= (ease**2 * (3 - 2 * ease))[:, None]

    def made(links: int, recording: sb.Recording | None, share: float) -> sb.Experiment:
        losses = {"bend_damping": 0.02 * share, "drag_linear": 0.02 * share}
        down = {"direction": (0, 0, -1), "pinned": ()}
        scene = sb.rope(0.5, links, density=0.05, EI=1e-3 * share, **losses, **down)
        rope = scene.ropes["rope"]
        scene.drive(rope.particles[:1], times, scene.positions[rope.particles[:1]] + path[:, None])
        places = [sb.on_rope(rope, 0.5 * (k + 1) / 6) for k in range(6)]
        recording = recording or sb.Recording(positions=np.zeros((151, 6, 3)), times=times)
        return sb.Experiment(scene=scene, recording=recording, markers=places, solver=sb.Solver(h=1 / 300), sigma=5e-4)

    fine = replace(made(120, None, 1.0), solver=sb.Solver(h=1 / 1200))
    seen = FitProblem([fine], as_parameters(["rope_EI"], [fine])).simulate(np.log([1e-3]))[0]
    noise = 5e-4 * np.random.default_rng(1000).standard_normal(seen.shape)
    recording = sb.Recording(positions=seen + noise, times=times, name="swung")
    e = made(20, recording, 1.3)
    names = ("rope_EI", "rope_bend_damping", "rope_drag_linear")
    problem = FitProblem([e], as_parameters(names, [e]))
    u = minimize(problem, problem.parameters.initial())[0].u
    finer = sb.Refinement(finer=lambda: [made(40, recording, 1.3)])
    assert set(missing_loss(problem, u, (problem, u))) == set(names)
    assert missing_loss(problem, u, (problem, u), refinement=finer) == {}


def test_what_stands_still_loses_nothing() -> None:
    """Static experiments beside a motion are left alone, and a fit of them only is not tested."""
    scene = rope(drag_linear=0.01)
    hangs = sb.equilibrium(scene).positions[AT]
    rest = sb.Experiment(
        scene=scene,
        recording=sb.Recording(positions=hangs[None] + 1e-3, times=[0.0], name="rest"),
        markers=[sb.on_particle(i) for i in AT],
        solver=SOLVER,
        sigma=SIGMA,
        static=True,
    )
    alone = fitted(rest, "rope_EI")
    assert "energy" not in alone["rope_EI"].words
    both = fitted([rest, fall(scene, drag_linear=0.005, bend_damping=0.003)], "rope_EI", "rope_drag_linear")
    assert "fall loses energy" in both["rope_EI"].words


def two(first: float, second: float, held: float) -> list[sb.Experiment]:
    """Two falls with bend damping; the model of the first has none, that of the second holds a given one."""
    models = rope(drag_linear=0.01), rope(drag_linear=0.01, bend_damping=held)
    one, other = (fall(m, drag_linear=0.005, bend_damping=d) for m, d in zip(models, (first, second), strict=True))
    return [one, replace(other, name="again")]


def test_motions_that_share_a_parameter_lack_a_loss_together_or_not_at_all() -> None:
    """Where one asks for more of it and the other for less, something else is wrong, such as a loss that is given. Each
    is judged apart too."""
    e = two(0.003, 0.002, 0.006)
    shared = fitted(e, "rope_EI", "rope_drag_linear")
    assert all("the given rope_bend_damping is too large" in one.words for one in shared.result.estimates)
    assert not any("energy" in one.words for one in shared.result.estimates)
    private = {name: {"private": True} for name in ("rope_EI", "rope_drag_linear")}
    apart = sb.fit(e, parameters=private, profiles=False, beginnings=False)
    assert "fall loses energy" in apart["rope_EI[fall]"].words
    assert "the given rope_bend_damping is too large" in apart["rope_EI[again]"].words


def shaken(model: dict[str, float], EI: float = 2e-3, **given: float) -> sb.Experiment:
    """A rope that hangs from a recorded hand, whose noise the fit corrects."""
    times = np.arange(61) / 100
    hand = 0.03 * np.minimum(times / 0.2, 1.0)[:, None] * np.sin(np.outer(2 * np.pi * times, (1.4, 2.1, 1.1)))
    hand -= hand[0]

    def hung(motion: np.ndarray, losses: dict[str, float]) -> sb.Scene:
        scene, line = sb.Scene("rope"), [[0, 0, 0], [0, 0, -0.4]]
        made = sb.add_rope(scene, "rope", points=line, segments=8, density=0.05, EI=EI, **losses)
        scene.follow(made.particles[:1], times, motion[:, None], ["hand"])
        return scene

    true = sb.simulate(hung(hand, given), times, SOLVER).positions[:, AT]
    positions = np.concatenate([hand[:, None], true], axis=1)
    positions += SIGMA * np.random.default_rng(0).standard_normal(positions.shape)
    names = ("hand", *(f"m{i}" for i in AT))
    recording = sb.Recording(positions=positions, times=times, markers=names, name="shaken")
    scene = hung(positions[:, 0], model)
    at = [None, *(sb.on_particle(int(scene.ropes["rope"].particles[i])) for i in AT)]
    return sb.Experiment(scene=scene, recording=recording, markers=at, solver=SOLVER, sigma=SIGMA, driven_sigma=SIGMA)


def test_corrected_driven_markers_do_not_hide_a_missing_loss() -> None:
    """What corrections of the hand could take up of a loss is no evidence of it; the rest is."""
    lacking = fitted(shaken({"drag_linear": 0.005}, drag_linear=0.005, bend_damping=0.003), "rope_EI")
    assert lacking["rope_EI"].verdict == "doubtful" and "shaken loses energy" in lacking["rope_EI"].words
    whole = {"drag_linear": 0.005, "bend_damping": 0.003}
    assert fitted(shaken(whole, **whole), "rope_EI")["rope_EI"].verdict == "identified"


def test_its_simulation_is_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    e = fall(rope(drag_linear=0.005), drag_linear=0.005)
    with_it = fitted(e, "rope_EI").result
    monkeypatch.setattr("sheetbend.fitting.conclusion.missing_loss", lambda *given: {})
    without = fitted(e, "rope_EI").result
    assert with_it.judging == (without.judging[0] + 2, without.judging[1] + 1)  # of the given drag, and of all losses
    assert f"more simulations, for intervals and checks: {with_it.judging[0]}, " in with_it.report()


def test_noise_is_hardly_ever_taken_for_a_loss() -> None:
    """White and correlated (0.8) residuals of a right model: at most 1 of 100 each."""
    times = np.arange(151) / 100
    scene, places = rope(drag_linear=0.005), [sb.on_particle(i) for i in AT]
    x = sb.simulate(scene, times, SOLVER).positions[:, AT]
    e = sb.Experiment(scene=scene, recording=sb.Recording(positions=x, times=times), markers=places, solver=SOLVER)
    problem = FitProblem([e], as_parameters(["rope_EI", "rope_drag_linear"], [e]))
    u = problem.parameters.initial()
    J, column, layout = problem.evaluate(u)[2], of_more_loss(problem, u), problem.rows_layout()
    assert column is not None
    q, _ = np.linalg.qr(J)
    every, noise = np.ones(len(column), dtype=bool), np.random.default_rng(0)
    for rho in (0.0, 0.8):
        found = []
        for _ in range(100):
            errors = noise.standard_normal(x.shape)
            for k in range(1, len(errors)):
                errors[k] = rho * errors[k - 1] + np.sqrt(1 - rho**2) * errors[k]
            left = errors.ravel() - q @ (q.T @ errors.ravel())
            asked = asked_for(left, J, column, every, layout)
            found.append((1.0, 0.0) if asked is None else (asked.chance, asked.explained))
        assert np.mean([chance < 0.05 for chance, _ in found]) < 0.1
        assert sum(chance < LEVEL and explained > EXPLAINS for chance, explained in found) <= 1
