"""What an experiment would tell before it is made: `identify` predicts intervals and verdicts from the scenes alone."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from ..files.whole import write_text
from ..quantities.wording import figures, short
from ..report.tables import Section, plain_section, wide
from ..result.estimate import Estimate, estimate_of

FORMAT = "sheetbend plan 1"


@dataclass(frozen=True)
class Variant:
    """What a change of the plan would give.

    Attributes:
        name: the change, in words.
        half_widths: by parameter, of the 95 % interval to expect, in its unit; None where it is open.
        verdicts: by parameter.
    """

    name: str
    half_widths: Mapping[str, float | None]
    verdicts: Mapping[str, str]


@dataclass(frozen=True)
class PlannedInput:
    """What is to be expected of an unknown force or wind over time.

    Attributes:
        name: of the input; with several recordings also that of its recording, in brackets.
        unit: of its values.
        half_width: 95 %, root mean square over the time and the axes; None where it is open.
        prior: the same of its prior.
        modes: names of its parameters.
    """

    name: str
    unit: str
    half_width: float | None
    prior: float
    modes: tuple[str, ...]


@dataclass(frozen=True)
class Plan:
    """What a fit to recordings of the planned experiments can be expected to print.

    Attributes:
        estimates: the parameters at the planned values, with the interval and the verdict to expect: of the data set
            with the median half-width. Time step and mesh are not counted.
        rank: directions in parameter space that the experiments determine, out of `len(estimates)`.
        gauges: combinations that stay free, in words.
        weakest: the combination that they determine least, in words; empty where all are known to 5 %.
        noise: what was assumed of it, in words.
        growth: of small displacements along each motion, in words.
        variants: what changes of the plan would give.
        inputs: of the unknown inputs over time, whose modes are estimates too.
    """

    estimates: tuple[Estimate, ...]
    rank: int
    gauges: tuple[str, ...]
    weakest: str
    noise: tuple[str, ...]
    growth: tuple[str, ...]
    variants: tuple[Variant, ...] = ()
    inputs: tuple[PlannedInput, ...] = ()

    def __getitem__(self, name: str) -> Estimate:
        """The estimate of that name; KeyError names the ones there are."""
        return estimate_of(self.estimates, name)

    def report(self) -> str:
        """The plan as plain text, at most 100 columns wide."""
        lines = [f"Plan: rank {self.rank} of {len(self.estimates)} parameters"]
        for section in self.sections():
            lines += ["", *plain_section(section)]
        return "\n".join(lines) + "\n"

    def sections(self) -> list[Section]:
        """The report as data, empty sections left out."""
        rows = [_row(e) for e in self.told]
        headers = ("parameter", "planned", "+/-", "95 % interval", "unit", "verdict to expect")
        notes = tuple((e.name, e.words) for e in self.told if e.verdict != "identified")
        parts = [
            Section("Intervals to expect", headers, tuple(rows), notes),
            self._over_time(),
            Section("What the plan cannot tell", notes=self._weak()),
            Section("What it assumes", notes=tuple(("", words) for words in (*self.noise, *self.growth))),
            self._compared(),
        ]
        return [part for part in parts if part.rows or part.notes]

    @property
    def told(self) -> list[Estimate]:
        """The estimates but for modes of inputs over time."""
        modes = {mode for one in self.inputs for mode in one.modes}
        return [e for e in self.estimates if e.name not in modes]

    def _over_time(self) -> Section:
        rows = tuple(
            (one.name, "" if one.half_width is None else short(one.half_width, 2), short(one.prior, 2), one.unit)
            for one in self.inputs
        )
        note = ("+/-", "95 %, root mean square over the time and the axes, with the recording and of the prior alone")
        headers = ("input", "+/-", "+/- of the prior", "unit")
        return Section("Unknown inputs over time", headers, rows, (note,) if rows else ())

    def _weak(self) -> tuple[tuple[str, str], ...]:
        gauges = tuple(("", gauge) for gauge in self.gauges)
        return (*gauges, ("known least", self.weakest)) if self.weakest else gauges

    def _compared(self) -> Section:
        """Half-widths of each variant over those of the plan, of many parameters one below the other."""
        names = [e.name for e in self.told]
        rows = []
        for variant in self.variants:
            cells = [_gain(self[name], variant.half_widths[name], variant.verdicts[name]) for name in names]
            rows.append((variant.name, *cells))
        title, headers = "What changes of the plan would give", ("change", *names)
        notes = [("+/-", "half-width over that of the plan; a verdict in its place where that changes")] if rows else []
        if rows and wide([headers, *rows]):
            notes += [(str(k), variant.name) for k, variant in enumerate(self.variants, 1)]
            numbered = [(str(k), *row[1:]) for k, row in enumerate(rows, 1)]
            (_, *columns), *turned = zip(headers, *numbered, strict=True)
            return Section(title, ("parameter", *columns), tuple(turned), tuple(notes))
        return Section(title, headers, tuple(rows), tuple(notes))

    def to_dict(self) -> dict[str, Any]:
        """Strict JSON values."""
        return {
            "format": FORMAT,
            "parameters": {e.name: asdict(e) for e in self.estimates},
            "rank": self.rank,
            "gauges": list(self.gauges),
            "weakest": self.weakest,
            "noise": list(self.noise),
            "growth": list(self.growth),
            "variants": [asdict(variant) for variant in self.variants],
            "inputs": [asdict(one) for one in self.inputs],
        }

    def save(self, path: str | Path) -> None:
        """Write `to_dict` as JSON, whole or not at all."""
        write_text(path, json.dumps(self.to_dict(), indent=2, allow_nan=False) + "\n")


def _row(e: Estimate) -> tuple[str, ...]:
    if e.half_width is None or e.lower is None or e.upper is None:
        return (e.name, short(e.value), "", "", e.unit, e.verdict)
    numbers: Sequence[float | None] = (e.value, e.half_width, e.lower, e.upper)
    value, half, lower, upper = figures(numbers, e.half_width)
    return (e.name, value, half, f"[{lower}, {upper}]", e.unit, e.verdict)


def _gain(planned: Estimate, half_width: float | None, verdict: str) -> str:
    if verdict != planned.verdict or half_width is None or not planned.half_width:
        return verdict if half_width is None or not planned.value else _share(verdict, half_width, planned.value)
    return f"{short(half_width / planned.half_width, 2)} x"


def _share(verdict: str, half_width: float, value: float) -> str:
    share = 100.0 * half_width / abs(value)
    return f"{verdict}, {short(share, 2)} %" if math.isfinite(share) else verdict
