"""What `sheetbend fabric` says of a fabric: its numbers, its readings, and what the tests reached."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from ..config.fabric_tests import FabricStudy
from ..quantities.wording import short
from ..report.tables import Section
from ..textile import Curve, WholeFabric
from ..textile.laboratory import extensions
from ..textile.reading import GRAM_FORCE

LOADS = {"E5": 5e2 * GRAM_FORCE, "E20": 2e3 * GRAM_FORCE, "E100": 1e4 * GRAM_FORCE, "EMT": 5e4 * GRAM_FORCE}
"""N/m under which FAST-1 (5, 20 and 100 gf/cm) and KES-FB1 (500 gf/cm) read extensions."""


def fabric_sections(study: FabricStudy, found: WholeFabric) -> tuple[Section, ...]:
    """Tables and notes of the report."""
    numbers, readings = found.fit.sections()
    reasons = tuple(("", reason) for reason in found.reasons)
    return (numbers, readings, *_reached(study), Section("How this fabric was found", notes=reasons))


def fabric_dict(found: WholeFabric) -> dict[str, Any]:
    """The fabric and its readings in SI units, as values for JSON."""
    readings = [
        {"name": m.name, "measured": m.value, "sigma": m.sigma, "fabric": r.laboratory, "unit": r.laboratory_unit}
        for m, r in zip(found.fit.measured, found.fit.readings, strict=True)
    ]
    return {
        "law": found.law,
        "estimates": [asdict(e) for e in found.fit.estimates],
        "readings": readings,
        "misfit": found.fit.misfit,
        "freedom": found.fit.freedom,
        "reasons": list(found.reasons),
    }


def _reached(study: FabricStudy) -> list[Section]:
    """How far the pulls went, and the extensions that they read: none at a load that they did not reach."""
    pulls = {along: c for along, c in study.curves.items() if along != "bias"}
    if not pulls:
        return []
    rows = tuple(_row(along, curves, study.tests.cycle) for along, curves in pulls.items())
    headers = ("along", "specimens", "up to [N/m]", "strain [%]", *(f"{name} [%]" for name in LOADS))
    loads = ", ".join(f"{name} {short(load, 3)} N/m" for name, load in LOADS.items())
    notes = [("extensions under", loads)]
    if any("not reached" in row for row in rows):
        notes.append(("not reached", "the pulls end below this load, and the law is not extrapolated to it"))
    notes.append(
        ("the law holds", "up to the strains of this table; beyond them it is a guess (textile.forecast_pull)")
    )
    return [Section("What the pulls reached", headers, rows, tuple(notes))]


def _row(along: str, curves: tuple[Curve, ...], cycle: int) -> tuple[str, ...]:
    read = extensions(curves, cycle, LOADS)
    load, strain = (min(float(getattr(c, of).max()) for c in curves) for of in ("load", "deformation"))
    cells = ("not reached" if value is None else short(100.0 * value) for value in read.values())
    return (along, str(len(curves)), short(load), short(100.0 * strain), *cells)
