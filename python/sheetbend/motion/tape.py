"""What the gradient of a rollout costs in memory and in substeps computed again, told before it runs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

from numpy.typing import ArrayLike

from .. import _core
from ..arrays.checks import MOST_WHOLE, check_count
from ..errors import InputError
from ..files.memory import expect_room, free_memory, in_words, least_in_words
from ..scene.scene import Scene
from .core_terms import compiled_of, substeps
from .solver import Solver


@dataclass(frozen=True)
class TapePlan:
    """Memory and cost of one gradient under a memory budget.

    With a large budget the tape keeps the positions at every substep boundary. Otherwise it keeps
    those of some boundaries, placed by binomial checkpointing (Griewank & Walther 2000), and the forward program runs
    again between them. Every substep is recomputed once more as it is reversed; that is part of any gradient here and
    not counted.

    Attributes:
        steps: substeps of the rollout.
        states: boundaries that the tape holds at most.
        tape: its bytes.
        working: bytes of everything else, by what it is: "inputs" (and the gradient), "frames" (positions and their
            cotangents), "plan" (colors or blocks), "forward" (states and record of a substep), "reverse" (cotangents,
            and the record that a substep is reversed from), "heap" (what allocators waste). The scene itself is not
            counted.
        recomputed: substeps that the forward program runs again.
        budget: bytes: `Solver.memory`, or half of the free memory where that is not given. None where it is not given
            and every boundary fits.
        least: the smallest budget that would do, bytes.
    """

    steps: int
    states: int
    tape: int
    working: Mapping[str, int]
    recomputed: int
    budget: int | None
    least: int

    @property
    def policy(self) -> str:
        """ "every boundary" or "binomial"."""
        return "every boundary" if self.states >= self.steps else "binomial"

    @property
    def total(self) -> int:
        """Bytes of tape and working memory."""
        return self.tape + sum(self.working.values())

    @property
    def recomputation(self) -> float:
        """Substeps computed again, as a share of the rollout's."""
        return self.recomputed / max(1, self.steps)

    def __str__(self) -> str:
        kept = f"{self.states} of {self.steps} states" if self.policy == "binomial" else f"all {self.steps} states"
        again = (
            f"{self.recomputed} substeps run again ({self.recomputation:.2f} per substep)"
            if self.recomputed
            else "no substep runs again"
        )
        budget = "fits in half of the free memory" if self.budget is None else f"budget {in_words(self.budget)}"
        parts = ", ".join(f"{name} {in_words(size)}" for name, size in self.working.items())
        return (
            f"gradient over {self.steps} substeps: {in_words(self.total)} ({budget}, least {in_words(self.least)})\n"
            f"  tape     {in_words(self.tape)}: {self.policy}, {kept}; {again}\n"
            f"  working  {in_words(sum(self.working.values()))}: {parts}"
        )


def tape_plan(scene: Scene, times: ArrayLike, solver: Solver | None = None, scenes: int = 1) -> TapePlan:
    """Predict what a gradient through `times` costs, without running anything.

    Args:
        scene: frozen by this call.
        times: (frames,) s on the substep grid: where the loss looks.
        solver: its `memory` is the budget, by default half of the free memory; `Solver()` by default.
        scenes: batch size; a batch goes eight scenes to a vector, one vector per thread at a time.

    Raises:
        InputError: times off the grid; a budget below the least that works, or a gradient that does not fit in the
            free memory.
    """
    solver = Solver.given(solver)
    check_count("scenes", scenes, 1, MOST_WHOLE, InputError)
    return planned(solver.core(compiled_of(scene)), substeps(times, solver.h), solver, solver.budget, scenes)


def planned(core: _core.Solver, steps: Sequence[int], solver: Solver, allowed: int, scenes: int = 1) -> TapePlan:
    """The core's plan under a budget of `allowed` bytes, in the package's words.

    Raises:
        InputError: the budget is below the least that works, or above what the machine has free.
    """
    with budget(solver):
        plan = core.tape_plan(steps, scenes, allowed)
    names = ("inputs", "frames", "plan", "forward", "reverse", "heap")
    working = {name: getattr(plan, name) for name in names}
    own = None if solver.memory is None and plan.states >= plan.steps else allowed
    found = TapePlan(plan.steps, plan.states, plan.tape, working, plan.recomputed, own, plan.least)
    expect_room("solver.memory", found.total, "lower the budget, or ask for fewer frames at a time")
    return found


@contextmanager
def budget(solver: Solver) -> Iterator[None]:
    """Turns the core's refusal of a budget into the package's error."""
    try:
        yield
    except _core.BudgetTooSmall as error:
        least = least_in_words(error.needed)
        if solver.memory is None:
            problem, got = "is half of the free memory by default, and too small", in_words(free_memory() // 2)
            fix = f'ask for fewer frames at a time, or give memory = "{least}" if the machine has it'
        else:
            problem, got = "is too small", str(solver.memory)
            fix = f'give at least memory = "{least}", ask for fewer frames at a time, or leave it out'
        problem += f" for this gradient, which needs {least} even when it keeps the fewest states"
        raise InputError("solver.memory", problem, got, fix) from error
