"""Priors that the data contradict.

A wrong density that is given leaves no trace in the residuals beside a fitted stiffness, because the stiffness
compensates for it exactly. Only a prior of the stiffness, from another experiment, can show the error.

With its mean m and standard deviation s, and the share h of an estimate u that comes from the prior (its
leverage; the rest comes from the data), the data alone give x = m + (u - m)/(1 - h). Where both are right, u - m has
the variance (1 - 2 h) s^2 + v. Here v is the variance of u, with correlated noise and errors of given values included;
for white noise alone it is h s^2.
"""

from __future__ import annotations

import math

import numpy as np

from ..arrays.types import Array
from ..optional import require
from ..problem.problem import FitProblem
from ..problem.smooth import modes_of_fields
from ..quantities.parameters import Parameter
from ..quantities.wording import short
from ..statistics.identifiability import Identifiability
from ..statistics.intervals import NORMAL, reach_of
from ..statistics.least_squares import solved
from .contradictions import value_words
from .directions import LEVEL

LEAST = 1e-3  # share of the estimate that must come from the data for them to contradict the prior


def against_priors(problem: FitProblem, u: Array, judged: Identifiability) -> tuple[tuple[str, ...], dict[str, str]]:
    """A warning for each prior that the data contradict at u (free,), and by parameter that would leave its interval
    without that prior, why it is doubtful. Takes no simulation. Priors of fields are not asked: a fit finds them."""
    estimates, names = {e.name: e for e in judged.estimates}, problem.parameters.free
    reach = np.array([reach_of(problem.parameters[name], estimates[name]) for name in names])
    _, r, J = problem.evaluate(u)
    inside, fields = problem.parameters.inside(u), modes_of_fields(problem.experiments)
    J = inside * J
    first, _ = problem.prior_rows
    rows = {name: first + k for k, name in enumerate(n for n in names if problem.parameters[n].prior is not None)}
    priors = [name for name in rows if inside[names.index(name)] and name.partition("[")[0] not in fields]
    warnings, doubts = list[str](), dict[str, str]()
    for name in priors:
        p, k, row = problem.parameters[name], names.index(name), rows[name]
        assert p.prior is not None
        sd = p.prior[1]
        share = float(J[row] @ solved(J, np.eye(1, len(J), row)[0]))
        variance = max((reach[k] / NORMAL / sd) ** 2, share)  # of the estimate, in units of the prior's
        if not (1.0 - share > LEAST and math.isfinite(variance)):
            continue
        score = abs(r[row]) / math.sqrt(1.0 - 2.0 * share + variance)
        if 2.0 * float(require("scipy.special", "fit").ndtr(-score)) > LEVEL / len(priors):
            continue
        data = sd / (1.0 - share)
        step, width = data * r[row] * share, data * NORMAL * math.sqrt(variance - share**2)
        words = (
            f"the data alone give {name} = {value_words(p, u[k], step, width)}, which contradicts its prior "
            f"({_words(p)}): {short(score, 2)} standard deviations"
        )
        warnings.append(f"{words}. Check the prior, and the given values that can compensate for {name}")
        steps = -solved(np.delete(J, row, axis=0), np.delete(r, row))
        doubts |= {other: words for other, step, own in zip(names, steps, reach, strict=True) if abs(step) > own}
    return tuple(warnings), doubts


def _words(p: Parameter) -> str:
    assert p.prior is not None
    mean, sd = p.prior
    around = f"{short(100 * sd, 2)} %" if p.log else f"{short(sd, 2)} {p.unit}".rstrip()
    return f"{f'{short(mean)} {p.unit}'.rstrip()}, sd {around}"
