"""The result of a fit to many recordings: shared estimates, and private ones as a distribution."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from ..errors import InputError
from ..files.door import ROOM, bounded_bytes, reading
from ..files.json_file import json_content
from ..files.typed import as_dataclass, as_type, mapping
from ..files.whole import write_text
from ..quantities.wording import several, short
from ..result.estimate import Estimate, check_widths, estimate_of
from ..statistics.intervals import NORMAL
from .report import estimate_row
from .tables import Section, plain_section

FORMAT = "sheetbend many 2"
SHARES = (0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0)
LABELS = [f"{100 * share:g} %" for share in SHARES]
FAR, LEAST = 2.0, 0.1  # times the median misfit, and sigma: recordings with more than both are named
MUCH = 1.7  # sigma, the median misfit above which a warning says that the model misses most recordings
NAMED = 5
LACKS = (
    "the model lacks something, or a given value or sigma is wrong. Fit three of the recordings with sheetbend.fit, "
    "which looks for the cause"
)


@dataclass(frozen=True)
class OwnParameter:
    """A private parameter in all recordings.

    Attributes:
        name, unit, log: of the parameter.
        values: one for each recording; NaN where it has none.
        sds: standard deviations, of the logarithm where `log`; NaN where the data do not determine it.
    """

    name: str
    unit: str
    log: bool
    values: tuple[float, ...]
    sds: tuple[float, ...]


@dataclass(frozen=True)
class _Distribution:
    """An `OwnParameter` in the JSON of a fit: values below which shares of the recordings lie."""

    name: str
    unit: str
    log: bool
    values: Mapping[str, float] | None
    sds: Mapping[str, float] | None


@dataclass(frozen=True)
class ManyFit:
    """A fit to many recordings.

    Attributes:
        estimates: of the shared parameters; intervals from the residuals alone.
        scatter: by shared parameter, the standard deviation that the scatter between recordings asks for, over that of
            independent residuals.
        own: of the private parameters.
        recordings: their names.
        misfit: (recordings,) root mean square of each one's residuals, in sigma.
        cost, first_cost: half the sum of squared residuals, priors included, at the end and at the start.
        rows: residuals.
        iterations, converged, seconds: how it went.
        evaluations, jacobians: how often all recordings were simulated, and how often of these with a Jacobian.
        jacobian_bytes: what was kept of one Jacobian.
        interrupted: whether Ctrl-C ended it.
    """

    estimates: tuple[Estimate, ...]
    scatter: Mapping[str, float]
    own: tuple[OwnParameter, ...]
    recordings: tuple[str, ...]
    misfit: tuple[float, ...]
    cost: float
    first_cost: float
    rows: int
    iterations: int
    converged: bool
    seconds: float
    evaluations: int
    jacobians: int
    jacobian_bytes: int
    interrupted: bool = False

    def __getitem__(self, name: str) -> Estimate:
        """The estimate of a shared parameter; KeyError names the ones there are."""
        return estimate_of(self.estimates, name)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What speaks against the fit: recordings that it misses by far, and that it misses most of them."""
        most = float(np.median(self.misfit))
        far = sorted(zip(self.misfit, self.recordings, strict=True), reverse=True)
        far = [(x, name) for x, name in far if x > max(FAR * most, LEAST)]
        if far:
            names = several([f"{name} ({short(x, 3)} sigma)" for x, name in far], NAMED)
            others = f". If half of the others are still missed by more than {MUCH:g} sigma then, {LACKS}"
            return (
                f"{len(far)} of {len(self.misfit)} recordings are missed by more than {FAR:g} times the median of "
                f"{short(most, 3)} sigma: {names}. Check their markers, axes, units and clocks, and leave out those "
                f"that cannot be corrected{others if most > MUCH else ''}",
            )
        if not most > MUCH:
            return ()
        return (
            f"half of the recordings are missed by {short(most, 3)} sigma or more, and the intervals take that for "
            f"noise: {LACKS}",
        )

    def report(self) -> str:
        """The report as plain text."""
        return "\n".join("\n".join([*plain_section(part), ""]) for part in self._sections())

    def table(self) -> str:
        """A CSV row for each recording: its misfit, and value and standard deviation of its private parameters."""
        out = io.StringIO()
        writer = csv.writer(out, lineterminator="\n")
        writer.writerow(_header(self.own))
        for i, name in enumerate(self.recordings):
            numbers = [x for p in self.own for x in (p.values[i], p.sds[i])]
            writer.writerow([name, repr(self.misfit[i]), *("" if math.isnan(x) else repr(x) for x in numbers)])
        return out.getvalue()

    def save(self, path: str | Path) -> None:
        """Write the result as JSON, whole or not at all, with private parameters and misfits as distributions; beside
        it, with the ending .csv, `table` with the numbers of every recording."""
        path = Path(path)
        data = {"format": FORMAT, "table": path.with_suffix(".csv").name, **self.__dict__}
        data["estimates"] = [asdict(e) for e in self.estimates]
        data["recordings"] = len(self.recordings)
        data["misfit"] = dict(zip(LABELS, np.quantile(self.misfit, SHARES).tolist(), strict=True))
        data["own"] = [
            {"name": p.name, "unit": p.unit, "log": p.log, "values": _known(p.values), "sds": _known(p.sds)}
            for p in self.own
        ]
        write_text(path.with_suffix(".csv"), self.table())
        write_text(path, json.dumps(data, indent=2, allow_nan=False) + "\n")

    @classmethod
    def load(cls, path: str | Path) -> ManyFit:
        """Read what `save` wrote, the table beside it included.

        Raises:
            InputError: the files hold no such fit, or do not belong together.
        """
        path = Path(path)
        with reading(path, InputError):
            data = dict(mapping(json_content(path, InputError, finite=True), str(path)))
            if (kind := data.pop("format", None)) != FORMAT:
                raise InputError(f"{path}: format", "is not the one that this version reads", kind, f"use {FORMAT!r}")
            data.pop("table", None)
            own: tuple[_Distribution, ...] = as_type(tuple[_Distribution, ...], data.get("own"), "own")
            count = as_type(int, data.get("recordings"), "recordings")
        table = path.with_suffix(".csv")
        with reading(table, InputError):
            header, *rows = csv.reader(io.StringIO(bounded_bytes(table, ROOM, InputError).decode()))
            if header != _header(own) or len(rows) != count or any(len(row) != len(header) for row in rows):
                fix = "keep the two files that ManyFit.save wrote together"
                raise InputError(str(table), f"is not the table of {path.name}", f"{len(rows)} rows", fix)
            numbers = np.array([[float(x) if x else math.nan for x in row[1:]] for row in rows])
        data["recordings"], data["misfit"] = [row[0] for row in rows], numbers[:, 0].tolist()
        columns = numbers[:, 1:].T.tolist()
        data["own"] = [
            OwnParameter(p.name, p.unit, p.log, tuple(columns[2 * k]), tuple(columns[2 * k + 1]))
            for k, p in enumerate(own)
        ]
        found = as_dataclass(cls, data, "")
        for i, estimate in enumerate(found.estimates):
            check_widths(estimate, f"estimates[{i}]")
        return found

    def _sections(self) -> list[Section]:
        shared = []
        for e in self.estimates:
            name, value, _, ends, unit, verdict = estimate_row(e)
            more = "" if e.name not in self.scatter else short(self.scatter[e.name], 2)
            shared.append((name, value, ends, unit, more, verdict))
        words = "standard deviation from the scatter between recordings over that of independent residuals"
        headers = ("parameter", "value", "95 % interval", "unit", "scatter", "verdict")
        notes = [("scatter", f"{words}; the larger counts"), *(("warning", w) for w in self.warnings)]
        open_ones = [(e.name, e.words) for e in self.estimates if e.verdict not in ("identified", "weak")]
        own = [(p.name, *(short(x) for x in _spread(p.values)), p.unit, _typical(p)) for p in self.own]
        misfit = ("misfit", *(short(x, 3) for x in np.quantile(self.misfit, SHARES)), "sigma", "")
        end = "converged" if self.converged else "did NOT converge"
        course = (
            ("fit", f"{end} after {self.iterations} iterations, {self.seconds:.3g} s"),
            ("cost", f"{short(self.cost, 6)} over {self.rows:,} residuals of {len(self.recordings):,} recordings"),
            ("at the start", short(self.first_cost, 6)),
            ("simulations of all", f"{self.evaluations}, {self.jacobians} of them with a Jacobian"),
            ("kept of a Jacobian", f"{short(self.jacobian_bytes / 1e6, 3)} MB"),
            ("not counted", "time step, mesh and given values; sheetbend.fit counts them, of a few of the recordings"),
        )
        each = ("of each recording", *LABELS, "unit", "its own half-width")
        return [
            Section("Shared parameters", headers, tuple(shared), (*notes, *open_ones)),
            Section("Recordings (shares that lie below)", each, (*own, misfit)),
            Section("Course", notes=course),
        ]


def _header(own: Sequence[OwnParameter | _Distribution]) -> list[str]:
    found = ["recording", "misfit [sigma]"]
    for p in own:
        unit = f" [{p.unit}]" if p.unit else ""
        found += [f"{p.name}{unit}", f"sd of ln {p.name}" if p.log else f"sd of {p.name}{unit}"]
    return found


def _known(values: Sequence[float]) -> dict[str, float] | None:
    """The distribution of what is known; None where nothing is."""
    known = [x for x in values if not math.isnan(x)]
    return dict(zip(LABELS, np.quantile(known, SHARES).tolist(), strict=True)) if known else None


def _spread(values: tuple[float, ...]) -> list[float]:
    known = [x for x in values if not math.isnan(x)]
    return [float(x) for x in np.quantile(known, SHARES)] if known else [math.nan] * len(SHARES)


def _typical(p: OwnParameter) -> str:
    """Median of the recordings' half-widths."""
    known = [x for x in p.sds if not math.isnan(x)]
    if not known:
        return "open"
    half = NORMAL * float(np.median(known))
    return f"{short(100 * half, 2)} %" if p.log else f"{short(half, 2)} {p.unit}".rstrip()
