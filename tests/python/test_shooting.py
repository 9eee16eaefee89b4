"""Motions that are shot in windows: agreement with one unbroken run, derivatives, and what the model loses."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.config import load
from sheetbend.doubts.missing_loss import missing_loss
from sheetbend.doubts.other_losses import other_losses
from sheetbend.doubts.unbroken import unbroken
from sheetbend.experiment.cut import borders
from sheetbend.experiment.wanted import as_parameters
from sheetbend.minimum import lifted_starts
from sheetbend.minimum.continuity import joined, with_window
from sheetbend.minimum.optimizers import walked
from sheetbend.minimum.progress import Progress
from sheetbend.problem.journal import Journal
from sheetbend.problem.lifted import Lifted
from sheetbend.problem.lifted_window import LiftedWindow, Rows, Seen
from sheetbend.problem.parts import expanded_to
from sheetbend.problem.problem import FitProblem
from sheetbend.report.report_shot import shot_motions
from sheetbend.result.shot import ShotMotion
from sheetbend.statistics.chain import Chain, Gap, Window

RATE, NOISE = 50.0, 2e-4
WANTED = ("arm_inertia", "arm_hinge_viscosity", "arm_angle", "arm_rate")


def pendulum(inertia: float = 0.003, viscosity: float = 2e-4) -> tuple[sb.Scene, sb.Arm]:
    scene = sb.Scene()
    arm = sb.add_arm(
        scene, mass=0.14, first_moment=0.016, inertia=inertia, length=0.25, viscosity=viscosity, angle=1.0, rate=0.5
    )
    return scene, arm


def swing(stop: float = 2.0, kicks: float = 0.0, seed: int = 0, **fields: object) -> sb.Experiment:
    """An arm that swings, with noise; with kicks (rad/s) of its rate that the model does not know."""
    rng, times = np.random.default_rng(seed), np.arange(round(stop * RATE) + 1) / RATE
    scene, arm = pendulum()
    blank = sb.Recording(np.zeros((len(times), 1, 3)), times, markers=("m",), name="swing")
    markers = {"m": arm.place(0.2)}
    plain = sb.Experiment(scene=scene, recording=blank, markers=markers, solver=sb.Solver(h=1 / 400), axes="xz")
    truth = replace(plain, solver=sb.Solver(h=1 / 3200))
    problem = FitProblem([truth], as_parameters(list(WANTED), [truth]))
    u, x, begun = problem.parameters.initial(), np.zeros((len(times), 1, 3)), 0
    for stop_at in [*range(10, len(times), 10), len(times)] if kicks else [len(times)]:
        x[begun:stop_at] = problem.simulate(u)[0][: stop_at - begun]
        ahead = problem.simulate(u)[0][stop_at - begun :, 0] if stop_at < len(times) else x[-1:, 0]
        angle = np.unwrap(np.arctan2(ahead[:, 0], -ahead[:, 2]))
        rate = (-3 * angle[0] + 4 * angle[1] - angle[2]) * RATE / 2 if len(angle) > 2 else 0.0
        u = np.array([*u[:2], angle[0], rate + kicks * rng.standard_normal()])
        begun = stop_at
    x[:, 0, [0, 2]] += NOISE * rng.standard_normal((len(times), 2))
    start, _ = pendulum(0.0033, 1e-4)
    recording = sb.Recording(x, times, markers=("m",), name="swing")
    return replace(plain, scene=start, recording=recording, sigma=NOISE, **fields)  # type: ignore[arg-type]


def seen_at(
    scene: sb.Scene, place: object, times: np.ndarray, solver: sb.Solver, any_of: str = "arm_inertia"
) -> sb.Experiment:
    """What a marker at a place of a scene of arms shows without noise."""
    recording = sb.Recording(np.zeros((len(times), 1, 3)), times, markers=("m",), name="swing")
    e = sb.Experiment(scene=scene, recording=recording, markers={"m": place}, solver=solver, axes="xz")  # type: ignore[dict-item]
    problem = FitProblem([e], as_parameters([any_of], [e]))
    return replace(e, recording=replace(recording, positions=problem.simulate(problem.parameters.initial())[0]))


def cut(e: sb.Experiment, loss: float) -> FitProblem:
    """The problem of an experiment in windows of 0.4 s with states off the best ones."""
    e = with_window(replace(e, shooting=sb.Shooting(0.4, loss)))
    states = tuple((1.0 + 0.1 * k, -0.3 * k) for k in range(1, len(borders(e)) - 1))
    e = replace(e, shooting=replace(e.shooting, states=states))  # type: ignore[type-var]
    return FitProblem([e], as_parameters(list(WANTED), [e]))


def counted_windows(monkeypatch: pytest.MonkeyPatch) -> list[bool]:
    """Grows with every evaluation of a window: whether it makes derivatives."""
    made: list[bool] = []
    at = LiftedWindow.at

    def counted(self: LiftedWindow, u: np.ndarray, state: np.ndarray, other: Seen | None = None) -> Seen | None:
        made.append(other is None)
        return at(self, u, state, other)

    monkeypatch.setattr(LiftedWindow, "at", counted)
    return made


def test_a_chain_is_solved_as_one_dense_system() -> None:
    rng = np.random.default_rng(3)
    q, p, count = 3, 2, 5
    own = [0 if k == 0 else q for k in range(count)]
    windows = [Window(rng.normal(size=(7, n)), rng.normal(size=(7, p)), rng.normal(size=7)) for n in own]
    gaps = [
        Gap(rng.normal(size=(4, n)), rng.normal(size=(4, q)), rng.normal(size=(4, p)), rng.normal(size=4)).times(1e6)
        for n in own[:-1]
    ]
    chain = Chain([w.compressed() for w in windows], gaps)
    first = np.cumsum([0, 0, *[q] * (count - 1)])
    rows = []
    for k, w in enumerate(windows):
        row = np.zeros((7, first[-1] + p + 1))
        row[:, first[k] : first[k + 1]] = w.state
        row[:, -p - 1 :] = np.column_stack([w.border, w.rest])
        rows.append(row)
    for k, g in enumerate(gaps):
        row = np.zeros((4, first[-1] + p + 1))
        row[:, first[k] : first[k + 1]], row[:, first[k + 1] : first[k + 2]] = g.before, g.behind
        row[:, -p - 1 :] = np.column_stack([g.border, g.rest])
        rows.append(row)
    M = np.vstack(rows)
    A, B, r = M[:, : first[-1]], M[:, first[-1] : -1], M[:, -1]
    step = rng.normal(size=p)
    best = np.linalg.lstsq(A, -(r + B @ step), rcond=None)[0]
    assert np.concatenate(chain.states(step)) == pytest.approx(best, rel=1e-6, abs=1e-9)
    assert np.concatenate(chain.along()) == pytest.approx(-np.linalg.lstsq(A, B, rcond=None)[0], rel=1e-6, abs=1e-9)
    left = np.sum((r + A @ np.linalg.lstsq(A, -r, rcond=None)[0]) ** 2)
    assert chain.rest @ chain.rest == pytest.approx(left, rel=1e-6)
    covariance = np.linalg.inv(A.T @ A)
    for k, (known, cross) in enumerate(chain.covariances()):
        mine, onward = slice(first[k], first[k + 1]), slice(first[k + 1], first[min(k + 2, count)])
        assert known == pytest.approx(covariance[mine, mine], rel=1e-3, abs=1e-9)
        assert cross == pytest.approx(covariance[mine, onward], rel=1e-3, abs=1e-9)
    assert chain.log_size == pytest.approx(0.5 * np.linalg.slogdet(A.T @ A)[1], rel=1e-6)


def test_a_state_that_no_row_feels_has_a_finite_covariance() -> None:
    """It was infinite, and what the states take of the degrees of freedom no number, so a fit ended in an error."""
    rng = np.random.default_rng(4)
    windows = [Window(rng.standard_normal((5, 2)), rng.standard_normal((5, 1)), rng.standard_normal(5)) for _ in "abc"]
    windows[2].state[:, 1] = 0.0
    gaps = [Gap(*rng.standard_normal((2, 2, 2)), rng.standard_normal((2, 1)), rng.standard_normal(2)) for _ in "ab"]
    gaps[1].behind[:, 1] = 0.0
    chain = Chain(windows, gaps)
    assert all(np.isfinite(part).all() for pair in chain.covariances() for part in pair)
    assert chain.states()[2][1] == 0.0


def test_windows_have_the_derivatives_of_their_rows() -> None:
    core = cut(swing(), 1e-3).core
    assert isinstance(core, Lifted)
    window, u = core.motions[0].windows[2], np.array([np.log(0.0032), np.log(1.5e-4), 1.0, 0.5])
    s, step = np.array([0.4, -2.0]), 1e-5
    here = window.at(u, s)
    assert here is not None
    for part in ("data", "start", "end"):
        for k in range(2):
            ends = [getattr(window.at(u, s + sign * step * np.eye(2)[k]), part).value for sign in (1, -1)]
            slope = getattr(here, part).state[:, k]
            assert (ends[0] - ends[1]) / (2 * step) == pytest.approx(slope, rel=1e-5, abs=1e-6 * np.abs(slope).max())
            ends = [getattr(window.at(u + sign * step * np.eye(4)[k], s), part).value for sign in (1, -1)]
            slope = getattr(here, part).border[:, k]
            assert (ends[0] - ends[1]) / (2 * step) == pytest.approx(slope, rel=1e-5, abs=1e-6 * np.abs(slope).max())
        assert not getattr(here, part).border[:, 2:].any()  # the motion's own start does not reach it


def test_the_cost_at_the_best_states_has_the_gradient_that_is_told() -> None:
    problem, u = cut(swing(), 1e-2), np.array([np.log(0.0032), np.log(1.5e-4), 1.0, 0.5])
    ok, r, J = problem.evaluate(u)
    assert ok and len(r) == problem.core.rows > problem.prior_rows[1]
    for k, step in enumerate((1e-4, 1e-3, 1e-4, 1e-4)):
        costs = [problem.cost(u + sign * step * np.eye(4)[k]) for sign in (1, -1)]
        assert (costs[0] - costs[1]) / (2 * step) == pytest.approx(J[:, k] @ r, rel=1e-4)


def test_a_cost_takes_derivatives_of_another_point_only_where_they_hold(monkeypatch: pytest.MonkeyPatch) -> None:
    """And is that of a point with derivatives of its own."""
    made = counted_windows(monkeypatch)
    first, windows = np.array([np.log(0.0032), np.log(1.5e-4), 1.0, 0.5]), 5
    for away, most in ((1e-3, 0), (0.03, windows), (0.1, windows)):
        own, kept = cut(swing(), 1e-2), cut(swing(), 1e-2)
        kept.evaluate(first)
        made.clear()
        cost = kept.cost(first + away)
        assert sum(made) <= most and len(made) > sum(made)
        _, r, _ = own.evaluate(first + away)
        assert 2 * cost == pytest.approx(r @ r, rel=1e-6)


def test_hard_continuity_gives_the_estimate_and_the_intervals_of_one_run() -> None:
    e = swing()
    wanted = list(WANTED)
    plain = sb.fit(e, parameters=wanted, refine=False, beginnings=False, profiles=False)
    shot = sb.fit(
        replace(e, shooting=sb.Shooting(0.4, 1e-6)), parameters=wanted, refine=False, beginnings=False, profiles=False
    )
    for name in wanted:
        a, b = plain[name], shot[name]
        assert a.half_width is not None and b.half_width is not None
        assert abs(a.value - b.value) < 0.005 * a.half_width, name
        assert b.half_width == pytest.approx(a.half_width, rel=1e-3), name
        assert a.verdict == b.verdict
    assert shot.result.rows == plain.result.rows
    assert shot.result.recordings[0].rms == pytest.approx(plain.result.recordings[0].rms, rel=1e-4)
    (motion,) = shot.result.shot
    assert motion.windows == 5 and motion.upper is None and motion.gap < 1e-6


@pytest.mark.parametrize("seed", [1, 4, 9, 10])
def test_first_states_of_a_whirling_double_pendulum_stay_near_its_motion(seed: int) -> None:
    """Where places and velocities were sought together, rates ran off by 1e4 to 1e8 rad/s and never came back."""
    rng, times = np.random.default_rng(seed), np.arange(401) / 200
    start = dict(
        zip(("upper", "lower"), np.reshape(rng.uniform([-3, -3, -15, -20], [3, 3, 15, 20]), (2, 2)).T, strict=True)
    )

    def arms(share: float) -> sb.Experiment:
        scene = sb.Scene()
        given = {name: {"angle": angle, "rate": rate} for name, (angle, rate) in start.items()}
        upper = {"mass": 0.0938, "first_moment": 0.0102 * share, "inertia": 0.00154358, "length": 0.1727}
        first = sb.add_arm(scene, "upper", **upper, **given["upper"])
        lower = {"mass": 0.137596, "first_moment": 0.0161 * share, "inertia": 0.00316 * share, "length": 0.25}
        second = sb.add_arm(scene, "lower", pivot=first, **lower, **given["lower"])
        blank = sb.Recording(np.zeros((len(times), 2, 3)), times, markers=("m1", "m2"), name="whirl")
        places = {"m1": first.place(0.1727), "m2": second.place(0.1168)}
        return sb.Experiment(scene=scene, recording=blank, markers=places, solver=sb.Solver(h=1 / 400), axes="xz")

    names = ["lower_inertia", *(f"{name}_{what}" for name in start for what in ("angle", "rate"))]
    true, e = arms(1.0), arms(1.06)
    problem = FitProblem([true], as_parameters(names, [true]))
    x = problem.simulate(problem.parameters.initial())[0] + 1e-4 * rng.standard_normal((len(times), 2, 3))
    cut = with_window(replace(e, recording=replace(e.recording, positions=x), shooting=0.125))
    wanted = as_parameters(names, [cut])
    ((found,), undone) = lifted_starts.begun([cut], wanted, expanded_to(wanted, [cut]).initial())
    assert isinstance(found.shooting, sb.Shooting) and not undone
    assert np.abs(np.array(found.shooting.states)[:, 1::2]).max() < 40.0


def test_a_window_that_nothing_shows_begins_where_the_one_before_ends() -> None:
    """And the estimates are those of one run that sees as little."""
    e, wanted = swing(), list(WANTED)
    e = replace(e, recording=e.recording.hidden([(0.8, 1.2)]))
    alone = {"refine": False, "beginnings": False, "profiles": False}
    plain = sb.fit(e, parameters=wanted, **alone)  # type: ignore[arg-type]
    shot = sb.fit(replace(e, shooting=sb.Shooting(0.4, 1e-6)), parameters=wanted, **alone)  # type: ignore[arg-type]
    (motion,) = shot.result.shot
    assert motion.windows == 5 and motion.gap < 1e-6 and shot.result.rows == plain.result.rows
    for name in wanted:
        a, b = plain[name], shot[name]
        assert a.half_width is not None and abs(a.value - b.value) < 0.01 * a.half_width, name
        assert b.half_width == pytest.approx(a.half_width, rel=0.01), name


def test_kicks_that_the_model_does_not_know_are_what_it_loses() -> None:
    kicked, options = swing(kicks=0.3, seed=1), {"refine": False, "beginnings": False, "profiles": False}
    soft = sb.fit(replace(kicked, shooting=0.4), parameters=list(WANTED), **options)  # type: ignore[arg-type]
    hard = sb.fit(replace(kicked, shooting=sb.Shooting(0.4, 1e-6)), parameters=list(WANTED), **options)  # type: ignore[arg-type]
    (lost,) = soft.result.shot
    assert lost.lower is not None and lost.upper is not None and lost.upper < 4 * lost.loss
    assert 0.005 < lost.lower < lost.loss < lost.upper  # two kicks of 0.3 rad/s in a window, at 0.15 m, times 0.2 s
    assert lost.lower < lost.gap / lost.length < lost.upper
    e = soft["arm_hinge_viscosity"]
    assert e.lower is not None and e.upper is not None and e.lower < 2e-4 < e.upper
    assert hard.result.recordings[0].rms > 3 * soft.result.recordings[0].rms  # type: ignore[operator]


def test_gaps_are_said_to_hide_a_friction_that_the_model_lacks() -> None:
    """With 1 mN m of dry friction missing, viscosity was twice too large, "identified", since the gaps took it up."""
    told = ShotMotion(name="a", windows=8, length=0.4, numbers=2, loss=5e-4, lower=3e-4, upper=8e-4, gap=1e-4, pace=0.1)
    for lower, hides in ((3e-4, True), (None, True), (0.0, False)):
        section = shot_motions(SimpleNamespace(shot=(replace(told, lower=lower),)))  # type: ignore[arg-type]
        assert ("A friction or drag that the model lacks" in dict(section.notes)["the model loses"]) is hides


@pytest.mark.parametrize(("friction", "toward_x"), [(0.0, 0.0), (1e-3, 0.0), (0.0, 0.4)])
def test_what_gaps_take_up_is_named_from_one_unbroken_motion(friction: float, toward_x: float) -> None:
    """Viscosity was twice too large, "identified", where a dry friction of 1 mN m was missing, and the rate at the
    start 0.2 rad/s too large where gravity was turned by 2.3 degrees."""
    times, rng = np.arange(151) / RATE, np.random.default_rng(0)
    numbers = {"mass": 0.14, "first_moment": 0.016, "inertia": 0.003, "length": 0.25, "angle": 1.0, "rate": 0.5}
    scene = sb.Scene(gravity=(toward_x, 0, -9.8))
    more = {"friction": friction} if friction else {}
    true = seen_at(scene, sb.add_arm(scene, viscosity=2e-4, **numbers, **more).place(0.2), times, sb.Solver(h=1 / 3200))
    x = true.recording.positions + NOISE * rng.standard_normal((len(times), 1, 3))
    model = sb.Scene(gravity=(0, 0, -9.8))
    own = sb.add_arm(model, viscosity=1e-4, **(numbers | {"inertia": 0.0033}))
    e = replace(true, scene=model, recording=replace(true.recording, positions=x), markers={"m": own.place(0.2)})
    e = replace(e, solver=sb.Solver(h=1 / 400), sigma=NOISE, shooting=0.4)
    found = sb.fit(e, parameters=list(WANTED), profiles=False).result
    named = [w for w in found.warnings if "of what a fit without `shooting` leaves of swing" in w]
    if friction:
        assert 8e-4 < 1e-3 * float(named[0].partition("a dry friction of ")[2].split()[0]) < 1.3e-3
        e = found["arm_hinge_viscosity"]
        assert e.verdict == "doubtful" and "With that it would be 2." in e.words
    elif toward_x:
        assert "gravity were turned by 2.3 degrees toward x" in named[0]
        assert found["arm_rate"].verdict == "doubtful"
    else:
        assert not named and not any(e.verdict == "doubtful" for e in found.estimates)


def test_a_motion_that_differences_explode_in_is_not_asked_unbroken() -> None:
    """A double pendulum near the top."""
    scene = sb.Scene()
    upper = sb.add_arm(scene, "upper", mass=0.1, first_moment=0.01, inertia=0.0015, length=0.17, angle=3.1, rate=0.0)
    lower = {"mass": 0.14, "first_moment": 0.016, "inertia": 0.003, "length": 0.25, "angle": 3.0}
    arm = sb.add_arm(scene, "lower", pivot=upper, **lower)
    e = seen_at(scene, arm.place(0.2), np.arange(300) / RATE, sb.Solver(h=1 / 400), "lower_inertia")
    e = with_window(replace(e, shooting=sb.Shooting(0.5, 1e-3)))
    problem = FitProblem([e], as_parameters(["lower_inertia"], [e]))
    assert unbroken(problem, problem.parameters.initial()) is None


def test_states_beside_the_parameters_have_the_derivatives_that_follow_from_them() -> None:
    """The reduced Jacobian is what the states leave of that with states held."""
    problem = cut(swing(), 1e-3)
    u = problem.parameters.initial()
    _, _, reduced = problem.evaluate(u)
    free = problem.with_states(u)
    assert free is not None and list(free.states) == [0]
    A, windows = free.states[0], 5
    assert A.shape == (problem.core.rows, 2 * (windows - 1))
    X, *_ = np.linalg.lstsq(A, free.jacobian, rcond=None)
    assert free.jacobian - A @ X == pytest.approx(reduced, abs=1e-7 * np.abs(reduced).max())
    gaps = problem.core.rows - problem.core.data_rows
    assert len(free.border) == len(free.motion) == gaps
    assert np.unique(free.border) == pytest.approx([0.4, 0.8, 1.2, 1.6])
    started = np.flatnonzero(free.jacobian[:, 2:].any(axis=1))  # the start is seen in the first window and its gap
    assert problem.row_times()[started[started < problem.core.data_rows]].max() <= 0.4 + 0.03
    assert (free.border[started[started >= problem.core.data_rows] - problem.core.data_rows] == 0.4).all()


def test_parts_of_a_shot_motion_ask_nothing_of_a_start_that_they_do_not_show() -> None:
    """By way of states that followed as in the fit to all of the data, the third quarter asked for an angle of
    -60,000 rad."""
    e = swing(stop=4.0, kicks=0.05, seed=3, shooting=0.8)
    found = sb.fit(e, parameters=list(WANTED), refine=False, profiles=False, beginnings=False)
    doubted = {name: found[name].words for name in WANTED if "contradict" in found[name].words}
    assert list(doubted) == ["arm_hinge_viscosity"]
    assert "from the third quarter of the time, " in doubted["arm_hinge_viscosity"]


def test_a_motion_that_loses_nothing_says_so_in_every_result(tmp_path: Path) -> None:
    e = swing(fit=(0.0, 1.6), held_out=(1.6, 2.0), shooting=0.4)
    found = sb.fit(e, parameters=list(WANTED))
    (lost,) = found.result.shot
    assert (lost.windows, lost.numbers) == (4, 2)
    assert lost.lower == 0.0 and lost.upper is not None and lost.upper < 2e-3
    held = found.result.recordings[0].held_out
    assert held is not None and held < 1.6 * NOISE  # noise in two coordinates is 1.41 times that of one
    for name, truth in zip(WANTED, (0.003, 2e-4, 1.0, 0.5), strict=True):
        assert found[name].verdict in ("identified", "weak")
        assert found[name].lower < truth < found[name].upper, name  # type: ignore[operator]
    assert "6 numbers of states at borders" in found.report() and "less than" in found.report()
    found.save(tmp_path / "fit.json")
    assert sb.FitResult.load(tmp_path / "fit.json").shot == found.result.shot


def test_a_journal_brings_back_the_states_too(tmp_path: Path) -> None:
    """Those behind costs alone as well, which go on from derivatives of an earlier point."""
    steps = (0.0, True), (1e-3, True), (-1e-3, True), (2e-3, False), (0.05, False), (1e-3, False)
    first = np.array([np.log(0.0032), np.log(1.5e-4), 1.0, 0.5])
    points = [(first + np.array([d, 0.0, 0.0, 0.0]), jacobian) for d, jacobian in steps]
    for known in range(1, len(points)):
        path = tmp_path / f"journal{known}"
        problem = cut(swing(), 1e-3)
        alone = [problem.evaluate(*point) for point in points]
        with Journal(path):
            problem = cut(swing(), 1e-3)
            for point in points[:known]:
                problem.evaluate(*point)
        with Journal(path) as journal:
            problem = cut(swing(), 1e-3)
            resumed = [problem.evaluate(*point) for point in points]
            assert (journal.read, journal.made) == (known, len(points) - known)
        for (_, r, J), (_, s, K) in zip(alone, resumed, strict=True):
            assert np.array_equal(r, s) and np.array_equal(J, K)


@pytest.mark.parametrize(
    ("given", "shooting", "doubt"),
    [
        (0.0, sb.Shooting(0.8), "swing loses energy that the model does not"),
        (6e-4, sb.Shooting(0.8, 1e-5), "the given arm_hinge_viscosity is too large: with a third of it"),
    ],
)
def test_a_wrong_loss_is_doubted_after_single_steps_of_the_states(
    given: float, shooting: sb.Shooting, doubt: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where another loss leads far off, states that follow to the end would take dozens of steps."""
    e, wanted = swing(stop=4.0), ("arm_inertia", "arm_angle", "arm_rate")
    e = replace(e, scene=pendulum(0.0033, given)[0], shooting=shooting)
    parameters = as_parameters(wanted, [e])
    experiments, at, _ = joined([e], parameters, 1)
    problem = FitProblem(experiments, parameters, expanded=at)
    u = walked(problem, problem.parameters.initial(), None)
    problem.evaluate(u)
    made = counted_windows(monkeypatch)
    found = missing_loss(problem, u, (problem, u)) if given == 0.0 else other_losses(problem, u)
    assert set(found) == set(wanted) and all(words.startswith(doubt) for words in found.values())
    assert sum(made) <= 7 * 5  # of 5 windows; 12 * 5 where they follow to the end


