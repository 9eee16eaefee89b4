"""What each field of a recording must be; the first one that is wrong is named, with its fix."""

from __future__ import annotations

import copy
import operator
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import is_several
from ..arrays.types import Array
from ..errors import RecordingError


def marker_indices(what: str, chosen: Iterable[str | int], markers: tuple[str, ...]) -> tuple[int, ...]:
    """Indices of markers given by name or index, in the given order; `what` names the field in errors.

    Raises:
        RecordingError: a name is unknown, an index is no integer or out of range, or a marker comes twice.
    """
    if not is_several(chosen):
        raise RecordingError(what, "must be a list of markers", chosen, f"write [{chosen!r}]")
    number = {name: i for i, name in enumerate(markers)}
    indices: dict[int, None] = {}
    for item in chosen:
        if isinstance(item, str):
            if item not in number:
                raise RecordingError(what, "names an unknown marker", item, choose_from(markers))
            index = number[item]
        else:
            index = _integer(what, item)
            if not 0 <= index < len(markers):
                fix = f"use 0 to {len(markers) - 1}"
                raise RecordingError(what, f"is out of range for {len(markers)} markers", index, fix)
        if index in indices:
            raise RecordingError(what, "names a marker twice", item, "name each marker once")
        indices[index] = None
    return tuple(indices)


def default_markers(count: int, letter: str = "m") -> tuple[str, ...]:
    """The names of markers that the source does not name: m0, m1, ..."""
    return tuple(f"{letter}{i}" for i in range(count))


def _integer(what: str, item: Any) -> int:
    try:
        if isinstance(item, bool | np.bool_):
            raise TypeError
        return operator.index(item)
    except TypeError:
        fix = "use integers or names"
        raise RecordingError(what, "must hold marker names or indices", item, fix) from None


def choose_from(markers: tuple[str, ...]) -> str:
    shown = ", ".join(markers[:12]) + (", ..." if len(markers) > 12 else "")
    return f"choose from {shown}"


def _numbers(what: str, values: ArrayLike, shape: str) -> Array:
    """Values as float64; `shape` says in errors what is wanted."""
    fix = f"give real numbers as an array of shape {shape}"
    try:
        array = np.asarray(values)
    except (TypeError, ValueError, RuntimeError):
        got = type(values).__name__
        raise RecordingError(what, "is ragged: its rows differ in length", got, fix) from None
    if array.dtype.kind not in "iuf":
        raise RecordingError(what, "must be real numbers", str(array.dtype), fix)
    return array.astype(np.float64)


def checked_positions(values: ArrayLike) -> Array:
    x = _numbers("positions", values, "(frames, markers, 3)")
    if x.ndim != 3 or x.shape[2] != 3:
        fix = "reshape to one row x, y, z per marker and frame; planar motion takes a constant coordinate"
        raise RecordingError("positions", "must have the shape (frames, markers, 3)", x.shape, fix)
    if x.shape[0] == 0 or x.shape[1] == 0:
        fix = "record at least one frame of one marker"
        raise RecordingError("positions", "must hold at least one frame and one marker", x.shape, fix)
    if np.isinf(x).any():
        frame, marker, _ = np.argwhere(np.isinf(x))[0]
        problem = f"is infinite in frame {frame}, marker {marker}"
        raise RecordingError("positions", problem, x[frame, marker].tolist(), "use NaN for a marker not seen")
    unseen = np.isnan(x)
    partly = unseen.any(axis=2) & ~unseen.all(axis=2)
    if partly.any():
        frame, marker = np.argwhere(partly)[0]
        raise RecordingError(
            "positions",
            f"has NaN in some coordinates only, in frame {frame}, marker {marker}",
            x[frame, marker].tolist(),
            "make all three NaN when it was not seen; planar motion takes a constant third coordinate",
        )
    return x


