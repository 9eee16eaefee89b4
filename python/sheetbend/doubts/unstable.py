"""Whether a search ended where a shape at rest is about to lose its stability.

Wires at rest with a free shape without load have an edge of stability: the larger their stiffness, the larger the
moment that their set has to take back, until they snap to another shape, far from the recording. A search cannot cross
this edge, because the cost behind it is far higher. So it ends there although the cost still falls toward it, and a
linear interval at that point tells nothing.
"""

from __future__ import annotations

import numpy as np

from ..arrays.types import Array
from ..errors import SheetbendError
from ..minimum.linear_step import gauss_newton
from ..problem.problem import FitProblem
from ..quantities.wording import short

AHEAD = 0.01  # of the step that the search would take next: so far ahead the edge is looked for
LEAP = 10.0  # times what that part of the step would move a shape to first order
SAME = 1e-6  # m: shapes nearer than this everywhere are one, as those of `equilibria`


def unstable_rests(problem: FitProblem, u: Array) -> dict[str, str]:
    """By free parameter, why a shape at rest that depends on it would snap to another one a little farther. Takes one
    Jacobian, and two equilibria for each static experiment.

    Args:
        u: (free,) the minimum.
    """
    rests = [i for i, e in enumerate(problem.experiments) if e.static and not e.is_cloud]
    if not rests:
        return {}
    ok, r, J = problem.evaluate(u)
    if not ok or not np.isfinite(J).all():
        return {}
    found: dict[str, str] = {}
    first, ahead = problem.core.first_rows, AHEAD * (gauss_newton(problem.parameters, u, J, r) - u)
    for i in rests:
        e = problem.experiments[i]
        expected = e.sigma * float(np.abs(J[first[i] : first[i + 1]] @ ahead).max())
        try:
            leap = float(np.nanmax(np.abs(problem.simulate_one(i, u + ahead) - problem.simulate_one(i, u))))
        except SheetbendError:
            continue  # no other shape to name
        if leap > LEAP * expected + SAME:
            found |= dict.fromkeys(problem.acting_on(e), _snaps(e.name, leap))
    return found


def _snaps(name: str, leap: float) -> str:
    return (
        f"the search ended at an edge of stability: a little farther {name} would snap to another shape, "
        f"{short(1e3 * leap)} mm off, although the cost falls toward it. Look at how it is held and at its shape "
        "without load: a narrower prior of it, or fewer of its modes (set_modes). The set of a rope keeps its "
        "direction in space, so it says little of how stable a shape is sideways; that of a rod turns with it"
    )
