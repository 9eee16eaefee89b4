"""Ceres and SciPy on one problem: the same residuals, the same answer; the Jacobian that both see; what Ctrl-C
leaves."""

from __future__ import annotations

import importlib
import signal

import numpy as np
import pytest
import sheetbend as sb
import sheetbend.minimum.way as way
from pytest import approx
from sheetbend.doubts import profiles
from sheetbend.experiment.wanted import as_parameters
from sheetbend.minimum import by_ceres, discretization, slope
from sheetbend.minimum.by_ceres import has_ceres
from sheetbend.minimum.discretization import Refinement
from sheetbend.minimum.optimizers import minimize
from sheetbend.minimum.progress import Best, Minimum, Progress
from sheetbend.problem.evaluator import Evaluator
from sheetbend.problem.journal import Timed
from sheetbend.problem.problem import FitProblem

fitting = importlib.import_module("sheetbend.fitting.fit")  # the name in the package is the function

SOLVER = sb.Solver(h=1 / 400)
WANTED = {"rope_EI": {"initial": 3e-3}, "rope_bend_damping": {"initial": 0.03}, "rope_density": {"prior": (0.05, 0.1)}}
needs_ceres = pytest.mark.skipif(not has_ceres(), reason="built without Ceres")


def rope() -> sb.Scene:
    return sb.rope(0.5, 6, density=0.05, EA=1e3, EI=2e-3, bend_damping=0.02, clamp_start=(1, 0, 0))


def swinging(noise: float = 1e-4, seed: int = 0, **fields: object) -> sb.Experiment:
    at = [2, 4, 6]
    clean = sb.simulate(rope(), np.arange(31) / 100, SOLVER)
    positions = clean.positions[:, at] + noise * np.random.default_rng(seed).standard_normal((31, 3, 3))
    recording = sb.Recording(positions=positions, times=clean.times, name=f"swing{seed}")
    given = {"markers": [sb.on_particle(i) for i in at], "solver": SOLVER, "sigma": 1e-4}
    return sb.Experiment(scene=rope(), recording=recording, **(given | fields))


def hanging(seed: int = 0) -> sb.Experiment:
    shape = sb.equilibrium(rope()).positions[None, 1:7]
    noisy = shape + 1e-4 * np.random.default_rng(seed).standard_normal(shape.shape)
    recording = sb.Recording(positions=noisy, times=[0.0], name="shape")
    return sb.Experiment(
        scene=rope(), recording=recording, markers=[sb.on_particle(i) for i in range(1, 7)], static=True, sigma=1e-4
    )


def problem_of(*experiments: sb.Experiment) -> FitProblem:
    return FitProblem(experiments, as_parameters(WANTED, experiments))


@needs_ceres
def test_ceres_tells_of_failures_in_its_result_alone(capfd):
    problem = problem_of(swinging())
    far = np.full(len(problem.parameters.initial()), 900.0)
    problem.parameters.limits = lambda: (np.full(len(far), -np.inf), np.full(len(far), np.inf))
    end = by_ceres.search(problem, far, 5, 1e-10, Best(None, far, np.inf))
    assert not end.converged and end.iterations == 0
    assert "evaluation failed" in end.message
    assert capfd.readouterr() == ("", "")


def limited(**damping: float) -> FitProblem:
    experiments = [swinging()]
    return FitProblem(experiments, as_parameters(WANTED | {"rope_bend_damping": damping}, experiments))


@needs_ceres
@pytest.mark.parametrize("initial", [0.03, 0.06, 0.1])
def test_ceres_ends_at_the_minimum_beside_a_limit(initial):
    """The damping, 0.02, comes to its limit on the way. Ceres went on from there by small steps along the limit, and
    ended where a step still promised a good part of the cost."""
    problem = limited(initial=initial, lower=0.025)
    end, _ = minimize(problem, problem.parameters.initial(), "ceres")
    assert end.converged and slope.promised(problem, end.u) < 1e-8
    assert end.u[1] == approx(np.log(0.025), rel=1e-15)
    assert end.evaluations < 60  # 166
    other, _ = minimize(problem, problem.parameters.initial(), "scipy", tolerance=1e-14)
    assert end.cost == approx(other.cost, rel=1e-6)


