"""Tosses of a folder, as its source has them: what can be read, and why the rest is left out.

A file holds arrays over all frames, `starts` (the first frame of each toss, and the end) and `toss` (its number).
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np

Arrays = dict[str, np.ndarray]
RATE_KEYS = ("rate_hz", "rate", "fps")
UNIT = 1e-3  # by which a quaternion that is written as a unit quaternion may be off
FALL = (8.6, 10.6)  # m/s^2, in which gravity is in lengths of these recordings, which are about 2 % short


def read(path: Path, columns: Mapping[str, tuple[int, ...]], rate: float) -> tuple[Arrays, list[str]]:
    """The tosses of a file whose frames are numbers, with their columns, and one sentence on each of the others.

    Args:
        path: of an .npz, beside which a .json of the same name may state `rate_hz`.
        columns: the shape of one frame of each array.
        rate: Hz, that of the experiment.

    Raises:
        SystemExit: the file has no such tosses, or states another rate.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            data = {key: file[key] for key in file.files}
    except (OSError, ValueError) as error:
        raise SystemExit(f"{path} cannot be read: {error}") from error
    missing = [key for key in ("starts", *columns) if key not in data]
    if missing:
        raise SystemExit(f"{path} has no {' and no '.join(missing)}; it has {', '.join(data)}")
    told = _told_rate(path, data)
    if told is not None and abs(told / rate - 1.0) > 0.01:
        raise SystemExit(f"{path} states {told:g} Hz, and the cuts of this experiment are for {rate:g} Hz")
    frames = len(data["position"])
    for key, shape in columns.items():
        if data[key].shape != (frames, *shape):
            raise SystemExit(f"{path}: {key} has the shape {data[key].shape}, not {(frames, *shape)}")
    data["quaternion"], words = _units(data["quaternion"].astype(float))
    starts = np.asarray(data["starts"]).ravel().astype(int)
    numbers = np.asarray(data.get("toss", np.arange(len(starts) - 1))).ravel()
    if len(numbers) != len(starts) - 1:
        raise SystemExit(
            f"{path}: {len(starts)} starts are of {len(starts) - 1} tosses, and {len(numbers)} have numbers"
        )
    kept: list[tuple[int, np.ndarray]] = []
    seen: dict[bytes, int] = {}
    for number, (first, last) in zip(numbers.tolist(), pairwise(starts.tolist()), strict=True):
        own = np.arange(max(first, 0), min(last, frames))
        here = [np.ascontiguousarray(data[key][own], dtype=float) for key in columns]
        if first < 0 or last > frames or len(own) < 2:
            words.append(f"toss {number}: {len(own)} frames")
        elif not all(np.isfinite(part).all() for part in here):
            words.append(f"toss {number}: frames that are no numbers")
        elif (same := seen.setdefault(here[0].tobytes(), number)) != number or any(n == number for n, _ in kept):
            words.append(f"toss {number}: " + ("its number is taken" if same == number else f"is toss {same} again"))
        else:
            kept.append((number, own))
    if not kept:
        raise SystemExit("\n".join([f"{path} has no toss that can be read", *words]))
    which = np.concatenate([own for _, own in kept])
    out = {key: data[key][which].astype(float) for key in columns}
    out["starts"] = np.cumsum([0, *(len(own) for _, own in kept)])
    out["toss"] = np.array([number for number, _ in kept])
    return out, words


def told_fall(heights: Sequence[np.ndarray], rate: float) -> list[str]:
    """A sentence if free flights, of heights (frames,), fall otherwise than in m and at this rate."""
    down = [-2.0 * rate**2 * np.polyfit(np.arange(len(z)), z, 2)[0] for z in heights if len(z) > 2]
    fall = float(np.median(down)) if down else np.mean(FALL)
    if FALL[0] < fall < FALL[1]:
        return []
    fix = f"the rate is {rate * np.sqrt(np.mean(FALL) / fall):.0f} Hz, or " if fall > 0 else ""
    return [f"flights fall with {fall:.3g} m/s^2: {fix}lengths are not in m, or z is not up"]


def again(x: np.ndarray, known: list[np.ndarray], frames: int = 8) -> bool:
    """Whether a toss (frames, 3) ends as one of others does, to a micrometer, in place."""
    return any(
        np.abs(x[-n:] - other[-n:]).max() < 1e-6 for other in known if (n := min(frames, len(x), len(other))) > 0
    )


def _told_rate(path: Path, data: Mapping[str, np.ndarray]) -> float | None:
    told = {key: float(data[key]) for key in RATE_KEYS if key in data and data[key].size == 1}
    if "dt" in data and data["dt"].size == 1:
        told["dt"] = 1.0 / float(data["dt"])
    beside = path.with_suffix(".json")
    if not told and beside.is_file():
        about = json.loads(beside.read_text())
        told = {key: float(about[key]) for key in RATE_KEYS if key in about}
    return next(iter(told.values()), None)


def _units(q: np.ndarray) -> tuple[np.ndarray, list[str]]:
    """Quaternions of length one; those without length are no numbers."""
    size = np.linalg.norm(q, axis=1)
    off = np.abs(size - 1.0) > 1e-6
    q = q.copy()
    with np.errstate(divide="ignore", invalid="ignore"):
        q[off] /= size[off, None]
    far = int((np.abs(size - 1.0) > UNIT).sum())
    return q, [f"{far} quaternions were not of length one and have been scaled"] if far else []
