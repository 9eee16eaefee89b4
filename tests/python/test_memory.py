"""Gradients under a memory budget: the same bits, the costs as told, the peak as measured."""

from __future__ import annotations

import re
import subprocess
import sys
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
from sheetbend import _core
from sheetbend.errors import InputError
from sheetbend.files.memory import in_bytes, in_words, least_in_words

STEPS = 120
TIMES = [0.03, 0.12]


def net() -> sb.Scene:
    """A small cloth with driven, loaded and damped parts."""
    scene = sb.Scene("net")
    n = 6
    grid = np.arange(n * n).reshape(n, n)
    x, y = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n), indexing="ij")
    scene.add_particles(np.stack([x.ravel(), y.ravel(), 0.1 * (x * y).ravel()], axis=1), 0.01)
    pairs = np.concatenate(
        [np.stack([a.ravel(), b.ravel()], 1) for a, b in ((grid[1:], grid[:-1]), (grid[:, 1:], grid[:, :-1]))]
    )
    scene.add_constraints("distance", pairs, name="link", compliance=1e-5, damping=1e-3)
    scene.pin([0])
    scene.drive([n - 1], [0.0, 0.2], [[[0.0, 1.0, 0.0]], [[0.1, 1.0, 0.2]]])
    scene.add_force([n * n - 1], [[[0.0, 0.1, 0.0]]])
    scene.set_drag(linear=1e-3, quadratic=1e-2)
    return scene.freeze()


SOLVERS = [
    sb.Solver(h=1e-3, integrator=integrator, method=method, iterations=2)
    for integrator in ("bdf1", "bdf2")
    for method in ("gauss_seidel", "direct")
]
solvers = pytest.mark.parametrize("solver", SOLVERS, ids=lambda s: f"{s.integrator}-{s.method}")


def budgets(scene: sb.Scene, solver: sb.Solver) -> list[int]:
    """From the least that works to everything."""
    whole = sb.tape_plan(scene, TIMES, solver)
    return [whole.least + int(share * (whole.total - whole.least)) for share in (0.0, 0.05, 0.3, 0.8, 1.0)]


@solvers
def test_a_budget_changes_no_bit_and_costs_what_was_told(solver: sb.Solver) -> None:
    scene = net()
    whole = sb.rollout(scene, TIMES, solver)
    bar = np.random.default_rng(1).standard_normal(whole.positions.shape)
    expected = whole.gradient(bar)
    assert expected.recomputed == 0 and whole.plan.policy == "every boundary"
    assert max(abs(v) for v in expected.quantities.values()) > 0
    told = []
    for budget in budgets(scene, solver):
        limited = sb.rollout(scene, TIMES, replace(solver, memory=budget))
        plan = limited.plan
        assert plan == sb.tape_plan(scene, TIMES, replace(solver, memory=budget))
        assert np.array_equal(limited.positions, whole.positions)
        first, again = limited.gradient(bar), limited.gradient(bar)  # again from a tape whose states were dropped
        for found in (first, again):
            assert found.quantities == expected.quantities
            assert all(np.array_equal(found.inputs[name], a) for name, a in expected.inputs.items())
            assert found.tape == plan.tape
        assert first.recomputed == plan.recomputed <= again.recomputed
        assert plan.total <= budget
        told.append(plan.recomputed)
    assert told[-1] == 0 < told[-2]
    assert all(a > b for a, b in pairwise(told))


