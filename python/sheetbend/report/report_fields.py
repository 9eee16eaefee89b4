"""The part of a report on stiffness fields with a smoothness prior."""

from __future__ import annotations

import math

from ..quantities.wording import short
from ..result.field import KNOWN, PRIOR_ALONE, UNSEEN, FieldFit
from ..result.result import FitData
from .tables import Section

LISTED = 24  # places at most; fit.json has all


def stiffness_fields(result: FitData) -> list[Section]:
    """The priors of all fields, and the stiffness of the places of each."""
    if not result.fields:
        return []
    rows = [_row(field) for field in result.fields]
    headers = ("field", "places", "E from", "to", "unit", "size", "95 %", "length", "95 %", "unit")
    notes = [
        (
            "E",
            "the stiffness of a cluster of a solid, of a triangle of a cloth along the warp, or EI of a rope's joint",
        ),
        ("size", "rms of ln E about its mean that the prior expects; length: over which E changes little"),
        ("95 %", "interval of what was found from the recordings; open: they do not determine it"),
    ]
    few = {f.name: f.finest for f in result.fields if f.finest is not None and f.finest < UNSEEN}
    if few:
        told = ", ".join(f"{name} ({100 * left:.0f} %)" for name, left in few.items())
        why = f"the data leave less than {100 * UNSEEN:.0f} % of the prior's variance in the finest modes"
        then = "They also show modes that are finer still, which change the estimates. "
        then += "Give more stiffness_modes, or softness_modes of a rope"
        notes.append(("too few modes", f"{told}: {why}. {then}"))
    return [Section("Stiffness fields", headers, tuple(rows), tuple(notes)), *map(_places, result.fields)]


def _row(f: FieldFit) -> tuple[str, ...]:
    return (
        f.name,
        str(len(f.stiffness)),
        short(min(f.stiffness), 3),
        short(max(f.stiffness), 3),
        f.unit,
        short(f.size, 2),
        interval(f.size_lower, f.size_upper, 1.0),
        short(1e3 * f.length, 2),
        interval(f.length_lower, f.length_upper, 1e3),
        "mm",
    )


def interval(lower: float | None, upper: float | None, factor: float) -> str:
    """The ends of what was found, in words."""
    if lower is None:
        return "given"
    if upper is None:
        return f"at least {short(factor * lower, 2)}" if lower > 0.0 else "open"
    if lower == 0.0:
        return f"at most {short(factor * upper, 2)}"
    return f"{short(factor * lower, 2)} to {short(factor * upper, 2)}"


def _places(f: FieldFit) -> Section:
    known = sum(left < KNOWN for left in f.left)
    alone = sum(left > PRIOR_ALONE for left in f.left)
    note = (
        f"of the prior's variance about the mean. {known} of {len(f.left)} {f.place}s are known from the data (below "
        f"{100 * KNOWN:.0f} %), {alone} from the prior alone (above {100 * PRIOR_ALONE:.0f} %)"
    )
    rows = [
        (
            str(c),
            " ".join(f"{1e3 * x:.3g}" for x in (center[:1] if f.place == "joint" else center)),
            short(E, 3),
            f"{100 * math.expm1(min(half, 50.0)):.2g} %",
            f"{100 * left:.2g} %",
        )
        for c, (center, E, half, left) in enumerate(
            zip(f.centers[:LISTED], f.stiffness, f.half_widths, f.left, strict=False)
        )
    ]
    more = [("not listed", f"{len(f.left) - LISTED} {f.place}s; fit.json has all")] if len(f.left) > LISTED else []
    headers = (f.place, "along it (mm)" if f.place == "joint" else "center (mm)", f"E ({f.unit})", "+/-", "left")
    return Section(f"Stiffness of the {f.place}s: {f.name}", headers, tuple(rows), (("left", note), *more))
