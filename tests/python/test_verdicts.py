"""Fits that nothing should rest on: rough motions, ends that are no minimum, minima that something contradicts."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

import numpy as np
import pytest
import sheetbend as sb
from pytest import approx
from sheetbend.cli.outcome import Code, code_of
from sheetbend.doubts.conclude import judged_parameters, without_verdict
from sheetbend.doubts.contradictions import elsewhere, held_out_motion
from sheetbend.doubts.profiles import Elsewhere
from sheetbend.doubts.stationary import no_minimum
from sheetbend.experiment.wanted import as_parameters
from sheetbend.minimum.progress import Minimum
from sheetbend.objects.arm import add_arm
from sheetbend.problem.problem import FitProblem
from sheetbend.result.estimate import UNSOUND
from sheetbend.statistics.identifiability import Identifiability

SOLVER = sb.Solver(h=1 / 400)
WANTED = {"rope_EI": {"initial": 3e-3}, "rope_bend_damping": {"initial": 0.03}}
TRUE = {"rope_EI": 2e-3, "rope_bend_damping": 0.02}
SIGMA = 1e-4


def rope(name: str = "rope") -> sb.Scene:
    scene = sb.Scene(name)
    sb.add_rope(
        scene, name, length=0.5, segments=6, density=0.05, EA=1e3, EI=2e-3, bend_damping=0.02, clamp_start=(1, 0, 0)
    )
    return scene.freeze()


def swinging(group: str = "rope", **fields: object) -> sb.Experiment:
    at = [2, 4, 6]
    clean = sb.simulate(rope(group), np.arange(41) / 100, SOLVER)
    positions = clean.positions[:, at] + SIGMA * np.random.default_rng(0).standard_normal((41, 3, 3))
    recording = sb.Recording(positions=positions, times=clean.times, name=f"swing of {group}")
    given = {"markers": [sb.on_particle(i) for i in at], "solver": SOLVER, "sigma": SIGMA}
    return sb.Experiment(scene=rope(group), recording=recording, **(given | fields))


def problem_of(*experiments: sb.Experiment, wanted: object = None) -> FitProblem:
    return FitProblem(experiments, as_parameters(wanted or WANTED, experiments))


def verdicts(found: sb.Fit) -> set[str]:
    return {e.verdict for e in found.result.estimates}


def claims_nothing(found: sb.Fit) -> bool:
    """No interval, no gauge, no correlation."""
    open_ = all(e.lower is None and e.upper is None for e in found.result.estimates)
    return open_ and not found.result.gauges and not found.result.correlations


# --- rough


def near_the_top(seconds: float) -> sb.Experiment:
    scene = sb.Scene("double_pendulum")
    upper = add_arm(scene, "upper", mass=0.09, first_moment=0.0107, inertia=0.00154, length=0.173, angle=3.0)
    add_arm(scene, "lower", mass=0.14, first_moment=0.0169, inertia=0.0033, length=0.25, pivot=upper, angle=3.1)
    last, times = int(scene.free[-1]), np.arange(round(20 * seconds) + 1) / 20
    clean = sb.simulate(scene, times, SOLVER).positions[:, [last]]
    noisy = clean + SIGMA * np.random.default_rng(0).standard_normal(clean.shape)
    recording = sb.Recording(positions=noisy, times=times, name="top")
    return sb.Experiment(
        scene=scene, recording=recording, markers=[sb.on_particle(last)], solver=SOLVER, sigma=SIGMA, axes="xz"
    )


ARMS = {"lower_inertia": {"initial": 0.0031}, "upper_inertia": {}, "lower_first_moment": {}}


def test_nothing_is_derived_from_a_motion_whose_derivatives_explode() -> None:
    found = sb.fit(near_the_top(20.0), parameters=ARMS)
    assert verdicts(found) == {"rough"} and claims_nothing(found)
    assert re.search(r"up to [0-9.]+ s it can be fitted", found["lower_inertia"].words)
    assert any(warning.startswith("rough: lower_inertia, upper_inertia") for warning in found.result.warnings)
    assert code_of([found.result], False) == Code.NOT_CONVERGED
    report = found.report()
    assert "not identifiable" not in report and "What contradicts this fit" in report


def test_the_first_half_second_of_the_same_motion_is_no_rough_one() -> None:
    found = sb.fit(near_the_top(0.5), parameters={"lower_inertia": {"initial": 0.0031}})
    assert found["lower_inertia"].verdict == "identified"
    assert found["lower_inertia"].value == approx(0.0033, rel=0.02)


@dataclass(frozen=True)
class Grown:
    """What a measurement of growth tells."""

    name: str
    largest: float
    until: float | None


def test_parameters_beside_a_rough_motion_keep_their_verdicts() -> None:
    """Two ropes without a common parameter, of which one is said to be rough."""
    first, second = swinging("rope"), swinging("cord")
    wanted = {"rope_EI": {}, "cord_EI": {"initial": 2.5e-3}, "cord_bend_damping": {}}
    problem = problem_of(first, second, wanted=wanted)
    u = problem.parameters.to_internal({"rope_EI": 2e-3, "cord_EI": 2e-3, "cord_bend_damping": 0.02})
    end = Minimum(u, problem_cost(problem, u), 3, 4, True, False, "")
    growth = [Grown(first.name, 3e37, 0.6), Grown(second.name, 2.0, None)]
    lost = without_verdict(problem, end, growth)
    assert list(lost) == ["rope_EI"] and lost["rope_EI"].verdict == "rough"
    assert "3e+37" in lost["rope_EI"].words and "up to 0.6 s" in lost["rope_EI"].words
    judged, _ = judged_parameters(problem, u, {}, {}, None, lost)
    assert [e.verdict for e in judged.estimates] == ["rough", "identified", "identified"]
    alone, _ = judged_parameters(
        problem_of(second, wanted={n: wanted[n] for n in wanted if "cord" in n}), u[1:], {}, {}, None
    )
    assert judged.estimates[1:] == alone.estimates


def test_what_shares_a_parameter_with_a_rough_motion_is_rough_too() -> None:
    first, second = swinging("rope"), swinging("rope", name="again")
    problem = problem_of(first, second, wanted={"rope_EI": {}, "rope_bend_damping": {"private": True}})
    u = problem.parameters.initial()
    end = Minimum(u, problem_cost(problem, u), 3, 4, True, False, "")
    lost = without_verdict(problem, end, [Grown(first.name, 1e9, 0.1)])
    assert {e.verdict for e in lost.values()} == {"rough"} and len(lost) == 3


# --- no minimum


def problem_cost(problem: FitProblem, u: np.ndarray) -> float:
    _, r, _ = problem.evaluate(u)
    return 0.5 * float(r @ r)


@pytest.mark.parametrize("optimizer", ["scipy", "auto"])
def test_an_optimizer_that_was_stopped_on_its_way_has_no_minimum(optimizer: str) -> None:
    found = sb.fit(swinging(), parameters=WANTED, optimizer=optimizer, max_iterations=2)
    assert verdicts(found) == {"no minimum"} and claims_nothing(found)
    assert "early: its next step would lower the cost by" in found["rope_EI"].words
    assert code_of([found.result], False) == Code.NOT_CONVERGED
    assert "no minimum: rope_EI, rope_bend_damping" in found.result.warnings[0]


def test_an_end_near_its_start_is_a_minimum_only_if_nothing_near_is_lower() -> None:
    problem = problem_of(swinging())
    u = problem.parameters.initial()
    cost = problem_cost(problem, u)
    stuck = Minimum(u, cost, 0, 1, True, False, "small steps", first=cost)
    assert "alone lowers" in no_minimum(problem, stuck)
    true = problem.parameters.to_internal(TRUE)
    least = problem_cost(problem, true)
    assert no_minimum(problem, Minimum(true, least, 0, 1, True, False, "", first=least)) == ""
    # residuals of several sigma in a true minimum, from which a fit starts again
    coarse = problem_of(swinging(sigma=SIGMA / 5), wanted=WANTED)
    again = sb.fit(swinging(sigma=SIGMA / 5), parameters={n: {"initial": v} for n, v in TRUE.items()}, refine=False)
    end = coarse.parameters.to_internal(again.values)
    least = problem_cost(coarse, end)
    assert 2 * least > 9 * coarse.core.data_rows
    assert no_minimum(coarse, Minimum(end, least, 0, 1, True, False, "", first=least)) == ""


def test_an_interrupted_fit_near_its_minimum_keeps_its_verdicts() -> None:
    problem = problem_of(swinging())
    best = problem.parameters.to_internal(sb.fit(swinging(), parameters=WANTED, refine=False).values)
    end = Minimum(best, problem_cost(problem, best), 3, 4, False, True, "interrupted", first=1e6)
    assert no_minimum(problem, end) == "" and without_verdict(problem, end) == {}
    far = problem.parameters.initial()
    begun = replace(end, u=far, cost=problem_cost(problem, far))
    assert no_minimum(problem, begun).startswith("interrupted early: its next step would lower")


# --- doubtful


def test_another_start_that_ends_as_low_elsewhere_is_a_doubt() -> None:
    found = sb.fit(swinging(), parameters=WANTED)
    problem, judged = problem_of(swinging()), Identifiability(found.result.estimates, (), 2, np.zeros(2), (), 1.0)
    cost, values = found.result.cost, found.values

    def doubts(rise: float, **changes: float) -> dict[str, str]:
        return elsewhere(problem, judged, cost, [Elsewhere(rise, values | changes, "another start")])

    assert doubts(0.0) == {} and doubts(1e-6 * cost, rope_EI=1.0001 * values["rope_EI"]) == {}
    assert list(doubts(1e-6 * cost, rope_EI=2 * values["rope_EI"])) == ["rope_EI"]
    assert "20 % lower" in doubts(-0.2 * cost, rope_EI=2 * values["rope_EI"])["rope_EI"]
    assert doubts(0.5 * cost, rope_EI=2 * values["rope_EI"]) == {}  # a worse minimum is none
    assert doubts(np.inf, rope_EI=2 * values["rope_EI"]) == {}  # nor is a start that diverged


def test_held_out_motion_that_is_missed_by_more_than_itself_is_a_doubt() -> None:
    """The held-out part shows the motion with its sign turned."""
    e = swinging()
    turned = e.recording.positions.copy()
    turned[20:] = 2 * turned[20:].mean(axis=0) - turned[20:]
    part = {"fit": (0.0, 0.19), "held_out": (0.2, 0.4), "parameters": WANTED}
    wrong = sb.fit(
        e.scene, replace(e.recording, positions=turned), markers=e.markers, solver=SOLVER, sigma=SIGMA, **part
    )
    assert verdicts(wrong) == {"doubtful"}
    assert "that nothing moves is a better prediction" in wrong["rope_EI"].words
    assert wrong["rope_EI"].lower is not None and code_of([wrong.result], False) == Code.NOT_CONVERGED
    right = sb.fit(e.scene, e.recording, markers=e.markers, solver=SOLVER, sigma=SIGMA, **part)
    assert not verdicts(right) & set(UNSOUND) and code_of([right.result], False) == Code.DONE
    # at rest there is no motion to miss: what is left is noise
    rows = [replace(row, motion=2 * SIGMA, held_out=3 * SIGMA) for row in wrong.result.recordings]
    assert held_out_motion(problem_of(e), wrong.comparisons, rows, interrupted=False) == {}
    # a model that moves where the recording hardly does: a cloth in a wind of the wrong sign was "identified"
    rows = [replace(row, motion=2 * SIGMA, held_out=30 * SIGMA) for row in rows]
    found = held_out_motion(problem_of(e), wrong.comparisons, rows, interrupted=False)
    assert "is 1500 % of the motion" in found["rope_EI"]
    # after Ctrl-C pieces start from the others' mean: masses of a triple pendulum were doubtful, then identified
    for predict, doubted in {"window": False, "mean": True}.items():
        pieces = [replace(c, experiment=replace(c.experiment, predict=predict)) for c in wrong.comparisons]
        assert ("rope_EI" in held_out_motion(problem_of(e), pieces, rows, interrupted=True)) == doubted


def test_a_file_of_an_earlier_version_still_loads(tmp_path) -> None:
    found = sb.fit(swinging(), parameters=WANTED).result
    found.save(tmp_path / "fit.json")
    assert sb.FitResult.load(tmp_path / "fit.json") == found
    assert found.misfit is not None and found.misfit.reduced_chi_square == approx(1.0, abs=0.15)
    assert found.misfit.model_error < 0.5 * SIGMA
    earlier = {key: value for key, value in found.to_dict().items() if key != "misfit"}
    assert sb.FitResult.from_dict(earlier).misfit is None
    assert "Misfit" in found.report() and "Misfit" not in sb.FitResult.from_dict(earlier).report()
