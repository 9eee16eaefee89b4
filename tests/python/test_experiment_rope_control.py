"""Rope control: exact gradients, targets that are reached along them, and what is said where there is none."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import sheetbend as sb

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "rope_control"
MODULES = ("motion", "task", "whip", "shape", "posts", "lift", "search", "least_squares", "drawn", "control")
LONG = 60.0  # s; searches end by their number of rollouts


@pytest.fixture(scope="module")
def scripts() -> Iterator[SimpleNamespace]:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(FOLDER))
        yield SimpleNamespace(**{name: importlib.import_module(name) for name in MODULES})
        for name in MODULES:
            del sys.modules[name]


@pytest.fixture(scope="module")
def shape(scripts):
    return scripts.shape.shape()


def somewhere(task, size: float) -> np.ndarray:
    return size * np.random.default_rng(0).standard_normal(task.size)


# --- gradients


@pytest.mark.parametrize("fast", [0.0, 15.0])
def test_gradient_of_the_whip(scripts, fast):
    task = scripts.whip.whip(fast)
    assert scripts.search.gradient_gap(task, somewhere(task, 0.15), np.eye(task.size)[::3]) < 1e-8


def test_gradient_of_the_shape(scripts, shape):
    directions = np.eye(shape.size)[:: shape.size // 12]  # one knot of each way that a gripper moves
    assert scripts.search.gradient_gap(shape, somewhere(shape, 0.15), directions) < 1e-8


@pytest.mark.parametrize("name", ["whip", "shape"])
def test_knots_by_complex_step(scripts, shape, name):
    task = shape if name == "shape" else scripts.whip.whip()
    values = task.control.values(somewhere(task, 0.15))
    report = sb.check_gradients(task.control.scene, [20 * task.solver.h], task.solver, samples=1, values=values)
    rows = [row for row in report.rows if row.name in task.control.scales]
    assert len(rows) == task.size
    assert all(row.passed for row in rows), str(report)


@pytest.mark.parametrize("name", ["wrap", "gap"])
def test_gradient_beside_posts(scripts, name):
    """The rope sticks to the table, slides and touches posts; differences over a kink would say something else."""
    task = getattr(scripts.posts, name)()
    assert scripts.search.gradient_gap(task, somewhere(task, 0.05), np.eye(task.size)[::5], step=1e-5) < 1e-6


def test_residuals_are_those_of_the_loss_and_the_gradient(scripts):
    task = scripts.posts.wrap()
    u = somewhere(task, 0.05)
    u[8:] += 0.15  # towards the post, where the hand is too near
    outcome, rest, jacobian = task.outcome_and_residuals(u)
    other, gradient = task.outcome_and_gradient(u)
    assert outcome == other
    assert rest @ rest == pytest.approx(outcome.cost, rel=1e-12)
    assert np.count_nonzero(rest) > 3 * 3 * 31 - 31 * 3  # not the heights alone
    assert np.abs(2.0 * jacobian.T @ rest - gradient).max() < 1e-9 * np.abs(gradient).max()


def test_gradient_of_the_lift(scripts):
    task = scripts.lift.lift()
    assert scripts.search.gradient_gap(task, somewhere(task, 0.05), np.eye(task.size)[::8], step=1e-6) < 1e-5


# --- targets


def test_the_bar_is_lifted_to_its_target(scripts):
    search = scripts.search.descend_again(scripts.lift.lift(), LONG)
    assert search.outcomes[0].error > 0.1
    assert search.outcomes[-1].reached


def test_the_rope_is_drawn_through_the_gap(scripts):
    search = scripts.least_squares.gauss_newton(scripts.posts.gap(), LONG, most=20)
    first, last = search.outcomes[0], search.outcomes[-1]
    assert first.error > 0.9
    assert last.reached and last.error < 1e-2 and last.speed < 0.05


@pytest.mark.slow
def test_the_rope_is_wrapped_around_the_post(scripts):
    descent = scripts.least_squares.gauss_newton
    search = scripts.search.descend_again(scripts.posts.wrap(), 10.0 * LONG, descent=descent)
    assert search.name == "Gauss-Newton"
    assert search.outcomes[0].error > 0.3
    assert search.outcomes[-1].reached and search.outcomes[-1].error < 1e-2


@pytest.mark.parametrize("fast", [0.0, 15.0])
def test_the_whip_reaches_its_target(scripts, fast):
    search = scripts.search.descend(scripts.whip.whip(fast), LONG, most=50)
    first, last = search.outcomes[0], search.outcomes[-1]
    assert first.error > 1.5
    assert last.reached and last.error < 5e-3 and last.speed > 0.99 * fast


def test_the_rod_nears_its_shape(scripts, shape):
    search = scripts.search.descend(shape, LONG, most=30)
    first, last = search.outcomes[0], search.outcomes[-1]
    assert first.error > 0.2
    assert last.error < 0.05 * first.error


def test_the_shape_is_at_rest_and_the_other_motion_leads_to_it(scripts, shape):
    nodes = shape.control.scene.ropes["rod"].particles
    values = scripts.shape.other_motion()
    later = sb.simulate(shape.control.scene, [3.0, 19.0], shape.solver, values).positions[:, nodes]
    assert np.abs(later[1] - shape.target).max() < 1e-6
    assert np.abs(later[0] - shape.target).max() < 5e-3


def test_effort_is_the_sum_of_the_unknowns_squares(scripts):
    """A mean square acceleration over that of an effort of 1, and the same of places, from the motion itself."""
    task, whip = scripts.whip.whip(), scripts.whip
    u = somewhere(task, 1.0)
    motion, knots = task.control.motion, (task.control.knots @ u).reshape(3, -1)
    t = np.linspace(0.0, motion.seconds, 20001)
    places, accelerations = motion.spline(t) @ knots.T, motion.spline(t, 2) @ knots.T
    effort = (places**2).sum(axis=1).mean() / whip.REACH**2
    effort += (accelerations**2).sum(axis=1).mean() / whip.ACCELERATION**2
    assert u @ u == pytest.approx(effort, rel=1e-2)  # the form's mean is over coarser times


@pytest.mark.slow
def test_a_rope_is_drawn_towards_the_gap(scripts):
    search = scripts.search.descend_again(scripts.posts.gap(), LONG, tries=2, most=6)
    first, last = search.outcomes[0], search.outcomes[-1]
    assert first.error > 0.9
    assert last.error < 0.15
    assert len(search.outcomes) > 10  # both descents are there
    assert all(b.cost <= a.cost for a, b in zip(search.outcomes[:-1], search.outcomes[1:], strict=True))
    assert (np.diff(search.seconds) > 0.0).all()


def test_a_motion_that_cannot_be_simulated_costs_more_than_the_start(scripts):
    task = scripts.whip.whip()

    class Torn:
        size = task.size
        require_gradient = staticmethod(lambda unknowns: None)

        @staticmethod
        def outcome_and_gradient(unknowns):
            if np.linalg.norm(unknowns) > 0.5:
                raise sb.UnbalancedError("forces do not balance", "use a smaller substep", 1, 0.0, 0, 1.0, "whip")
            return task.outcome_and_gradient(unknowns)

    search = scripts.search.descend(Torn(), LONG, most=20)
    assert search.lost > 0
    assert search.outcomes[-1].cost < search.outcomes[0].cost
    assert np.linalg.norm(search.best) <= 0.5


# --- where there is no gradient


def test_a_whip_asked_for_too_soon_says_so(scripts):
    """Without bending, a hand that moves sideways is felt at the tip when its wave arrives, 0.6 s later."""
    with pytest.raises(sb.EmptyGradientError, match="not arrived"):
        scripts.search.descend(scripts.whip.whip(seconds=0.2, axes="xy", EI=None), LONG, most=5)
    late = scripts.whip.whip(seconds=0.6, axes="xy", EI=None)
    late.require_gradient(np.zeros(late.size))


def test_a_search_that_ends_where_nothing_is_felt_says_so(scripts):
    """A loss that is flat beyond a line, short of the target."""
    task = scripts.whip.whip()
    (rope,) = task.control.scene.ropes.values()
    tip = rope.particles[-1]

    def flat(x):
        bar = np.zeros_like(x)
        missing = max(0.0, 0.01 - x[1, tip, 0])
        bar[1, tip, 0] = -2.0 * missing
        return missing**2, bar

    with pytest.raises(sb.EmptyGradientError, match="no derivative with respect to any position"):
        scripts.search.descend(replace(task, loss=flat, effort=0.0), LONG, most=30)


# --- the other search, and the figure


def test_without_cma_the_comparison_is_left_out(scripts, monkeypatch):
    monkeypatch.setitem(sys.modules, "cma", None)
    assert scripts.search.evolve(scripts.whip.whip(), 1.0) is None


def test_cma_improves(scripts):
    pytest.importorskip("cma")
    search = scripts.search.evolve(scripts.whip.whip(), 0.3)
    assert search.outcomes[-1].cost < search.outcomes[0].cost


def test_the_report_and_the_figure(scripts, tmp_path, capsys, monkeypatch):
    pytest.importorskip("matplotlib")
    monkeypatch.setitem(sys.modules, "cma", None)
    task = scripts.whip.whip()
    searches = scripts.control.solve(task, 0.2)
    scripts.drawn.draw([(task, searches)], tmp_path / "control.png")
    assert (tmp_path / "control.png").stat().st_size > 10_000
    told = capsys.readouterr().out
    assert "1671 mm from the target" in told and "CMA-ES: left out" in told