@needs_ceres
@pytest.mark.parametrize("most", [3, 8])
def test_runs_that_hold_a_limit_share_the_most_iterations(most):
    problem = limited(initial=0.06, lower=0.025)
    told: list[Progress] = []
    end, _ = minimize(problem, problem.parameters.initial(), "ceres", max_iterations=most, observe=told.append)
    assert end.iterations <= most and max(one.iteration for one in told) == end.iterations


@needs_ceres
def test_ceres_leaves_a_limit_that_nothing_presses_on(monkeypatch):
    """A run that was stopped there goes on without holding it, and without stopping again; one that held it, too."""
    problem = limited(initial=0.06, lower=0.025)
    resting = [frozenset(), frozenset(), frozenset({1}), frozenset()]
    runs = []
    run = by_ceres.run

    def counted(problem, w, most, tolerance, watch):
        runs.append((watch.held, watch.limits))
        return run(problem, w, most, tolerance, watch)

    monkeypatch.setattr(by_ceres, "run", counted)
    monkeypatch.setattr(by_ceres, "_resting", lambda problem, w: resting.pop(0))
    minimize(problem, problem.parameters.initial(), "ceres")
    assert runs == [(frozenset(), True), (frozenset(), False)]
    minimize(problem, problem.parameters.initial(), "ceres")
    assert runs[2:] == [({1}, True), (frozenset(), False)]


@needs_ceres
@pytest.mark.parametrize("loss", ["squares", "soft_l1", "huber"])
def test_ceres_and_scipy_give_the_same_answer(loss):
    """As asked for, within a thousandth of the intervals; iterated until the cost is level to rounding, 1e-4 standard
    errors."""
    experiments = [swinging(loss=loss), hanging()]
    ceres, scipy = (sb.fit(experiments, parameters=WANTED, optimizer=name, refine=False) for name in ("ceres", "scipy"))
    assert (ceres.result.optimizer, scipy.result.optimizer) == ("ceres", "scipy")
    assert ceres.result.converged and scipy.result.converged
    assert ceres.result.cost == approx(scipy.result.cost, rel=1e-9)
    for name in WANTED:
        one, other = ceres[name], scipy[name]
        assert one.value == approx(other.value, abs=1e-3 * other.half_width)
        assert (one.verdict, one.half_width) == (other.verdict, approx(other.half_width, rel=1e-3))

    problem = problem_of(*experiments)
    ends = [minimize(problem, problem.parameters.initial(), name, tolerance=1e-15)[0].u for name in ("ceres", "scipy")]
    _, _, jacobian = problem.evaluate(ends[0])
    standard_errors = np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian)))
    assert (np.abs(ends[0] - ends[1]) / standard_errors).max() < 1e-4


AT_REST = ("rope_EI", "rope_density")


@pytest.mark.parametrize(
    ("experiments", "wanted"),
    [
        ((swinging(),), WANTED),
        ((hanging(),), AT_REST),
        ((swinging(start="equilibrium"),), AT_REST),
        ((swinging(), hanging()), WANTED),
    ],
    ids=["motion", "static", "from equilibrium", "both"],
)
def test_the_jacobian_is_the_residuals_own(experiments, wanted):
    """Columns against differences of fourth order in the internal coordinates."""
    problem = FitProblem(experiments, as_parameters(wanted, experiments))
    u = problem.parameters.initial()
    ok, _, jacobian = problem.evaluate(u)
    assert ok

    def along(column: int, step: float) -> np.ndarray:
        ends = [problem.evaluate(u + sign * step * np.eye(len(u))[column], jacobian=False)[1] for sign in (1.0, -1.0)]
        return (ends[0] - ends[1]) / (2.0 * step)

    for column in range(len(u)):
        expected = (4.0 * along(column, 1e-3) - along(column, 2e-3)) / 3.0
        assert np.abs(expected).max() > 1.0
        assert jacobian[:, column] == approx(expected, abs=1e-7 * np.abs(expected).max())


