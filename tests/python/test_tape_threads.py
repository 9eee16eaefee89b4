"""Gradients from several threads on one tape have the bits of one after the other, also where the tape drops states."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import sheetbend as sb

THREADS, CALLS = 4, 1000
TIMES = [0.01, 0.03]


def chain() -> sb.Scene:
    """Four links: a substep of microseconds, so that reverses of several threads overlap."""
    return sb.rope(0.1, 4, density=0.05, EI=1e-4, bend_damping=1e-3, drag_linear=5e-3, clamp_start=(1, 0, 0))


@pytest.mark.parametrize("kept", ["least", "whole"])
def test_a_thousand_gradients_on_one_tape(kept: str) -> None:
    scene, solver = chain(), sb.Solver(h=1e-3)
    if kept == "least":
        solver = sb.Solver(h=1e-3, memory=sb.tape_plan(scene, TIMES, solver).least)
    run = sb.rollout(scene, TIMES, solver)
    assert run.plan.policy == ("binomial" if kept == "least" else "every boundary")
    bars = [np.random.default_rng(k).standard_normal(run.positions.shape) for k in range(8)]
    expected = [sb.rollout(scene, TIMES, solver).gradient(bar) for bar in bars]

    def same(k: int) -> bool:
        found, wanted = run.gradient(bars[k % 8]), expected[k % 8]
        return all(np.array_equal(found.inputs[name], wanted.inputs[name]) for name in wanted.inputs)

    with ThreadPoolExecutor(THREADS) as pool:
        assert sum(pool.map(same, range(CALLS))) == CALLS
    again = run.gradient(bars[0])  # and the tape still serves
    assert again.quantities == expected[0].quantities


def test_through_torch() -> None:
    torch = pytest.importorskip("torch")
    import sheetbend.torch as st

    scene = chain()
    least = sb.tape_plan(scene, TIMES, sb.Solver(h=1e-3)).least
    solver = sb.Solver(h=1e-3, memory=least)
    EI = torch.tensor(1e-4, dtype=torch.float64, requires_grad=True)
    loss = (st.simulate(scene, TIMES, solver, values={"rope_EI": EI}) ** 2).sum()
    (expected,) = torch.autograd.grad(loss, EI, retain_graph=True)

    def gradient(_: int) -> float:
        return float(torch.autograd.grad(loss, EI, retain_graph=True)[0])

    with ThreadPoolExecutor(THREADS) as pool:
        assert set(pool.map(gradient, range(200))) == {float(expected)}
