"""What the time step, the mesh and sweeps do to an estimate, and that a fit counts it without being asked."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import sheetbend as sb
from pytest import approx
from sheetbend.experiment.wanted import as_parameters
from sheetbend.mesh import grid
from sheetbend.minimum import discretization, time_step
from sheetbend.minimum.linear_step import gauss_newton, moves
from sheetbend.minimum.optimizers import minimize, refit
from sheetbend.minimum.progress import Minimum
from sheetbend.minimum.time_step import settle
from sheetbend.problem.problem import FitProblem
from sheetbend.quantities.parameters import Parameter, Parameters
from sheetbend.result.estimate import Estimate

TRUE = {"warp": 60.0, "weft": 40.0, "shear": 12.0}
WANTED = ["cloth_warp", "cloth_shear", "cloth_bending", "cloth_drag_linear"]
SEEN = np.array([(x, y) for x in np.linspace(0.0, 0.2, 4)[1:] for y in np.linspace(0.0, 0.2, 4)])


def swatch(cells: int = 4, share: float = 1.0) -> tuple[sb.Scene, list[sb.Place]]:
    """A sheet of 0.2 m held along one side, level, with stiffness off by a share; and places of its markers."""
    scene, mesh = sb.Scene("swatch"), grid(0.2, 0.2, cells, cells, "one_way")
    stiffness = {name: share * value for name, value in TRUE.items()} | {"weft": TRUE["weft"]}
    held = np.flatnonzero(mesh.material[:, 0] == 0.0)
    known = {"density": 0.15, "bending": 5e-5, "membrane_damping": 1e-3, "drag_linear": 0.1}
    cloth = sb.add_cloth(scene, mesh, held=held, **stiffness, **known)
    scene.pin(cloth.particles[held])
    return scene, list(sb.on_cloth(cloth, SEEN))


def recorded(h: float = 1 / 960, cells: int = 4, noise: float = 2e-4, frames: int = 15) -> sb.Recording:
    """It falls; seen at 60 Hz."""
    scene, places = swatch(cells)
    times = np.arange(frames + 1) / 60
    blank = sb.Recording(positions=np.zeros((len(times), len(places), 3)), times=times, name="swatch")
    e = sb.Experiment(scene=scene, recording=blank, markers=places, solver=sb.Solver(h=h, method="newton"))
    problem = FitProblem([e], as_parameters(["cloth_warp"], [e]))
    seen = problem.simulate(problem.parameters.initial())[0]
    return replace(blank, positions=seen + noise * np.random.default_rng(0).standard_normal(seen.shape))


def watched(recording: sb.Recording, cells: int = 4, method: str = "newton", **solver: object) -> sb.Experiment:
    scene, places = swatch(cells, 1.3)
    return sb.Experiment(
        scene=scene,
        recording=recording,
        markers=places,
        sigma=2e-4,
        solver=sb.Solver(**({"h": 1 / 240, "method": method} | solver)),
    )


def off(e: Estimate, truth: float) -> float:
    """Distance from the truth in half-widths."""
    return abs(e.value - truth) / e.half_width


def test_a_coarse_substep_is_not_identified_stiffness():
    """Measured at 1/960 and fitted at 1/240: the warp reads 15 % too stiff, at the end of its interval, until the
    estimate is moved to the limit of short substeps. Without that limit, what the long substep damps is noticed."""
    recording = recorded()
    plain = sb.fit(watched(recording), parameters=WANTED, profiles=False, refine=False)
    assert plain["cloth_warp"].value > 1.15 * TRUE["warp"] and plain["cloth_warp"].verdict == "doubtful"
    assert "take a shorter substep" in plain["cloth_warp"].words
    assert "time step not counted" in plain.report()
    found = sb.fit(watched(recording), parameters=WANTED, profiles=False)
    for name in ("warp", "shear"):
        assert off(found[f"cloth_{name}"], TRUE[name]) < 1
    warp = found["cloth_warp"]
    assert off(warp, TRUE["warp"]) < 0.5 * off(plain["cloth_warp"], TRUE["warp"])
    assert warp.value - warp.moved == approx(plain["cloth_warp"].value)
    assert warp.verdict == "identified" and warp.half_width < plain["cloth_warp"].half_width
    assert 0 < warp.discretization < 0.1 * abs(warp.moved)
    assert found.result.cost < 0.8 * plain.result.cost and "value moved by" in found.report()


def test_the_estimate_moves_to_where_a_fit_of_combined_runs_ends():
    recording = recorded()
    found = sb.fit(watched(recording), parameters=WANTED, profiles=False)
    whole = sb.fit(watched(recording, extrapolate=2), parameters=WANTED, profiles=False, refine=False)
    for name in WANTED:
        assert found[name].value == approx(whole[name].value, abs=0.1 * whole[name].half_width)
        assert found[name].statistical == approx(whole[name].half_width, rel=0.05)
    assert found.result.cost == approx(whole.result.cost, rel=1e-3)


def test_what_is_measured_at_the_limit_is_not_moved_from_it():
    """A substep that does not matter moves the estimate by less than a tenth of its interval."""
    scene = sb.rope(0.5, 6, density=0.05, EI=2e-3, bend_damping=0.02, clamp_start=(1, 0, 0))
    solver = sb.Solver(h=1 / 2400)
    x = sb.simulate(scene, np.arange(31) / 100, solver).positions[:, [3, 6]]
    x += 1e-3 * np.random.default_rng(0).standard_normal(x.shape)
    recording = sb.Recording(positions=x, times=np.arange(31) / 100, name="rope")
    places = [sb.on_particle(3), sb.on_particle(6)]
    found = sb.fit(scene, recording, ["rope_EI"], markers=places, solver=solver)["rope_EI"]
    assert 0 < abs(found.moved) < 0.1 * found.half_width


def test_a_drag_that_a_long_substep_takes_for_its_own_comes_back():
    """At 5 ms backward Euler damps more than the air does. The fit said "at a bound", with a drag of at most 0.0052."""

    def rope(drag: float) -> sb.Scene:
        return sb.rope(0.5, 6, density=0.05, EI=2e-3, drag_linear=drag, clamp_start=(1, 0, 0))

    times, watched_at = np.arange(61) / 100, (2, 4, 6)
    fine = sb.Solver(h=1 / 3200, integrator="bdf1", extrapolate=2)
    x = sb.simulate(rope(0.01), times, fine).positions[:, watched_at]
    x += 1e-3 * np.random.default_rng(0).standard_normal(x.shape)
    e = sb.Experiment(
        scene=rope(0.013),
        recording=sb.Recording(positions=x, times=times, name="rope"),
        markers=[sb.on_particle(k) for k in watched_at],
        solver=sb.Solver(h=1 / 200, integrator="bdf1"),
        sigma=1e-3,
    )
    found = sb.fit(e, parameters=["rope_EI", "rope_drag_linear"], beginnings=False)
    for name, true in (("rope_EI", 2e-3), ("rope_drag_linear", 0.01)):
        assert found[name].lower < true < found[name].upper < 1.1 * true
    assert found["rope_drag_linear"].moved == approx(found["rope_drag_linear"].value, rel=1e-4)
    assert any("went to a limit at the substep of the fit" in words for words in found.result.warnings)


def test_sweeps_that_have_not_converged_are_a_floor():
    """The stiffness that 3 sweeps can show is far above what is fitted, and still they are read as the fabric's."""
    recording = recorded(1 / 240)
    found = sb.fit(watched(recording, method="gauss_seidel", iterations=3), parameters=WANTED, profiles=False)
    assert found["cloth_bending"].verdict == "at its floor"
    assert "twice as many would move it" in found["cloth_bending"].words
    assert off(found["cloth_warp"], TRUE["warp"]) < 1
    enough = sb.fit(watched(recording, method="gauss_seidel", iterations=60), parameters=WANTED, profiles=False)
    assert {e.verdict for e in enough.result.estimates} <= {"identified", "weak"}