@solvers
def test_torch_keeps_to_the_budget(solver: sb.Solver) -> None:
    torch = pytest.importorskip("torch")
    import sheetbend.torch as st

    scene = net()

    def gradients(memory: int | None, batch: int) -> list[object]:
        limited = replace(solver, memory=memory)
        compliance = (1e-5 * torch.arange(1, batch + 1, dtype=torch.float64)).requires_grad_()
        value = compliance[0] if batch == 1 else compliance
        loss = st.simulate(scene, TIMES, limited, {"link_compliance": value}).square().sum()
        return [loss, *torch.autograd.grad(loss, compliance)]

    for batch in (1, 11):
        expected = gradients(None, batch)
        least = sb.tape_plan(scene, TIMES, solver, scenes=batch).least
        for memory in (least, 2 * least):
            assert all(torch.equal(a, b) for a, b in zip(gradients(memory, batch), expected, strict=True))
        with pytest.raises(sb.InputError, match=re.escape("solver.memory: is too small")):
            gradients(least - 1, batch)

    module = st.SceneModule(scene, TIMES, replace(solver, memory="1 GB"), learn=["link_compliance"])
    module().square().sum().backward()
    stored = module.get_parameter("link_compliance").grad
    assert stored is not None and torch.allclose(stored, gradients(None, 1)[1] * 1e-5, rtol=1e-12)


@pytest.mark.slow
def test_second_derivatives_keep_to_the_budget() -> None:
    torch = pytest.importorskip("torch")
    import sheetbend.torch as st

    scene, solver = net(), SOLVERS[2]

    def curvature(memory: int | None) -> object:
        start = torch.tensor(1e-5, dtype=torch.float64)
        limited = replace(solver, memory=memory)
        return torch.func.hessian(lambda c: st.simulate(scene, TIMES, limited, {"link_compliance": c}).square().sum())(
            start
        )

    # Dual numbers take twice the room of plain ones.
    assert torch.equal(curvature(4 * sb.tape_plan(scene, TIMES, solver).least), curvature(None))


def test_second_derivatives_of_a_batch_keep_to_the_budget() -> None:
    scene, steps, rng = net(), [30, STEPS], np.random.default_rng(2)
    inputs = scene.compiled.inputs() * (1.0 + 1e-3 * rng.standard_normal((5, scene.compiled.core.inputs)))
    directions = 1e-3 * rng.standard_normal(inputs.shape)
    bars = rng.standard_normal((2, 5, len(steps), scene.compiled.core.dofs))
    needed = []
    for threads in (1, 2):
        core = replace(SOLVERS[2], threads=threads).core(scene.compiled)
        with pytest.raises(_core.BudgetTooSmall) as caught:
            core.vjp_dot_batch(inputs, directions, steps, *bars, 0.0, memory=1)
        needed.append(caught.value.needed)
        least = core.vjp_dot_batch(inputs, directions, steps, *bars, 0.0, memory=needed[-1])
        assert np.array_equal(least, core.vjp_dot_batch(inputs, directions, steps, *bars, 0.0))
        with pytest.raises(_core.BudgetTooSmall):
            core.vjp_dot_batch(inputs, directions, steps, *bars, 0.0, memory=needed[-1] - 1)
    assert needed[0] < needed[1] < 2 * needed[0]  # each thread has a tape; the batch itself is there once


def test_check_gradients_keeps_to_the_budget() -> None:
    scene, solver = net(), SOLVERS[0]
    least = sb.tape_plan(scene, [0.01], solver).least
    assert sb.check_gradients(scene, [0.01], replace(solver, memory=least)).passed
    with pytest.raises(sb.InputError, match=re.escape("solver.memory")):
        sb.check_gradients(scene, [0.01], replace(solver, memory=least - 1))


def test_a_small_budget_is_refused_with_the_least_that_works() -> None:
    scene, solver = net(), SOLVERS[1]
    with pytest.raises(ValueError, match=re.escape("solver.memory: is too small")) as caught:
        sb.tape_plan(scene, TIMES, replace(solver, memory="10 kB"))
    assert "got '10 kB'" in str(caught.value)
    enough = re.search(r'memory = "(.+?)"', str(caught.value))
    assert enough is not None
    plan = sb.tape_plan(scene, TIMES, replace(solver, memory=enough[1]))
    assert plan.policy == "binomial" and plan.recomputed > STEPS
    with pytest.raises(sb.InputError, match=re.escape("solver.memory")):
        sb.rollout(scene, TIMES, replace(solver, memory="10 kB"))


