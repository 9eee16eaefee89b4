"""Model-predictive control by gradients through substeps, with warm start, beside CMA-ES in the same processor time.

    python experiments/one_substep/mpc.py

A hand swings the end of a hanging rope up, and a force folds a towel's corner over (mpc_tasks.py). Every 0.1 s the
controller plans the actions of the next half second. It starts from what is left of the plan before. CMA-ES is left out
where the package cma is not installed.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
import sheetbend as sb
import torch
from mpc_tasks import Now, Rope, Towel
from torch import Tensor

KNOTS = 5  # actions of a plan, one for each 0.1 s
UNIT = 0.03  # m; costs far from 1 would have L-BFGS begin with steps that are far too short
NO_MOTION = 1e6
Cost = Callable[[Tensor], Tensor]
Search = Callable[[Cost, Tensor], Tensor]


def carried_out(task: Rope | Towel, now: Now, action: Tensor) -> list[Now]:
    """States of all substeps of 0.1 s with the same action."""
    after = []
    for _ in range(round(0.1 / task.stepper.solver.h)):
        now = task.step(now, action)
        after.append(now)
    return after


def cost_of(task: Rope | Towel, now: Now, plan: Tensor) -> Tensor:
    """Mean cost (*batch) over the substeps of a plan (*batch, KNOTS, 3), near 1 where the task is off by UNIT."""
    costs = []
    for k in range(KNOTS):
        after = carried_out(task, now, plan[..., k, :])
        costs += [task.cost(later, last=k == KNOTS - 1) for later in after]
        now = after[-1]
    return torch.stack(costs).mean(0) / UNIT**2 + 1e-3 * plan.square().sum((-1, -2))


def by_gradient(evaluations: int) -> Search:
    """L-BFGS with so many gradients."""

    def search(cost: Cost, plan: Tensor) -> Tensor:
        plan = plan.clone().requires_grad_()
        steps = torch.optim.LBFGS([plan], max_iter=evaluations, max_eval=evaluations, line_search_fn="strong_wolfe")
        best = (float("inf"), plan.detach().clone())

        def closure() -> Tensor:
            nonlocal best
            steps.zero_grad()
            value = cost(plan)
            value.backward()
            best = min(best, (float(value.detach()), plan.detach().clone()), key=lambda found: found[0])
            return value

        steps.step(closure)
        return best[1]

    return search


def costs_of(cost: Cost, plans: Tensor) -> list[float]:
    """Costs of a batch of plans; NO_MOTION for one that pulls so hard that a substep has no solution."""
    try:
        return list(cost(plans).tolist())
    except sb.UnbalancedError:
        return [NO_MOTION] if len(plans) == 1 else [c for plan in plans for c in costs_of(cost, plan[None])]


def by_evolution(seconds: float) -> Search:
    """CMA-ES for so much processor time; a generation is one batch of 16 scenes."""
    import cma

    def search(cost: Cost, plan: Tensor) -> Tensor:
        end = time.process_time() + seconds
        evolution = cma.CMAEvolutionStrategy(
            plan.flatten().numpy(), 0.5, {"popsize": 16, "verbose": -9, "seed": 1, "maxiter": 1 << 30}
        )
        with torch.no_grad():
            best = (float(cost(plan)), plan)
            while time.process_time() < end:
                asked = evolution.ask()
                plans = torch.tensor(np.array(asked), dtype=plan.dtype).view(-1, *plan.shape)
                costs = costs_of(cost, plans)
                evolution.tell(asked, costs)
                best = min([best, *zip(costs, plans, strict=True)], key=lambda found: found[0])
        return best[1]

    return search


def control(task: Rope | Towel, search: Search, plans: int | None = None) -> tuple[list[float], float]:
    """What the task misses after each substep, in m, and the mean processor time of a plan, in s."""
    now, plan = task.start(), task.first_plan(KNOTS)
    missed, spent = [], 0.0
    for _ in range(plans or task.plans):
        begun = time.process_time()
        plan = search(lambda p: cost_of(task, now, p), plan)  # noqa: B023
        spent += time.process_time() - begun
        with torch.no_grad():
            after = carried_out(task, now, plan[0])
        missed += [task.missed(later) for later in after]
        now = after[-1]
        plan = torch.cat([plan[1:], plan[-1:]])  # the warm start of the next plan
    return missed, spent / (plans or task.plans)


def line(name: str, task: Rope | Towel, missed: list[float], seconds: float) -> str:
    last = missed[-round(0.3 / task.stepper.solver.h) :]
    return f"  {name}, {seconds:.2f} s a plan: at most {1e3 * max(last):.1f} mm off in the last 0.3 s"


def main(evaluations: int = 12) -> None:
    for task in (Rope.make(), Towel.make()):
        print(f"{type(task).__name__}, {task.plans} plans of {KNOTS} actions")
        missed, seconds = control(task, by_gradient(evaluations))
        print(line(f"L-BFGS, {evaluations} gradients", task, missed, seconds))
        try:
            import cma  # noqa: F401
        except ImportError:
            print("  CMA-ES: left out, the package cma is not installed")
            continue
        print(line("CMA-ES", task, *control(task, by_evolution(seconds))))


if __name__ == "__main__":
    main()
