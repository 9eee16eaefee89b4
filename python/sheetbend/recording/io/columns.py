"""Names of columns as people write them: the marker, the axis and the length unit in `tip_x`, `x1`, `M1 X [mm]`, and in
`distance [mm]`, the only column of a sensor that reads one coordinate."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

from ...files.units import METERS
from .cells import refuse

AXES = ("x", "y", "z")
FIX = "name the columns of each marker <marker>_x, <marker>_y, <marker>_z"
_LONGEST = 200  # characters of a name
_UNIT = re.compile(
    r"(.*[^\s\[(])[\s_]*[\[(]\s*(mm|cm|m|in|ft)\s*[\])]|(.*[_. ]?[xyz]\d*)(?:[_ ]| ?/ ?| in )(mm|cm|m)",
    re.IGNORECASE | re.DOTALL,
)
_WAYS = (
    re.compile(r"(?P<marker>.*)[_.: -](?P<axis>[xyz])", re.IGNORECASE | re.DOTALL),
    re.compile(r"(?P<axis>[xyz])[_.: -]?(?P<marker>.*)", re.IGNORECASE | re.DOTALL),
    re.compile(r"(?P<marker>.*\d)(?P<axis>[xyz])", re.IGNORECASE | re.DOTALL),
)
_OF_ROS = re.compile(r"(?:field\.)?(.+?)\.(?:pose\.)?(?:position|point|translation)\.[xyz]", re.DOTALL)
_BESIDE = re.compile(r"(?:.*\.)?(?:orientation|rotation)\.[xyzw]|(?:field\.)?header\..*", re.DOTALL)
_ALONE = re.compile(
    r"(.*?)(?:[\s_]*[\[(]\s*([^\s\[\]()]+)\s*[\])]|(?:_| ?/ ?| in )(?![xyz]$)([a-zµμ]{1,2}))?",
    re.IGNORECASE | re.DOTALL,
)
_LENGTHS = re.compile(
    r".*(?:distance|displacement|deflection|position|height|laser|abstand|auslenkung|weg)(?:[_. -]?\d+)?", re.IGNORECASE
)
_NAMED = re.compile(r"(?:marker|point|particle|node)?[_ ]?(?:id|name|label)|marker|point|particle|node", re.IGNORECASE)
_TURNS = {"qx", "qy", "qz", "qw"}


def beside(name: str) -> bool:
    """Whether a column holds what ROS writes beside places: a rotation, a header, a frame's name."""
    return len(name) <= _LONGEST and _BESIDE.fullmatch(name) is not None


def of_names(header: Sequence[str]) -> int | None:
    """The column with the name of a marker, in the header of a table with a row for each marker and frame."""
    found = [k for k, name in enumerate(header[1:], start=1) if _NAMED.fullmatch(name)]
    return found[0] if len(found) == 1 and len(header) == 2 + len(AXES) else None


def coordinates(header: Sequence[str], own: Sequence[int]) -> tuple[list[int], list[str]]:
    """Of columns, those that are x, y and z of markers, and the names of the others, such as the rotation of a tool or
    the error of a camera. All columns where those of coordinates do not make up whole markers."""
    places = [k for k in own if _is_coordinate(header[k])]
    names = [without_unit(header[k])[0] for k in places]
    whole = names and all(_marker_of(names[k : k + 3], 3) is not None for k in range(0, len(names), 3))
    if not whole or {header[k].lower() for k in own} >= _TURNS:
        return list(own), []
    return places, [header[k] for k in sorted({*own} - {*places})]


def _is_coordinate(name: str) -> bool:
    bare = without_unit(name)[0]
    return len(bare) <= _LONGEST and any(way.fullmatch(bare) for way in _WAYS)


