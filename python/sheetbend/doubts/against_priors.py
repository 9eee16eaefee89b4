"""Priors that the data contradict.

A density that is told wrong leaves no trace in the residuals beside a fitted stiffness, since the two trade exactly. A
prior of the stiffness, from another experiment, is all that can tell. With its mean m and standard deviation s, the
estimate u and its variance v, the data alone ask for x = m + (u - m)/(1 - v/s^2), and x - m has the variance
s^2/(1 - v/s^2) where both are right.
"""

from __future__ import annotations

import math

import numpy as np

from ..arrays.timeseries import Array
from ..minimum.problem import FitProblem
from ..optional import require
from ..quantities.parameters import Parameter
from ..quantities.wording import short
from ..statistics.identifiability import Identifiability
from ..statistics.intervals import NORMAL, reach_of
from ..statistics.least_squares import solved
from .contradictions import value_words
from .directions import LEVEL

LEAST = 1e-3  # of the prior's variance: what the data must take off it to contradict it


def against_priors(problem: FitProblem, u: Array, judged: Identifiability) -> tuple[tuple[str, ...], dict[str, str]]:
    """A warning for each prior that the data contradict at u (free,), and by parameter that would leave its interval
    without that prior, why it is doubtful. Takes no simulation."""
    estimates, names = {e.name: e for e in judged.estimates}, problem.parameters.free
    reach = np.array([reach_of(problem.parameters[name], estimates[name]) for name in names])
    _, r, J = problem.evaluate(u)
    first, _ = problem.prior_rows
    priors = [name for name in names if problem.parameters[name].prior is not None]
    warnings, doubts = list[str](), dict[str, str]()
    for row, name in enumerate(priors, start=first):
        p, k = problem.parameters[name], names.index(name)
        assert p.prior is not None
        mean, sd = p.to_internal(p.prior[0]), p.prior[1]
        left = 1.0 - (reach[k] / NORMAL / sd) ** 2
        if not left > LEAST:
            continue
        score = abs(u[k] - mean) / sd / math.sqrt(left)
        if 2.0 * float(require("scipy.special", "fit").ndtr(-score)) > LEVEL / len(priors):
            continue
        alone = value_words(p, u[k], (u[k] - mean) * (1.0 / left - 1.0), reach[k] / math.sqrt(left))
        words = (
            f"the data alone ask for {name} = {alone}, which its prior ({_words(p)}) contradicts: "
            f"{short(score, 2)} standard deviations"
        )
        warnings.append(f"{words}. Check the prior, and the given values with which {name} trades")
        steps = -solved(np.delete(J, row, axis=0), np.delete(r, row))
        doubts |= {other: words for other, step, own in zip(names, steps, reach, strict=True) if abs(step) > own}
    return tuple(warnings), doubts


def _words(p: Parameter) -> str:
    assert p.prior is not None
    mean, sd = p.prior
    around = f"{short(100 * sd, 2)} %" if p.log else f"{short(sd, 2)} {p.unit}".rstrip()
    return f"{f'{short(mean)} {p.unit}'.rstrip()}, sd {around}"
