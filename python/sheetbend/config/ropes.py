"""Ropes and rods of a scene, built from their description: shape at the start, and what holds their ends."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..arrays.types import Array
from ..errors import ConfigError
from ..objects.chain import straight_way
from ..objects.grip import Grip
from ..objects.rod import add_rod
from ..objects.rod_shape import initial_shape
from ..objects.rope import Rope, add_rope
from ..objects.tool import Tool
from ..scene.body import BodyPoint
from ..scene.scene import Scene
from . import rope_schema as schema
from .errors import located
from .grips import Led, end_on_body, held_end, hold_led, place_of
from .moment import Moment
from .rope_points import Seats, curve, through_markers

_ELSEWHERE = {
    *("name", "pinned", "points", "segments", "velocity", "smoothing", "markers", "grip"),
}
"""Keys of a rope or rod that are not arguments of `add_rope`, or not as they stand."""
_OF_ROPES = {"start", "direction", "clamp_start", "clamp_end"}
"""Keys of a rod that are not arguments of `add_rod`."""


def build_rope(
    scene: Scene,
    path: str,
    section: schema.Rope | schema.Rod,
    moment: Moment | None,
    seats: Seats,
    finer: int,
    tools: Mapping[str, Tool],
) -> Rope:
    """Add a rope or rod with what moves its ends to a scene.

    Args:
        seats: the markers on it, in order along it.
        finer: multiplies its segments.
        tools: of the scene, by name.

    Raises:
        ConfigError: anything inconsistent, with the path of the key.
    """
    section = section.model_copy(update={"segments": finer * section.segments})
    points, speeds, ends = _start(scene, path, section, moment, seats, tools)
    fields: dict[str, Any] = section.model_dump(exclude=_ELSEWHERE, exclude_none=True)
    grips = {end: held for end, held in ends.items() if not isinstance(held, Led)}
    # one marker with a direction is a clamp that the marker moves
    clamps = {f"clamp_{g.at}": g.direction for g in section.grip if g.at not in grips and g.direction is not None}
    fields |= clamps | {"points": points, "velocity": speeds, "segments": section.segments}
    with located(path, section.name):
        if isinstance(section, schema.Rod):
            built: Rope = _add_rod(scene, section, fields, grips)
        else:
            own: dict[str, Any] = {f"grip_{end}": grip for end, grip in grips.items()}
            own |= {f"{grip.at}_lead": grip.lead for grip in section.grip}
            built = add_rope(scene, section.name, **fields, **own)
        hold_led(scene, built, ends)
    return built


def _start(
    scene: Scene,
    path: str,
    section: schema.Rope | schema.Rod,
    moment: Moment | None,
    seats: Seats,
    tools: Mapping[str, Tool],
) -> tuple[Array | None, Array | None, dict[str, Grip | Led | BodyPoint]]:
    """Initial points and velocities, and what moves the ends."""
    measured = section.points == "recording"
    points = None if measured or section.points is None else np.array(section.points)
    speeds = None
    exact = measured and (section.markers is not None or bool(section.grip) or section.velocity is not None)
    if measured and not exact:
        points = through_markers(f"{path}.points", moment, seats, section.length)
    length = section.length if section.length is not None or not exact else _length(path, moment, seats)
    if exact:
        assert length is not None
        points, _ = curve(f"{path}.points", section, moment, seats, length, {})
    line = _straight(section) if points is None else points
    ends: dict[str, Grip | Led | BodyPoint] = {}
    for i, grip in enumerate(section.grip):
        here = None if points is None and grip.at == "end" else line[0 if grip.at == "start" else -1]
        if grip.body is not None:
            ends[grip.at] = end_on_body(f"{path}.grip[{i}]", grip, scene, here)
            continue
        way = np.diff(line[:2] if grip.at == "start" else line[-2:], axis=0)[0]
        ends[grip.at] = held_end(f"{path}.grip[{i}]", grip, moment, tools, here, way)
    places = {end: place_of(held) for end, held in ends.items()}
    if exact:
        assert length is not None
        points, speeds = curve(f"{path}.points", section, moment, seats, length, places)
    elif points is None and len(places) == 1:
        ((end, place),) = places.items()
        line = _straight(section, _way(ends[end]))
        points = line + (place - line[0 if end == "start" else -1])
    elif points is None and places:
        points = np.stack([places["start"], places["end"]])
    if ends:
        assert points is not None
        fitted = length if length is not None else float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
        held = [_pose(ends.get(end), places.get(end), points, k) for end, k in (("start", 0), ("end", -1))]
        with located(path):
            stretches = section.EA is not None
            points, speeds = initial_shape(section.name, fitted, section.segments, points, speeds, held, stretches)
    return points, speeds, ends


def _pose(
    held: Grip | Led | BodyPoint | None, place: Array | None, points: Array, k: int
) -> tuple[Array, Array] | None:
    if held is None or place is None:
        return None
    own = _way(held)
    if own is not None:
        return place, own
    way = np.diff(points[:2] if k == 0 else points[-2:], axis=0)[0]
    return place, way / max(float(np.linalg.norm(way)), 1e-12)


def _way(held: Grip | Led | BodyPoint) -> Array | None:
    """(3,) the direction in which a rope passes what holds its end at the start; None where that is free."""
    if isinstance(held, BodyPoint):
        return None if held.along is None else held.body.turned(held.along)
    return held.direction[0] if isinstance(held, Grip) else None


def _straight(section: schema.Rope | schema.Rod, held: Array | None = None) -> Array:
    """Both ends of a straight rope, in the direction that is given, or else in that of what holds it."""
    given = section.direction, section.clamp_start, section.clamp_end
    along = held if held is not None and given == (None, None, None) else np.array(straight_way(*given)[1])
    size = float(np.linalg.norm(along)) or 1.0
    return np.array(section.start) + np.outer([0.0, 1.0], along) * ((section.length or 1.0) / size)


def _length(path: str, moment: Moment | None, seats: Seats) -> float:
    """Of a rope that does not give it: the arc length of its last marker."""
    last = seats[-1][0] if seats else None
    if last is not None and last > 0:
        return last
    return float(np.linalg.norm(np.diff(through_markers(f"{path}.points", moment, seats, None), axis=0), axis=1).sum())


def _add_rod(scene: Scene, section: schema.Rod, fields: dict[str, Any], grips: Mapping[str, Grip | BodyPoint]) -> Rope:
    """A rod takes clamps as grips that stay."""
    given = {key: value for key, value in fields.items() if key not in _OF_ROPES}
    points = _straight(section) if fields["points"] is None else fields["points"]
    held: dict[str, Any] = dict(grips)
    for end, k in (("start", 0), ("end", -1)):
        clamp = fields.get(f"clamp_{end}")
        if clamp is not None:
            held[end] = Grip.fixed(points[k], clamp, section.director if end == "start" else None)
    if "start" in held:
        given.pop("director", None)
    return add_rod(scene, section.name, **{**given, "points": points}, **held)


def check_markers(path: str, section: schema.Rope | schema.Rod, names: tuple[str, ...]) -> None:
    """Raises ConfigError where a rope's `markers` name none of a recording."""
    for marker in section.markers or {}:
        if marker not in names:
            fix = f"name some of: {', '.join(names)}"
            raise ConfigError(f"{path}.markers.{marker}", "is not a marker of the recording", marker, fix)