@pytest.mark.parametrize("threads", [1, 3])
def test_threads_leave_the_fit_alone(threads):
    experiments = [swinging(seed=1), swinging(seed=2), hanging()]
    found = sb.fit(experiments, parameters=WANTED, threads=threads)
    assert found.values == sb.fit(experiments, parameters=WANTED).values


def interrupt_at(iteration: int):
    """An observer that presses Ctrl-C."""

    def observe(progress: Progress) -> None:
        if progress.iteration >= iteration:
            signal.raise_signal(signal.SIGINT)

    return observe


OPTIMIZERS = [pytest.param("ceres", marks=needs_ceres), "scipy"]


@pytest.mark.parametrize("optimizer", OPTIMIZERS)
def test_an_interrupted_search_returns_its_best_point(optimizer):
    problem = problem_of(swinging())
    u = problem.parameters.initial()
    start = 0.5 * float(np.square(problem.evaluate(u)[1]).sum())
    end, _ = minimize(problem, u, optimizer, observe=interrupt_at(2))
    assert end.interrupted and not end.converged
    _, residuals, _ = problem.evaluate(end.u)
    assert end.cost == approx(0.5 * float(residuals @ residuals)) and end.cost <= start * (1.0 + 1e-12)


@pytest.mark.parametrize("optimizer", OPTIMIZERS)
def test_an_interrupted_fit_refits_nothing(optimizer, monkeypatch):
    """Profiles and refinements would go on for many times what was interrupted."""

    def never(*_: object, **__: object) -> None:
        raise AssertionError("a refit after Ctrl-C")

    monkeypatch.setattr(profiles, "refit", never)
    monkeypatch.setattr(profiles, "ProfilePath", never)
    monkeypatch.setattr(discretization, "refined_estimates", never)
    monkeypatch.setattr(discretization, "settle", never)
    found = sb.fit([swinging()], parameters=WANTED, optimizer=optimizer, progress=interrupt_at(2))
    assert found.result.interrupted and not found.result.converged
    assert "best point so far" in found.report() and "linear" in found.report()
    assert all(e.discretization == 0.0 for e in found.result.estimates)


def test_ctrl_c_during_the_refits_keeps_the_converged_values(monkeypatch):
    whole = sb.fit([swinging()], parameters=WANTED, refine=False)

    def pressed(*_: object) -> None:
        signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(discretization, "settle", pressed)
    found = sb.fit([swinging()], parameters=WANTED)
    assert found.result.interrupted and found.result.converged
    assert found.values == whole.values
    assert found.report().startswith("Fit converged, then interrupted,")


@needs_ceres
@pytest.mark.parametrize("damping", [{}, {"initial": 0.06, "lower": 0.025}], ids=["inside", "at a limit"])
def test_each_iteration_is_told_once(damping):
    """Ceres begins with the point where the walk, or its own run before, ended. That was told again, with the same
    number."""
    seen: list[Progress] = []
    wanted = WANTED | {"rope_bend_damping": damping}
    found = sb.fit(
        [swinging()], parameters=wanted, optimizer="ceres", refine=False, profiles=False, progress=seen.append
    )
    numbers = [progress.iteration for progress in seen if progress.condition is None]
    assert numbers == list(range(numbers[0], found.result.iterations + 1)) and numbers[0] <= 1


def test_ctrl_c_at_a_further_start_keeps_the_first(monkeypatch):
    whole = sb.fit([swinging()], parameters=WANTED, refine=False)
    exact, starts = way.minimize, []

    def second_is_interrupted(*arguments: object, **options: object) -> object:
        starts.append(arguments)
        if len(starts) == 2:
            raise KeyboardInterrupt
        return exact(*arguments, **options)

    monkeypatch.setattr(way, "minimize", second_is_interrupted)
    found = sb.fit([swinging()], parameters=WANTED, starts=[{"rope_EI": 1e-2}, {"rope_EI": 1e-3}])
    assert len(starts) == 2 and [start.converged for start in found.result.starts] == [True, False]
    assert found.result.interrupted and found.values == whole.values


