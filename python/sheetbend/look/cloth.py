"""Cloths in a recording: how their markers lie on the flat fabric, what holds them, and how they are fitted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import RecordingError
from .cloth_held import SAGS, SIDES, Hold, holds, row_of, slung
from .cloth_parts import cloth_parts
from .folded import folded
from .seen import Seen
from .sheet import flattened, placed, spacing
from .slung import Slack, slack
from .take import Description, Measured, Take
from .text import joined, table

Array = np.ndarray
CELLS = 10  # along the longer side
WHOLE = 0.8  # share of the markers that must hang together as one sheet
WARP, SHEAR = 500.0, 100.0  # N/m per kg/m^2, to start from
ASKEW = 0.15  # slope at which a cloth hangs that a wind blows on
AIR = 0.7  # kg/m^3, of a plate across the wind: half the density of air times a drag coefficient of 1.2
SUBSTEP = 1 / 250  # s, at most
GUESS = 0.5  # standard deviation of what is assumed without a measurement, relative
SIZE = 0.01  # standard deviation of the flat size that markers on a stretched cloth show, relative
FITTED, LONGEST = 2 / 3, 3.0  # share of the time that is fitted, and s at most


@dataclass(frozen=True)
class Sheet:
    """A cloth as its markers show it.

    Attributes:
        name: of the cloth in the configuration.
        own: its markers.
        flat: (markers, 2) m, where they lie on the fabric.
        width, height: m.
        low: (2,) m, from the left and lower edge to the outer markers.
        origin, axes: (3,) m and (2, 3), where the fabric lies best.
        held: what holds it.
        slung: whether it lies between two sides that are held, its x axis from one to the other.
        slack: what it is without tension, where its motion shows it.
        wind: (3,) m/s, a guess, where the cloth hangs askew and hardly moves; None elsewhere.
    """

    name: str
    own: list[int]
    flat: Array
    width: float
    height: float
    low: Array
    origin: Array
    axes: Array
    held: list[Hold]
    slung: bool
    slack: Slack | None
    wind: Array | None


def describe(takes: Sequence[Take], measured: Measured) -> Description | None:
    """Cloths through the markers that lie on sheets; None where they do not."""
    s = takes[0].seen
    if not s.sheet:
        return None
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
    sheets, notes, unknown = [], list[str](), list[str]()
    first = (_looked_at(s, name, own, others, density, {}) for name, own in cloths.items())
    bars = _bars([sheet for sheet in first if sheet is not None])
    for name, own in cloths.items():
        sheet = _looked_at(s, name, own, others, density, bars)
        if sheet is None:
            unknown.append(_lies_over(names, own, "the middle of their cloth is above two of its sides"))
            continue
        sheets.append(sheet)
    pairs = folded(s, [(sheet.own, sheet.flat) for sheet in sheets])
    sides = {k for pair in pairs for k in pair}
    for pair in pairs:
        own = sorted(sheets[pair[0]].own + sheets[pair[1]].own)
        unknown.append(_lies_over(names, own, "they hang from two rows that face each other, on either side of it"))
    sheets = [sheet for k, sheet in enumerate(sheets) if k not in sides]
    for sheet in sheets:
        notes += _seen_of(s, sheet, len(cloths) > 1)
    if not sheets:
        fix = "measure the fabric between the markers and write the configuration by hand, see docs/configuration.md"
        raise RecordingError("markers", "lie on a cloth that something holds up from below", joined(names), fix)
    unknown = [*_unknown(s, sheets, measured), *unknown]
    used = {k for sheet in sheets for hold in sheet.held for k in hold.markers}
    unused = [k for k in others if k not in used]
    if unused:
        unknown.append(f"what the markers {joined(names[k] for k in unused)} are attached to: they are left out")
    kind = ("a cloth" if len(sheets) == 1 else f"{len(sheets)} cloths") + (" at rest" if s.static else "")
    return Description(kind, notes, unknown, _lines(takes, sheets, density, measured))


def _bars(sheets: Sequence[Sheet]) -> dict[int, tuple[float, ...]]:
    """Directions of bars by their markers, the median of what the rows beside them show: a row may be tilted, as that
    of a fabric cut on the bias is, and this counts by its distance from the marker."""
    shown: dict[int, list[Array]] = {}
    for hold in (hold for sheet in sheets for hold in sheet.held):
        if hold.bar is not None:
            bar, rows = np.array(hold.bar), shown.setdefault(hold.markers[0], [])
            rows.append(bar * (np.sign(bar @ rows[0]) if rows else 1.0))
    return {k: tuple(np.median(rows, axis=0).tolist()) for k, rows in shown.items()}


def _lies_over(names: Sequence[str], own: Sequence[int], because: str) -> str:
    return (
        f"what {joined(names[k] for k in own)} lie over: {because}, and no marker shows how the fabric runs there. "
        "They are left out; write this cloth by hand, as experiments/twin_cloth does"
    )


def _seen_of(s: Seen, sheet: Sheet, several: bool) -> list[str]:
    names, held = s.recording.markers, []
    apart = spacing(s.apart[np.ix_(sheet.own, sheet.own)])
    whose = f"{sheet.name}: " if several else ""
    notes = [
        f"{whose}{len(sheet.own)} markers lie on a sheet, some {1e3 * apart:.3g} mm apart: a cloth of "
        f"{sheet.width:.3g} x {sheet.height:.3g} m with half of that beyond the outer ones where nothing holds it"
    ]
    for hold in sheet.held:
        of = joined(names[k] for k in hold.markers)
        what = f"single vertices of the {hold.side} edge" if hold.corners else f"the whole {hold.side} edge"
        if not hold.own:
            how = "moves" if hold.moves else "stays in place"
            held.append(f"on what holds {what} and {how}: {of}")
        elif hold.corners:
            how = "move" if hold.moves else "hardly move"
            held.append(f"{of} {how}, and the {hold.side} row of markers sags between them: the cloth is held there")
        else:
            how = "moves: it is taken as what holds the cloth"
            if not hold.moves:
                how = "hardly moves: the edge beyond it is taken as held"
            row = {"top": "upper", "bottom": "lower"}.get(hold.side, hold.side)
            held.append(f"the {row} row of markers, {of}, {how}")
    if sheet.slung:
        held.append("its middle hangs below its left and right edge: it is slung between them")
    if sheet.slack is not None:
        held.append(
            f"its length changes with its sag as that of a fabric of {sheet.slack.length:.4g} m without tension, from "
            f"the first to the last row, and {sheet.slack.first:.4g} m in the first frame"
        )
    if sheet.wind is not None:
        held.append("it hangs at a slant and hardly moves: a wind blows, or another axis points up")
    return notes + [whose + words for words in held]


def _unknown(s: Seen, sheets: Sequence[Sheet], measured: Measured) -> list[str]:
    held = [hold for sheet in sheets for hold in sheet.held]
    windy = any(sheet.wind is not None for sheet in sheets)
    said = []
    if any(hold.own and not hold.corners for hold in held):
        said.append(
            "what holds the cloth: whole edges are taken. Change the set, or give a grip with the holder's markers"
        )
    if any(hold.corners for hold in held):
        said.append(
            "how large a patch is held at each corner: one vertex of the mesh is taken, and a cloth that is held at "
            "single vertices comes out too soft. Measure the patches, and give each set a box (`lower`, `upper`)"
        )
    said.append(
        "the size of the flat fabric: distances are taken as it hangs, stretched by its weight and the air. If that is "
        "1 %, the lowest markers are off by 1 % of the height, and the fitted tension is too stiff. Measure the edges "
        "and the markers on the flat cloth, and which way its warp runs, and correct mesh, origin and markers"
    )
    if windy:
        said.append(
            "how much the cloth is stretched: its flat size along warp and weft is fitted beside the tension, with a "
            "prior of 1 % about what the markers show. Give the sd of your own measurement where you have one"
        )
        said.append(
            "the stiffness in tension at the start: warp and shear begin at a guess, and the wind's pull shows them"
        )
    elif any(sheet.slung for sheet in sheets):
        said.append(
            "the stiffness across, in shear and in bending: a slung cloth shows that along its length, which is fitted "
            "as `..._warp`, whichever way the threads run. It is only as good as the length of the flat fabric, which "
            "is fitted beside it: an error of 0.2 % is one of 15 to 40 % of the stiffness"
        )
    if not windy and not all(sheet.slung for sheet in sheets):
        said.append("the stiffness in tension: a hanging cloth hardly shows it. warp and shear are not fitted")
    said.append(
        "how strongly the air acts at the start: `air_normal` begins with the value of a plate; a steady wind "
        "shows it only together with the wind's speed"
        if windy
        else "the wind: the air is taken to stand still, and `air_tangential`, its friction along the cloth, is a guess"
    )
    said.append(
        "the density: 0.2 kg/m^2 is assumed, and all other values are proportional to it. The intervals allow for 50 % "
        "of it (`[given]`): measure it, and give --density"
        if measured.density is None
        else "the mass of the markers"
    )
    if any(hold.moves and hold.own for hold in held):
        rows = "the upper row's noise" if len(held) == 1 and held[0].side == "top" else "their noise"
        said.append(
            f"the true motion of the holder: {rows}, {1e3 * s.noise:.2g} mm in each coordinate, shakes "
            "the cloth, and the prediction is worse for it. Give the holder's own markers, or its poses as a "
            '[[scene.tool]]; or add `driven_sigma = "estimate"` to [[recording]], which takes many times as long'
        )
    return said


def _looked_at(
    s: Seen, name: str, own: list[int], others: Sequence[int], density: float, bars: Mapping[int, tuple[float, ...]]
) -> Sheet | None:
    """A cloth; None where something lies under it. Bars point where its rows beside them do, if not given."""
    r = s.recording
    flat = flattened(s.apart[np.ix_(own, own)])
    start = int(np.argmax(r.mask[:, own].sum(axis=1)))
    up = -s.gravity / np.linalg.norm(s.gravity)
    place, axes, flat = placed(flat, r.positions[start, own], up)
    apart = spacing(s.apart[np.ix_(own, own)])
    axis, rise = slung(r.positions[:, own], flat, up, apart)
    if rise < -SAGS:
        return None
    is_slung = rise > SAGS
    if is_slung and axis == 1:  # from now on x runs from one held side to the other
        place = place + axes[0] * np.ptp(flat[:, 0])
        flat = np.stack([flat[:, 1], np.ptp(flat[:, 0]) - flat[:, 0]], axis=1)
        axes = np.stack([axes[1], -axes[0]])
    found = slack(s, own, flat, apart) if is_slung else None
    if found is not None:
        flat = flat * [found.length / np.ptp(flat[:, 0]), 1.0]
    held = holds(s, own, flat, others, ("left", "right") if is_slung else ("top",), bars)
    beyond = {hold.side: hold.beyond for hold in held}
    if found is not None:  # the cloth is stretched there too
        beyond |= {side: beyond[side] * found.length / found.first for side in ("left", "right") if side in beyond}
    low, high = (
        np.array([beyond.get(side, 0.5 * apart) for side in sides]) for sides in (("left", "bottom"), ("right", "top"))
    )
    width, height = (np.ptp(flat, axis=0) + low + high).tolist()
    at_rest = not s.static and not any(hold.moves for hold in held) and not is_slung
    wind = _wind(s, own, [own[k] for k in row_of(flat, "top", apart)], up, density) if at_rest else None
    return Sheet(name, own, flat + low, width, height, low, place - axes.T @ low, axes, held, is_slung, found, wind)


def _wind(s: Seen, own: list[int], row: list[int], up: Array, density: float) -> Array | None:
    """m/s, of a wind that balances the weight of a cloth that leans by as much on average, about half of the time."""
    x = s.recording.positions[len(s.recording.times) // 2 :]
    lean = np.nanmean(x[:, own], axis=(0, 1)) - np.nanmean(x[:, row], axis=(0, 1))
    drop = float(-lean @ up)
    across = lean + drop * up
    slope = float(np.linalg.norm(across)) / max(drop, 1e-9)
    if drop <= 0 or slope < ASKEW:
        return None
    speed = np.sqrt(density * float(np.linalg.norm(s.gravity)) * slope / AIR)
    return np.asarray(speed * across / np.linalg.norm(across))


def _lines(takes: Sequence[Take], sheets: Sequence[Sheet], density: float, measured: Measured) -> list[str]:
    s, r = takes[0].seen, takes[0].seen.recording
    lines = [] if r.gravity is not None else table("[scene]", {"gravity": s.gravity.tolist()})
    solver: dict[str, Any] = {"method": "newton"}
    if not s.static:
        solver["substeps"] = max(1, int(np.ceil(float(np.median(np.diff(r.times))) / SUBSTEP - 1e-9)))
    lines += table("[solver]", solver)
    winds = [sheet.wind for sheet in sheets if sheet.wind is not None]
    if winds:
        wind = np.mean(winds, axis=0).tolist()
        lines += table("[scene.wind]", {"velocity": wind}, {"velocity": "m/s, a guess to start from"})
    for sheet in sheets:
        lines += _cloth(s, sheet, density)
    for take in takes:
        lines += table("[[recording]]", _recording(take))
    for sheet in sheets:
        lines += _parameters(sheet, density, s.static) + _guesses(sheet, measured, s.static)
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
    cloth |= dict.fromkeys(_sizes(sheet), 1.0)
    cloth |= {"origin": sheet.origin.tolist(), "x_axis": sheet.axes[0].tolist(), "y_axis": sheet.axes[1].tolist()}
    cloth["shape"] = "recording" if s.recording.mask[0, sheet.own].all() or s.static else None
    pinned, sets, grips = (
        sum(found, list[Any]()) for found in zip(*(h.tables(names, s) for h in sheet.held), strict=True)
    )
    cloth["pinned"] = pinned or None
    lines = table("[[scene.cloth]]", cloth, {"density": "kg/m^2", "bending": "N m, a guess to start from"})
    cells = [max(2, round(CELLS * side / max(sheet.width, sheet.height))) for side in (sheet.width, sheet.height)]
    mesh = {"kind": "grid", "width": sheet.width, "height": sheet.height, "nx": cells[0], "ny": cells[1]}
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


def _fitted(sheet: Sheet, density: float, static: bool) -> dict[str, tuple[float, float]]:
    """Bounds of what is fitted of a cloth."""
    found = {} if sheet.slung else {"bending": (1e-7 * density, 1.0 * density)}  # tension hides it on coarse cells
    # kept at a guess they draw the wind far off: on experiments/cloth_in_wind 9 mm in the place of 3
    tension = ("warp", "shear") if sheet.wind is not None else ("warp",) if sheet.slung else ()
    for name, guess in {"warp": WARP, "shear": SHEAR}.items():
        if name in tension:
            found[name] = (0.01 * guess * density, 100.0 * guess * density)
    if sheet.wind is not None:
        found["air_tangential"] = (1e-3, 1.0)
    if not static:
        found["air_normal"] = (0.02, 20.0)
    return found


def _parameters(sheet: Sheet, density: float, static: bool) -> list[str]:
    lines = []
    for name, (lower, upper) in _fitted(sheet, density, static).items():
        lines += table(f"[parameters.{sheet.name}_{name}]", {"lower": lower, "upper": upper})
    for size in _sizes(sheet):
        lines += table(f"[parameters.{sheet.name}_{size}]", {"prior": [1.0, SIZE]}, {"prior": "mean and sd"})
    return lines


def _guesses(sheet: Sheet, measured: Measured, static: bool) -> list[str]:
    """How far off the numbers may be that are assumed: they count in the intervals."""
    guessed = ["warp", "shear", "bending", *([] if static else ["membrane_damping", "bend_damping", "air_tangential"])]
    fitted = _fitted(sheet, 1.0, static)
    names = ([] if measured.density is not None else ["density"]) + [name for name in guessed if name not in fitted]
    lines = list[str]()
    for name in names:
        lines += table(f"[given.{sheet.name}_{name}]", {"sd": GUESS}, {"sd": "relative: a guess"})
    return lines


def _sizes(sheet: Sheet) -> tuple[str, ...]:
    """Of the flat fabric, those that its tension depends on: of what the markers show it is stretched there."""
    return ("warp_size", "weft_size") if sheet.wind is not None else ("warp_size",) if sheet.slung else ()


def _recording(take: Take) -> dict[str, Any]:
    s, r = take.seen, take.seen.recording
    entries: dict[str, Any] = {"file": take.file, "units": take.units}
    if s.static:
        return entries | {"static": True, "sigma": max(s.noise, 1e-3 * float(np.nanmax(s.apart)))}
    start, stop = float(r.times[0]), float(r.times[-1])
    last = start + min(FITTED * (stop - start), LONGEST)
    if s.rest:
        entries["start"] = "equilibrium"
    entries |= {"fit": [start, last], "held_out": [last, min(stop, last + 0.5 * (last - start)) + 1e-3]}
    return entries | {"sigma": max(s.noise, 2e-4)}