@pytest.mark.parametrize(
    ("steps", "undone"),
    [(1, "gaps between windows are given 10 % of the motion's size"), (8, "gaps between windows are as wide as where")],
)
def test_ctrl_c_before_the_search_keeps_the_point_reached_last(steps: int, undone: str) -> None:
    reached: list[Progress] = []

    def press(progress: Progress) -> None:
        reached.append(progress)
        if len(reached) == steps:
            raise KeyboardInterrupt

    fit = sb.fit(swing(shooting=0.4), parameters=list(WANTED), progress=press)
    assert fit.interrupted and not fit.result.converged and len(reached) == steps
    assert np.log(fit["arm_inertia"].value) == pytest.approx(reached[-1].u[0])
    assert fit.result.shot[0].loss > 0.0 and "best point so far" in fit.report()
    assert f"interrupted before the search: {undone}" in " ".join(fit.report().split())


def test_ctrl_c_while_windows_get_their_first_states_keeps_those_that_are_known(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    sought, nearest = list[np.ndarray](), lifted_starts._nearest

    def press(
        rows: Callable[[np.ndarray], Rows | None], state: np.ndarray, free: list[bool] | None = None
    ) -> np.ndarray:
        sought.append(nearest(rows, state, free))
        if len(sought) == 6:
            raise KeyboardInterrupt
        return sought[-1]

    monkeypatch.setattr(lifted_starts, "_nearest", press)
    fit = sb.fit(swing(shooting=0.4), parameters=list(WANTED))
    assert fit.interrupted and fit["arm_inertia"].value == pytest.approx(0.0033)
    left = fit.result.message.removeprefix("interrupted before the search: states at ")
    assert left.endswith(" borders of windows were not sought") and 0 < int(left.split()[0]) < 19


@pytest.mark.parametrize(("calls", "steps"), [(1, 0), (6, 0), (0, 1), (0, 8)])
def test_a_fit_that_was_stopped_before_its_search_goes_on_to_the_same_bits(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, calls: int, steps: int
) -> None:
    """Its journal was refused as one of another fit: it began with the states that were known when Ctrl-C came."""
    made = {"calls": 0, "steps": 0}
    nearest = lifted_starts._nearest

    def count(what: str, last: int) -> None:
        made[what] += 1
        if made[what] == last:
            raise KeyboardInterrupt

    def press(*given: object) -> np.ndarray:
        count("calls", calls)
        return nearest(*given)  # type: ignore[arg-type]

    def fit(**more: object) -> sb.Fit:
        return sb.fit(swing(shooting=0.4), parameters=list(WANTED), profiles=False, refine=False, **more)  # type: ignore[arg-type]

    alone, path = fit(), tmp_path / "journal"
    monkeypatch.setattr(lifted_starts, "_nearest", press)
    assert fit(journal=path, progress=lambda _: count("steps", steps)).interrupted and path.is_file()
    monkeypatch.setattr(lifted_starts, "_nearest", nearest)
    assert fit(journal=path).result.estimates == alone.result.estimates and not path.exists()


def test_windows_are_refused_where_they_cannot_be() -> None:
    rope = sb.rope(0.6, 6, density=0.05, EI=1e-3, clamp_start=(1, 0, 0))
    times = np.arange(20) / 50
    recording = sb.Recording(np.zeros((20, 7, 3)) + np.arange(20)[:, None, None] / 20, times)
    with pytest.raises(sb.InputError, match="needs quantities that set how the scene starts"):
        sb.fit(sb.Experiment(scene=rope, recording=recording, shooting=0.2), parameters=["rope_EI"])
    with pytest.raises(sb.InputError, match="is short for these frames"):
        with_window(replace(swing(), shooting=0.05))
    with pytest.raises(sb.InputError, match="does not go with"):
        replace(swing(), shooting=0.4, static=True)
    with pytest.raises(sb.InputError, match="must be a length"):
        replace(swing(), shooting=-1.0)
    for steps in (0, 2.5, True):
        with pytest.raises(sb.InputError, match=r"shooting\.steps: must be a whole number, at least 1"):
            sb.Shooting(0.4, steps=steps)
    many = [replace(swing(), name=f"swing {k}", shooting=0.4) for k in range(20)]
    with pytest.raises(sb.InputError, match="does not go with many recordings"):
        sb.fit_many(many, list(WANTED)[:2])


def test_a_configuration_says_how_a_recording_is_shot(tmp_path: Path) -> None:
    swing().recording.save(tmp_path / "swing.npz")
    text = """
    [experiment]
    name = "swing"
    [solver]
    substeps = 8
    [[scene.arm]]
    name = "arm"
    mass = 0.14
    first_moment = 0.016
    inertia = 0.003
    length = 0.25
    viscosity = 2e-4
    [[marker]]
    marker = "m"
    arm = "arm"
    radius = 0.2
    [[recording]]
    file = "swing.npz"
    axes = "xz"
    shooting = {}
    [parameters.arm_inertia]
    """
    for written, window in (("0.4", 0.4), ('"auto"', "auto")):
        (tmp_path / "swing.toml").write_text(text.format(written))
        (e,) = load(tmp_path / "swing.toml").experiments
        assert isinstance(e.shooting, sb.Shooting) and e.shooting.window == window
    chosen = with_window(e).shooting
    assert isinstance(chosen, sb.Shooting) and chosen.window == pytest.approx(0.48)  # 24 frames at least
    (tmp_path / "swing.toml").write_text(text.format('"often"'))
    with pytest.raises(sb.ConfigError, match="shooting"):
        load(tmp_path / "swing.toml")
