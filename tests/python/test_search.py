"""How a fit finds its minimum from far off: steps inside boxes, windows from the motion, starts that diverge, what runs
off, and what it all took."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
from pytest import approx
from sheetbend.errors import InputError, SheetbendError
from sheetbend.experiment.wanted import as_parameters
from sheetbend.minimum.approach import Approach, inside
from sheetbend.minimum.by_ceres import has_ceres
from sheetbend.minimum.growth import Growth
from sheetbend.minimum.optimizers import minimize
from sheetbend.minimum.search import Search
from sheetbend.minimum.windows import chosen, cut
from sheetbend.problem.coordinates import LOG_STEP, step_limits
from sheetbend.problem.problem import FitProblem
from sheetbend.quantities.parameters import DEFAULT_RANGE, Parameter, Parameters
from sheetbend.report.fit_result import FitResult
from sheetbend.report.report import plain

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "far_starts"
sys.path.insert(0, str(FOLDER))
import hand_held  # noqa: E402

OPTIMIZERS = [
    pytest.param("ceres", marks=pytest.mark.skipif(not has_ceres(), reason="built without Ceres")),
    "scipy",
]


def problem_of(e: sb.Experiment, start: dict[str, float]) -> FitProblem:
    return FitProblem([e], as_parameters({name: {"initial": value} for name, value in start.items()}, [e]))


@pytest.fixture(scope="module")
def rod() -> sb.Experiment:
    return hand_held.experiment(hand_held.FEW, hand_held.recording(hand_held.FEW))


# --- steps


def test_a_step_in_a_box_is_the_best_one_there():
    """Against many feasible points and the conditions of Karush, Kuhn and Tucker."""
    rng = np.random.default_rng(3)
    for n in (1, 2, 5, 12):
        J, r = rng.standard_normal((30, n)) * 10.0 ** rng.uniform(-3, 3, n), 10.0 * rng.standard_normal(30)
        ridge, lower, upper = np.full(n, 1e-3), -rng.uniform(0.0, 0.5, n), rng.uniform(0.0, 0.5, n)
        s = inside(J, r, ridge, lower, upper)
        slope = J.T @ (r + J @ s) + ridge**2 * s
        scale = np.linalg.norm(J, axis=0) * np.linalg.norm(r)
        assert (s >= lower).all() and (s <= upper).all()
        inner = (s > lower) & (s < upper)
        assert (np.abs(slope[inner]) < 1e-9 * scale[inner]).all()
        assert (slope[s <= lower] > -1e-9 * scale[s <= lower]).all()
        assert (slope[s >= upper] < 1e-9 * scale[s >= upper]).all()


def test_no_step_takes_a_logarithm_further_than_a_decade(rod):
    start = {"rod_EI": 3e-5, "rod_bend_damping": 1.0, "rod_drag_linear": 3e-4}
    walk = Approach(problem_of(rod, start), problem_of(rod, start).parameters.initial())
    before = walk.u
    for _ in range(4):
        assert walk.step()
        assert np.abs(walk.u - before).max() <= LOG_STEP * (1.0 + 1e-12)
        before = walk.u


def test_natural_scales_limit_steps_too():
    p = Parameters(
        [
            Parameter(name="EI", initial=1.0, log=True),
            Parameter(name="angle", initial=0.0, scale=0.1),
            Parameter(name="plain", initial=1.0),
        ]
    )
    assert step_limits(p) == approx([np.log(10.0), 0.1, np.inf])


@pytest.mark.parametrize("optimizer", OPTIMIZERS)
def test_optimizers_keep_to_it_as_well(rod, optimizer):
    problem = problem_of(rod, {"rod_EI": 3e-3, "rod_bend_damping": 1e-9, "rod_drag_linear": 10.0})
    u = problem.parameters.initial()
    end, _ = minimize(problem, u, optimizer, max_iterations=1)
    assert np.abs(end.u - u).max() <= LOG_STEP * (1.0 + 1e-12)


# --- limits


def test_positive_parameters_have_wide_limits_where_the_user_gave_none():
    p = Parameters(
        [
            Parameter(name="EI", initial=2.0, log=True),
            Parameter(name="drag", initial=1.0, log=True, lower=0.1),
            Parameter(name="x", initial=0.0),
        ]
    )
    lower, upper = p.limits()
    assert lower == approx([np.log(2.0 / DEFAULT_RANGE), np.log(0.1), -np.inf])
    assert upper == approx([np.log(2.0 * DEFAULT_RANGE), np.log(DEFAULT_RANGE), np.inf])
    assert p.bounds()[0][0] == -np.inf  # the user's
    assert p.ran_off(np.array([lower[0], lower[1], 0.0])) == ("EI",)
    assert p.ran_off(np.array([upper[0] - 1.0, upper[1], 0.0])) == ("drag",)


@pytest.mark.parametrize("optimizer", OPTIMIZERS)
def test_what_the_data_want_gone_stops_at_its_limit(optimizer):
    """A rope recorded without drag: the fit's runs towards zero and not to the least number that there is."""
    times = np.arange(31) / 100
    solver = sb.Solver(h=1 / 400)
    options = {"density": 0.05, "EA": 1e3, "EI": 2e-3, "clamp_start": (1, 0, 0)}
    x = sb.simulate(sb.rope(0.5, 6, **options), times, solver).positions
    made = sb.rope(0.5, 6, drag_linear=0.1, **options)
    recording = sb.Recording(positions=x[:, [2, 4, 6]], times=times, name="no drag")
    markers = [sb.on_particle(i) for i in (2, 4, 6)]
    e = sb.Experiment(scene=made, recording=recording, markers=markers, solver=solver, sigma=1e-6)
    problem = problem_of(e, {"rope_EI": 2e-3, "rope_drag_linear": 0.1})
    end = Search(optimizer=optimizer).run(problem).ends[0]
    drag = problem.parameters.to_physical(end.u)["rope_drag_linear"]
    assert 0.99 * 0.1 / DEFAULT_RANGE < drag < 1e-4