def padded(frames: Sequence[Array]) -> Array:
    """(frames, most, 3), points (n, 3) of each frame and behind them NaN.

    Raises:
        RecordingError: there is no point at all.
    """
    most = max((len(x) for x in frames), default=0)
    if most == 0:
        raise RecordingError("points", "hold no point", len(frames), "give at least one frame with points")
    x = np.full((len(frames), most, 3), np.nan)
    for own, points in zip(x, frames, strict=True):
        own[: len(points)] = points
    return x


def check_points(where: str, points: Array) -> None:
    """Check that the points (n, 3) of a cloud are numbers; errors name `where` they are."""
    bad = np.flatnonzero(~np.isfinite(points).all(axis=1))
    if bad.size:
        fix = "leave out points that the camera did not see"
        raise RecordingError(where, f"is not finite at point {bad[0]}", points[bad[0]].tolist(), fix)


def check_seen(positions: Array, markers: tuple[str, ...]) -> None:
    never = np.isnan(positions[:, :, 0]).all(axis=0)
    if never.any():
        names = [markers[i] for i in np.flatnonzero(never)]
        fix = "remove them, and give the others their places if nothing else does"
        raise RecordingError("positions", "hold markers that are never seen (all NaN)", names, fix)


def checked_times(values: ArrayLike, frames: int | None) -> Array:
    """Times in s, strictly increasing; as many as frames when that is given."""
    t = _numbers("times", values, "(frames,)")
    if t.ndim != 1 or len(t) == 0:
        fix = "give one time in s per frame"
        raise RecordingError("times", "must have the shape (frames,)", t.shape, fix)
    if frames is not None and len(t) != frames:
        fix = "give one time per frame of positions"
        raise RecordingError("times", f"must have one entry per frame, {frames}", len(t), fix)
    if not np.isfinite(t).all():
        frame = int(np.flatnonzero(~np.isfinite(t))[0])
        fix = "give every frame a time"
        raise RecordingError("times", f"is not finite in frame {frame}", float(t[frame]), fix)
    backwards = np.flatnonzero(np.diff(t) <= 0)
    if len(backwards):
        frame = int(backwards[0]) + 1
        problem = "repeats" if t[frame] == t[frame - 1] else "runs backwards"
        pair = (float(t[frame - 1]), float(t[frame]))
        fix = "sort the frames by time and keep one frame per time"
        raise RecordingError("times", f"{problem} at frame {frame}", pair, fix)
    return t


def checked_markers(names: Iterable[str], count: int, letter: str = "m") -> tuple[str, ...]:
    if not is_several(names):
        raise RecordingError("markers", "must be a list of names", names, f"give {count} names")
    names = tuple(names) or default_markers(count, letter)
    if len(names) != count:
        fix = f"give {count} names, one per marker of positions"
        raise RecordingError("markers", "must be one name per marker", len(names), fix)
    earlier: set[str] = set()
    for i, name in enumerate(names):
        if not isinstance(name, str) or not name.isprintable() or not name or name != name.strip():
            fix = "use text without line breaks or spaces at its ends"
            raise RecordingError("markers", f"holds no name at {i}", name, fix)
        if name in earlier:
            raise RecordingError("markers", "holds a name twice", name, "give every marker a name of its own")
        earlier.add(name)
    return names


def checked_gravity(values: ArrayLike) -> Array:
    g = _numbers("gravity", values, "(3,)")
    if g.shape != (3,) or not np.isfinite(g).all():
        fix = "give x, y, z in m/s^2, for example [0, 0, -9.81]"
        raise RecordingError("gravity", "must be three finite numbers", g.tolist(), fix)
    return g


def checked_metadata(metadata: Any) -> dict[str, Any]:
    if not isinstance(metadata, Mapping) or not all(isinstance(key, str) for key in metadata):
        raise RecordingError("metadata", "must be a dict with text keys", metadata, "use names as keys")
    return copy.deepcopy(dict(metadata))
