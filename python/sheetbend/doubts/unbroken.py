"""Motions that were shot in windows, fitted once more as unbroken ones.

Gaps between windows take up whatever acts all along a motion: with 1 mN m of dry friction missing, the viscosity of a
pendulum came out twice too large, "identified". One unbroken motion has no gaps. Where a few steps lead from the
estimate to a minimum of it, its residuals are asked for what is wrong.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ..arrays.types import Array
from ..experiment.experiment import Experiment
from ..minimum.approach import Approach
from ..minimum.discretization import Refinement
from ..minimum.growth import growths
from ..minimum.optimizers import WALK, WALK_PROMISE
from ..problem.problem import FitProblem
from .roughness import rough_parameters


def unbroken(problem: FitProblem, u: Array) -> tuple[FitProblem, Array] | None:
    """The problem with no motion cut, and its minimum near u (free,); None where differences grow too fast along a
    motion, or few steps lead to none."""
    whole = problem.of(_uncut(problem.experiments))
    grown = growths(whole, u)
    if any(growth.until is not None for growth in grown):
        return None
    walk = Approach(whole, u)
    while walk.iterations < WALK and walk.step() and walk.promised > WALK_PROMISE:
        pass
    ok, _, J = whole.evaluate(walk.u)
    if not ok or walk.promised > WALK_PROMISE:
        return None
    return None if rough_parameters(whole, walk.u, J[: whole.core.data_rows], grown) else (whole, walk.u)


def unbroken_refinement(refinement: Refinement) -> Refinement:
    """The same with no motion cut on the finer mesh either."""
    made = refinement.finer
    return refinement if made is None else replace(refinement, finer=lambda: _uncut(made()))


def _uncut(experiments: Sequence[Experiment]) -> list[Experiment]:
    return [replace(e, shooting=None) for e in experiments]
