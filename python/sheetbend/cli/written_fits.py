"""Fits that `sheetbend fit` wrote, read from their folders so that they can be compared."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..config import build, parse
from ..errors import ConfigError
from ..files.door import reading
from ..recording.recording import Recording
from ..report.fit_result import FitResult
from .predicted import PREDICTED

_OURS = ("experiment", "output")  # tables that are no part of the model
_TIME = 1e-6  # s within which frames are the same


@dataclass(frozen=True)
class HeldOut:
    """Held-out frames of one recording as one fit predicts them: times (frames,) s, names of the markers, measured and
    predicted (frames, markers, 3) m along the axes that count."""

    times: np.ndarray
    markers: tuple[str, ...]
    measured: np.ndarray
    predicted: np.ndarray


@dataclass(frozen=True)
class Written:
    """A fit in its folder: its name there, result, settings by dotted key, and held-out motions by recording."""

    name: str
    result: FitResult
    settings: Mapping[str, Any]
    held_out: Mapping[str, HeldOut]


def read_written(path: Path, name: str) -> Written:
    """Read the folder that `sheetbend fit` has written.

    Args:
        path: the folder, or the fit.json in it.
        name: for reports.

    Raises:
        ConfigError: the folder lacks fit.json, fitted.toml or predicted markers.
    """
    folder = path.parent if path.is_file() else path
    for needed in ("fit.json", "fitted.toml"):
        if not (folder / needed).is_file():
            fix = "give the folder of `sheetbend fit` (of a configuration with a scene), with all that it wrote"
            raise ConfigError(str(path), f"has no {needed}", str(folder), fix)
    result, config = FitResult.load(folder / "fit.json"), parse(folder / "fitted.toml")
    with reading(folder / "fitted.toml", ConfigError):
        study = build(config, folder)
    held = {}
    for e in study.experiments:
        whole = e.fitted() if e.predict == "mean" else e.held()
        file = folder / f"{PREDICTED}{e.name}.npz"
        if whole is None or not file.is_file():
            continue
        predicted = Recording.load(file)
        axes = ["xyz".index(a) for a in e.axes]
        which = [_nearest(predicted.times, t) for t in whole.times]
        rows = [k for k in which if k is not None]
        seen = [k is not None for k in which]
        held[e.name] = HeldOut(
            whole.times[seen],
            tuple(whole.markers),
            whole.positions[seen][:, :, axes],
            predicted.positions[rows][:, :, axes],
        )
    data = config.model_dump(mode="json", exclude_unset=True, exclude_none=True)
    settings = {k: v for table, part in data.items() if table not in _OURS for k, v in _flat(table, part).items()}
    return Written(name, result, settings, held)


def in_common(first: HeldOut, second: HeldOut) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
    """Times that both hold out, and the mean squared errors (frames,) m^2 of both there, over the markers that both
    compare and that were seen; None where there are none."""
    names = [n for n in first.markers if n in second.markers]
    rows = [(k, j) for k, t in enumerate(first.times) if (j := _nearest(second.times, t)) is not None]
    if not names or not rows or first.measured.shape[2] != second.measured.shape[2]:
        return None
    frames = np.array(rows).T
    errors = []
    for held, at in zip((first, second), frames, strict=True):
        own = [held.markers.index(n) for n in names]
        errors.append(((held.predicted - held.measured)[at][:, own] ** 2).sum(axis=2))
    seen = np.isfinite(errors[0]) & np.isfinite(errors[1])
    kept = seen.any(axis=1)
    if not kept.any():
        return None
    means = [np.where(seen, e, 0.0).sum(axis=1)[kept] / seen.sum(axis=1)[kept] for e in errors]
    return first.times[frames[0]][kept], means[0], means[1]


def _nearest(times: np.ndarray, t: float) -> int | None:
    k = int(np.abs(times - t).argmin())
    return k if abs(times[k] - t) <= _TIME else None


def _flat(key: str, value: Any) -> dict[str, Any]:
    """Settings by dotted keys; lists of tables by their numbers."""
    if isinstance(value, dict):
        return {k: v for name, part in value.items() for k, v in _flat(f"{key}.{name}", part).items()}
    if isinstance(value, list) and value and all(isinstance(part, dict) for part in value):
        return {k: v for i, part in enumerate(value) for k, v in _flat(f"{key}[{i}]", part).items()}
    return {key: value}
