"""Recordings in the layout of the DEFORM rope data: a pickle per recording, positions alone.

    a list of frames, each an array (3, markers) or three lists of numbers; or one array (frames, 3, markers)

Markers are in order along the rope. NaN means not seen, and so does an empty entry. A marker that is never seen is
left out. The files say neither times nor which markers are driven: 100 frames per second and two markers
in each grip (0, 1, -2, -1) are assumed, as in that data; `rate` and `clamped` in the JSON beside the file replace them.
Lengths are in the unit of that JSON, meters without one; the axes are those of the source, so say `gravity` there when
z does not point up.

Another order of the axes (`axes`), and a dict that also holds times or a rate, are read if they are clear. The
recording's `mends` then report it.

Layout: Chen et al. 2024, Differentiable Discrete Elastic Rods for Real-Time Modeling of Deformable Linear Objects. The
pickles are read by `plain_pickle`, which runs nothing that they name.
"""

from __future__ import annotations

import pickle
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from ...arrays.types import Array
from ...errors import RecordingError
from ...files.door import check_room
from ...files.whole import written
from ..marker_data import MarkerData
from ..recording_checks import default_markers
from . import clock, plain_pickle, sidecar
from .axes import ordered

ASSUMED = ("times", "clamped")
"""What the files do not say; see `sheetbend.recording.io`."""
RATE = 100.0
"""Frames per second, Hz."""
MANY, MORE = 100, 5
"""Markers, and markers per frame, from which a file's axes must be in another order."""
GRIPPED = 2
"""Markers in each grip."""
USUAL = (0, 2, 1)
"""The axes of frames, markers and coordinates."""
POSITIONS = ("positions", "markers", "points", "trajectory", "data")
"""What the entry of a dict is called, where several might be the markers; the first that there is."""
RATES = ("rate", "fps", "hz", "frame_rate", "framerate", "frequency")


def read(path: Path) -> MarkerData:
    """Read a pickle.

    Raises:
        RecordingError: it is no pickle, is damaged, names anything but NumPy arrays, or the shape is another.
    """
    content, named = plain_pickle.arrays(path, needed=POSITIONS), {}
    if isinstance(content, dict):
        named = content
        content = _markers_of(path, named)
    if not isinstance(content, list) and content.ndim != 3:
        problem, shape = "must have the shape (frames, 3, markers)", content.shape
        raise RecordingError(str(path), problem, shape, _other_axes(shape))
    positions, times, words = _positions(path, list(content))
    if times is None:
        times = _times_of(path, named, len(positions))
    if times is None:
        times = np.arange(len(positions)) / RATE
        if "rate" not in sidecar.beside(path):
            words.append(f"no rate is told: {RATE:.4g} frames per second are assumed (`rate` in the JSON beside it)")
    count = positions.shape[1]
    names, clamped = default_markers(count), {i for i in range(count) if i < GRIPPED or i >= count - GRIPPED}
    seen = np.flatnonzero(np.isfinite(positions[:, :, 0]).any(axis=0))
    if 0 < len(seen) < count:
        unseen = ", ".join(name for i, name in enumerate(names) if i not in seen)
        words.append(f"{unseen} of {count} markers {'is' if len(seen) == count - 1 else 'are'} never seen: left out")
        positions, names = positions[:, seen], tuple(names[i] for i in seen)
        clamped = {new for new, old in enumerate(seen.tolist()) if old in clamped}
    metadata = {"mended": words} if words else {}
    return MarkerData(positions, times, names, tuple(sorted(clamped)), metadata=metadata)


def write(recording: MarkerData, path: Path) -> None:
    """Write a list of float64 arrays (3, markers), one per frame; markers not seen are NaN."""
    frames = [np.ascontiguousarray(frame.T) for frame in recording.positions]
    with written(path) as beside, beside.open("wb") as file:
        pickle.dump(frames, file, protocol=4)


def _markers_of(path: Path, named: Mapping[str, plain_pickle.Content]) -> plain_pickle.Content:
    """The entry of a dict that holds the markers."""
    possible = {name: entry for name, entry in named.items() if _axes(entry) == 3}
    usual = [name for name in possible if name.lower() in POSITIONS]
    chosen = min(usual, key=lambda name: POSITIONS.index(name.lower()), default=None)
    if chosen is None and len(possible) != 1:
        what = "several arrays that could be its markers" if possible else "no array of markers"
        fix = 'store the markers under "positions", an array (frames, 3, markers)'
        raise RecordingError(str(path), f"is a dict that holds {what}", sorted(possible or named), fix)
    return possible[chosen] if chosen is not None else next(iter(possible.values()))