def test_motions_that_are_not_smooth_count_all_that_half_the_step_moves():
    """Linear knots kick, so that runs have no limit to be combined to; the estimate stays."""
    scene = sb.rope(0.5, 6, density=0.05, EI=2e-3, bend_damping=0.02, clamp_start=(1, 0, 0))
    times = np.arange(31) / 100
    held = scene.positions[[0]] + 0.02 * np.sin(12 * times)[:, None, None] * np.array([0.0, 0.0, 1.0])
    scene = sb.rope(0.5, 6, density=0.05, EI=2e-3, bend_damping=0.02, pinned=())
    scene.drive([0], times, held, "linear")
    solver = sb.Solver(h=1 / 200)
    x = sb.simulate(scene, times, replace(solver, h=1 / 1600)).positions[:, [3, 6]]
    x += 1e-4 * np.random.default_rng(0).standard_normal(x.shape)
    recording = sb.Recording(positions=x, times=times, name="rope")
    found = sb.fit(
        scene, recording, ["rope_EI"], markers=[sb.on_particle(3), sb.on_particle(6)], solver=solver, start_time=0.0
    )
    assert found["rope_EI"].moved == 0 and found["rope_EI"].discretization > 0
    assert found.result.refits[0].to_limit == approx(4 / 3)
    assert off(found["rope_EI"], 2e-3) < 1