def test_short_windows_come_first_and_end_in_the_same_minimum():
    whole, seen = sb.fit([swinging(), hanging()], parameters=WANTED), []
    found = sb.fit([swinging(), hanging()], parameters=WANTED, windows=[0.05, 0.15], progress=seen.append)
    lengths = [progress.window for progress in seen]
    assert list(dict.fromkeys(lengths)) == [0.05, 0.15, None]
    firsts = [seen[lengths.index(length)].cost for length in (0.05, 0.15, None)]
    assert firsts[0] < whole.result.first_cost  # five frames of it
    assert firsts[2] < 1e-2 * whole.result.first_cost
    assert found.result.first_cost == whole.result.first_cost
    for name in WANTED:
        assert found[name].value == approx(whole[name].value, abs=1e-2 * whole[name].half_width)


def test_ctrl_c_in_a_window_keeps_its_best_point(monkeypatch):
    pressed = []

    def observe(progress: Progress) -> None:
        if progress.window == 0.05 and progress.iteration == 3 and not pressed:
            pressed.append(progress)
            signal.raise_signal(signal.SIGINT)

    found = sb.fit([swinging()], parameters=WANTED, windows=[0.05], optimizer="scipy", progress=observe)
    problem = problem_of(swinging())
    _, r, _ = problem.evaluate(problem.parameters.to_internal(found.values), jacobian=False)
    assert pressed and found.result.interrupted
    assert found.result.cost == approx(0.5 * r @ r, rel=1e-9)


@pytest.mark.parametrize("windows", [[0.1, 0.1], [-0.1], [float("nan")], [0.0]])
def test_windows_that_do_not_increase_are_refused(windows):
    with pytest.raises(sb.InputError, match="windows"):
        sb.fit([swinging()], parameters=WANTED, windows=windows)


def test_a_window_without_a_frame_is_refused():
    with pytest.raises(sb.InputError, match="hold no fitted frame of 'swing0'"):
        sb.fit([swinging(fit=(0.1, 0.3), start_time=0.0)], parameters=WANTED, windows=[0.05])


def test_a_cheap_jacobian_comes_with_the_residuals():
    problem = problem_of(swinging())
    u = problem.parameters.initial()
    assert not problem.cheap_jacobian
    problem.evaluate(u, jacobian=False)
    problem.evaluate(u)
    for ratio, cheap in ((1.5, True), (20.0, False)):
        problem.seconds = {False: 1.0, True: ratio}
        assert problem.cheap_jacobian is cheap
    calls, exact = [], problem.evaluate
    for ratio in (1e-9, 1e9):  # of the seconds that a Jacobian takes to those of the residuals
        calls.clear()

        def noted(at, jacobian=True, ratio=ratio):
            calls.append(jacobian)
            found = exact(at, jacobian)
            problem.seconds = {False: 1.0, True: ratio}
            return found

        problem.evaluate = noted
        end, _ = minimize(problem, u, "scipy")
        assert end.converged
        assert (False in calls[2:]) is (ratio > 1)


def test_one_step_with_the_fits_jacobian_moves_what_a_refit_moves():
    at_half = swinging(noise=1e-6, solver=sb.Solver(h=1 / 800))
    by_refit, by_step = (
        sb.fit(
            [swinging(noise=1e-6, solver=sb.Solver(h=1 / 200))],
            parameters=WANTED,
            refine=Refinement(halve_step=False, finer=lambda: [at_half], linear=linear),
            profiles=False,
        )
        for linear in (False, True)
    )
    assert by_step.on_mesh == by_refit.on_mesh  # before the mesh moves them
    (full,), (step,) = by_refit.result.refits, by_step.result.refits
    assert full.name == step.name == "finer mesh"
    for name, moved in full.moved.items():
        assert 0.02 < moved / by_refit.on_mesh[name] < 0.05
        assert step.moved[name] == approx(moved, rel=0.05)  # what is left out is of second order


def test_a_refit_is_part_of_the_saved_result(tmp_path):
    found = sb.fit([swinging()], parameters=WANTED, refine=Refinement(linear=True), profiles=False).result
    found.save(tmp_path / "fit.json")
    assert sb.FitResult.load(tmp_path / "fit.json") == found
    (made,) = found.refits
    for e in found.estimates:
        step = made.to_limit * np.log1p(made.moved[e.name] / e.value)
        assert e.discretization == approx(e.value * np.expm1(abs(step))) and e.discretization > 0
    assert "How much a finer discretization changes the values" in found.report()
    earlier = {key: value for key, value in found.to_dict().items() if key not in ("refits", "not_counted")}
    assert sb.FitResult.from_dict(earlier).refits == ()


