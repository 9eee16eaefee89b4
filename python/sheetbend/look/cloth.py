"""Cloths in a recording: how their markers lie on the flat fabric, what holds them, and how they are fitted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ..arrays.types import Array
from ..errors import RecordingError
from . import robot
from .beginning import lets_go
from .cloth_held import SIDES, Hold
from .cloth_parts import cloth_parts
from .cloth_sheet import AIR, Sheet, sheet_of
from .cloth_words import lies_over, seen_of, unknown_of
from .folded import folded
from .seen import Seen
from .take import Description, Measured, Take, max_gap
from .text import joined, table
from .unseen import Freed, freed, moves_first

CELLS = 10  # along the longer side
WHOLE = 0.8  # share of the markers that must hang together as one sheet
WARP, SHEAR = 500.0, 100.0  # N/m per kg/m^2, to start from
SUBSTEP = 1 / 250  # s, at most
GUESS = 0.5  # standard deviation of what is assumed without a measurement, relative
SIZE = 0.01  # standard deviation of the flat size that markers on a stretched cloth show, relative
FITTED, LONGEST = 2 / 3, 3.0  # share of the time that is fitted, and s at most


def describe(takes: Sequence[Take], measured: Measured) -> Description | None:
    """Cloths through the markers that lie on sheets; None where they do not."""
    s = takes[0].seen
    if not s.sheet:
        return None
    if s.up_by == "guess":
        guesses = [s, replace(s, up=3 - s.up)]
        for guess in [*guesses, *(seen.upside_down() for seen in guesses)]:  # it does not stand on what holds it
            found = _described([replace(takes[0], seen=guess), *takes[1:]], measured, stands=False)
            if found is not None:
                sign = "" if guess.gravity[guess.up] < 0.0 else "-"
                return found._replace(up=None if guess is s else f"{sign}{'xyz'[guess.up]}")
    return _described(takes, measured, stands=True)


def _described(takes: Sequence[Take], measured: Measured, stands: bool) -> Description | None:
    """The same; None where a cloth stands on an edge that rests, and may not."""
    s = takes[0].seen
    names = s.recording.markers
    density = 0.2 if measured.density is None else measured.density
    cloths, others = cloth_parts(s)
    count = sum(map(len, cloths.values()))
    if count < WHOLE * len(names):
        raise RecordingError(
            "markers",
            f"do not hang together as one sheet or several: {count} of them do, with neighbors on all sides",
            joined(names),
            "give a recording with markers about evenly on each cloth and some on what holds it, or write the "
            "configuration by hand",
        )
    found = _sheets(s, cloths, others, density, measured, stands)
    if found is None:
        return None
    sheets, unknown = found
    notes = list[str]()
    free = _freed(takes, sheets)
    for sheet in sheets:
        notes += seen_of(s, sheet, len(cloths) > 1)
        if _moves(s, sheet):
            notes.append("it moves at the first frame: speeds at the start are those of the markers")
    if free is not None:
        takes, notes, unknown = [free.take], [*notes, free.said], [free.unknown, *unknown]
        sheets = [replace(sheet, starts_flat=False) for sheet in sheets]
    if not sheets:
        fix = "measure the fabric between the markers and write the configuration by hand, see docs/configuration.md"
        raise RecordingError("markers", "lie on a cloth that something holds up from below", joined(names), fix)
    unknown = [*unknown_of(s, sheets, measured), *unknown]
    for sheet in sheets:
        if sheet.ride is not None:
            shown = sheet.held[0].edge is not None
            more = robot.notes(sheet.ride, "the held edge" if shown else "the upper row of markers")
            notes, unknown = notes + more[0], unknown + more[1]
    used = {k for sheet in sheets for hold in sheet.held for k in hold.markers}
    unused = [k for k in others if k not in used]
    if unused:
        unknown.append(f"what the markers {joined(names[k] for k in unused)} are attached to: they are left out")
    kind = ("a cloth" if len(sheets) == 1 else f"{len(sheets)} cloths") + (" at rest" if s.static else "")
    lines = _lines(takes, sheets, density, measured, free is not None)
    driving = tuple(names[k] for sheet in sheets for hold in sheet.held for k in hold.driving(s))
    return Description(kind, notes, unknown, lines, driving=driving)


def _sheets(
    s: Seen,
    cloths: Mapping[str, list[int]],
    others: Sequence[int],
    density: float,
    measured: Measured,
    stands: bool,
) -> tuple[list[Sheet], list[str]] | None:
    """The cloths that hang, and in words what lies over something; None where a cloth stands on an edge that rests, and
    may not."""
    names, sheets, unknown = s.recording.markers, list[Sheet](), list[str]()
    first = (sheet_of(s, name, own, others, density, {}, Measured()) for name, own in cloths.items())
    bars = _bars([sheet for sheet in first if sheet is not None])
    for name, own in cloths.items():
        sheet = sheet_of(s, name, own, others, density, bars, measured)
        if sheet is None:
            unknown.append(lies_over(names, own, "the middle of their cloth is above two of its sides"))
            continue
        if not stands and any(hold.side == "bottom" and hold.own and not hold.moves for hold in sheet.held):
            return None
        sheets.append(sheet)
    pairs = folded(s, [(sheet.own, sheet.flat) for sheet in sheets])
    sides = {k for pair in pairs for k in pair}
    for pair in pairs:
        own = sorted(sheets[pair[0]].own + sheets[pair[1]].own)
        unknown.append(lies_over(names, own, "they hang from two rows that face each other, on either side of it"))
    return [sheet for k, sheet in enumerate(sheets) if k not in sides], unknown


def _freed(takes: Sequence[Take], sheets: Sequence[Sheet]) -> Freed | None:
    """The part of the only recording in which cloths move freely that something unseen moved; None elsewhere."""
    s = takes[0].seen
    if len(takes) > 1 or s.static or not s.rest or any(sheet.ride or sheet.wind is not None for sheet in sheets):
        return None
    own = [k for sheet in sheets for k in sheet.own]
    holding = [k for sheet in sheets for hold in sheet.held for k in hold.markers]
    return freed(takes[0], own, "cloth") if own and moves_first(s, own, holding) else None


def _bars(sheets: Sequence[Sheet]) -> dict[int, tuple[float, ...]]:
    """Directions of bars by their markers, the median of what the rows beside them show: a row may be tilted, as that
    of a fabric cut on the bias is, and this counts by its distance from the marker."""
    shown: dict[int, list[Array]] = {}
    for hold in (hold for sheet in sheets for hold in sheet.held):
        if hold.bar is not None:
            bar, rows = np.array(hold.bar), shown.setdefault(hold.markers[0], [])
            rows.append(bar * (np.sign(bar @ rows[0]) if rows else 1.0))
    return {k: tuple(np.median(rows, axis=0).tolist()) for k, rows in shown.items()}


def _lines(
    takes: Sequence[Take], sheets: Sequence[Sheet], density: float, measured: Measured, midway: bool
) -> list[str]:
    s, r = takes[0].seen, takes[0].seen.recording
    lines = takes[0].scene_lines
    solver: dict[str, Any] = {"method": "newton"}
    if not s.static:
        if sheets[0].ride is not None:  # its clock is not that of the frames
            solver["h"] = 1 / 120
        else:
            solver["substeps"] = max(1, int(np.ceil(takes[0].step / SUBSTEP - 1e-9)))
    lines += table("[solver]", solver)
    winds = [sheet.wind for sheet in sheets if sheet.wind is not None]
    if winds:
        wind = np.mean(winds, axis=0).tolist()
        lines += table("[scene.wind]", {"velocity": wind}, {"velocity": "m/s, a guess to start from"})
    for sheet in sheets:
        lines += _cloth(s, sheet, density)
    for take in takes:
        own, r = _recording(take, sheets[0].ride), take.seen.recording
        driving = [k for sheet in sheets for hold in sheet.held for k in hold.driving(s)]
        own["max_gap"] = max_gap(r.times, r.mask[:, driving])
        why = {"max_gap": "s, for which a marker of a grip is lost"}
        if midway:
            why["fit"] = "begins after what no marker shows has let go"
        lines += table("[[recording]]", own, why)
    for sheet in sheets:
        lines += _parameters(sheet, density) + _guesses(sheet, measured)
    if winds:
        for k in np.flatnonzero(np.arange(3) != s.up):
            lines += table(f"[parameters.wind_{'xyz'[k]}]", {"lower": -20.0, "upper": 20.0})
    fit = {"profiles": False, "double_segments": False}
    return lines + table("[fit]", fit, {"double_segments": "true counts the mesh in the intervals, and takes longer"})


def _cloth(s: Seen, sheet: Sheet, density: float) -> list[str]:
    names = s.recording.markers
    cloth: dict[str, Any] = {} if sheet.name == "cloth" else {"name": sheet.name}
    warp = (WARP if sheet.slack is None else sheet.slack.stiffness) * density
    cloth |= {"density": density, "warp": warp, "shear": SHEAR * density}
    cloth |= {"bending": 1e-4 * density, "membrane_damping": 5e-3, "bend_damping": 2e-2}
    if not s.static:  # air resists motion across a cloth far more than along it; drag of its particles is alike in both
        cloth |= {"air_normal": AIR, "air_tangential": 0.02}
    cloth |= dict.fromkeys(sheet.sizes, 1.0)
    origin, axes, ahead = sheet.origin, list(sheet.axes), list[str]()
    if sheet.ride is not None:
        (hold,), numbers = sheet.held, {k: i for i, k in enumerate(sheet.own)}
        if hold.edge is not None:
            along, below = hold.edge.along + sheet.low[0], 0.0
        else:
            along, below = sheet.flat[[numbers[k] for k in hold.markers], 0], hold.beyond
        origin, *axes, position = robot.placed(sheet.ride, s, along, below, hold.beyond, sheet.height)
        ahead, cloth["on_tool"] = robot.lines(sheet.ride, position), robot.TOOL
    cloth |= {"origin": origin.tolist(), "x_axis": axes[0].tolist(), "y_axis": axes[1].tolist()}
    through = sheet.ride is None and not sheet.starts_flat and (s.recording.mask[0, sheet.own].all() or s.static)
    cloth["shape"] = "recording" if through else None
    cloth["velocity"] = "recording" if _moves(s, sheet) else None
    pinned, sets, grips = (
        sum(found, list[Any]()) for found in zip(*(h.tables(names, s) for h in sheet.held), strict=True)
    )
    cloth["pinned"] = pinned or None
    lines = ahead + table("[[scene.cloth]]", cloth, {"density": "kg/m^2", "bending": "N m, a guess to start from"})
    cells = [max(2, round(CELLS * side / max(sheet.width, sheet.height))) for side in (sheet.width, sheet.height)]
    mesh = {"kind": "grid", "width": sheet.width, "height": sheet.height, "nx": cells[0], "ny": cells[1]}
    mesh |= {} if sheet.margin is None else {"margin": list(sheet.margin)}
    lines += table("[scene.cloth.mesh]", mesh)
    for hold in sheet.held:
        if hold.bar is not None and cloth["shape"] is not None:
            bar = {"set": hold.side, "marker": names[hold.markers[0]], "direction": list(hold.bar)}
            lines += table("[[scene.cloth.bar]]", bar, {"direction": "that of the row of markers beside it"})
    for given in sets:
        lines += table("[[scene.cloth.set]]", given)
    for grip in grips:
        lines += table("[[scene.cloth.grip]]", grip)
    places = {names[k]: at.tolist() for k, at in zip(sheet.own, sheet.flat, strict=True)}
    if sheet.slung:  # else the shape at the start would end in the air beyond the outer markers
        places |= {names[k]: at for hold in sheet.held for k, at in _at_edge(sheet, hold)}
    return lines + table("[scene.cloth.markers]", places)


def _moves(s: Seen, sheet: Sheet) -> bool:
    """Whether a cloth moves at the first frame."""
    return not s.static and not s.rest and sheet.ride is None and not lets_go(s, sheet.own)


def _at_edge(sheet: Sheet, hold: Hold) -> list[tuple[int, list[float]]]:
    """Where markers of a holder are on the edge that they hold: the shape at the start goes through them."""
    axis, sign = SIDES[hold.side]
    size = (sheet.width, sheet.height)
    found = []
    for k, along in zip(hold.markers, hold.along, strict=False) if hold.bar is None else ():
        at = along + sheet.low[1 - axis]
        if 0.0 <= at <= size[1 - axis]:
            here = size[axis] if sign > 0 else 0.0
            found.append((k, [here, at] if axis == 0 else [at, here]))
    return found


def _fitted(sheet: Sheet, density: float) -> dict[str, tuple[float, float]]:
    """Bounds of what is fitted of a cloth."""
    found = {} if sheet.slung else {"bending": (1e-7 * density, 1.0 * density)}  # tension hides it on coarse cells
    for name in sheet.tension:
        guess = {"warp": WARP, "shear": SHEAR}[name]
        found[name] = (0.01 * guess * density, 100.0 * guess * density)
    if sheet.wind is not None:
        found["air_tangential"] = (1e-3, 1.0)
    if not sheet.static:
        found["air_normal"] = (0.02, 20.0)
    return found


def _parameters(sheet: Sheet, density: float) -> list[str]:
    lines = []
    for name, (lower, upper) in _fitted(sheet, density).items():
        lines += table(f"[parameters.{sheet.name}_{name}]", {"lower": lower, "upper": upper})
    if sheet.ride is not None:
        prior = [sheet.ride.shift, robot.CLOCK_SD]
        lines += table(f"[parameters.{robot.CLOCK}]", {"prior": prior}, {"prior": "mean and sd, s"})
    for size in sheet.sizes:
        lines += table(f"[parameters.{sheet.name}_{size}]", {"prior": [1.0, SIZE]}, {"prior": "mean and sd"})
    return lines


def _guesses(sheet: Sheet, measured: Measured) -> list[str]:
    """How far off the numbers may be that are assumed: they count in the intervals."""
    losses = [] if sheet.static else ["membrane_damping", "bend_damping", "air_tangential"]
    guessed, fitted = ["warp", "shear", "bending", *losses], _fitted(sheet, 1.0)
    names = ([] if measured.density is not None else ["density"]) + [name for name in guessed if name not in fitted]
    lines = list[str]()
    for name in names:
        lines += table(f"[given.{sheet.name}_{name}]", {"sd": GUESS}, {"sd": "relative: a guess"})
    return lines


def _recording(take: Take, ride: robot.Riding | None) -> dict[str, Any]:
    s, r = take.seen, take.seen.recording
    entries: dict[str, Any] = dict(take.reading)
    if s.static:
        return entries | {"static": True, "sigma": max(s.noise, 1e-3 * float(np.nanmax(s.apart)))}
    start, stop = float(r.times[0]), float(r.times[-1])
    last = start + min(FITTED * (stop - start), LONGEST)
    if ride is not None:
        entries |= {"time_offset": robot.CLOCK, "start_time": ride.start}
    if s.rest if ride is None else ride.rests:
        entries["start"] = "equilibrium"
    entries |= {"fit": [start, last], "held_out": [last, min(stop, last + 0.5 * (last - start)) + 1e-3]}
    return entries | {"sigma": max(s.noise, 2e-4)}
