"""What data tell of a friction where everything sticks: that it is large enough.

Where nothing slides, motions do not depend on the coefficient of friction, and their derivative with respect to it is
zero. A smaller one would let go, so the cost rises below some value: a bound from one side. Where it never rises,
nothing is pressed and pulled. Where it falls, the search started among frictions at which all sticks, though the
recording slides, and no gradient could lead it away.

A search that comes from below may also end just before everything sticks, where the cost has a kink: steep below, level
above. The linear interval knows one side of it. So one refit at the upper end of each tells whether the cost rises.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..arrays.types import Array
from ..problem.problem import FitProblem
from ..quantities.wording import quantity, side_words
from ..result.estimate import Estimate
from ..statistics.identifiability import Identifiability
from ..statistics.intervals import NORMAL
from ..statistics.profile import profile_interval
from .profiles import Profiles

ASKED = ("identified", "weak", "not identifiable", "one-sided")
LEVEL = 0.25  # of the rise that the end of an interval has: a cost that rises less there is level
STEP = 0.1  # of the logarithm, or of the coefficient: the first step of the search


def bounded_by_sticking(problem: FitProblem, u: Array, judged: Identifiability, refitter: str) -> Identifiability:
    """The estimates, those of frictions that move no residual, or on one side only, with the bound that they have.

    Takes some ten refits of the other parameters for each of these, one for each friction that has an interval, and
    nothing where there are none.

    Args:
        u: (free,) the minimum.
        refitter: optimizer of refits.
    """
    terms = [term for e in problem.experiments for term in e.scene.terms if term.array == "friction"]
    frictions = {name for term in terms for name in term.quantities}
    asked = [e for e in judged.estimates if e.verdict in ASKED and e.name.partition("[")[0] in frictions]
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
    if e.verdict == "one-sided":  # as its profile found
        return replace(e, words=f"{e.words}, because all contacts stick") if e.upper is None else e
    side = 1.0 if e.statistical is not None else -1.0
    if e.statistical is not None and (
        profiles(e.name, e.value + e.statistical) > profiles(e.name, e.value) + LEVEL * rise
    ):
        return e
    costs: dict[float, float] = {}

    def cost(value: float) -> float:
        costs[value] = profiles(e.name, value)
        return costs[value]

    limits = {"lower": parameter.lower, "upper": parameter.upper}
    ends = profile_interval(cost, e.value, rise, step=STEP, log=parameter.log, sides=(side,), **limits)
    bound = e.lower if side > 0.0 else ends[0]
    best = min(costs, key=lambda value: costs[value])
    if costs[best] < costs[e.value] - rise:
        words = (
            f"nothing slides here, so the gradient is zero, but {quantity(best, parameter)} explains the data better: "
            "start from there"
        )
        return replace(e, verdict="no minimum", words=words)
    if bound is None or not np.isfinite(bound) or ends[1] is not None:
        return e
    words = f"{side_words(parameter, bound, None)}, because all contacts stick"
    return replace(e, lower=bound, upper=None, half_width=None, statistical=None, verdict="one-sided", words=words)
