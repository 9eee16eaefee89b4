"""A beam in a recording: one body that stays and one that swings, with nothing seen between them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..recording.oscillation import along, dominant_direction, first_frequency
from ..arrays.timeseries import mean_position
from .text import joined, table

if TYPE_CHECKING:
    from .draft import Take

Array = np.ndarray
Description = tuple[str, list[str], list[str], list[str]]
PERIODS_FITTED, PERIODS_PREDICTED = 3.0, 8.0


def describe(takes: Sequence[Take], density: float | None) -> Description | None:
    """A beam that is clamped at a group of markers and seen at its other end; None for other recordings."""
    s = takes[0].seen
    r = s.recording
    if len(takes) > 1 or len(s.bodies) != 1:
        return None
    tip = s.bodies[0]
    base = tuple(sorted({*s.still, *(k for k in s.loose if k in r.clamped)}))
    if len(base) < 2 or len(base) + len(tip) < len(r.markers):
        return None
    x = r.positions
    direction = dominant_direction(x[:, list(tip)])
    swing = along(x[:, list(tip)], direction)
    start = _turning(r.times, swing)
    free = r.times >= start  # before it the beam is held, and a step hides the frequency
    frequency = first_frequency(r.times[free], swing[free])
    if frequency is None:
        return None
    last = float(r.times[-1])
    if start + (PERIODS_FITTED + 1) / frequency > last:
        return None
    clamp = np.nanmean(mean_position(x)[list(base)], axis=0)
    rest = mean_position(x[r.times > last - max(2.0 / frequency, 0.2 * (last - start))])[list(tip)]
    end = rest.mean(axis=0)
    length = float(np.linalg.norm(end - clamp))
    way = (end - clamp) / length
    weight = density if density is not None else 1.0
    down = s.gravity / np.linalg.norm(s.gravity)
    normal = np.cross(way, direction.mean(axis=0))
    normal = normal if np.linalg.norm(normal) > 1e-9 else np.cross(way, down)
    normal /= np.linalg.norm(normal)
    EI = weight * (2 * np.pi * frequency) ** 2 * length**4 / 1.8751**4
    notes = [
        f"{joined(r.markers[k] for k in base)} stay in place, {joined(r.markers[k] for k in tip)} move as one body",
        f"they swing at {frequency:.4g} Hz, from a turning point at {start:.4g} s",
    ]
    unknown = [
        "where the clamp and the end of the beam are: the middles of the two groups of markers are taken. Measure them "
        "and correct start, direction, length and the markers' offsets: EI goes with the cube of the length",
        "what bent the beam before it was let go: a force at its end is fitted",
        "the density"
        + (": it is 1 kg/m here, and EI is EI/density" if density is None else " of what moves with the end"),
    ]
    lines = [] if r.gravity is not None else table("[scene]", {"gravity": s.gravity.tolist()})
    lines += table("[solver]", {"substeps": max(1, int(np.ceil(np.median(np.diff(r.times)) * 40 * frequency)))})
    rope: dict[str, Any] = {"name": "beam", "length": length, "segments": 10, "density": weight, "EI": EI}
    rope |= {"start": clamp.tolist(), "direction": way.tolist(), "clamp_start": way.tolist(), "clamp_angles": True}
    rope |= {"plane": normal.tolist(), "loss_factor": 0.1, "loss_frequency": frequency}
    lines += table("[[scene.rope]]", rope, {"EI": "of a uniform beam of this frequency"})
    load = np.nan_to_num(x[int(np.searchsorted(r.times, start)), list(tip)].mean(axis=0) - end)
    force = 3.0 * EI / length**3 * load
    axis = int(np.argmax(np.abs(force)))
    pull: dict[str, Any] = {
        "name": "pull",
        "particles": ["beam:end"],
        "force": np.where(np.eye(3)[axis] > 0, force, 0.0).tolist(),
    }
    lines += table("[[scene.force]]", pull | {"times": [0.0, 1e-6], "factors": [1.0, 0.0]})
    frame: Array = np.stack([way, normal, np.cross(way, normal)])
    places: list[dict[str, Any]] = [
        {
            "marker": r.markers[k],
            "arc_length": length,
            "offset": (frame @ (at - end)).tolist(),
            "normal": normal.tolist(),
        }
        for k, at in zip(tip, rest, strict=True)
    ]
    period = 1.0 / frequency
    stop = start + PERIODS_FITTED * period
    swings: dict[str, Any] = {
        "file": takes[0].file,
        "units": takes[0].units,
        "start": "equilibrium",
        "start_time": start,
    }
    swings |= {"fit": [start, stop], "held_out": [stop, min(stop + PERIODS_PREDICTED * period, last)]}
    lines += table("[[recording]]", swings | {"sigma": max(s.noise, 1e-3 * length), "marker": places})
    parameters: dict[str, dict[str, Any]] = {"beam_EI": {}, "beam_loss_factor": {}, f"pull_{'xyz'[axis]}": {}}
    parameters["beam_start_angle"] = {"prior": [0.0, 0.1]}
    for name, entries in parameters.items():
        lines += table(f"[parameters.{name}]", entries)
    return "a beam clamped at one end", notes, unknown, lines


def _turning(times: Array, swing: Array) -> float:
    """s, of the first turning point after the largest speed: there a motion starts from a shape at rest."""
    speed = np.gradient(swing, times)
    fastest = int(np.argmax(np.abs(speed)))
    after = np.flatnonzero(np.sign(speed[fastest:]) != np.sign(speed[fastest]))
    return float(times[fastest + (int(after[0]) if len(after) else 0)])
