"""What `sheetbend textile` prints and writes of curves: their KES numbers, the fitted fabric, the mean curve."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from ..arrays.types import Array
from ..errors import InputError
from ..files.whole import written
from ..quantities.wording import short
from ..report.tables import Section, plain_section
from ..textile import (
    Curve,
    FabricFit,
    MeanCurve,
    Reading,
    bending_loop,
    bending_yield,
    shear_loop,
    shear_yield,
    tensile_loop,
)

_COLUMNS = {
    "tension": "strain (mm/mm),force (N/m),scatter (N/m)",
    "shear": "angle (rad),force (N/m),scatter (N/m)",
    "bending": "curvature (1/m),moment (N.m/m),scatter (N.m/m)",
}


def kes_numbers(curve: Curve, cycle: int) -> tuple[dict[str, Reading | None], float | None]:
    """The KES numbers of a curve by name, None where the test does not give them, and the share of the work that the
    loop loses."""
    if curve.test == "tension":
        t = tensile_loop(curve, cycle)
        lost = None if t.resilience is None else 1.0 - t.resilience.value
        return {"EMT": t.extension, "WT": t.energy, "LT": t.linearity, "RT": t.resilience}, lost
    if curve.test == "shear":
        s = shear_loop(curve, cycle)
        return {"G": s.stiffness, "2HG": s.hysteresis, "2HG5": s.hysteresis_far, **_yields(curve)}, s.lost
    b = bending_loop(curve, cycle)
    return {"B": b.rigidity, "2HB": b.hysteresis, **_yields(curve)}, b.lost


def _yields(curve: Curve) -> dict[str, Reading | None]:
    """What a cloth with the same loop takes, by its keys, and what that leaves of the loop's height."""
    sheared = curve.test == "shear"
    keys = ("shear", "yield_shear_share", "yield_shear") if sheared else ("bending", "yield_share", "yield_curvature")
    try:
        found = shear_yield(curve) if sheared else bending_yield(curve)
    except InputError:  # too little of a loop to tell
        return dict.fromkeys((*keys, "misfit"))
    return {key: getattr(found, key) for key in keys} | {"misfit": Reading(found.misfit, "", {}, "%", 100.0)}


def report(curves: Sequence[Curve], fit: FabricFit | None, cycle: int) -> str:
    """A row per specimen in the laboratory's units, mean and scatter of several, and the fitted fabric."""
    found = [kes_numbers(curve, cycle)[0] for curve in curves]
    units = {name: r for row in reversed(found) for name, r in row.items() if r is not None}
    names = [name for name in found[0] if name in units]
    values = {name: np.array([r.value for row in found if (r := row[name]) is not None]) for name in names}
    rows = [(c.name, *(_cell(row[name]) for name in names)) for c, row in zip(curves, found, strict=True)]
    if len(curves) > 1:
        for label, of in (("mean", np.mean), ("scatter", _scatter)):
            rows.append((label, *(short(float(of(values[name])) * units[name].per, 4) for name in names)))
    headers = [f"{name} [{units[name].laboratory_unit}]" if units[name].laboratory_unit else name for name in names]
    means = ", ".join(f"{n} {short(float(values[n].mean()), 4)} {units[n].unit}".rstrip() for n in names)
    notes = [("in SI units", means)]
    if fit is None:
        notes.append(("left out of an elastic fabric", _loss_in_words(curves, cycle)))
    lines = plain_section(Section("Curves", ("specimen", *headers), tuple(rows), tuple(notes)))
    return "\n".join(lines) + ("\n" if fit is None else f"\n\n{fit}\n")


def to_dict(curves: Sequence[Curve], fit: FabricFit | None, cycle: int) -> dict[str, Any]:
    """The curves and the fitted fabric in SI units, as values for JSON."""
    rows: list[dict[str, Any]] = []
    for c in curves:
        told, lost = kes_numbers(c, cycle)
        values = {name: None if r is None else r.value for name, r in told.items()}
        rows.append({"name": c.name, "test": c.test, "points": len(c.load), **values, "lost": lost})
    if fit is None:
        return {"curves": rows}
    readings = [
        {"name": m.name, "measured": m.value, "sigma": m.sigma, "fabric": r.laboratory}
        for m, r in zip(fit.measured, fit.readings, strict=True)
    ]
    estimates = [asdict(e) for e in fit.estimates]
    misfit = {"misfit": fit.misfit, "freedom": fit.freedom}
    return {"curves": rows, "estimates": estimates, "readings": readings, **misfit}


def write_mean(test: str, mean: MeanCurve, path: Path) -> None:
    """The mean curve and its scatter as a table that `read_curves` takes."""
    table = np.column_stack([mean.deformation, mean.load, mean.scatter])
    with written(path) as beside:
        np.savetxt(beside, table[:, : 3 if mean.count > 1 else 2], "%.9g", ",", header=_header(test, mean), comments="")


def _header(test: str, mean: MeanCurve) -> str:
    return ",".join(_COLUMNS[test].split(",")[: 3 if mean.count > 1 else 2])


def _cell(value: Reading | None) -> str:
    return "-" if value is None else short(value.laboratory, 4)


def _scatter(values: Array) -> float:
    return float(values.std(ddof=1)) if len(values) > 1 else np.nan


def _loss_in_words(curves: Sequence[Curve], cycle: int) -> str:
    lost = [part for part in (kes_numbers(c, cycle)[1] for c in curves) if part is not None]
    if not lost:
        return "the curves have no unloading, so the loss of a loop is not known"
    return f"the specimens lose {100.0 * float(np.mean(lost)):.0f} % of the work of loading"
