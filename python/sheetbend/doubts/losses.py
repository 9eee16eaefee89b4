"""What a motion tells of its losses, and which numbers of air can be none.

Damping of the membrane and of bending and drag of the air all take energy from a swing, and a free swing shows little
but their sum. With I the information matrix of the losses p, everything else fitted along, the weighted sum k p that
the data know best for its size has the weights k = I p and the relative variance 1/(p' I p). Weights in physical units
hold where one loss has run off to nothing and another has taken all of it over.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays.types import Array
from ..problem.problem import FitProblem
from ..quantities.parameters import Parameters
from ..quantities.wording import short
from ..result.estimate import Estimate
from ..statistics.identifiability import Identifiability
from ..statistics.intervals import NORMAL
from ..statistics.least_squares import unexplained

LOSSES = (
    *("_damping", "_viscosity", "_loss_factor"),
    *("_drag", "_drag_linear", "_drag_quadratic", "_air_normal", "_air_tangential"),
)
"""Ends of the names of quantities that take energy, but for friction: in contacts it does more than that, and in hinges
no derivative tells what more of it does to one that sticks."""
KNOWN = 0.2  # relative half-width up to which a sum counts as known, as an identified parameter does
AIR, LARGEST_DRAG = 1.2, 2.0  # kg/m^3; drag coefficient of a plate across the flow, and hardly anything has more
COEFFICIENTS = ("_air_normal", "_air_tangential")


def loss_doubts(problem: FitProblem, u: Array, judged: Identifiability) -> tuple[str, ...]:
    """What a reader must know of fitted losses at the minimum u (free,)."""
    return (*_combined(problem, u, judged), *air_doubts(judged.estimates))


def air_doubts(estimates: Sequence[Estimate]) -> Iterator[str]:
    """Coefficients of air (density * drag coefficient / 2, kg/m^3) that no air can have."""
    most = 0.5 * AIR * LARGEST_DRAG
    for e in estimates:
        least = e.value if e.lower is None else e.lower
        surface = e.name.endswith("_drag_quadratic") and e.unit == "N s^2/m^4"  # per area; of ropes it is per length
        if least > most and (surface or e.name.partition("[")[0].endswith(COEFFICIENTS)):
            density = 2.0 * least / LARGEST_DRAG
            yield (
                f"{e.name} is too large for air: even with a drag coefficient of {LARGEST_DRAG:g} it needs a density "
                f"of at least {short(density, 2)} kg/m^3, but air has {AIR:g}. It contains other losses (friction in "
                "the fabric or the grip) or an error of the model"
            )


@dataclass(frozen=True)
class LossSum:
    """What a motion shows of losses that it does not tell apart.

    Attributes:
        names: of the losses, the one with the largest share first.
        weights: of each, in units of the first per its own; that of the first is 1.
        value: of the weighted sum, in the unit of the first.
        half_width: of its 95 % interval, as a share of the value.
    """

    names: tuple[str, ...]
    weights: tuple[float, ...]
    value: float
    half_width: float


def _combined(problem: FitProblem, u: Array, judged: Identifiability) -> list[str]:
    names = [e.name for e in judged.estimates if e.verdict != "identified" and _is_loss(problem.parameters, e.name)]
    known = None if len(names) < 2 else loss_sum(problem, u, names, judged.autocorrelation_time)
    if known is None or known.half_width > KNOWN or min(known.weights) < 0:
        return []
    unit = problem.parameters[known.names[0]].unit
    parts = [n if w == 1.0 else f"{short(w, 2)} {n}" for n, w in zip(known.names, known.weights, strict=True)]
    return [
        f"losses: the motion does not separate {' and '.join(names)}. It shows their sum, {' + '.join(parts)} = "
        f"{short(known.value)} {unit} (to {short(100 * known.half_width, 2)} %). Fix all but one, or add a motion in "
        "which they act differently, such as a faster one. The sum also contains hysteresis of the fabric and friction "
        "in its grip, which the model does not have"
    ]


def loss_sum(problem: FitProblem, u: Array, names: Sequence[str], autocorrelation_time: float = 1.0) -> LossSum | None:
    """The weighted sum of losses that the data know best for its size, with all other parameters fitted along; None
    where they know none.

    Args:
        names: of free parameters on a log scale.
        autocorrelation_time: frames of residual that count as one.
    """
    _, r, J = problem.evaluate_exactly(u)
    rows = problem.core.data_rows
    own = [problem.parameters.free.index(name) for name in names]
    rest = [k for k in range(J.shape[1]) if k not in own]
    prior = problem.parameters.prior_jacobian()
    others = np.vstack([J[:rows][:, rest], prior[~prior[:, own].any(axis=1)][:, rest]])
    here = np.vstack([J[:rows][:, own], np.zeros((len(others) - rows, len(own)))])
    if rest:
        here = unexplained(others, here, rcond=None)
    together = here.sum(axis=1)  # what residuals do when all of them grow by one share
    seen = float(together @ together)
    if seen == 0.0:
        return None
    deviation = np.sqrt(r[:rows] @ r[:rows] / max(rows - J.shape[1], 1) * autocorrelation_time)
    values = problem.parameters.to_physical(u)
    found = here.T @ together / [values[name] for name in names]
    order = np.argsort(-np.abs(here.T @ together))
    weights = found[order] / found[order[0]]
    named = tuple(names[k] for k in order)
    value = float(sum(w * values[n] for w, n in zip(weights, named, strict=True)))
    return LossSum(named, tuple(weights.tolist()), value, float(NORMAL * deviation / np.sqrt(seen)))


def _is_loss(parameters: Parameters, name: str) -> bool:
    return name.partition("[")[0].endswith(LOSSES) and parameters[name].log
