"""Many fits of one kind in one table, and the population that their specimens are of."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from ..errors import InputError
from ..quantities.wording import short
from ..result.estimate import Estimate
from ..result.result import FitData
from ..statistics.intervals import NORMAL
from ..statistics.population import Population, population
from .report_recordings import SELDOM
from .tables import Section, plain_section

COUNTED = ("identified", "weak")  # verdicts of estimates that a population is made from
FEWEST = 3


@dataclass(frozen=True)
class Trait:
    """One parameter over all specimens.

    Attributes:
        name, unit: of the parameter.
        log: whether mean and spread are those of the logarithm: where all counted values and lower ends are positive.
        found: by random effects, in logarithms where `log`; None for fewer than `FEWEST` counted estimates.
        left_out: specimens that are not counted, and their verdicts.
    """

    name: str
    unit: str
    log: bool
    found: Population | None
    left_out: Mapping[str, str]

    @property
    def shows_spread(self) -> bool:
        """Whether any spread explains how much the specimens differ; none does where they differ by less than their
        intervals alone would make them."""
        return self.found is None or self.found.spread_interval[1] > 0.0

    def told(self) -> tuple[str, ...]:
        """A row: parameter, specimens, mean, interval, unit, spread, interval."""
        p = self.found
        if p is None:
            return (self.name, "0", "", "", self.unit, "", "")
        inverse = math.exp if self.log else float
        mean = [short(inverse(x), 4) for x in (p.mean, *p.mean_interval)]
        factor, unit = (100.0, " %") if self.log else (1.0, "")
        spread = [short(factor * x, 3) for x in (p.spread, *p.spread_interval)]
        ends = f"[{spread[1]}, {spread[2]}]" if self.shows_spread else "not told"
        return (self.name, str(p.count), mean[0], f"[{mean[1]}, {mean[2]}]", self.unit, spread[0] + unit, ends)


@dataclass(frozen=True)
class Collected:
    """Fits by specimen, and what their parameters are over all of them."""

    fits: Mapping[str, FitData]
    traits: tuple[Trait, ...]

    @staticmethod
    def of(fits: Mapping[str, FitData]) -> Collected:
        """Collect the fits of specimens by name. Private parameters, which each recording has for itself, are in the
        table alone.

        Raises:
            InputError: there are none.
            MissingExtraError: SciPy is not installed.
        """
        if not fits:
            raise InputError("fits", "are missing", 0, "give folders with a fit.json each")
        names = dict.fromkeys(e.name for fit in fits.values() for e in fit.estimates if "[" not in e.name)
        return Collected(dict(fits), tuple(_trait(name, fits) for name in names))

    @property
    def markers(self) -> dict[str, str]:
        """By specimen, which markers it lacks or seldom shows though most specimens show them, in words."""
        best = {name: seen for name, fit in self.fits.items() if (seen := _seen_best(fit))}
        every = dict.fromkeys(marker for seen in best.values() for marker in seen)
        shown = {m: sum(seen.get(m, 0.0) >= SELDOM for seen in best.values()) for m in every}
        common = [m for m in every if shown[m] > len(best) / 2]
        words = {}
        for name, seen in best.items():
            lacks = [m for m in common if m not in seen]
            few = [f"{m} is seen in {100 * seen[m]:.2g} % of the frames" for m in common if seen.get(m, 1.0) < SELDOM]
            if lacks or few:
                words[name] = "; ".join([f"lacks {', '.join(lacks)}"] * bool(lacks) + few)
        return words

    def report(self) -> str:
        """The table and the population as plain text."""
        headers = ("parameter", "specimens", "mean", "95 % interval", "unit", "spread", "95 % of it")
        notes = [
            ("spread", "standard deviation between specimens, the errors of their fits taken out; % of logarithms")
        ]
        if alike := [trait.name for trait in self.traits if not trait.shows_spread]:
            why = "specimens differ by less than their intervals alone would make them. Intervals also contain errors"
            notes.append(("not told", f"{', '.join(alike)}: {why} that all specimens share, such as that of the mesh"))
        for trait in self.traits:
            if trait.left_out:
                told = ", ".join(f"{name} ({verdict})" for name, verdict in trait.left_out.items())
                notes.append((f"{trait.name} leaves out", told))
        if self.markers:
            told = "; ".join(f"{name}: {words}" for name, words in self.markers.items())
            notes.append(("markers", f"{told}. Most specimens show these markers in most frames"))
        rows = tuple(trait.told() for trait in self.traits)
        return "\n".join(plain_section(Section("Population", headers, rows, tuple(notes)))) + "\n"

    def table(self) -> str:
        """CSV with a row for each specimen and parameter."""
        out = io.StringIO()
        to = csv.writer(out, lineterminator="\n")
        to.writerow(
            (
                "specimen",
                "parameter",
                "value",
                "lower",
                "upper",
                "half_width",
                "unit",
                "verdict",
                "converged",
                "markers",
            )
        )
        markers = self.markers
        for name, fit in self.fits.items():
            for e in fit.estimates:
                numbers = ("" if x is None else repr(x) for x in (e.value, e.lower, e.upper, e.half_width))
                to.writerow((name, e.name, *numbers, e.unit, e.verdict, fit.converged, markers.get(name, "")))
        return out.getvalue()

    def petab(self) -> str:
        """The means in the columns of PEtab's table of parameters, bounds at four spreads and errors from the mean."""
        out = io.StringIO()
        to = csv.writer(out, delimiter="\t", lineterminator="\n")
        to.writerow(("parameterId", "parameterScale", "lowerBound", "upperBound", "nominalValue", "estimate"))
        for trait in self.traits:
            p = trait.found
            if p is None:
                continue
            reach = 4.0 * (p.spread + (p.mean_interval[1] - p.mean) / NORMAL)
            inverse = math.exp if trait.log else float
            ends = [repr(inverse(x)) for x in (p.mean - reach, p.mean + reach, p.mean)]
            to.writerow((trait.name, "log" if trait.log else "lin", *ends, 1))
        return out.getvalue()

    def to_dict(self) -> dict[str, Any]:
        """Strict JSON values of the population."""
        return {trait.name: asdict(trait) for trait in self.traits}


