"""Forces and winds over time that nobody measured: their modes, their prior, and fits that find them."""

from __future__ import annotations

import math
import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any, Literal

import numpy as np
import pytest
import sheetbend as sb
import tomli_w
from commands import run
from sheetbend import pesto
from sheetbend.cli.figures import figure_files
from sheetbend.config import load
from sheetbend.config.values import with_values
from sheetbend.experiment.wanted import as_parameters
from sheetbend.minimum.progress import Progress
from sheetbend.objects.over_time import modes_of_times
from sheetbend.page.of_fit import result_page
from sheetbend.problem.problem import FitProblem
from sheetbend.problem.smooth import with_fields
from sheetbend.result.bootstrap import Bootstrap, BootstrapInterval
from sheetbend.statistics.intervals import NORMAL

NOISE, PUSH = 5e-4, {"scale": 0.02, "spacing": 0.05, "duration": 0.5}
TIMES, SOLVER = np.arange(31) / 60, sb.Solver(h=1 / 300)
ALONE: dict[str, Any] = {"refine": False, "profiles": False, "beginnings": False}


def hung(unknown: bool = True, **more: Any) -> sb.Scene:
    """A clamped rope that swings down, and a force on its sixth node."""
    own = {"density": 0.05, "EI": 1e-3, "bend_damping": 0.02, "drag_linear": 0.02, "clamp_start": (1.0, 0.0, 0.0)}
    scene = sb.rope(0.4, 10, pinned=(), **own)
    if unknown:
        sb.add_unknown_force(scene, [6], **(PUSH | more))
    return scene


def course(scene: sb.Scene, seed: int, size: float = 0.02, length: float = 0.08) -> tuple[dict[str, float], np.ndarray]:
    """Values of the modes drawn from the prior, and the force (knots, 3) that they make."""
    (own,) = scene.over_time.values()
    q = own.deviations(size, length) * np.random.default_rng(seed).standard_normal(len(own.modes))
    return dict(zip(own.modes, q, strict=True)), (own.shapes @ q).reshape(-1, 3)


def seen(seed: int, name: str = "swing") -> tuple[sb.Experiment, np.ndarray]:
    """An experiment with a force drawn from the prior, and the force."""
    values, truth = course(hung(), seed)
    x = sb.simulate(hung(), TIMES, SOLVER, values=values).positions
    x = x + NOISE * np.random.default_rng(seed).standard_normal(x.shape)
    places, recording = [sb.on_particle(i) for i in range(11)], sb.Recording(x, TIMES, name=name)
    return sb.Experiment(scene=hung(), recording=recording, markers=places, solver=SOLVER, sigma=NOISE), truth


def test_modes_are_waves_with_a_prior_of_the_given_size_and_length() -> None:
    """In one direction the correlation of Matern's field is (1 + r/l) exp(-r/l), far from the ends."""
    spacing = 0.01
    values, shapes = modes_of_times(200, spacing)
    assert values[:5] == pytest.approx((np.arange(5) * np.pi / (199 * spacing)) ** 2, rel=1e-3, abs=1e-6)
    assert shapes[:, 0] == pytest.approx(np.ones(200))
    scene = hung(spacing=0.0026)
    own = scene.over_time["push"]
    covariance = (own.shapes * own.deviations(0.3, 0.02) ** 2) @ own.shapes.T
    x = slice(0, None, 3)
    assert np.mean(np.diag(covariance)[x][1:-1]) == pytest.approx(0.09, rel=0.02)
    assert np.abs(covariance[x, 1::3]).max() == 0.0
    r = 0.0026 * np.arange(20)
    found = covariance[x, x][96, 96:116] / covariance[x, x][96, 96]
    assert found == pytest.approx((1 + r / 0.02) * np.exp(-r / 0.02), abs=0.02)


def test_a_force_of_modes_is_the_force_at_its_knots() -> None:
    scene = hung()
    values, force = course(scene, 1)
    given = hung(unknown=False)
    given.add_force([6], force[:, None], scene.over_time["push"].times)
    plain = sb.simulate(given, TIMES, SOLVER).positions
    assert sb.simulate(scene, TIMES, SOLVER, values=values).positions == pytest.approx(plain, abs=1e-12)
    assert np.abs(sb.simulate(scene, TIMES, SOLVER).positions - plain).max() > 0.01


