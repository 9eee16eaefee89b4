"""Many starts: where they are drawn, how they are raced and grouped, and what a result tells of them."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.config import load
from sheetbend.errors import InputError
from sheetbend.experiment.wanted import as_parameters
from sheetbend.minimum.conditioning import Condition
from sheetbend.minimum.progress import Progress
from sheetbend.minimum.race import Course, Reference, race
from sheetbend.minimum.starts import drawn, off_bounds
from sheetbend.problem.problem import FitProblem
from sheetbend.quantities.parameters import Parameter, Parameters
from sheetbend.report.fit_result import FitResult
from test_journal import bits
from test_search import swinging, without_answer

TWIN = Path(__file__).resolve().parents[2] / "experiments/twin/twin.toml"
ALONE = {"refine": False, "profiles": False, "beginnings": False}
EI = {"rope_EI": {"initial": 3e-3}}


# --- points


def test_starts_fill_priors_bounds_or_two_decades():
    parameters = Parameters(
        [
            Parameter(name="open", initial=2.0, log=True),
            Parameter(name="bounded", initial=0.5, lower=0.0, upper=1.0),
            Parameter(name="half", initial=2.0, log=True, lower=1.0),
            Parameter(name="prior", initial=1.0, log=True, prior=(3.0, 0.1), upper=3.0),
            Parameter(name="angle", initial=0.2, scale=0.1),
            Parameter(name="zero", initial=0.0),
        ]
    )
    points = drawn(parameters, 65)
    assert np.array_equal(points[0], parameters.initial()) and len(points) == 65
    assert np.array_equal(points, drawn(parameters, 65))  # the same every time
    x = np.array([list(parameters.to_physical(u).values()) for u in points[1:]])
    ranges = [(0.2, 20.0), (0.0, 1.0), (1.0, 20.0), (0.0, 3.0), (0.1, 0.3), (0.0, 0.0)]
    for column, (lower, upper) in zip(x.T, ranges, strict=True):
        assert lower - 1e-12 <= column.min() and column.max() <= upper + 1e-12
    for column, lower, upper in ((np.log(x[:, 0]), *np.log([0.2, 20.0])), (x[:, 1], 0.0, 1.0)):
        assert np.histogram(column, 8, (lower, upper))[0].tolist() == [8] * 8  # even, as no independent draws are
    left = np.log(x[:, 3] / 3.0) / 0.1  # the lower half of a normal distribution
    assert np.sqrt(np.mean(left**2)) == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("count", [0, -3, True, 5000])
def test_a_number_of_starts_is_checked(count):
    with pytest.raises(InputError, match="starts"):
        sb.fit(swinging(), parameters=EI, starts=count)


def test_starts_are_moved_off_bounds():
    parameters = Parameters(
        [
            Parameter(name="both", initial=0.0, lower=0.0, upper=2.0),
            Parameter(name="above", initial=1.0, log=True, upper=1.0),
            Parameter(name="angle", initial=-1.0, lower=-1.0, scale=0.2),
            Parameter(name="inside", initial=0.01, lower=0.0, upper=2.0),
        ]
    )
    moved = off_bounds(parameters, parameters.initial())
    assert moved == pytest.approx([0.1, -0.05 * math.log(10.0), -0.99, 0.01])


def test_a_fit_from_a_bound_finds_what_is_inside():
    wanted = {"rope_EI": {"initial": 1e-1, "upper": 1e-1, "lower": 1e-5}}
    seen: list[Progress] = []
    found = sb.fit(swinging(), parameters=wanted, progress=seen.append, **ALONE)
    assert math.exp(seen[0].u[0]) == pytest.approx(1e-1 * (1e-4) ** 0.05)
    assert found["rope_EI"].value == pytest.approx(2e-3, rel=0.05)


# --- condition


def test_the_condition_names_parameters_that_are_alike():
    rng = np.random.default_rng(1)
    a, b = rng.standard_normal((2, 40))
    J = np.stack([a, 1e6 * b, 3.0 * a + 1e-6 * b], axis=1)
    found = Condition.of(J, ["mass", "drag", "stiffness"])
    assert found.number > 1e6 and set(found.alike) == {"mass", "stiffness"}
    assert f"{' and '.join(found.alike)} can hardly be told apart" in found.words
    apart = Condition.of(np.stack([a, 1e6 * b], axis=1), ["mass", "drag"])
    exact = np.linalg.cond(np.stack([a / np.linalg.norm(a), b / np.linalg.norm(b)], axis=1))
    assert apart.number == pytest.approx(exact) and "told apart" not in apart.words
    unseen = Condition.of(np.stack([a, 0.0 * b], axis=1), ["mass", "drag"])
    assert unseen.number == np.inf and unseen.unseen == ("drag",) and "drag moves nothing" in unseen.words


def test_the_condition_is_told_before_the_first_step():
    seen: list[Progress] = []
    found = sb.fit(swinging(), parameters=["rope_EI", "rope_density"], progress=seen.append, **ALONE)
    assert seen[0].iteration == 0 and seen[0].condition is not None
    assert all(progress.condition is None for progress in seen[1:])
    assert found.result.condition == seen[0].condition.words and "condition" in found.report()


# --- the race


def test_ends_are_alike_where_a_quadratic_model_explains_them():
    end = Reference(np.zeros(2), 10.0, np.diag([10.0, 1e-3]), 0.0)
    assert end.holds(np.array([0.1, 100.0]), 10.5)  # the second hardly counts
    assert not end.holds(np.array([0.1, 0.0]), 12.0)  # costs more than the model says: another valley
    assert not end.holds(np.array([0.1, 0.0]), 9.0)
    assert not end.holds(np.array([1.0, 0.0]), 60.0)
    assert not end.holds(np.array([np.inf, 0.0]), 10.0)


def test_32_starts_on_the_twin_rope_are_one_group():
    """Over two decades: between a tenth and ten times the initial values."""
    study = load(TWIN)
    wanted = dict.fromkeys(study.parameters)
    seen: list[Progress] = []
    found = sb.fit(study.experiments, parameters=wanted, starts=32, progress=seen.append, **ALONE)
    alone = sb.fit(study.experiments, parameters=wanted, **ALONE)
    starts = found.result.starts
    assert len(starts) == 32 and sum(start.group == 1 for start in starts) >= 30
    assert found.result.cost == pytest.approx(alone.result.cost, rel=1e-6)
    assert [s.raced for s in starts] == sorted(s.raced for s in starts)
    factors = [s.first["rope_EI"] / 1e-3 for s in starts]
    assert 0.1 <= min(factors) < 0.2 and 5.0 < max(factors) <= 10.0
    # Of windows a third as long at most: a sixteenth of a whole fit each.
    assert found.result.jacobians < 14 * 32
    assert max(p.start for p in seen if p.start) == (32, 32)
    words = found.report()
    assert "Groups of starts" in words and "32 of 32 ended within 1 %" in words
    assert FitResult.from_dict(found.result.to_dict()) == found.result


def test_raced_starts_that_diverge_are_rows(monkeypatch):
    without_answer(lambda p, v: v["rope_EI"] > 1.5e-2, monkeypatch)
    found = sb.fit(swinging(), parameters=EI, starts=16, **ALONE)
    starts = found.result.starts
    lost = [s for s in starts if s.cost is None]
    assert len(starts) == 16 and 1 <= len(lost) <= 4 and starts[-len(lost) :] == tuple(lost)
    assert all(s.group is None and s.raced is None and s.first["rope_EI"] > 1.5e-2 for s in lost)
    assert found["rope_EI"].value == pytest.approx(2e-3, rel=0.05)
    assert any(f"{len(lost)} of 16 starts failed" in words for words in found.result.warnings)
    assert f"failed: {len(lost)} of 16" in found.report()


def test_where_all_raced_starts_diverge_the_fit_says_why(monkeypatch):
    without_answer(lambda p, v: True, monkeypatch)
    with pytest.raises(sb.SheetbendError, match="cannot start"):
        sb.fit(swinging(), parameters=EI, starts=4, **ALONE)


def two_minima() -> tuple[sb.Experiment, str]:
    """A rope that leaves its clamp to the left or to the right of the picture's plane: the picture does not tell."""
    times = np.arange(30) / 50

    def scene() -> sb.Scene:
        return sb.rope(0.5, 6, density=0.05, EI=5e-3, clamp_start=(1, 0, 0), clamp_angles=True, plane=(0, 0, 1))

    solver = sb.Solver(h=1 / 200)
    name = next(name for name in scene().quantities if "angle" in name)
    exact = sb.simulate(scene(), times, solver, values={name: 0.6}).positions
    noise = 1e-4 * np.random.default_rng(2).standard_normal(exact.shape)
    recording = sb.Recording((exact + noise)[:, [3, 4, 5, 6]], times)
    markers = [sb.on_particle(i) for i in (3, 4, 5, 6)]
    made = sb.Experiment(scene=scene(), recording=recording, markers=markers, solver=solver, axes="xz", sigma=1e-4)
    return made, name