def rope(links: int, EI: float = 2e-3) -> sb.Experiment:
    """Clamped level and let go, seen at three places along it."""
    scene = sb.rope(0.5, links, density=0.05, EI=EI, bend_damping=0.02, drag_linear=0.01, clamp_start=(1, 0, 0))
    places = [sb.on_rope(scene.ropes["rope"], s) for s in (0.2, 0.35, 0.5)]
    times = np.arange(25) / 100
    blank = sb.Recording(positions=np.zeros((25, 3, 3)), times=times, name="rope")
    return sb.Experiment(scene=scene, recording=blank, markers=places, solver=sb.Solver(h=1 / 400), sigma=1e-4)


def of_sixty_links() -> sb.Recording:
    e = rope(60)
    problem = FitProblem([e], as_parameters(["rope_EI"], [e]))
    seen = problem.simulate(problem.parameters.initial())[0]
    return replace(e.recording, positions=seen + 1e-4 * np.random.default_rng(0).standard_normal(seen.shape))


def test_a_finer_mesh_is_counted_where_it_can_be_made_and_named_where_not(tmp_path):
    """A rope of 10 links fitted to one of 60: its EI is off by many half-widths of an interval without the mesh."""
    recording = of_sixty_links()
    coarse = replace(rope(10, 3e-3), recording=recording)
    wanted = ["rope_EI", "rope_bend_damping", "rope_drag_linear"]
    alone = sb.fit(coarse, parameters=wanted, profiles=False)
    assert alone.result.not_counted == ("mesh not counted",) and "mesh not counted" in alone.report()
    alone.save(tmp_path / "fit.json")
    assert sb.FitResult.load(tmp_path / "fit.json").not_counted == alone.result.not_counted
    assert alone["rope_EI"].verdict == "doubtful" and off(alone["rope_EI"], 2e-3) > 2
    assert "links of 50 mm can look like that" in " ".join(alone.report().split())
    finer = sb.Refinement(finer=lambda: [replace(rope(20), recording=recording)], linear=True)
    found = sb.fit(coarse, parameters=wanted, profiles=False, refine=finer)
    assert found.result.not_counted == () and dict(found.on_mesh) == alone.values
    assert all(off(found[name], truth) < 1 for name, truth in zip(wanted, (2e-3, 0.02, 0.01), strict=True))
    EI, before = found["rope_EI"], alone["rope_EI"]
    assert EI.value - EI.moved == approx(before.value - before.moved) and EI.verdict == "identified"
    assert abs(EI.value - 2e-3) < 0.1 * abs(before.value - 2e-3) and EI.half_width < 4 * before.half_width
    found.save(tmp_path / "fit.json")
    assert sb.FitResult.load(tmp_path / "fit.json") == found.result
    assert "and fine meshes" in found.report()
    step = found.result.refits[-1]
    assert step.name == "finer mesh" and 0 < step.left["rope_EI"] < 0.3 * abs(step.to_limit * step.moved["rope_EI"])


@pytest.mark.slow
def test_a_sheet_on_a_mesh_three_times_too_coarse_is_not_identified():
    """6 cells fitted to 18: drag comes out 32 % too low, four half-widths of an interval without the mesh."""
    recording = recorded(1 / 480, cells=18, noise=1e-4)

    def of(cells: int) -> sb.Experiment:
        e = watched(recording, cells=cells)
        for name in ("cloth_warp", "cloth_shear"):
            e.scene.quantities[name] = replace(e.scene.quantities[name], value=TRUE[name.removeprefix("cloth_")])
        return e

    truth = {"cloth_bending": 5e-5, "cloth_drag_linear": 0.1}
    alone = sb.fit(of(6), parameters=list(truth), profiles=False)
    # Without the mesh parts of the data contradict each other, which is said.
    assert alone["cloth_drag_linear"].verdict == "doubtful" and off(alone["cloth_drag_linear"], 0.1) > 3
    assert "mesh not counted" in alone.report().split("Where the intervals")[0]
    finer = sb.Refinement(finer=lambda: [of(12)], linear=True)
    found = sb.fit(of(6), parameters=list(truth), profiles=False, refine=finer)
    for name, value in truth.items():
        assert found[name].verdict in ("weak", "doubtful") and off(found[name], value) < 1


def test_a_refit_on_a_finer_mesh_begins_near_its_end(monkeypatch: pytest.MonkeyPatch):
    """It ends where one from the fit's minimum does, in fewer iterations."""
    coarse, fine = (replace(rope(links, 3e-3), recording=of_sixty_links()) for links in (20, 40))
    wanted = ["rope_EI", "rope_bend_damping", "rope_drag_linear"]
    problem = FitProblem([coarse], as_parameters(wanted, [coarse]))
    u = minimize(problem, problem.parameters.initial())[0].u
    plain = minimize(FitProblem([fine], problem.given), u)[0]
    ends: list[Minimum] = []

    def noted(*given: Any, **options: Any) -> Minimum:
        ends.append(refit(*given, **options))
        return ends[-1]

    monkeypatch.setattr(discretization, "refit", noted)
    finer = sb.Refinement(finer=lambda: [fine])
    (made,), _, _ = discretization.refined_estimates(finer, [coarse], problem, u, u, "auto")
    (end,) = ends
    assert end.iterations < plain.iterations and end.first < 0.3 * plain.first
    assert made.moved == approx(moves(problem.parameters, u, plain.u), rel=1e-6)


