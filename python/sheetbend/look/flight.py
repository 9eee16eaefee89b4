"""A rigid body in free flight in a recording: all markers keep their distances, and gravity alone accelerates them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from ..arrays.rigid import rigid_motion
from ..arrays.rotations import quaternions_of
from ..arrays.types import Array
from ..recording.of_poses import start_of_poses
from .seen import Seen
from .take import Description, Measured, Take
from .text import joined, table

FEWEST = 9  # frames of a flight, and of a window in which it is looked for
WIDTH = 0.04  # s of such a window, at least
ALLOWED = 0.1  # of what gravity alone does in a window: how little a flight leaves of it
SURE = 4.0  # times the noise: the same
TRIMMED = 2  # frames at an end of a flight that something else begins at: a touch moves the middle only later
LONG = 0.1  # s, beyond which no more is allowed in a longer flight
OFF = 0.7  # times the markers' mean distance from their middle: how far from there the center of mass may be
FITTED = 2 / 3  # share of the flight that is fitted; the rest is predicted
BEGUN = 0.03  # s from whose poses the start is told
TURN = 0.02  # rad in a substep, at most
SUBSTEP = 1 / 400  # s, at most
ROUND = 0.05  # of the markers' own moment: markers on a plane make no body that is flat
CENTER_SD = 0.25  # of the markers' mean distance from their middle


class Flight(NamedTuple):
    """The longest flight of a recording.

    Attributes:
        frames: of the recording.
        points: (markers, 3) m, in axes of the body: those along which its markers spread.
        inertia: (3,) kg m^2, of 1 kg spread evenly over the markers.
        start: keys of a [[scene.body]] that say how it starts.
    """

    frames: slice
    points: Array
    inertia: Array
    start: dict[str, list[float]]


def describe(takes: Sequence[Take], measured: Measured) -> Description | None:
    """A body that flies; None for other recordings."""
    s = takes[0].seen
    r = s.recording
    if len(takes) > 1 or len(s.bodies) != 1 or len(s.bodies[0]) < len(r.markers):
        return None
    # a fall shows which way is up, where the file does not say it
    ups = {"": s}
    if s.up_by == "guess":
        ups = {"xyz"[up]: replace(s, up=up) for up in (s.up, 3 - s.up)}
        ups |= {f"-{name}": seen.upside_down() for name, seen in ups.items()}
    found = [(flight, name) for name, seen in ups.items() if (flight := _longest(seen)) is not None]
    if not found:
        return None
    flight, up = max(found, key=lambda pair: pair[0].frames.stop - pair[0].frames.start)
    s = ups[up]
    t, reach = r.times[flight.frames], _reach(flight.points)
    turned = float(np.linalg.norm(flight.start["spin"])) * float(t[-1] - t[0])
    notes = [
        f"{joined(r.markers)} keep their distances: a rigid body",
        f"from {t[0]:.4g} to {t[-1]:.4g} s gravity alone accelerates it: it flies, and turns by {turned:.2g} rad",
    ]
    unknown = [
        "the mass: a flight does not depend on it. It is set to 1 kg, and moments of inertia count per kg",
        "where the center of mass is: it is fitted, with the markers' middle as the prior. A slow turn hardly shows it",
        "the moments of inertia and their axes: those of equal masses at the markers stand in their place. They matter "
        "where the body turns by more than about a radian. Measure or compute them (`box` for a homogeneous box); "
        "[parameters.body_inertia_2] and [parameters.body_inertia_3] then fit their ratios to the first",
        "the unit of length: a scale that is 1 % off looks like gravity that is 1 % off, and is not fitted",
        "the air: it does not slow the body. Add `drag` to [[scene.body]] and [parameters.body_drag] for a light one",
    ]
    if len(t) < len(r.times):
        unknown.append(
            "what holds or touches it in the other frames, which are left out. What it bounces on needs the corners of "
            "the body: see docs/contact.md, Bodies"
        )
    lines = _lines(replace(takes[0], seen=s), flight, reach)
    return Description("a rigid body in free flight", notes, unknown, lines, up or None)


def _longest(s: Seen) -> Flight | None:
    """The longest part in which the markers' middle accelerates as gravity asks."""
    r = s.recording
    seen = np.flatnonzero(np.isfinite(r.positions).all(axis=(1, 2)))
    if len(seen) < FEWEST:
        return None
    turns, centers, _ = rigid_motion(r.positions[seen])
    off = r.positions[seen] - centers[:, None]
    reach = float(np.linalg.norm(off, axis=2).mean())
    noise = s.noise / np.sqrt(len(r.markers))
    span = _longest_span(r.times[seen], turns, centers, noise, s.gravity, reach)
    if span.stop == span.start:
        return None
    first = span.start + (TRIMMED if span.start > 0 else 0)
    own = seen[first : span.stop - (TRIMMED if span.stop < len(seen) else 0)]
    if len(own) < FEWEST:
        return None
    turns, centers, _ = rigid_motion(r.positions[own])
    middle = np.einsum("fba,fkb->fka", turns, r.positions[own] - centers[:, None]).mean(axis=0)
    axes = np.linalg.svd(middle)[2]
    axes[2] = np.cross(axes[0], axes[1])
    points = middle @ axes.T
    squares = np.mean(points**2, axis=0)
    begun = slice(0, max(4, int((r.times[own] < r.times[own[0]] + BEGUN).sum())))
    frames = turns @ axes.T
    start = start_of_poses(r.times[own][begun], centers[begun], quaternions_of(frames[begun]), s.gravity)
    keys = {"at": start["at"], "quaternion": quaternions_of(start["rotation"][None])[0]}
    keys |= {key: start[key] for key in ("velocity", "spin")}
    inertia = squares.sum() * (1.0 + ROUND) - squares
    return Flight(slice(own[0], own[-1] + 1), points, inertia, {k: v.tolist() for k, v in keys.items()})