def test_a_force_goes_beside_given_ones_with_other_knots() -> None:
    times, wave = np.array([0.0, 0.13, 0.31]), np.array([[0.0, 0.01, 0.0], [0.0, -0.02, 0.01], [0.0, 0.0, 0.02]])
    scene, sum_of_both = hung(unknown=False), hung(unknown=False)
    scene.add_force([6, 9], np.stack([wave, -wave], axis=1), times)
    own = sb.add_unknown_force(scene, [6], **PUSH)
    values, force = course(scene, 2)
    knots = np.union1d(times, own.times)
    at = [
        np.stack([np.interp(knots, t, f[:, k]) for k in range(3)], axis=1)
        for t, f in ((times, wave), (own.times, force))
    ]
    sum_of_both.add_force([6, 9], np.stack([at[0] + at[1], -at[0]], axis=1), knots)
    plain = sb.simulate(sum_of_both, TIMES, SOLVER).positions
    assert sb.simulate(scene, TIMES, SOLVER, values=values).positions == pytest.approx(plain, abs=1e-12)
    later = hung(unknown=False)
    sb.add_unknown_force(later, [6], **PUSH)
    later.add_force([9], -wave[:, None], times)
    later.add_force([4], [0.0, 0.0, 0.05])  # of any time
    sum_of_both = hung(unknown=False)
    loads = np.stack([at[1], -at[0], np.tile([0.0, 0.0, 0.05], (len(knots), 1))], axis=1)
    sum_of_both.add_force([6, 9, 4], loads, knots)
    plain = sb.simulate(sum_of_both, TIMES, SOLVER).positions
    assert sb.simulate(later, TIMES, SOLVER, values=values).positions == pytest.approx(plain, abs=1e-12)


def test_a_force_along_a_rope_and_on_a_body_is_spread_as_it_should_be() -> None:
    scene, given = hung(unknown=False), hung(unknown=False)
    own = sb.add_unknown_force(scene, scene.ropes["rope"], **PUSH)
    values, force = course(scene, 3)
    share = np.full(11, 0.1)
    share[[0, -1]] = 0.05
    given.add_force(range(11), force[:, None] * share[:, None], own.times)
    plain = sb.simulate(given, TIMES, SOLVER).positions
    assert sb.simulate(scene, TIMES, SOLVER, values=values).positions == pytest.approx(plain, abs=1e-12)
    moved = []
    for unknown in (True, False):
        scene = sb.Scene()
        box = scene.add_body("box", mass=0.1, inertia=[1e-4, 1e-4, 1.5e-4], at=(0.0, 0.0, 1.0))
        point = box.point((0.05, 0.0, 0.02), name="touch")
        if unknown:
            sb.add_unknown_force(scene, point, **PUSH)
        else:
            scene.add_force(point, force, own.times)
        moved.append(sb.simulate(scene, TIMES, SOLVER, values=values if unknown else {}).positions)
    assert moved[0] == pytest.approx(moved[1], abs=1e-12)


def test_an_unknown_wind_is_added_to_the_constant_one() -> None:
    mesh = sb.mesh.grid(0.3, 0.2, 3, 2, pattern="one_way")

    def flag(**air: Any) -> sb.Scene:
        scene = sb.Scene("flag")
        given = {"density": 0.15, "warp": 20.0, "shear": 5.0, "bending": 2e-4, "membrane_damping": 0.01}
        cloth = sb.add_cloth(scene, mesh, name="cloth", **given)
        scene.pin(cloth.particles[mesh.sets["left"]])
        scene.add_air(mesh.triangles, 0.6, 0.05, **air)
        return scene

    scene, newton = flag(wind=(0.0, 2.0, 0.0)), sb.Solver(h=1 / 120, method="newton")
    own = sb.add_unknown_wind(scene, scale=1.0, spacing=0.1, duration=0.5)
    values, wind = course(scene, 4, size=0.5, length=0.1)
    given = flag(wind=wind + np.array([0.0, 2.0, 0.0]), times=own.times)
    plain = sb.simulate(given, TIMES, newton).positions
    assert sb.simulate(scene, TIMES, newton, values=values).positions == pytest.approx(plain, abs=1e-10)
    faster = sb.simulate(scene, TIMES, newton, values={**values, "wind_y": 3.0}).positions
    assert np.abs(faster - plain).max() > 1e-3
    e = sb.Experiment(
        scene=scene,
        recording=sb.Recording(plain, TIMES, name="flag"),
        solver=newton,
        markers=[sb.on_particle(i) for i in range(plain.shape[1])],
    )
    _matches_differences(FitProblem([e], as_parameters(["cloth_bending", *own.modes[:7]], [e])))
    with pytest.raises(sb.SceneError, match=r"wind: changes over given times already"):
        sb.add_unknown_wind(flag(wind=wind, times=own.times), scale=1.0, spacing=0.1, duration=0.5)
    without = sb.rope(0.4, 4, density=0.05, EI=1e-3, clamp_start=(1.0, 0.0, 0.0))
    with pytest.raises(sb.SceneError, match=r"wind: blows on nothing"):
        sb.add_unknown_wind(without, scale=1.0, spacing=0.1, duration=0.5)


