"""What "stiffness" means of a rope whose bending slides inside: that of small motion, and that of large motion.

Friction inside the rope holds a part of its bending stiffness, `yield_share`, until the curvature has changed by
`yield_curvature`. Small motion shows all of it, EI; what slides adds no more, and (1 - yield_share) EI is left.
"""

from __future__ import annotations

import math

from ..quantities.wording import short
from ..report.fit_result import FitResult
from ..report.tables import Section
from ..result.estimate import Estimate
from .model import NAME
from .over_density import quantity

Interval = tuple[float, float | None, float | None]
"""Value and ends of the 95 % interval, None where it is open."""


def tangent_stiffness(result: FitResult) -> Interval | None:
    """(1 - yield_share) EI, to first order in both; None where nothing slides in the model."""
    EI, share = (_estimate(result, name) for name in ("EI", "yield_share"))
    if EI is None or share is None:
        return None
    value = EI.value * (1.0 - share.value)
    if EI.half_width is None or EI.upper is None or share.half_width is None:
        return value, None, None
    parts = math.log(EI.upper / EI.value), -share.half_width / (1.0 - share.value)
    named = {EI.name, share.name}
    alike = next((c.value for c in result.correlations if {c.first, c.second} == named), 0.0)
    reach = math.sqrt(max(parts[0] ** 2 + parts[1] ** 2 + 2.0 * alike * parts[0] * parts[1], 0.0))
    return value, value * math.exp(-reach), value * math.exp(reach)


def stiffness_section(result: FitResult) -> Section | None:
    """Both stiffnesses of a rope that slides inside, as a table; None of others."""
    after, EI = tangent_stiffness(result), _estimate(result, "EI")
    if after is None or EI is None:
        return None
    rows = [("EI at small strain", EI.value, EI.lower, EI.upper), ("EI where the rope slides inside", *after)]
    cells = tuple((what, *("" if x is None else short(x) for x in numbers), EI.unit) for what, *numbers in rows)
    note = (
        "share and curvature of yield are in the table of estimates; a slow test of large bending shows the lower one"
    )
    return Section("Bending stiffness", ("", "value", "from", "to", "unit"), cells, (("EI", note),))


def _estimate(result: FitResult, name: str) -> Estimate | None:
    return next((e for e in result.estimates if quantity(e.name) == f"{NAME}_{name}"), None)