def test_a_refinement_that_has_no_answer_is_named_and_does_not_end_the_fit(monkeypatch):
    monkeypatch.setattr("sheetbend.experiment.checks.ENDLESS", np.inf)  # so that such a substep is tried
    recording = of_sixty_links()
    coarse = replace(rope(10, 3e-3), recording=recording)
    broken = replace(rope(20), recording=recording, solver=sb.Solver(h=1e-300))
    ways = [sb.Refinement(finer=lambda: [broken], linear=linear) for linear in (True, False)]
    with pytest.warns(sb.RedundantConstraintsWarning, match="no answer in double precision") as told:
        fits = [sb.fit(coarse, parameters=["rope_EI"], refine=refine) for refine in ways]
    for found in fits:
        (words,) = found.result.not_counted
        assert words.startswith("finer mesh not counted: ") and found.result.converged
    assert not any("follows from" in str(w.message) for w in told)


def test_the_limit_is_simulated_once_at_every_point(monkeypatch):
    e = rope(8)
    problem = FitProblem([e], as_parameters(["rope_EI"], [e]))
    fine = FitProblem([replace(e, solver=sb.Solver(h=1 / 1600))], problem.given)
    seen = fine.simulate(problem.parameters.initial())[0]
    problem = FitProblem([replace(e, recording=replace(e.recording, positions=seen))], problem.given)
    end, _ = minimize(problem, problem.parameters.initial())
    asked, evaluate = [], FitProblem.evaluate

    def noted(self, u, jacobian=True):
        asked.append((self.experiments[0].solver, tuple(u), jacobian))
        return evaluate(self, u, jacobian)

    monkeypatch.setattr(FitProblem, "evaluate", noted)
    found = settle(problem, end.u)
    plain = [one for one in asked if not one[-1]]
    assert found.moved and plain and len(plain) == len(set(plain))


def test_what_refine_may_be():
    coarse = replace(rope(10), recording=of_sixty_links())
    for given in (None, False):
        result = sb.fit(coarse, parameters=["rope_EI"], refine=given).result
        assert result.not_counted == ("time step not counted", "mesh not counted")
        assert result["rope_EI"].discretization == 0 and result["rope_EI"].moved == 0
    with pytest.raises(sb.InputError, match="refine"):
        sb.fit(coarse, parameters=["rope_EI"], refine="finer")


class Bent:
    """A problem of two numbers whose Gauss-Newton steps in the second go too far, since its residuals are large and
    bend; the first moves by `shift` from one discretization to the next."""

    def __init__(self, shift: float) -> None:
        self.shift, self.parameters = shift, Parameters([Parameter(name=n, initial=0.0) for n in ("moved", "bent")])
        self.experiments, self.core, self.jacobians = (), SimpleNamespace(data_rows=3, rows=3), 0
        self.estimates_corrections = False

    def follow(self, other: Bent) -> Bent:
        return self

    def evaluate(self, u: np.ndarray, jacobian: bool = True) -> tuple[bool, np.ndarray, np.ndarray]:
        self.jacobians += jacobian
        r = np.array([u[0] - self.shift, u[1], 10.0 + 0.075 * u[1] ** 2])
        return True, r, np.array([[1.0, 0.0], [0.0, 1.0], [0.0, 0.15 * u[1]]])


def test_a_step_in_vain_does_not_throw_the_limit_away(monkeypatch: pytest.MonkeyPatch):
    """The first step takes off all that the limit has to give, the second raises the cost by a tenth."""
    problem, limit, finest = Bent(0.0), Bent(5.0), Bent(5.5)
    given = iter([limit, finest])
    monkeypatch.setattr(problem, "of", lambda experiments: next(given), raising=False)
    start = np.array([0.0, 2.0])
    found = time_step.settle(problem, start)
    assert found.problem is limit and limit.jacobians <= 2
    assert found.u == approx([5.0, 2.0]) and found.moved == approx({"moved": 5.0, "bent": 0.0})
    (left,) = found.refits
    step = gauss_newton(limit.parameters, found.u, *limit.evaluate(found.u)[:0:-1])
    assert left.moved == approx({"moved": 8 / 7 * 0.5, "bent": abs(step[1] - 2.0)})
