"""Sections of a report on scenes that are driven: what predicts their motion without physics, and their clocks."""

from __future__ import annotations

from ..experiment.clock import lateness
from ..quantities.wording import short
from ..recording.baseline import IN_WORDS
from ..result.result import FitData
from .tables import Section


def driven_sections(result: FitData) -> list[Section]:
    """The sections on predictions without physics and on clocks; empty where nothing is driven or shifted."""
    return [_without_physics(result), _clocks(result)]


def _without_physics(result: FitData) -> Section:
    """The simulation beside every prediction without physics. The strongest one counts."""
    rows = [r for r in result.recordings if r.without_physics]
    kinds = [kind for kind in IN_WORDS if any(kind in r.without_physics for r in rows)]
    table, notes = [], [(kind, IN_WORDS[kind]) for kind in kinds]
    for r in rows:
        best = min(r.without_physics, key=lambda kind: r.without_physics[kind])
        error = r.rms if r.held_out is None else r.held_out
        scale = 1e3 if r.unit == "m" else 1.0
        cells = [_cell(r.without_physics.get(kind), scale, kind == best) for kind in kinds]
        part = "fitted" if r.held_out is None else "held out"
        table.append((r.name, part, _cell(error, scale, False), *cells, "mm" if r.unit == "m" else r.unit))
    if notes:
        notes.append(("*", "the strongest of them, which is what a simulation has to beat"))
    headers = ("recording", "part", "simulation", *kinds, "unit")
    return Section("Driven motion without physics, rms", headers, tuple(table), tuple(notes))


def _cell(error: float | None, scale: float, best: bool) -> str:
    return "" if error is None else short(error * scale) + (" *" if best else "")


def _clocks(result: FitData) -> Section:
    notes = [(r.name, lateness(r)) for r in result.recordings if r.late is not None]
    return Section("Clocks", notes=tuple(notes))
