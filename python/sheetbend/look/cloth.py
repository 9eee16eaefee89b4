"""A cloth in a recording: how its markers lie on the flat fabric, and which edge holds it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..arrays.timeseries import default_max_gap
from ..errors import RecordingError
from .seen import NEAR, Seen
from .take import Description, Measured, Take
from .text import joined, table

Array = np.ndarray
CELLS = 10  # along the longer side
WHOLE = 0.8  # share of the markers that must hang together as one sheet
QUIET = 0.1  # of the motion of all: how little the upper row moves where the edge above it is held
FITTED, LONGEST = 2 / 3, 1.5  # share of the time that is fitted, and s at most


def describe(takes: Sequence[Take], measured: Measured) -> Description | None:
    """A cloth through the markers that lie on a sheet; None where they do not."""
    s = takes[0].seen
    if not s.sheet:
        return None
    r = s.recording
    own = _connected(s)
    if len(own) < WHOLE * len(r.markers):
        raise RecordingError(
            "markers",
            f"do not hang together as one sheet: {len(own)} of them do, the others are on grips or on further cloths",
            joined(r.markers),
            "give a recording with the markers of one cloth and of what holds it, or write the configuration by hand",
        )
    flat = _flattened(s.apart[np.ix_(own, own)])
    start = int(np.argmax(r.mask[:, own].sum(axis=1)))
    up = -s.gravity / np.linalg.norm(s.gravity)
    place, axes, flat = _placed(flat, r.positions[start, own], up)
    spacing = _spacing(s.apart[np.ix_(own, own)])
    size = np.ptp(flat, axis=0)
    row = [own[k] for k in np.argsort(flat[:, 0]) if flat[k, 1] > size[1] - 0.5 * spacing]
    pinned = s.static or _motion(r.positions[:, row]) < QUIET * _motion(r.positions[:, own])
    margin = np.array([[0.5, 0.5], [0.5, 0.5 if pinned else 0.0]]) * spacing  # left and bottom; right and top
    width, height = (size + margin.sum(axis=0)).tolist()
    origin = place - axes.T @ margin[0]
    names = [r.markers[k] for k in own]
    notes = [
        f"{len(own)} markers lie on a sheet, some {1e3 * spacing:.3g} mm apart: a cloth of {width:.3g} x "
        f"{height:.3g} m with half of that beyond the outer ones",
    ]
    edge = "hardly moves: the edge above it is held" if pinned else "moves: it is taken for what holds the cloth"
    notes.append(f"the upper row of markers, {joined(r.markers[k] for k in row)}, {edge}")
    unknown = [
        "what holds the cloth: the whole upper edge is taken. Change the set, or give a grip with the holder's markers",
        "the edges of the fabric and which way its warp runs: measure them and correct mesh, origin and markers",
        "the stiffness in tension: a cloth that hangs hardly shows it. warp and shear are kept, not fitted",
        "a wind: the air is taken to stand still",
        "the density"
        + (
            ": 0.2 kg/m^2 is taken, and stiffness and drag go with it"
            if measured.density is None
            else " of the markers"
        ),
    ]
    others = [k for k in range(len(r.markers)) if k not in set(own)]
    if others:
        unknown.append(f"what {joined(r.markers[k] for k in others)} are on: they are left out")
    weight = 0.2 if measured.density is None else measured.density
    lines = [] if r.gravity is not None else table("[scene]", {"gravity": s.gravity.tolist()})
    step = float(np.median(np.diff(r.times))) if len(r.times) > 1 else 0.0
    solver: dict[str, Any] = {"method": "newton"}
    if not s.static:
        solver["substeps"] = max(1, int(np.ceil(step / 0.004 - 1e-9)))
    lines += table("[solver]", solver)
    cloth: dict[str, Any] = {
        "density": weight,
        "warp": 500.0 * weight,
        "shear": 100.0 * weight,
        "bending": 1e-4 * weight,
    }
    cloth |= {"membrane_damping": 5e-3, "bend_damping": 2e-2, "drag_linear": 0.5 * weight}
    cloth |= {"origin": origin.tolist(), "x_axis": axes[0].tolist(), "y_axis": axes[1].tolist()}
    whole = r.mask[0, own].all()
    cloth["shape"] = "recording" if whole or s.static else None
    cloth["pinned"] = ["top"] if pinned else None
    lines += table("[[scene.cloth]]", cloth, {"density": "kg/m^2", "bending": "N m, a guess to start from"})
    cells = [max(2, round(CELLS * side / max(width, height))) for side in (width, height)]
    mesh = {"kind": "grid", "width": width, "height": height, "nx": cells[0], "ny": cells[1]}
    lines += table("[scene.cloth.mesh]", mesh)
    if not pinned:
        lines += table("[[scene.cloth.grip]]", {"set": "top", "markers": _seen_through(s, row)})
    places = dict(zip(names, (flat + margin[0]).tolist(), strict=True))
    lines += table("[scene.cloth.markers]", places)
    for take in takes:
        lines += table("[[recording]]", _recording(take))
    lines += table("[parameters.cloth_bending]", {"lower": 1e-7 * weight, "upper": 1.0 * weight})
    if not s.static:
        lines += table("[parameters.cloth_drag_linear]", {"lower": 1e-3 * weight, "upper": 1e2 * weight})
    lines += table(
        "[fit]", {"profiles": False, "double_segments": False}, {"double_segments": "true for the intervals"}
    )
    return Description("a cloth" + (" at rest" if s.static else ""), notes, unknown, lines)


def _spacing(apart: Array) -> float:
    return float(np.median((apart + np.where(np.eye(len(apart)) > 0, np.inf, 0.0)).min(axis=1)))


def _connected(s: Seen) -> list[int]:
    """The largest set of markers that hang together by near neighbors."""
    near = s.apart < 1.2 * NEAR * _spacing(s.apart)
    left, best = set(range(len(near))), list[int]()
    while left:
        group, border = set[int](), [min(left)]
        while border:
            k = border.pop()
            if k in left:
                left.remove(k)
                group.add(k)
                border += [int(j) for j in np.flatnonzero(near[k])]
        if len(group) > len(best):
            best = sorted(group)
    return best


def _flattened(apart: Array) -> Array:
    """(markers, 2) m on the flat fabric: distances along the fabric by shortest paths (Tenenbaum, de Silva & Langford
    2000, Science 290, 2319), and classical scaling of these."""
    path = np.where(apart < 1.2 * NEAR * _spacing(apart), apart, np.inf)
    np.fill_diagonal(path, 0.0)
    for k in range(len(path)):
        path = np.minimum(path, path[:, [k]] + path[[k]])
    # a straight way over the fabric is never shorter than what was seen between two markers, nor much longer
    path = np.maximum(apart, np.minimum(path, 1.1 * apart))
    n = len(path)
    centered = np.eye(n) - 1.0 / n
    values, vectors = np.linalg.eigh(-0.5 * centered @ path**2 @ centered)
    flat = vectors[:, -2:] * np.sqrt(np.maximum(values[-2:], 0.0))
    angles = np.linspace(0.0, np.pi / 2, 91)[:-1]
    turns = [np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]]) for a in angles]
    best = min(turns, key=lambda turn: float(np.prod(np.ptp(flat @ turn, axis=0))))
    return np.asarray(flat @ best)


def _placed(flat: Array, x: Array, up: Array) -> tuple[Array, Array, Array]:
    """Where the flat fabric lies best on the markers (k, 3): the place of its lower left corner, its axes (2, 3), and
    the layout (k, 2) turned so that its y axis points up, from that corner."""
    seen = ~np.isnan(x[:, 0])
    for turn in range(4):
        c, s = [(1, 0), (0, 1), (-1, 0), (0, -1)][turn]
        turned = flat @ np.array([[c, -s], [s, c]])
        mean, center = turned[seen].mean(axis=0), x[seen].mean(axis=0)
        u, _, vt = np.linalg.svd((turned[seen] - mean).T @ (x[seen] - center), full_matrices=False)
        axes = u @ vt
        if axes[1] @ up >= abs(axes[0] @ up) - 1e-9:
            break
    corner = turned.min(axis=0)
    return center + axes.T @ (corner - mean), axes, turned - corner


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