def _seen_best(fit: FitData) -> dict[str, float]:
    """By marker, the share of the fitted frames of the recording that shows it most."""
    best: dict[str, float] = {}
    for recording in fit.recordings:
        for marker, share in recording.seen.items():
            best[marker] = max(share, best.get(marker, 0.0))
    return best


def _trait(name: str, fits: Mapping[str, FitData]) -> Trait:
    counted: dict[str, Estimate] = {}
    left: dict[str, str] = {}
    for specimen, fit in fits.items():
        e = next((e for e in fit.estimates if e.name == name), None)
        if e is None:
            left[specimen] = "not fitted"
        elif e.verdict in COUNTED and e.half_width and e.lower is not None and e.upper is not None:
            counted[specimen] = e
        else:
            left[specimen] = e.verdict
    unit = next((e.unit for fit in fits.values() for e in fit.estimates if e.name == name), "")
    log = all(e.value > 0 and (e.lower or 0.0) > 0 for e in counted.values())
    if len(counted) < FEWEST:
        return Trait(name, unit, log, None, left)
    y, sd = np.array([errors_of(e, log) for e in counted.values()]).T
    return Trait(name, unit, log, population(y, sd**2), left)


def errors_of(e: Estimate, log: bool) -> tuple[float, float]:
    """Value and standard deviation of an estimate with both ends, of its logarithm if wanted."""
    ends: Sequence[float] = (e.lower or 0.0, e.upper or 0.0)
    if log:
        return math.log(e.value), (math.log(ends[1]) - math.log(ends[0])) / (2 * NORMAL)
    return e.value, (ends[1] - ends[0]) / (2 * NORMAL)
