"""What acts between substeps: a network that learns a force, a policy, and plans by gradients, each in a small run."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import torch

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "one_substep"
MODULES = ("residual", "policy", "mpc", "mpc_tasks")


@pytest.fixture
def script() -> Iterator[Callable[[str], ModuleType]]:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(FOLDER))
        yield importlib.import_module
        for name in MODULES:
            sys.modules.pop(name, None)


def test_a_residual_force_halves_the_error_on_new_throws(
    script: Callable[[str], ModuleType], capsys: pytest.CaptureFixture[str]
) -> None:
    """After two thirds of its training."""
    alone, helped = script("residual").main(steps=10)
    assert helped < 0.5 * alone
    assert "less error is the network's work" in capsys.readouterr().out


def test_a_policy_reaches_targets_that_it_was_not_trained_with(
    script: Callable[[str], ModuleType], capsys: pytest.CaptureFixture[str]
) -> None:
    """After an eighth of its training; 90 % of the targets are missed by at most what is returned."""
    before, after = script("policy").main(rounds=8, count=40)
    assert before > 0.05  # m, the proportional controller alone
    assert after < 0.02
    assert "of 40 new targets within 2 cm" in capsys.readouterr().out


def test_plans_fold_the_corner_of_a_towel(script: Callable[[str], ModuleType]) -> None:
    """Of a coarser towel, in half a second, and it stays there."""
    mpc, tasks = script("mpc"), script("mpc_tasks")
    task = tasks.Towel.make(cells=4)
    missed, _ = mpc.control(task, mpc.by_gradient(8), plans=6)
    assert missed[0] > 0.3  # m
    assert max(missed[-6:]) < 0.01  # over the last 0.1 s


def test_plans_swing_the_end_of_a_rope_up(script: Callable[[str], ModuleType]) -> None:
    """From 0.58 m below its target to above the hand in half a second; the whole way is for the script."""
    mpc, tasks = script("mpc"), script("mpc_tasks")
    missed, _ = mpc.control(tasks.Rope.make(), mpc.by_gradient(12), plans=5)
    assert missed[0] > 0.55
    assert min(missed) < 0.15


def test_a_plan_has_the_gradient_of_differences(script: Callable[[str], ModuleType]) -> None:
    mpc, tasks = script("mpc"), script("mpc_tasks")
    task = tasks.Rope.make()
    now, plan = task.start(), task.first_plan(mpc.KNOTS) + 0.1
    direction = torch.from_numpy(np.random.default_rng(0).standard_normal((mpc.KNOTS, 3)))
    probe = plan.clone().requires_grad_()
    mpc.cost_of(task, now, probe).backward()
    step = 1e-5
    ends = [float(mpc.cost_of(task, now, plan + sign * step * direction)) for sign in (1, -1)]
    assert float((probe.grad * direction).sum()) == pytest.approx((ends[0] - ends[1]) / (2 * step), rel=1e-6)


def test_a_population_of_plans_is_one_batch_and_betters_the_first(script: Callable[[str], ModuleType]) -> None:
    pytest.importorskip("cma")
    mpc, tasks = script("mpc"), script("mpc_tasks")
    task = tasks.Rope.make()
    now, plan = task.start(), task.first_plan(mpc.KNOTS)
    found = mpc.by_evolution(0.3)(lambda p: mpc.cost_of(task, now, p), plan)
    both = mpc.cost_of(task, now, torch.stack([plan, found]))
    assert float(both[1]) < float(both[0])
    assert float(both[0]) == pytest.approx(float(mpc.cost_of(task, now, plan)), rel=1e-12)
