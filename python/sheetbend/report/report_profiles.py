"""What a report tells of the profiles of a fit."""

from __future__ import annotations

import math

from ..quantities.wording import short
from ..result.estimate import ProfileCurve
from ..result.result import FitData
from .tables import Section

_SHOWN = 0.05  # an end that is so much nearer or farther than the linear picture has it
_END = 1.0  # rise there


def lopsided_profiles(result: FitData) -> Section:
    """The intervals of which an end is not where the linear picture has it."""
    rows = []
    for curve in result.profiles:
        lower, upper = _parts(curve)
        if any(part is None or abs(part - 1.0) > _SHOWN for part in (lower, upper)):
            rows.append((curve.name, *("open" if part is None else short(part, 3) for part in (lower, upper))))
    if not rows:
        return Section("Profiles")
    words = (
        "how far the ends of the interval are from the estimate, in half-widths of the interval of a linear model. "
        f"Listed are {len(rows)} of {len(result.profiles)} parameters, where an end is off by more than {_SHOWN:.0%}"
    ).replace("%", " %")
    return Section("Profiles", ("parameter", "lower end", "upper end"), tuple(rows), (("ends", words),))


def _parts(curve: ProfileCurve) -> list[float | None]:
    ends = zip(curve.rises[:: len(curve.rises) - 1], curve.parabola[:: len(curve.rises) - 1], strict=True)
    return [math.sqrt(parabola) if rise >= _END else None for rise, parabola in ends]