def _matches_differences(problem: FitProblem) -> None:
    u = problem.parameters.initial() + 0.01
    _, _, J = problem.evaluate(u)
    for k in range(len(u)):
        step = 1e-5 * np.eye(len(u))[k]
        after, before = (problem.evaluate(u + s * step, jacobian=False)[1] for s in (1, -1))
        assert (after - before) / 2e-5 == pytest.approx(J[:, k], abs=1e-5 * np.abs(J[:, k]).max())


def test_derivatives_with_respect_to_modes() -> None:
    """Of the residuals against differences, of a rollout against complex steps, and both against each other."""
    e, _ = seen(0)
    modes = e.scene.over_time["push"].modes
    problem = FitProblem([e], as_parameters(["rope_EI", *modes[3:9]], [e]))
    _matches_differences(problem)
    u = problem.parameters.initial() + 0.01
    _, r, J = problem.evaluate(u)
    rollout = sb.rollout(e.scene, TIMES, SOLVER, values=problem.parameters.to_physical(u))
    bar = np.zeros_like(rollout.positions)
    bar[:, list(e.compared)] = r.reshape(len(TIMES), -1, 3) / NOISE
    gradient = rollout.gradient(bar).quantities
    assert [gradient[mode] for mode in modes[3:9]] == pytest.approx((J.T @ r)[1:], rel=1e-8)
    report = sb.check_gradients(hung(), TIMES[:7], SOLVER, values=course(hung(), 0)[0])
    assert report.passed and set(modes) <= {row.name for row in report.rows}


def test_a_force_is_found_beside_the_stiffness() -> None:
    e, truth = seen(5)
    fit = sb.fit(e, parameters={"rope_EI": {"initial": 2e-3}, "rope_bend_damping": {}}, **ALONE)
    (found,) = fit.result.over_time
    inside = np.abs(np.array(found.values) - truth) < np.array(found.half_widths)
    assert inside.sum() >= 0.88 * truth.size and found.recording == "swing"
    assert np.median(found.half_widths) < 0.5 * np.std(truth)
    estimate = fit["rope_EI"]
    assert estimate.verdict == "identified" and estimate.lower is not None and estimate.upper is not None
    assert estimate.lower < 1e-3 < estimate.upper
    assert found.size_lower is not None and found.size_upper is not None
    assert found.size_lower < 0.02 < found.size_upper and np.mean(found.left) < 0.3
    alone = FitProblem([e], as_parameters(["rope_EI"], [e]))
    _, _, J = alone.evaluate(alone.parameters.initial())
    assert estimate.half_width is not None
    assert estimate.half_width > 1.2 * 1e-3 * 2 / np.linalg.norm(J)  # that of a fit which knows the force
    report = fit.report()
    assert "Unknown inputs over time" in report and "Force push in swing (N)" in report and "push_x_1" not in report
    assert sb.FitResult.from_dict(fit.result.to_dict()).over_time == fit.result.over_time
    _leaves_modes_out(fit.result)
    panels = sb.plot.over_time(found)
    assert panels[1].lines[1].get_ydata() == pytest.approx(np.array(found.values)[:, 1])
    plain = sb.fit(
        hung(unknown=False), e.recording, ["rope_EI"], markers=e.markers, solver=SOLVER, sigma=NOISE, **ALONE
    )
    assert plain.result.misfit is not None and plain.result.misfit.reduced_chi_square > 30.0
    assert any("misses" in words for words in plain.result.warnings)


