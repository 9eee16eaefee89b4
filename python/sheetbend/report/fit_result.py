"""The result of a fit as users hold it: it saves, loads and reports what `FitData` holds."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..files.door import reading
from ..files.json_file import json_content
from ..files.typed import as_dataclass, listed, mapping
from ..files.whole import write_text
from ..result.estimate import Estimate, check_widths
from ..result.motions import RecordingFit
from ..result.result import FitData
from .report import plain

FORMAT = "sheetbend fit 1"


@dataclass(frozen=True, kw_only=True)
class FitResult(FitData):
    """The result of a fit, as plain data: `result["rope_EI"]` is an `Estimate` with value, interval and verdict.

    The attributes are those of `FitData`. `report` returns its text, `save` and `load` write and read JSON.
    """

    def to_dict(self) -> dict[str, Any]:
        """Strict JSON values: no NaN and no infinity, None in their place."""
        out = asdict(self)
        parameters, recordings = {}, {}
        for estimate in out.pop("estimates"):
            name, interval = estimate.pop("name"), [estimate.pop("lower"), estimate.pop("upper")]
            parameters[name] = {**estimate, "interval": interval}
        for recording in out.pop("recordings"):
            name = recording.pop("name")
            recordings[name] = recording
        strict: dict[str, Any] = _strict(
            {
                "format": FORMAT,
                "parameters": parameters,
                "held_out": {name: part["held_out"] for name, part in recordings.items()},
                "baseline": {name: part["baseline"] for name, part in recordings.items()},
                "seconds": out.pop("seconds"),
                "recordings": recordings,
                "baseline_is": out.pop("baseline"),
                **out,
            }
        )
        return strict

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> FitResult:
        """The inverse of `to_dict`.

        Raises:
            InputError: it is no fit, one of another format, or a field is missing, unknown or of another type; it names
                its path.
        """
        found = data.get("format") if isinstance(data, Mapping) else data
        if found != FORMAT:
            raise InputError("format", "is not the one that this version reads", found, f"use {FORMAT!r}")
        known = {one.name for one in fields(cls)}
        values = {name: value for name, value in data.items() if name in known}
        values["baseline"] = data.get("baseline_is", "")
        estimates = mapping(data.get("parameters"), "parameters")
        values["estimates"] = [_estimate(name, part) for name, part in estimates.items()]
        recordings = mapping(data.get("recordings"), "recordings")
        values["recordings"] = [_recording(name, part) for name, part in recordings.items()]
        return as_dataclass(cls, values, "")

    def save(self, path: str | Path) -> None:
        """Write `to_dict` as JSON, whole or not at all."""
        write_text(path, json.dumps(self.to_dict(), indent=2, allow_nan=False) + "\n")

    @classmethod
    def load(cls, path: str | Path) -> FitResult:
        """Read what `save` wrote.

        Raises:
            InputError: the file holds no fit.
        """
        path = Path(path)
        with reading(path, InputError):
            data = json_content(path, InputError, finite=True)
            try:
                return cls.from_dict(data)
            except InputError as error:
                raise InputError(f"{path}: {error.field}", error.problem, error.got, error.fix) from error

    def report(self) -> str:
        """The report as plain text, at most 100 columns wide."""
        return plain(self)


def _estimate(name: str, part: object) -> Estimate:
    where = f"parameters.{name}"
    told = mapping(part, where)
    ends = listed(told.get("interval"), f"{where}.interval")
    if len(ends) != 2:
        raise InputError(f"{where}.interval", "must be [lower, upper]", ends, "give both, null where open")
    rest = {key: value for key, value in told.items() if key != "interval"}
    return check_widths(
        as_dataclass(Estimate, {"name": name, "lower": ends[0], "upper": ends[1], **rest}, where), where
    )


def _recording(name: str, part: object) -> RecordingFit:
    where = f"recordings.{name}"
    return as_dataclass(RecordingFit, {"name": name, **mapping(part, where)}, where)


def _strict(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _strict(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [_strict(part) for part in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