def _longest_span(times: Array, turns: Array, centers: Array, noise: float, gravity: Array, reach: float) -> slice:
    """The longest run of frames that a body flies through; empty where there is none."""
    step = float(np.median(np.diff(times)))
    size = float(np.linalg.norm(gravity)) / (12.0 * np.sqrt(5.0))  # rms of a parabola beyond its line, per s^2
    width = max(FEWEST, round(WIDTH / step) + 1, round(np.sqrt(2.0 * SURE * noise / (ALLOWED * size)) / step) + 1)

    def flies(first: int, last: int) -> bool:
        t = times[first:last] - times[first:last].mean()
        if t[-1] - t[0] > 1.5 * (last - first) * step:
            return False
        left, apart = _left(t, turns[first:last], centers[first:last], noise, gravity, reach)
        return left < max(SURE * noise, ALLOWED * size * min(t[-1] - t[0], LONG) ** 2) and apart < OFF * reach

    best, first = slice(0, 0), 0
    while first + width <= len(times):
        last = first + width
        if not flies(first, last):
            first += 1
            continue
        while last < len(times) and flies(first, last + 1):
            last += 1
        if last - first > best.stop - best.start:
            best = slice(first, last)
        first = last - width + 1
    return best


def _left(t: Array, turns: Array, centers: Array, noise: float, gravity: Array, reach: float) -> tuple[float, float]:
    """m, rms of what a parabola of the known gravity leaves of the markers' middle, less what a center of mass apart
    from it adds as it turns; and how far apart that is."""
    ones = np.repeat(np.eye(3)[None], len(t), axis=0)
    columns = np.concatenate([ones, t[:, None, None] * ones, turns - turns.mean(axis=0)], axis=2)
    matrix, fallen = columns.reshape(-1, 9), (centers - 0.5 * np.outer(t**2, gravity)).ravel()
    near = np.zeros((3, 9))
    near[:, 6:] = np.eye(3) * (noise + 1e-9) / reach  # where it hardly turns, the center of mass is taken as near
    values = np.linalg.lstsq(np.concatenate([matrix, near]), np.concatenate([fallen, np.zeros(3)]))[0]
    return float(np.sqrt(np.mean((matrix @ values - fallen) ** 2))), float(np.linalg.norm(values[6:]))


def _reach(points: Array) -> float:
    return float(np.linalg.norm(points, axis=1).mean())


def _lines(take: Take, flight: Flight, reach: float) -> list[str]:
    s, r = take.seen, take.seen.recording
    t = r.times[flight.frames]
    step, spin = take.step, float(np.linalg.norm(flight.start["spin"]))
    lines = take.scene_lines
    lines += table("[solver]", {"substeps": int(np.ceil(step * max(1.0 / SUBSTEP, spin / TURN)))})
    body: dict[str, Any] = {"name": "body", "mass": 1.0, "inertia": flight.inertia.tolist()} | flight.start
    said = {"mass": "kg, not known: see above", "inertia": "kg m^2, of equal masses at the markers"}
    lines += table("[[scene.body]]", body, said | {"velocity": "as the first frames of the flight show it"})
    for name, point in zip(r.markers, flight.points, strict=True):
        lines += table("[[marker]]", {"marker": name, "body": "body", "point": point.tolist()})
    cut = float(t[round(FITTED * (len(t) - 1))] + 0.5 * step)
    own: dict[str, Any] = {**take.reading, "start_time": float(t[0])}
    own |= {"fit": [float(t[0]), cut], "held_out": [cut, float(t[-1]) + 1e-4], "sigma": max(s.noise, 1e-5)}
    lines += table("[[recording]]", own, {"held_out": "predicted, not fitted"})
    for of in ("", "turn_", "velocity_", "spin_"):
        for axis in "xyz":
            lines += table(f"[parameters.body_{of}{axis}]", {})
    for axis in "xyz":
        lines += table(f"[parameters.body_center_{axis}]", {"prior": [0.0, CENTER_SD * reach]})
    return lines
