"""A cloth in a recording: how its markers lie on the flat fabric, and which edge holds it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays.timeseries import default_max_gap
from ..errors import RecordingError
from .seen import Seen
from .sheet import connected, flattened, placed, spacing
from .take import Description, Measured, Take
from .text import joined, table

Array = np.ndarray
CELLS = 10  # along the longer side
WHOLE = 0.8  # share of the markers that must hang together as one sheet
QUIET = 0.1  # of the motion of all: how little the upper row moves where the edge above it is held
ASKEW = 0.15  # slope at which a cloth hangs that a wind blows on
AIR = 0.7  # kg/m^3, of a plate across the wind: half the density of air times a drag coefficient of 1.2
SUBSTEP = 1 / 250  # s, at most
FITTED, LONGEST = 2 / 3, 3.0  # share of the time that is fitted, and s at most


@dataclass(frozen=True)
class Sheet:
    """A cloth as its markers show it.

    Attributes:
        own: its markers.
        flat: (markers, 2) m, where they lie on the fabric.
        width, height: m.
        origin, axes: (3,) m and (2, 3), where the fabric lies best.
        row: the upper row of markers.
        pinned: whether that row hardly moves.
        wind: (3,) m/s, a guess, where the cloth hangs askew and hardly moves; None elsewhere.
    """

    own: list[int]
    flat: Array
    width: float
    height: float
    origin: Array
    axes: Array
    row: list[int]
    pinned: bool
    wind: Array | None


def describe(takes: Sequence[Take], measured: Measured) -> Description | None:
    """A cloth through the markers that lie on a sheet; None where they do not."""
    s = takes[0].seen
    if not s.sheet:
        return None
    names = s.recording.markers
    density = 0.2 if measured.density is None else measured.density
    own = connected(s.apart)
    if len(own) < WHOLE * len(names):
        raise RecordingError(
            "markers",
            f"do not hang together as one sheet: {len(own)} of them do, the others are on grips or on other cloths",
            joined(names),
            "give a recording with the markers of one cloth and of what holds it, or write the configuration by hand",
        )
    sheet = _looked_at(s, own, density)
    apart = spacing(s.apart[np.ix_(own, own)])
    edge = "moves: it is taken as what holds the cloth"
    if sheet.pinned:
        edge = "hardly moves: the edge above it is taken as held"
    notes = [
        f"{len(own)} markers lie on a sheet, some {1e3 * apart:.3g} mm apart: a cloth of {sheet.width:.3g} x "
        f"{sheet.height:.3g} m with half of that beyond the outer ones",
        f"the upper row of markers, {joined(names[k] for k in sheet.row)}, {edge}",
    ]
    if sheet.wind is not None:
        notes.append("it hangs at a slant and hardly moves: a wind blows, or another axis points up")
    unknown = [
        "what holds the cloth: the whole upper edge is taken. Change the set, or give a grip with the holder's markers",
        "the size of the flat fabric: distances are taken as it hangs, stretched by its weight and the air. If that is "
        "1 %, the lowest markers are off by 1 % of the height, and the fitted tension is too stiff. Measure the edges "
        "and the markers on the flat cloth, and which way its warp runs, and correct mesh, origin and markers",
        "the stiffness in tension: a hanging cloth hardly shows it. warp and shear are not fitted"
        if sheet.wind is None
        else "the stiffness in tension at the start: warp and shear begin at a guess, and the wind's pull shows them",
        "the wind: the air is taken to stand still, and `air_tangential`, its friction along the cloth, is a guess"
        if sheet.wind is None
        else "how strongly the air acts at the start: `air_normal` begins with the value of a plate; a steady wind "
        "shows it only together with the wind's speed",
        "the density: 0.2 kg/m^2 is assumed, and all other values are proportional to it"
        if measured.density is None
        else "the mass of the markers",
    ]
    if not sheet.pinned:
        unknown.append(
            f"the true motion of the holder: the upper row's noise, {1e3 * s.noise:.2g} mm in each coordinate, shakes "
            "the cloth, and the prediction is worse for it. Give the holder's own markers, or its poses as a "
            '[[scene.tool]]; or add `driven_sigma = "estimate"` to [[recording]], which takes many times as long'
        )
    others = [k for k in range(len(names)) if k not in set(own)]
    if others:
        unknown.append(f"what {joined(names[k] for k in others)} are attached to: they are left out")
    return Description("a cloth" + (" at rest" if s.static else ""), notes, unknown, _lines(takes, sheet, density))


def _looked_at(s: Seen, own: list[int], density: float) -> Sheet:
    r = s.recording
    flat = flattened(s.apart[np.ix_(own, own)])
    start = int(np.argmax(r.mask[:, own].sum(axis=1)))
    up = -s.gravity / np.linalg.norm(s.gravity)
    place, axes, flat = placed(flat, r.positions[start, own], up)
    apart = spacing(s.apart[np.ix_(own, own)])
    size = np.ptp(flat, axis=0)
    row = [own[k] for k in np.argsort(flat[:, 0]) if flat[k, 1] > size[1] - 0.5 * apart]
    pinned = s.static or _motion(r.positions[:, row]) < QUIET * max(_motion(r.positions[:, own]), float(apart))
    margin = np.array([[0.5, 0.5], [0.5, 0.5 if pinned else 0.0]]) * apart  # left and bottom; right and top
    width, height = (size + margin.sum(axis=0)).tolist()
    wind = _wind(s, own, row, up, density) if pinned and not s.static else None
    return Sheet(own, flat + margin[0], width, height, place - axes.T @ margin[0], axes, row, pinned, wind)


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


def _lines(takes: Sequence[Take], sheet: Sheet, density: float) -> list[str]:
    s, r = takes[0].seen, takes[0].seen.recording
    lines = [] if r.gravity is not None else table("[scene]", {"gravity": s.gravity.tolist()})
    solver: dict[str, Any] = {"method": "newton"}
    if not s.static:
        solver["substeps"] = max(1, int(np.ceil(float(np.median(np.diff(r.times))) / SUBSTEP - 1e-9)))
    lines += table("[solver]", solver)
    if sheet.wind is not None:
        lines += table("[scene.wind]", {"velocity": sheet.wind.tolist()}, {"velocity": "m/s, a guess to start from"})
    cloth: dict[str, Any] = {"density": density, "warp": 500.0 * density, "shear": 100.0 * density}
    cloth |= {"bending": 1e-4 * density, "membrane_damping": 5e-3, "bend_damping": 2e-2}
    if not s.static:  # air resists motion across a cloth far more than along it; drag of its particles is alike in both
        cloth |= {"air_normal": AIR, "air_tangential": 0.02}
    cloth |= {"origin": sheet.origin.tolist(), "x_axis": sheet.axes[0].tolist(), "y_axis": sheet.axes[1].tolist()}
    cloth["shape"] = "recording" if r.mask[0, sheet.own].all() or s.static else None
    cloth["pinned"] = ["top"] if sheet.pinned else None
    lines += table("[[scene.cloth]]", cloth, {"density": "kg/m^2", "bending": "N m, a guess to start from"})
    cells = [max(2, round(CELLS * side / max(sheet.width, sheet.height))) for side in (sheet.width, sheet.height)]
    mesh = {"kind": "grid", "width": sheet.width, "height": sheet.height, "nx": cells[0], "ny": cells[1]}
    lines += table("[scene.cloth.mesh]", mesh)
    if not sheet.pinned:
        lines += table("[[scene.cloth.grip]]", {"set": "top", "markers": _seen_through(s, sheet.row)})
    lines += table(
        "[scene.cloth.markers]", {r.markers[k]: at.tolist() for k, at in zip(sheet.own, sheet.flat, strict=True)}
    )
    for take in takes:
        lines += table("[[recording]]", _recording(take))
    lines += table("[parameters.cloth_bending]", {"lower": 1e-7 * density, "upper": 1.0 * density})
    if sheet.wind is not None:
        for k in np.flatnonzero(np.arange(3) != s.up):
            lines += table(f"[parameters.wind_{'xyz'[k]}]", {"lower": -20.0, "upper": 20.0})
        # kept at a guess they draw the wind far off: on experiments/cloth_in_wind 9 mm in the place of 3
        for name in ("warp", "shear"):
            bounds = {"lower": 0.01 * cloth[name], "upper": 100.0 * cloth[name]}
            lines += table(f"[parameters.cloth_{name}]", bounds)
        lines += table("[parameters.cloth_air_tangential]", {"lower": 1e-3, "upper": 1.0})
    if not s.static:
        lines += table("[parameters.cloth_air_normal]", {"lower": 0.02, "upper": 20.0})
    fit = {"profiles": False, "double_segments": False}
    return lines + table("[fit]", fit, {"double_segments": "true counts the mesh in the intervals, and takes longer"})


def _motion(x: Array) -> float:
    if len(x) < 2:
        return 0.0
    return float(np.sqrt(np.nanmean(np.nanvar(x, axis=0).sum(axis=1))))


def _seen_through(s: Seen, row: list[int]) -> list[str]:
    """Markers of a row that are never lost for long; all of them where there is none."""
    r, gap = s.recording, default_max_gap(s.recording.times)
    kept = []
    for k in row:
        t = r.times[r.mask[:, k]]
        if r.mask[0, k] and r.mask[-1, k] and np.diff(t).max() <= gap:
            kept.append(k)
    return [r.markers[k] for k in (kept or row)]


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
