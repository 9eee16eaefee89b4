"""The unbalanced force after each Newton step of the implicit method."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..arrays.types import Array
from ..errors import InputError
from ..scene.scene import Scene
from .core_terms import compiled_of, divergence, substeps
from .solver import Solver


@dataclass(frozen=True)
class ForceBalance:
    """How the forces of each substep of the method "implicit" came into balance; `force_balance` makes it.

    Attributes:
        times: (substeps,) s, the ends of the substeps.
        left: (substeps, blocks, 1 + most Newton steps), the largest unbalanced force over the largest force: at the
            start of the substep and after each Newton step, NaN after a block's last step. Blocks are the connected
            parts of the scene.
    """

    times: Array
    left: Array

    @property
    def newton_steps(self) -> Array:
        """(substeps, blocks), how many Newton steps each block took."""
        return np.isfinite(self.left).sum(axis=2) - 1

    def report(self) -> str:
        """A table with a line for each substep, of the block that took the most Newton steps."""
        lines = ["substep  t [s]     force that is left, of the largest"]
        for k, (time, blocks) in enumerate(zip(self.times, self.left, strict=True), start=1):
            slowest = blocks[np.isfinite(blocks).sum(axis=1).argmax()]
            lines.append(f"{k:7d}  {time:<8.5g}  " + " ".join(f"{left:.0e}" for left in slowest[np.isfinite(slowest)]))
        return "\n".join(lines)


def force_balance(scene: Scene, end: float, solver: Solver, values: Mapping[str, float] | None = None) -> ForceBalance:
    """Record how the forces of every substep came into balance.

    Args:
        scene: frozen by this call.
        end: end of the motion, s; a multiple of the substep.
        solver: with the method "implicit".
        values: quantities to change, by name.

    Raises:
        InputError: another method, or an end between two substeps.
        UnbalancedError, DivergenceError: as `simulate`.
    """
    solver = Solver.given(solver)
    if solver.method != "implicit":
        fix = "use 'implicit': the others end after their iterations"
        raise InputError("solver.method", "balances no forces", solver.method, fix)
    compiled = compiled_of(scene)
    count = substeps([end], solver.h)[0]
    with divergence(scene):
        found = solver.core(compiled).force_balance(compiled.inputs(compiled.values(values)), count, 0.0)
    most = max((len(block) for blocks in found for block in blocks), default=0)
    left = np.full((count, max(map(len, found), default=0), most), np.nan)
    for k, blocks in enumerate(found):
        for b, block in enumerate(blocks):
            left[k, b, : len(block)] = block
    return ForceBalance(solver.h * np.arange(1, count + 1), left)