# --- windows


def grown(problem: FitProblem, sigma: float) -> tuple[Growth, ...]:
    """Growth that passes `sigma` in the middle of the motion."""
    times = np.linspace(0.0, 2.0, 101)
    return (Growth("rod", times, np.where(times < 1.0, 1.0, sigma)),)


def test_windows_are_parts_of_the_motion_and_end_where_displacements_grow(rod):
    problem = problem_of(rod, hand_held.FEW)
    assert chosen(problem, grown(problem, 1.0)) == approx((2.0 / 27, 2.0 / 9, 2.0 / 3))
    early = chosen(problem, (Growth("rod", np.linspace(0, 2, 101), 10.0 ** np.linspace(0, 40, 101)),))
    assert early and 0.1 < max(early) < 0.2  # the growth is 1e4 at 0.2 s


def test_no_window_for_equilibria_nor_for_few_frames(rod):
    x = rod.recording.positions
    few = sb.Recording(positions=x[:8], times=rod.recording.times[:8], name="short")
    short = replace(rod, recording=few)
    assert chosen(problem_of(short, hand_held.FEW), ()) == ()


def test_windows_that_cannot_be_are_refused():
    with pytest.raises(InputError, match="windows"):
        Search(windows="automatic")
    with pytest.raises(InputError, match="increase"):
        Search(windows=[0.2, 0.1])


# --- far starts

FAR = [(0.01, 10.0, 0.01), (100.0, 100.0, 0.02), (0.1, 0.01, 100.0)]


@pytest.mark.parametrize(
    ("optimizer", "far"),
    list(zip(("auto", "scipy", "auto"), FAR, strict=True)),
)
def test_a_rod_in_a_hand_is_found_from_100_times_off(rod, optimizer, far):
    best = Search(optimizer=optimizer).run(problem_of(rod, hand_held.FEW))
    start = {name: value * f for (name, value), f in zip(hand_held.FEW.items(), far, strict=True)}
    found = Search(optimizer=optimizer).run(problem_of(rod, start))
    assert found.ends[0].cost == approx(best.ends[0].cost, rel=1e-6)
    assert found.ends[0].converged and found.ends[0].windows
    assert not best.ends[0].windows and best.ends[0].evaluations < 12
    assert found.ends[0].evaluations < 70