@pytest.mark.parametrize("optimizer", ["scipy", pytest.param("ceres", marks=needs_ceres)])
def test_an_end_at_a_kink_is_no_convergence(optimizer):
    """A marker half on a particle that goes back and forth with every substep, never as far as was measured: nearest is
    a substep, where the motion between substeps has a kink. Steps shrink there and no slope vanishes."""
    scene = sb.Scene("zigzag", gravity=(0.0, 0.0, 0.0))
    scene.add_particles([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0]], 1.0)
    times = 0.01 * np.arange(41)
    motion = 0.01 * (-1.0) ** np.arange(41)[:, None, None] * np.array([1.0, 0.0, 0.0])
    scene.drive([0], times, motion)
    scene.add_quantity("clock", 0.004, "s", positive=False)
    measured = np.full((9, 1, 3), np.nan)
    measured[:8, 0, 0] = 0.006 + 1e-4 * np.arange(8)
    measured[:8, 0, 1:] = 0.0
    e = sb.Experiment(
        scene=scene,
        recording=sb.Recording(positions=measured, times=0.02 * np.arange(5, 14), name="zigzag"),
        markers=[sb.between(0, 1, 0.5)],
        solver=sb.Solver(h=0.01),
        start_time=0.0,
        time_offset="clock",
        axes="x",
    )
    fit = sb.fit(e, parameters=["clock"], optimizer=optimizer, profiles=False)
    assert fit["clock"].value == approx(0.0, abs=1e-6)  # 1 mm off, the least that it can be
    assert not fit.result.converged
    assert "no step lowers the cost, but its gradient promises 97 % less" in fit.result.message
    assert any("did not converge: no step" in words for words in fit.result.warnings)
    assert "did NOT converge" in fit.report()


@pytest.mark.parametrize(
    ("promised", "converged", "doubted"), [(1e-6, True, False), (0.01, True, True), (0.5, False, True)]
)
def test_a_slope_at_the_end_is_told_and_a_steep_one_is_no_end(monkeypatch, promised, converged, doubted):
    end = Minimum(np.zeros(1), 2.0, 3, 4, True, False, "small steps")
    monkeypatch.setattr(slope, "promised", lambda problem, u: promised)
    found = slope.judged(None, end, first=10.0)
    assert (found.converged, bool(found.doubt)) == (converged, doubted)
    assert found.message.endswith("small steps")


@needs_ceres
def test_the_last_jacobian_of_ceres_is_not_made_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """It has the bits of one that is."""
    problem = problem_of(swinging())
    end = minimize(problem, problem.parameters.initial(), "ceres")[0]
    fresh = problem_of(swinging()).evaluate(end.u)
    monkeypatch.setattr(problem, "evaluator", None)
    _, r, J = problem.evaluate(end.u)
    assert np.array_equal(r, fresh[1]) and np.array_equal(J, fresh[2])


@needs_ceres
def test_ceres_begins_with_the_jacobian_that_is_known(monkeypatch: pytest.MonkeyPatch) -> None:
    """It once made that of its start again, which costs as much as twenty simulations of a rope between grips."""
    fresh, known = problem_of(swinging()), problem_of(swinging())
    u = known.parameters.initial()
    known.evaluate(u)
    asked: list[tuple[bool, bool]] = []
    evaluate = Evaluator.__call__

    def evaluated(self: Evaluator, at: np.ndarray, jacobian: bool) -> Timed:
        asked.append((np.array_equal(at, u), jacobian))
        return evaluate(self, at, jacobian)

    monkeypatch.setattr(Evaluator, "__call__", evaluated)
    end, same = minimize(known, u, "ceres", first=1.0)[0], minimize(fresh, u, "ceres", first=1.0)[0]
    assert asked and (True, True) not in asked
    assert np.array_equal(end.u, same.u) and end.cost == same.cost and end.iterations == same.iterations