def markers(path: Path, line: int, names: Sequence[str]) -> tuple[list[str], str | None]:
    """The markers whose x, y, z stand in columns of these names, or whose x, y as a camera sees them, and their length
    unit where the names tell it.

    Raises:
        RecordingError: three columns in a row are not x, y, z of one marker, or the units differ.
    """
    if {name.lower() for name in names} >= _TURNS:
        fix = "they go with a cloth: sheetbend new cloth.csv --poses, or `[[scene.tool]]`; see docs/recordings.md"
        refuse(path, line, "names the poses of a body, and no markers", list(names), fix)
    pairs = [without_unit(name) for name in names]
    told = {unit for _, unit in pairs}
    if len(told) > 1:
        got = sorted("none" if unit is None else unit for unit in told)
        refuse(path, line, "must name one length unit in all columns", got, "write it in every column, or in none")
    bare = [name for name, _ in pairs]
    unit = told.pop() if told else None
    if None not in (in_plane := [_marker_of(bare[k : k + 2], 2) for k in range(0, len(bare), 2)]):
        return [marker for marker in in_plane if marker is not None], unit
    found = []
    for k in range(0, len(bare), 3):
        three = bare[k : k + 3]
        marker = _marker_of(three, 3)
        if marker is None:
            _refuse_three(path, line, three)
        match = _OF_ROS.fullmatch(three[0]) if len(three[0]) <= _LONGEST else None
        found.append(match[1] if match else marker)
    return found, unit


def alone(path: Path, line: int, name: str) -> tuple[str, int, str | None]:
    """The marker, the axis and the length unit of the only column, what a laser or another sensor of one coordinate
    writes. Axis 2 where the name tells none.

    Raises:
        RecordingError: the name does not say that it is a length, or has a unit that is not known.
    """
    match = _ALONE.fullmatch(name) if len(name) <= _LONGEST else None
    bare, unit = (match[1].strip(), match[2] or match[3]) if match else (name, None)
    along = next((found for way in _WAYS if (found := way.fullmatch(bare))), None)
    is_length = along is not None or _LENGTHS.fullmatch(bare) is not None
    if match and match[3] and match[3].lower() == "in" and not is_length:  # as in voltage_in
        bare, unit = name, None
    if unit is None and not is_length:
        fix = f'if it is a length, write its unit: "{name} [mm]"; write an angle as a place at a known radius'
        refuse(path, line, "has one column beside the time, and its name does not say that it is a length", name, fix)
    if unit is not None and unit.lower() not in METERS:
        refuse(path, line, "must name a length unit", unit, f"write the column in one of {', '.join(METERS)}")
    axis = 2 if along is None else AXES.index(along["axis"].lower())
    return bare, axis, None if unit is None else unit.lower()


def without_unit(name: str) -> tuple[str, str | None]:
    """The name of a column and its length unit: `tip_x [mm]`, `tip_x_mm`, `tip_x / mm`, `tip_x in mm`."""
    match = _UNIT.fullmatch(name) if len(name) <= _LONGEST else None
    if match is None:
        return name, None
    unit = (match[2] or match[4]).lower()
    return (match[1] or match[3]).strip(), unit if unit in METERS else None


def _marker_of(names: Sequence[str], count: int) -> str | None:
    """The marker whose first coordinates, as many as `count`, these are; None where they are not."""
    return next((one for way in _WAYS if (one := _marker(way, names, count)) is not None), None)


def _marker(way: re.Pattern[str], names: Sequence[str], count: int) -> str | None:
    """The same in this way of writing."""
    matches = [way.fullmatch(name) for name in names]
    if len(names) < count or any(match is None for match in matches):
        return None
    axes = [match["axis"].lower() for match in matches if match]
    stems = {match["marker"] for match in matches if match}
    if axes != list(AXES[:count]) or len(stems) > 1:
        return None
    stem = stems.pop()
    return f"m{stem}" if way is not _WAYS[0] and (not stem or stem.isdigit()) else stem  # a number is no name


def _refuse_three(path: Path, line: int, names: Sequence[str]) -> NoReturn:
    axes = [name[-1:].lower() for name in names]
    if axes == ["x", "y", "x"] or (len(names) == 2 and axes == ["x", "y"]):
        fix = "write x, y and z of each marker, or x and y of all where one camera tracks them"
        refuse(path, line, "has only x and y of a marker", names[0], fix)
    first = _WAYS[0].fullmatch(names[0])
    marker = first["marker"] if first and first["axis"].lower() == "x" else names[0]
    wanted = [f"{marker}_{axis}" for axis in AXES]
    for name, want in zip(names, wanted, strict=False):
        if name != want:
            refuse(path, line, f"must have the column {want!r} there", name, FIX)
    refuse(path, line, "must have three columns x, y, z per marker", names[-1], FIX)