@pytest.mark.slow
def test_a_loose_tolerance_leaves_nothing_to_the_optimizer(rod):
    """Where the steps have arrived, the derivatives of an optimizer's start and end would tell nothing."""
    problem = problem_of(rod, hand_held.FEW)
    best = problem.parameters.to_physical(Search().run(problem).ends[0].u)

    def beside(factor: float) -> FitProblem:
        parameters = (replace(p, initial=factor * best[name]) for name, p in problem.parameters.items())
        return FitProblem(problem.experiments, Parameters(parameters))

    there = Search(windows=(), tolerance=1e-3).run(beside(1.0)).ends[0]  # what promises less is no step
    assert there.converged and (there.iterations, there.evaluations, there.jacobians) == (0, 1, 1)
    end = Search(windows=(), tolerance=1e-3).run(beside(1.00005)).ends[0]
    assert end.converged and "less than the tolerance" in end.message and end.jacobians <= end.iterations + 1
    assert end.cost == approx(there.cost, rel=1e-3)


def test_twelve_numbers_of_a_rod_need_no_bounds():
    """The draw of experiments/far_starts that took 200 iterations to nowhere when Ceres began at the start."""
    truth = hand_held.TWELVE
    e = hand_held.experiment(truth, hand_held.recording(truth))
    best = Search().run(problem_of(e, dict(truth))).ends[0]
    rng = np.random.default_rng(0)
    start = {}
    for name, value in truth.items():
        far = np.exp(rng.uniform(np.log(2.0), np.log(5.0)) * rng.choice([-1, 1]))
        mode = "softness" in name or "tilt" in name
        start[name] = float(value * rng.choice([-1.0, 0.0, 2.0])) if mode else float(value * far)
    found = Search().run(problem_of(e, start)).ends[0]
    assert found.converged and found.cost == approx(best.cost, rel=1e-4)
    assert found.evaluations < 120


def flag() -> tuple[sb.Experiment, dict[str, float]]:
    """A mesh sequence without noise of a flag in the wind."""
    truth = {"cloth_warp": 300.0, "cloth_shear": 100.0, "cloth_bending": 1e-4, "wind_x": 2.0, "wind_y": 0.5}

    def scene() -> sb.Scene:
        flat = sb.mesh.grid(0.4, 0.3, 8, 6, "one_way")
        mesh = sb.TriangleMesh(flat.vertices[:, [0, 2, 1]], flat.triangles, flat.material, flat.sets)
        made, held = sb.Scene("flag"), mesh.sets["left"]
        stiff = {"warp": 300.0, "shear": 100.0, "bending": 1e-4, "membrane_damping": 1e-3}
        cloth = sb.add_cloth(made, mesh, held=held, density=0.15, **stiff)
        made.pin(cloth.particles[held])
        made.add_air(cloth.particles[mesh.triangles], 0.6, 0.05, (2.0, 0.5, 0.0))
        return made

    solver = sb.Solver(h=1 / 400, method="newton")
    times = np.arange(61) / 100
    x = sb.simulate(scene(), times, solver).positions
    recording = sb.Recording(positions=x, times=times, name="flag")
    markers = [sb.on_particle(i) for i in range(x.shape[1])]
    return sb.Experiment(scene=scene(), recording=recording, markers=markers, solver=solver), truth


def test_a_flag_ends_at_the_truth_and_not_in_a_minimum_beside_it():
    """Without windows 101 iterations led to a warp of 210 N/m at 2 sigma."""
    e, truth = flag()
    start = {"cloth_warp": 150.0, "cloth_shear": 100.0, "cloth_bending": 3e-4, "wind_x": 0.5, "wind_y": 0.125}
    problem = problem_of(e, start)
    found = Search().run(problem)
    assert problem.parameters.to_physical(found.ends[0].u) == approx(truth, rel=1e-8)
    assert found.ends[0].windows and found.growths[0].largest > 50.0


