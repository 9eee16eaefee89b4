"""What `sheetbend.torch.Stepper` adds to a substep of the core and to its backward pass, in us of processor time.

    OMP_NUM_THREADS=1 python experiments/bench/single_substeps.py

The shortest of nine chains of 400 substeps, forward and backward, less the shortest of nine loops over the core's own
`step` and `vjp` on the same numbers.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
import sheetbend as sb
import torch
from sheetbend.torch import Stepper
from torch import Tensor

SUBSTEPS, REPEATS = 400, 9


def shortest(what: Callable[[], object]) -> float:
    """us for each substep, of several tries."""
    tries = []
    for _ in range(REPEATS):
        begun = time.process_time()
        for _ in range(SUBSTEPS):
            what()
        tries.append(time.process_time() - begun)
    return 1e6 * min(tries) / SUBSTEPS


def chains(stepper: Stepper, inputs: Tensor, given: dict[str, Tensor]) -> tuple[float, float]:
    """us for each substep of a chain, forward and backward."""
    tries = []
    for _ in range(REPEATS):
        state = stepper.start(inputs)
        begun = time.process_time()
        for _ in range(SUBSTEPS):
            state = stepper(state, inputs, **given)
        between = time.process_time()
        state.numbers[3].backward(retain_graph=True)
        tries.append((between - begun, time.process_time() - between))
    forward, backward = np.min(tries, axis=0)
    return 1e6 * forward / SUBSTEPS, 1e6 * backward / SUBSTEPS


def measure(segments: int, forced: bool) -> tuple[float, float, float, float]:
    """us of the core's substep, of what is added to it, and the same of the backward pass."""
    rope = sb.rope(0.5, segments, density=0.05, EI=1e-3, drag_linear=0.02, pinned=(0,))
    if forced:
        rope.add_force(range(1, segments + 1), np.zeros((1, segments, 3)))
    stepper = Stepper(rope, sb.Solver(h=1e-3))
    push = torch.zeros(segments, 3, dtype=torch.float64, requires_grad=True)
    given = {"force": push} if forced else {}
    inputs = stepper.inputs({"rope_EI": torch.tensor(1e-3, dtype=torch.float64, requires_grad=not forced)})
    whole = chains(stepper, inputs, given)
    core = stepper._cores[tuple(given)]
    x = stepper.start().numbers.numpy()
    numbers = core.filled(inputs.detach().numpy(), [push.detach().numpy()] if forced else [])
    after = core.compiled.step(x, numbers)
    bar = np.ones_like(after)
    forward = shortest(lambda: core.compiled.step(x, numbers))
    backward = shortest(lambda: core.compiled.vjp(x, numbers, after, bar))
    return forward, whole[0] - forward, backward, whole[1] - backward


def main() -> None:
    torch.set_num_threads(1)
    print("segments  force  forward: core  added   backward: core  added")
    for segments in (10, 50):
        for forced in (False, True):
            cells = [f"{us:.1f}" for us in measure(segments, forced)]
            print(f"{segments:8}  {forced!s:>5}  {cells[0]:>13}  {cells[1]:>5}   {cells[2]:>14}  {cells[3]:>5}")


if __name__ == "__main__":
    main()