def test_two_minima_are_two_groups_and_each_is_fitted():
    e, angle = two_minima()
    wanted = {angle: {"initial": 0.5, "lower": -1.0, "upper": 1.0}}
    problem = FitProblem([e], as_parameters(wanted, [e]))
    raced = race(Course(problem, (0.3,)), drawn(problem.parameters, 8))
    assert {end.group for end in raced} == {1, 2}
    left = {end.group: end.u[0] > 0 for end in raced}
    assert left[1] != left[2] and all((end.u[0] > 0) == left[end.group] for end in raced)
    found = sb.fit(e, parameters=wanted, starts=8, **ALONE)
    ends = {s.group: s.values[angle] for s in found.result.starts}
    assert sorted(ends.values()) == pytest.approx([-0.6, 0.6], rel=0.02)


# --- journals


def test_a_raced_fit_goes_on_to_the_same_bits(tmp_path: Path):
    given = {"parameters": ["rope_EI", "rope_bend_damping"], "starts": 8, "windows": [0.1, 0.2], **ALONE}
    whole = sb.fit(swinging(), **given)
    path = tmp_path / "journal.sqlite"

    def stop(progress: Progress) -> None:
        if progress.start == (5, 8):
            raise KeyboardInterrupt

    stopped = sb.fit(swinging(), **given, journal=path, progress=stop)
    assert stopped.interrupted and "the best of 5 starts that had ended of 8" in stopped.result.message
    assert path.exists() and stopped["rope_EI"].value > 0.0
    assert bits(sb.fit(swinging(), **given, journal=path)) == bits(whole)
    assert not path.exists()