@pytest.mark.parametrize("steps", [1, 3])
def test_ctrl_c_while_the_size_is_sought_keeps_the_point_reached_last(steps: int) -> None:
    """It comes after so many steps of the first walk, and no search follows."""
    e, _ = seen(5)
    reached: list[Progress] = []

    def press(progress: Progress) -> None:
        reached.append(progress)
        if len(reached) == steps:
            raise KeyboardInterrupt

    fit = sb.fit(e, parameters={"rope_EI": {"initial": 2e-3}}, progress=press, windows=(), **ALONE)
    assert fit.interrupted and not fit.result.converged and len(reached) == steps
    assert math.log(fit["rope_EI"].value) == pytest.approx(reached[-1].u[0])
    (found,) = fit.result.over_time
    assert (found.size_lower is None, found.size_upper) == (False, None)
    assert ("open" in fit.report()) and fit.result.first_cost == pytest.approx(reached[-1].cost, rel=1e-6)
    assert "interrupted before the search: sizes and lengths of smooth priors" in fit.report()


def test_a_wrong_drag_beside_an_unknown_force_is_named() -> None:
    """Three times the given one. The warning named 33 modes of the force, which no table shows."""
    values, _ = course(hung(), 0)
    x = sb.simulate(hung(), TIMES, sb.Solver(h=1 / 2400), values=values | {"rope_drag_linear": 0.06}).positions
    x = x + NOISE * np.random.default_rng(0).standard_normal(x.shape)
    places, recording = [sb.on_particle(i) for i in range(11)], sb.Recording(x, TIMES, name="swing")
    e = sb.Experiment(scene=hung(), recording=recording, markers=places, solver=SOLVER, sigma=NOISE)
    found = sb.fit(e, parameters={"rope_EI": {"initial": 2e-3}, "rope_bend_damping": {}}, **ALONE).result
    assert found["rope_EI"].verdict == "doubtful" and "given rope_drag_linear is too small" in found["rope_EI"].words
    assert found.warnings[0].startswith("doubtful: rope_EI, rope_bend_damping, push (see")


def _leaves_modes_out(result: sb.FitResult) -> None:
    """Tables of several starts and of a bootstrap, and the page, where every number has a value."""
    intervals = tuple(BootstrapInterval(name=e.name, lower=0.0, upper=1.0) for e in result.estimates)
    drawn = Bootstrap(drawn="12 stretches", draws=50, lost=0, intervals=intervals)
    starts = tuple(replace(start, group=1, raced=1.0, first=start.values) for start in result.starts) * 2
    whole = replace(result, bootstrap=drawn, starts=starts)
    assert "push_x_1" not in whole.report() and "12 stretches" in whole.report()
    page = result_page(whole, [], "pushed").partition('id="fit"')[0]
    assert "Unknown inputs over time" in page and "push_x_1" not in page


def test_each_recording_has_a_force_of_its_own() -> None:
    (first, one), (second, two) = seen(6, "first"), seen(7, "second")
    prior = {"push": sb.Smooth(size=0.02, length=0.08)}
    fit = sb.fit([first, second], parameters=["rope_EI"], smooth=prior, **ALONE)
    assert [found.recording for found in fit.result.over_time] == ["first", "second"]
    for found, truth in zip(fit.result.over_time, (one, two), strict=True):
        inside = np.abs(np.array(found.values) - truth) < np.array(found.half_widths)
        assert inside.mean() > 0.88 and (found.size, found.size_lower) == (0.02, None)
        assert found.modes[0] == f"push_x_1[{found.recording}]"
    plan = sb.identify([first, second], parameters=["rope_EI"], smooth=prior, suggest=False)
    assert next(e for e in plan.estimates if e.name == "rope_EI").half_width == pytest.approx(
        fit["rope_EI"].half_width, rel=0.5
    )


def test_a_bootstrap_has_no_doubt_of_modes() -> None:
    """A draw without the stretches in which a force acts tells nothing of it: twelve modes were named."""
    prior = {"push": sb.Smooth(size=0.02, length=0.08)}
    fit = sb.fit(
        [seen(6, "first")[0], seen(7, "second")[0]], parameters=["rope_EI"], smooth=prior, bootstrap=50, **ALONE
    )
    assert fit.result.bootstrap is not None and not any("push" in words for words in fit.result.warnings)


