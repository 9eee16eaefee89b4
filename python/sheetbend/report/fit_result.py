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
from ..result.result import (
    Estimate,
    FitData,
    RecordingFit,
)
from .report import plain

FORMAT = "sheetbend fit 1"


@dataclass(frozen=True, kw_only=True)
class FitResult(FitData):
    """A finished (or interrupted) fit.

    Attributes:
        estimates: one per free parameter, in the order of the parameters.
        given: the parameters that were not fitted.
        correlations: of every pair of determined estimates.
        gauges: combinations of parameters that the data leave free, in words.
        recordings: errors per recording.
        baseline: what the no-physics baseline predicts, in words.
        held_out_is: what was held out, in words, where it is not a part of each recording.
        cost: half the sum of squared residuals, priors included.
        first_cost: that of the best start's first point; None where the motion diverges there.
        jacobian_seconds: what one Jacobian took at the end; None where none was made from Python.
        rows: number of data residuals.
        autocorrelation_time: frames of residual that count as one, 1 when they are independent.
        starts: the ends of all starts, best first.
        refits: on finer discretizations, of which `Estimate.discretization` is made.
        not_counted: what of the discretization the intervals leave out, such as "mesh not counted", and why.
        misfit: residuals against the sigma that was told; None in files of earlier versions.
        optimizer, iterations, seconds, converged, interrupted, message: how it went.
        growth: of every fitted motion.
        windows: s, the lengths that were fitted first, as given or chosen.
        evaluations, jacobians: how often all experiments were simulated, and how often of these with a Jacobian, over
            all starts and windows, up to the minimum.
        judging: how often all experiments, or some of them, were simulated besides, and how often of these with a
            Jacobian: for beginnings, limits, refits, profiles and doubts.
        forces: errors per force sensor.
        premises: numbers that the fit took as given, and what an error in each moves.
        warnings: what a reader must know before using the numbers.
        assumed: how the ends of ropes are held and what that assumes, in words, where a configuration says it.
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
    found = as_dataclass(Estimate, {"name": name, "lower": ends[0], "upper": ends[1], **rest}, where)
    for part_of in ("half_width", "statistical", "discretization", "systematic"):
        width = getattr(found, part_of)
        if width is not None and width < 0:
            raise InputError(f"{where}.{part_of}", "must not be negative", width, "give a half-width")
    return found


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