def _axes(entry: plain_pickle.Content) -> int:
    if not isinstance(entry, list):
        return entry.ndim
    return 1 + max((frame.ndim for frame in entry), default=0)


def _times_of(path: Path, named: Mapping[str, plain_pickle.Content], frames: int) -> Array | None:
    """(frames,) s that stand beside the markers in a dict, or that its rate gives.

    Raises:
        RecordingError: times that are not one for each frame, or do not rise; a rate that is none.
    """
    for name, entry in named.items():
        unit = clock.unit(name)
        if unit is None or _axes(entry) != 1:
            continue
        stamps = np.asarray(entry, dtype=float)
        if stamps.shape != (frames,) or not (np.diff(stamps) > 0.0).all():
            fix = 'mend them, or store "rate", the frames per second, in their place'
            problem = f"must be {frames} rising times, one for each frame"
            raise RecordingError(f"{path}: {name}", problem, f"{stamps.size} times", fix)
        return (stamps - stamps[0]) / clock.PER_SECOND.get(unit, 1)
    for name, entry in named.items():
        if name.lower() in RATES and np.size(entry) == 1 and not np.isnan(np.asarray(entry, dtype=float)).any():
            return np.arange(frames) / sidecar.rate(float(np.asarray(entry).reshape(())))
    return None


def _positions(path: Path, frames: list[NDArray[Any]]) -> tuple[Array, Array | None, list[str]]:
    """(frames, markers, 3), the times where they stand there too, and what was done."""
    if not frames:
        raise RecordingError(str(path), "holds no frame", 0, "record at least one frame")
    held = [frame for frame in frames if frame.size]
    words = []
    if held and len(held) < len(frames):
        nothing = np.full(held[0].shape, np.nan)
        words.append(f"{len(frames) - len(held)} of {len(frames)} frames hold nothing: no marker is seen there")
        frames = [frame if frame.size else nothing for frame in frames]
    if frames[0].ndim == 2 and all(frame.shape == frames[0].shape for frame in frames):
        check_room(path, f"{len(frames)} times {frames[0].size} numbers", 8 * len(frames) * frames[0].size)
        found = ordered(np.stack(frames), USUAL)
        if found is not None and not _too_many(len(found.positions), found.positions.shape[1]):
            return found.positions, found.times, [*found.words, *words]
    _refuse(path, frames)


def _too_many(frames: int, markers: int) -> bool:
    return markers >= MANY and markers > MORE * frames


def _refuse(path: Path, frames: list[NDArray[Any]]) -> NoReturn:
    """Raise what is wrong with the shapes of frames."""
    for i, frame in enumerate(frames):
        if frame.ndim != 2 or frame.shape[0] != 3:
            problem, fix = "must have the shape (3, markers)", _fix(len(frames), frame.shape)
            raise RecordingError(f"{path}: frame {i}", problem, frame.shape, fix)
        if frame.shape != frames[0].shape:
            fix = f"give every frame the markers of the first, {frames[0].shape[1]}, with NaN where one was not seen"
            raise RecordingError(f"{path}: frame {i}", "has another number of markers", frame.shape[1], fix)
    found = (len(frames), *frames[0].shape)
    problem = "has the shape (frames, 3, markers) with far more markers than frames: the axes are in another order"
    fix = "if its axes are (markers, 3, frames), store `numpy.transpose(x, (2, 1, 0))`"
    raise RecordingError(str(path), problem, found, fix)


def _other_axes(shape: tuple[int, ...]) -> str:
    """What brings an array of two axes, or of four, into the order (frames, 3, markers)."""
    if len(shape) == 4:
        return f"it seems to hold {shape[0]} recordings: store each in a file of its own"
    if len(shape) == 2 and shape[1] % 3 == 0 and shape[1] > 3:
        return "if a row holds x, y, z of each marker in turn, store `x.reshape(len(x), -1, 3).transpose(0, 2, 1)`"
    return "store one array (frames, 3, markers), or a list of arrays (3, markers)"


def _fix(count: int, shape: tuple[int, ...]) -> str:
    """What brings `count` entries of such a shape into the order (frames, 3, markers)."""
    if len(shape) in (1, 3):
        return _other_axes((count, *shape))
    if len(shape) == 2 and shape[1] == 3:
        return "its axes are (frames, markers, 3): store `numpy.transpose(x, (0, 2, 1))`"
    if len(shape) == 2 and count == 3:
        order = (1, 0, 2) if shape[0] > shape[1] else (2, 0, 1)
        axes = "(3, frames, markers)" if shape[0] > shape[1] else "(3, markers, frames)"
        return f"its axes seem to be {axes}: store `numpy.transpose(x, {order})`"
    return "store each frame as an array (3, markers) with the rows x, y, z"