def test_a_plan_speaks() -> None:
    scene, solver = net(), replace(SOLVERS[1], memory="150 kB")
    text = str(sb.tape_plan(scene, TIMES, solver))
    assert "budget 150 kB" in text and "binomial" in text and "run again" in text
    assert "every boundary" in str(sb.tape_plan(scene, TIMES, SOLVERS[1]))
    with pytest.raises(sb.InputError, match="scenes"):
        sb.tape_plan(scene, TIMES, solver, scenes=0)


@pytest.mark.parametrize(
    ("amount", "size"),
    [("2 GB", 2 * 10**9), ("1.5MiB", 3 * 2**19), (" 500 kb ", 500_000), ("7 B", 7), (12345, 12345), (1e6, 10**6)],
)
def test_amounts_of_memory(amount: object, size: int) -> None:
    assert in_bytes("memory", amount) == size


@pytest.mark.parametrize("amount", ["", "2", "GB", "-1 GB", "2 XB", 0, -5, float("nan"), float("inf"), True, [1]])
def test_what_is_no_amount_is_refused(amount: object) -> None:
    with pytest.raises(sb.InputError, match=re.escape("solver.memory: is not an amount of memory")):
        sb.Solver(memory=amount)  # type: ignore[arg-type]


@pytest.mark.parametrize("size", [1, 999, 1000, 1001, 999_400, 999_999, 1_234_567, 10**9, 99_999_999_999])
def test_words_for_bytes(size: int) -> None:
    assert in_bytes("memory", in_words(size)) == pytest.approx(size, rel=6e-3)
    assert size <= in_bytes("memory", least_in_words(size)) <= 1.011 * size


def test_gradient_of_the_wrong_shape_is_refused() -> None:
    run = sb.rollout(net(), TIMES, SOLVERS[0])
    with pytest.raises(sb.InputError, match="positions_bar"):
        run.gradient(np.zeros((1, 36, 3)))
    with pytest.raises(sb.InputError, match="positions_bar"):
        run.gradient(np.full(run.positions.shape, np.nan))


PEAK = """
import ctypes, sys
import numpy as np
import sheetbend as sb

def now(what):
    return next(1024 * int(line.split()[1]) for line in open("/proc/self/status") if line.startswith(what))

n, share, integrator = int(sys.argv[1]), float(sys.argv[2]), sys.argv[3]
grid = np.arange(n * n).reshape(n, n)
x, y = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n), indexing="ij")
scene = sb.Scene("cloth")
scene.add_particles(np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1), 0.2 / n**2)
scene.pin([0, n - 1])
for name, ends in {
    "stretch": ((grid[1:], grid[:-1]), (grid[:, 1:], grid[:, :-1])),
    "shear": ((grid[1:, 1:], grid[:-1, :-1]), (grid[1:, :-1], grid[:-1, 1:])),
}.items():
    pairs = np.concatenate([np.stack([a.ravel(), b.ravel()], 1) for a, b in ends])
    scene.add_constraints("distance", pairs, name=name, compliance=1e-7)
solver, times = sb.Solver(h=1e-3, integrator=integrator, method="gauss_seidel", iterations=1), [0.02, 0.04]
whole = sb.tape_plan(scene, times, solver)
budget = whole.least + int(share * (whole.total - whole.least))
limited = sb.Solver(**{**vars(solver), "memory": budget})
if sys.argv[4] == "torch":
    import torch
    import sheetbend.torch as st

    def gradient(simulation):
        compliance = torch.tensor(1e-7, dtype=torch.float64, requires_grad=True)
        simulation({"shear_compliance": compliance}).square().sum().backward()

    gradient(st.Simulation(scene, [0.001], solver))  # whatever is loaded on first use
    simulation = st.Simulation(scene, times, limited)
else:
    run = sb.rollout(scene, [0.001], solver)
    run.gradient(2 * run.positions)  # code that is loaded on first use is not the budget's
    del run
ctypes.CDLL(None).malloc_trim(0)
open("/proc/self/clear_refs", "w").write("5")  # the high-water mark starts again
before = now("VmRSS")
plan = sb.tape_plan(scene, times, limited)
if sys.argv[4] == "torch":
    gradient(simulation)
else:
    run = sb.rollout(scene, times, limited)
    assert run.gradient(2 * run.positions).recomputed == plan.recomputed
print(budget, plan.total, plan.recomputed, now("VmHWM") - before)
"""


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/clear_refs").exists(), reason="only Linux resets the high-water mark")
@pytest.mark.parametrize(
    ("share", "integrator", "path"),
    [
        (0.0, "bdf1", "numpy"),
        (0.5, "bdf1", "numpy"),
        (0.3, "bdf2", "numpy"),
        (1.0, "bdf2", "numpy"),
        (0.3, "bdf1", "torch"),
    ],
)
def test_measured_peak_of_a_cloth_stays_within_the_budget(share: float, integrator: str, path: str) -> None:
    """40,000 particles, 40 substeps, in a fresh process: memory above what the scene itself takes."""
    if path == "torch":
        pytest.importorskip("torch")
    command = [sys.executable, "-c", PEAK, "200", str(share), integrator, path]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    budget, planned, recomputed, measured = map(int, done.stdout.split())
    assert (recomputed > 0) == (share < 1.0)
    assert 0.75 * planned <= measured <= budget, done.stdout


