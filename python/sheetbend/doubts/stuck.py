"""What data tell of a friction where everything sticks: that it is large enough.

Where nothing slides, motions do not depend on the coefficient of friction, and their derivative with respect to it is
zero. A smaller one would let go, so the cost rises below some value: a bound from one side. Where it never rises,
nothing is pressed and pulled. Where it falls, the search started among frictions at which all sticks, though the
recording slides, and no gradient could lead it away.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..arrays.timeseries import Array
from ..minimum.problem import FitProblem
from ..quantities.wording import quantity, side_words
from ..result.result import Estimate
from ..statistics.identifiability import Identifiability
from ..statistics.profile import profile_interval
from .profiles import Profiles

NORMAL = 1.96  # standard deviations, of a 95 % interval
STEP = 0.1  # of the logarithm, or of the coefficient: the first step of the search


def bounded_by_sticking(problem: FitProblem, u: Array, judged: Identifiability, refitter: str) -> Identifiability:
    """The estimates, those of frictions that move no residual with their lower bound where they have one.

    Takes some ten refits of the other parameters for each of these, and nothing where there are none.

    Args:
        u: (free,) the minimum.
        refitter: optimizer of refits.
    """
    terms = [term for e in problem.experiments for term in e.scene.terms if term.array == "friction"]
    frictions = {name for term in terms for name in term.quantities}
    asked = [e for e in judged.estimates if e.verdict == "not identifiable" and e.name.partition("[")[0] in frictions]
    _, r, _ = problem.evaluate(u)
    variance = float(r @ r) / max(problem.core.data_rows - len(u), 1)
    rise = 0.5 * NORMAL**2 * variance * max(judged.autocorrelation_time, 1.0)
    if not asked or not rise > 0.0:
        return judged
    profiles = Profiles(problem, u, refitter, np.zeros(len(u)))
    found = {e.name: _bounded(e, problem, profiles, rise) for e in asked}
    return replace(judged, estimates=tuple(found.get(e.name, e) for e in judged.estimates))


def _bounded(e: Estimate, problem: FitProblem, profiles: Profiles, rise: float) -> Estimate:
    parameter = problem.parameters[e.name]
    costs: dict[float, float] = {}

    def cost(value: float) -> float:
        costs[value] = profiles(e.name, value)
        return costs[value]

    limits = {"lower": parameter.lower, "upper": parameter.upper}
    bound, _ = profile_interval(cost, e.value, rise, step=STEP, log=parameter.log, sides=(-1.0,), **limits)
    best = min(costs, key=lambda value: costs[value])
    if costs[best] < costs[e.value] - rise:
        words = (
            f"nothing slides here, so that no gradient leads away, and {quantity(best, parameter)} explains the data "
            "better: start from there"
        )
        return replace(e, verdict="no minimum", words=words)
    if bound is None or not np.isfinite(bound):
        return e
    words = f"{side_words(parameter, bound, None)}, for all that touches sticks"
    return replace(e, lower=bound, verdict="one-sided", words=words)