def test_a_plan_tells_what_is_left_of_a_force() -> None:
    e, _ = seen(0)
    prior = {"push": sb.Smooth(size=0.02, length=0.08)}
    plan = sb.identify(e, parameters=["rope_EI"], smooth=prior)
    (push,) = plan.inputs
    fit = sb.fit(e, parameters=["rope_EI"], smooth=prior, **ALONE)
    (found,) = fit.result.over_time
    weights = np.full(11, 0.1)
    weights[[0, -1]] = 0.05
    mean = np.sqrt(weights @ np.mean(np.square(found.half_widths), axis=1))
    assert push.half_width == pytest.approx(mean, rel=0.15) and push.prior == pytest.approx(NORMAL * 0.02)
    assert "Unknown inputs over time" in plan.report() and "push_x_1" not in plan.report()
    half = {v.name: v.half_widths for v in plan.variants}["the same recordings once more"]
    known = plan["rope_EI"].half_width
    assert known is not None and half["rope_EI"] == pytest.approx(known / np.sqrt(2), rel=0.1)  # and another force


def test_a_force_is_zero_in_a_recording_that_is_only_predicted() -> None:
    (first, _), (second, truth) = seen(6, "first"), seen(7, "second")
    for predict in ("mean", "window"):
        fit = sb.fit([first, replace(second, predict=predict)], parameters=["rope_EI"], **ALONE)
        values = fit.values_of(second)
        at = np.array([values[mode] for mode in second.scene.over_time["push"].modes])
        force = (second.scene.over_time["push"].shapes @ at).reshape(-1, 3)
        if predict == "mean":
            assert not force.any() and "push" not in [given.name[:4] for given in fit.result.given]
        else:
            assert np.sqrt(np.mean((force - truth)[2:-1] ** 2)) < 0.4 * np.std(truth)


@pytest.mark.parametrize(("count", "predict"), [(1, "mean"), (2, "mean"), (1, "window")])
def test_a_force_may_be_in_predicted_recordings_alone(count: int, predict: Literal["mean", "window"]) -> None:
    """The fit ended in StopIteration or KeyError."""
    first, _ = seen(6, "first")
    predicted = [replace(e, predict=predict) for e, _ in (seen(7, "second"), seen(8, "third"))][:count]
    fit = sb.fit([replace(first, scene=hung(unknown=False)), *predicted], parameters=["rope_EI"], **ALONE)
    assert fit.result.over_time == () and [e.name for e in fit.result.estimates] == ["rope_EI"]
    values = fit.values_of(predicted[-1])
    assert any(values[mode] for mode in hung().over_time["push"].modes) == (predict == "window")


def test_what_makes_no_input_is_refused() -> None:
    scene = hung(unknown=False)
    for more, words in (
        ({"scale": -1.0}, r"push.scale: must be a positive number"),
        ({"spacing": 0.0}, r"push.spacing: must be a positive number"),
        ({"spacing": 0.6}, r"push.spacing: is longer than the motion.*at most the 0.5 s"),
        ({"spacing": 1e-3}, r"push.spacing: makes more than 200 knots.*at least 0.0025"),
        ({"duration": float("nan")}, r"push.duration: must be a positive number"),
    ):
        with pytest.raises(sb.SceneError, match=words):
            sb.add_unknown_force(scene, [6], **(PUSH | more))
    with pytest.raises(sb.SceneError, match=r"push.particles"):
        sb.add_unknown_force(scene, [99], **PUSH)
    with pytest.raises(sb.SceneError, match=r"push.particles: must be some, each once"):
        sb.add_unknown_force(scene, [6, 6], **PUSH)
    with pytest.raises(sb.SceneError, match=r"push.particles: are a rope of another scene"):
        sb.add_unknown_force(scene, hung().ropes["rope"], **PUSH)
    assert not scene.over_time and not any(name.startswith("push") for name in scene.quantities)
    with pytest.raises(sb.SceneError, match=r"push.name: is taken"):
        sb.add_unknown_force(hung(), [2], **PUSH)
    frozen = hung()
    assert frozen.compiled
    with pytest.raises(sb.SceneError, match=r"is frozen"):
        sb.add_unknown_force(frozen, [2], name="other", **PUSH)


