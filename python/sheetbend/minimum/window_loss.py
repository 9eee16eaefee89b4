"""What the model of a motion that is shot in windows loses: how large the gaps between its windows are.

It follows from the marginal likelihood: the states and the parameters integrated out of the linear picture, gaps normal
with one deviation for all. That is restricted maximum likelihood (Patterson & Thompson 1971, Biometrika 58), and the
deviations that cost 1.92 of its logarithm bound the 95 % interval. Data count with the variance and the autocorrelation
that their residuals show.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ..arrays.types import Array
from ..experiment.cut import start_quantities
from ..optional import require
from ..problem.lifted import Lifted
from ..problem.lifted_motion import Motion
from ..problem.problem import FitProblem
from ..statistics.chain import Chain
from ..statistics.intervals import LIKELY
from ..statistics.spectral import effective_deviation

SMALLEST, LARGEST, LOOKED = 1e-6, 1.0, 37  # of the motion's size: gaps that are looked at, and how many


@dataclass(frozen=True)
class Loss:
    """What a model loses, m/s: the gap that is expected over a window's length; upper and lower end of 95 %."""

    value: float
    lower: float
    upper: float


def loss(problem: FitProblem, u: Array, experiment: int, size: float) -> Loss:
    """What the model of one experiment loses, from the linear picture at u, where the problem was evaluated last.

    Args:
        size: of its motion, m.
    """
    core, e = problem.core, problem.experiments[experiment]
    assert isinstance(core, Lifted)
    motion = core.motions[experiment]
    scale = math.sqrt(len(start_quantities(e.scene))) / motion.length
    deviance = Deviance(problem, u, experiment, motion)
    at = np.log(size) + np.linspace(np.log(SMALLEST), np.log(LARGEST), LOOKED)
    heights = np.array([deviance(x) for x in at])
    best = int(np.argmin(heights))
    optimize = require("scipy.optimize", "fit")
    lower, upper = at[max(best - 1, 0)], at[min(best + 1, LOOKED - 1)]
    found = optimize.minimize_scalar(deviance, bounds=(lower, upper), method="bounded", options={"xatol": 1e-3})
    x, least = (float(found.x), float(found.fun)) if found.fun < heights[best] else (at[best], heights[best])
    likely = [float(at[k]) for k in range(LOOKED) if heights[k] < least + LIKELY] + [x]

    def end(inside: float, step: float) -> float:
        outside = inside
        while at[0] < outside < at[-1] and deviance(outside) < least + LIKELY:
            outside += step
        if not at[0] < outside < at[-1]:
            return outside
        return float(optimize.brentq(lambda t: deviance(t) - least - LIKELY, outside - step, outside, xtol=1e-3))

    step = (at[-1] - at[0]) / (LOOKED - 1)
    first, last = end(min(likely), -step), end(max(likely), step)
    low = 0.0 if first <= at[0] else scale * math.exp(first)
    return Loss(scale * math.exp(x), low, scale * math.exp(last))


class Deviance:
    """Minus twice the logarithm of the marginal likelihood, of a gap's logarithmic deviation, up to a constant."""

    def __init__(self, problem: FitProblem, u: Array, experiment: int, motion: Motion) -> None:
        first = problem.core.first_rows
        own = slice(first[experiment], first[experiment + 1])
        ok, r, _ = problem.evaluate(u)
        here = motion.solve(u)
        assert ok and here is not None
        layout = problem.rows_layout()
        taken = motion.absorbed() + len(u)
        weight = 1.0 / effective_deviation(r[own], layout.of(layout.recording == experiment), taken)
        self._windows = [
            replace(w, state=weight * w.state, border=weight * w.border, rest=weight * w.rest)
            for w in motion.fitted(here.seen)
        ]
        self._gaps = [gap.times(motion.deviation) for gap in motion.gaps(here.seen)]
        self._prior = problem.parameters.prior_jacobian(), problem.parameters.prior_residuals(u)
        self._count = motion.states.size

    def __call__(self, log_deviation: float) -> float:
        chain = Chain(self._windows, [gap.times(math.exp(-log_deviation)) for gap in self._gaps])
        M = np.column_stack([np.vstack([chain.border, self._prior[0]]), np.concatenate([chain.rest, self._prior[1]])])
        R = np.asarray(np.linalg.qr(M, mode="r"))
        p = M.shape[1] - 1
        size = np.abs(np.diag(R))[:p]
        known = size > 1e-9 * size.max(initial=1e-300)
        cost = float(np.sum(R[p:, -1] ** 2))
        return cost + 2.0 * (chain.log_size + float(np.log(size[known]).sum()) + self._count * log_deviation)
