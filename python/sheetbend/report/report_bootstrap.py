"""What a report tells of the bootstrap of a fit."""

from __future__ import annotations

from ..quantities.wording import figures
from ..result.result import FitData
from .tables import Section


def bootstrap(result: FitData) -> Section:
    """The section on bootstrap intervals, beside the half-widths that residuals give."""
    found = result.bootstrap
    if found is None:
        return Section("Bootstrap")
    estimates = {e.name: e for e in result.estimates}
    rows = []
    for one in found.intervals:
        e, half = estimates[one.name], 0.5 * (one.upper - one.lower)
        lower, upper, width, statistical = figures((one.lower, one.upper, half, e.statistical), half or None)
        rows.append((one.name, f"[{lower}, {upper}]", width, statistical, e.unit))
    told = f"{found.draws} fits to {found.drawn}, drawn with replacement"
    if found.lost:
        told += f"; {found.lost} of them did not settle and do not count"
    notes = (("drawn", told), ("not counted", "time step, mesh and given values, which move all of these fits alike"))
    headers = ("parameter", "95 % interval", "+/-", "from residuals", "unit")
    return Section("Bootstrap", headers, tuple(rows), notes)