def test_an_input_that_does_not_suit_its_recording_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    e, _ = seen(0)

    def refused(scene: sb.Scene, **more: Any) -> str:
        given = {"recording": e.recording, "markers": e.markers, "solver": SOLVER, "sigma": NOISE} | more
        own = sb.Experiment(scene=scene, **given)
        with pytest.raises(sb.InputError) as found:
            with_fields(as_parameters(["rope_EI"], [own]), [own], {})
        return str(found.value)

    assert "push.duration: ends before the recording" in refused(hung(duration=0.3))
    assert "push.spacing: is longer than the recording" in refused(hung(spacing=0.3), fit=(0.0, 0.2))
    assert "swing.static: has no time for the unknown force" in refused(hung(), static=True)
    many = [replace(e, name=f"e{k}") for k in range(20)]
    with pytest.raises(sb.InputError, match=r"scene: has unknown inputs over time"):
        sb.fit_many(many, ["rope_EI"])
    monkeypatch.setitem(sys.modules, "pypesto", ModuleType("pypesto"))
    with pytest.raises(sb.InputError, match=r"scene: has unknown inputs over time"):
        pesto.problem(e, parameters=["rope_EI"])


def test_a_configuration_fits_a_force(tmp_path: Path) -> None:
    e, truth = seen(8)
    e.recording.save(tmp_path / "swing.npz")
    rope = {"name": "rope", "length": 0.4, "segments": 10, "density": 0.05, "EI": 1e-3, "bend_damping": 0.02}
    rope |= {"drag_linear": 0.02, "clamp_start": [1.0, 0.0, 0.0]}
    push = {"particles": ["rope:6"], "scale": 0.02, "spacing": 0.05}
    config: dict[str, Any] = {
        "experiment": {"name": "pushed"},
        "solver": {"h": 1 / 300},
        "scene": {"rope": [rope], "unknown_force": [push]},
        "marker": [{"marker": f"m{k}", "particle": f"rope:{k}"} for k in range(11)],
        "recording": [{"file": "swing.npz", "sigma": NOISE}],
        "parameters": {"rope_EI": {}},
        "smooth": {"push": {"length": 0.08}},
        "fit": {"windows": [], "halve_step": False, "double_segments": False, "profiles": False},
    }
    (tmp_path / "pushed.toml").write_text(tomli_w.dumps(config))
    study = load(tmp_path / "pushed.toml")
    fit = sb.fit(study.experiments, parameters=study.parameters, beginnings=False, **study.options)
    (found,) = fit.result.over_time
    assert (np.abs(np.array(found.values) - truth) < np.array(found.half_widths)).mean() > 0.88
    assert found.length == 0.08 and "swing_push.png" in figure_files(study.experiments, study.config)
    back = with_values(study.config, fit.values)
    assert back.recording[0].values["push_x_1"] == fit.values["push_x_1"]
    ended = run("fit", tmp_path / "pushed.toml", "--output", tmp_path / "out")
    assert ended.exit_code == 0, ended.output
    assert {"swing_push.png", "report.html", "fitted.toml"} <= {file.name for file in (tmp_path / "out").iterdir()}
    again = sb.FitResult.load(tmp_path / "out" / "fit.json").over_time[0]
    assert np.array(again.values) == pytest.approx(np.array(found.values), abs=0.1 * np.median(found.half_widths))
    twice = config | {"scene": config["scene"] | {"unknown_force": [push, push]}}
    (tmp_path / "twice.toml").write_text(tomli_w.dumps(twice))
    with pytest.raises(sb.ConfigError, match=r"^scene.unknown_force\[1\].name: is taken"):
        load(tmp_path / "twice.toml")
    for changes, words in (
        ({"rope": "rope"}, "must act on one of particles, rope and body"),
        ({"particles": ["rope:77"]}, r"scene.unknown_force\[0\].particles"),
        ({"spacing": 3.0}, r"scene.unknown_force\[0\].spacing: is longer than the motion"),
        ({"scale": -1.0}, r"scene.unknown_force\[0\].scale"),
    ):
        broken = config | {"scene": config["scene"] | {"unknown_force": [push | changes]}}
        (tmp_path / "broken.toml").write_text(tomli_w.dumps(broken))
        with pytest.raises(sb.ConfigError, match=words):
            load(tmp_path / "broken.toml")