def test_without_a_budget_half_of_the_free_memory_is_used_and_told(monkeypatch, caplog):
    scene, solver = net(), SOLVERS[3]
    expected = sb.rollout(scene, TIMES, solver)
    assert expected.plan.budget is None and "fits in half of the free memory" in str(expected.plan) and not caplog.text
    free = 2 * budgets(scene, solver)[2]
    monkeypatch.setattr("sheetbend.motion.solver.free_memory", lambda: free)
    found = sb.rollout(scene, TIMES, solver)
    assert found.plan.policy == "binomial" and found.plan.total <= found.plan.budget == free // 2
    assert "solver.memory is not given" in caplog.text and str(found.plan) in caplog.text
    bar = np.ones_like(expected.positions)
    assert found.gradient(bar).quantities == expected.gradient(bar).quantities
    monkeypatch.setattr("sheetbend.motion.solver.free_memory", lambda: 1000)
    with pytest.raises(InputError, match=r"half of the free memory by default, and too small.*fewer frames"):
        sb.rollout(scene, TIMES, solver)


def wide() -> sb.Scene:
    """400 particles: ten million states of them are 96 GB."""
    return sb.rope(1.0, 400, density=0.05, EA=100.0)


def test_ten_million_substeps_are_planned_within_the_free_memory():
    plan = sb.tape_plan(wide(), [1e4], sb.Solver(h=1e-3))
    assert plan.steps == 10**7 and plan.policy == "binomial" and plan.total <= plan.budget


def test_what_does_not_fit_is_refused_before_it_runs(monkeypatch):
    monkeypatch.setattr("sheetbend.files.memory.free_memory", lambda: 10**9)
    scene, solver = wide(), sb.Solver(h=1e-3, memory="3 GB")
    times = np.broadcast_to(np.float64(1.0), 10**5)
    with pytest.raises(InputError, match=r"times: needs .* GB of memory, of which 1.00 GB are free.*fewer"):
        sb.simulate(scene, times, solver)
    with pytest.raises(InputError, match=r"solver.memory: needs .* of which 1.00 GB are free"):
        sb.rollout(scene, times, solver)
    with pytest.raises(InputError, match=r"solver.memory: needs .* of which 1.00 GB are free"):
        sb.rollout(scene, [1e3], solver)
    with pytest.raises(InputError, match="more than 2147483647 substeps"):
        sb.simulate(scene, [1e8], solver)