# --- starts, steps back, counts


def rope(**options: float) -> sb.Scene:
    return sb.rope(0.5, 6, density=0.05, EA=1e3, EI=2e-3, bend_damping=0.02, clamp_start=(1, 0, 0), **options)


def swinging() -> sb.Experiment:
    clean = sb.simulate(rope(), np.arange(31) / 100, sb.Solver(h=1 / 400))
    noise = 1e-4 * np.random.default_rng(0).standard_normal((31, 3, 3))
    recording = sb.Recording(positions=clean.positions[:, [2, 4, 6]] + noise, times=clean.times, name="swing")
    markers = [sb.on_particle(i) for i in (2, 4, 6)]
    return sb.Experiment(scene=rope(), recording=recording, markers=markers, solver=sb.Solver(h=1 / 400), sigma=1e-4)


def without_answer(refused, monkeypatch) -> None:
    """Let evaluations of all problems fail where `refused(problem, values)` says so."""
    exact = FitProblem.evaluate

    def evaluate(self, u, jacobian=True):
        ok, r, J = exact(self, u, jacobian)
        return ok and not refused(self, self.parameters.to_physical(u)), r, J

    monkeypatch.setattr(FitProblem, "evaluate", evaluate)


def test_a_start_that_diverges_is_a_row_of_the_table(monkeypatch):
    e = swinging()
    without_answer(lambda p, v: v["rope_EI"] > 10.0, monkeypatch)
    found = sb.fit([e], parameters={"rope_EI": {"initial": 3e-3}}, starts=[{"rope_EI": 1e3}, {"rope_EI": 1e-3}])
    starts = found.result.starts
    assert [s.cost is None for s in starts] == [False, False, True]
    assert starts[2].values["rope_EI"] == approx(1e3) and not starts[2].converged
    assert found["rope_EI"].value == approx(2e-3, rel=0.05)
    assert "1 diverged" in plain(found.result)
    assert any("1 of 3 starts failed" in words for words in found.result.warnings)
    assert FitResult.from_dict(found.result.to_dict()) == found.result


def test_where_every_start_diverges_the_fit_says_why(monkeypatch):
    e = swinging()
    without_answer(lambda p, v: True, monkeypatch)
    with pytest.raises(SheetbendError, match="the fit cannot start"):
        sb.fit([e], parameters={"rope_EI": {"initial": 3e-3}})


def test_a_window_that_diverges_is_approached_by_shorter_ones(monkeypatch):
    """Each length has an answer only near the truth, the nearer the longer it is."""
    e = swinging()

    def refused(problem: FitProblem, values: dict[str, float]) -> bool:
        length = problem.recordings[0].times[-1]
        return abs(np.log(values["rope_EI"] / 2e-3)) > 0.2 / length

    without_answer(refused, monkeypatch)
    found = Search(windows=[0.05, 0.3]).run(problem_of(e, {"rope_EI": 2e-2}))
    end = found.ends[0]
    assert end.converged and np.exp(end.u[0]) == approx(2e-3, rel=0.05)
    assert end.first is None  # the whole motion has no answer at the start


def test_a_fit_counts_its_simulations_and_tells_the_growth_and_its_windows():
    found = sb.fit([swinging()], parameters={"rope_EI": {"initial": 4e-2}, "rope_bend_damping": {"initial": 0.2}})
    r = found.result
    assert r.evaluations >= r.jacobians >= r.iterations > 0
    assert [g.name for g in r.growth] == ["swing"]
    assert r.growth[0].largest == approx((1.0, 1.0), rel=0.5) and r.growth[0].until == (None, None)
    assert f"{r.evaluations:,}, {r.jacobians:,} of them with a Jacobian" in plain(r)
    assert FitResult.from_dict(r.to_dict()) == r


def test_a_cut_problem_ends_before_its_length(rod):
    part = cut(problem_of(rod, hand_held.FEW), 0.5)
    assert part.recordings[0].times[-1] == approx(0.49)
