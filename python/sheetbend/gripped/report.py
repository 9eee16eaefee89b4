"""The report of a rope's fit: estimates, the steps of the recipe, what the motion does not determine by itself, and
unseen recordings."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any

from ..optional import require
from ..quantities.wording import short
from ..report import report
from ..report.fit_result import FitResult
from ..report.tables import Section, plain_section, rich_section
from .conclusion import spread_words
from .evaluation import Evaluation
from .model import NAME
from .over_density import OVER, as_quantities, in_units, is_over_density
from .recipe import RopeFit
from .stiffness import stiffness_section, tangent_stiffness
from .trades import trades

if TYPE_CHECKING:
    from rich.console import Group


@dataclass(frozen=True)
class RopeReport:
    """A fitted rope with its name and what it predicts.

    Attributes:
        name: of the rope.
        found: from `fit_rope`.
        unseen: predictions of other recordings, or None.
        without_twist: those of a fit with `WITHOUT_TWIST`, or None.
    """

    name: str
    found: RopeFit
    unseen: Evaluation | None = None
    without_twist: Evaluation | None = None

    @property
    def result(self) -> FitResult:
        """The last fit, with the warnings of the recipe."""
        result = self.found.fit.result
        more = tuple(
            f"the prediction of {name}{where} diverges: it is left out of the errors"
            for part, where in ((self.unseen, ""), (self.without_twist, " without twist"))
            for name in (part.diverged if part is not None else ())
        )
        notes = tuple(f"unseen recording {note}" for note in (self.unseen.notes if self.unseen is not None else ()))
        words = self.unseen.words if self.unseen is not None else ""
        return replace(result, prediction=words, warnings=(*result.warnings, *self.found.warnings, *notes, *more))

    def plain(self) -> str:
        """As plain text."""
        lines = [f"{self.name}, a rope between two grips", "", report.plain(self.result)]
        for section in self.sections():
            lines += [*plain_section(section), ""]
        if self.unseen is not None and self.unseen.scores is not None:
            lines.append(self.unseen.scores.report())
        return "\n".join(lines)

    def rich(self) -> Group:
        """For rich terminals.

        Raises:
            MissingExtraError: rich is not installed.
        """
        parts: list[object] = [report.rich_report(self.result)]
        for section in self.sections():
            parts += ["", *rich_section(section)]
        if self.unseen is not None and self.unseen.scores is not None:
            parts += ["", self.unseen.scores.rich_report()]
        group: Group = require("rich.console", "cli").Group(*parts)
        return group

    def to_dict(self) -> dict[str, Any]:
        """Strict JSON values; what `FitResult.load` reads, and beside it the steps, the trades and the errors in m."""
        EI = "EI" if self.found.weighed else f"EI{OVER}"
        steps = [{EI if k == "EI" else k: _finite(v) for k, v in asdict(step).items()} for step in self.found.steps]
        return self.result.to_dict() | {
            "rope": self.name,
            "weighed": self.found.weighed,
            "values": dict(self.found.values),
            "segments": self.found.model.segments,
            "tangent_stiffness": tangent_stiffness(self.result),
            "model_spread": dict(self.found.spread),
            "grips_late": self.found.model.late,
            "markers_beside": [list(pair) for pair in self.found.model.beside],
            "steps": steps,
            "trades": [f"{what}: {words}" for what, words in trades(self.result)],
            **errors(self.unseen, self.without_twist),
        }

    @property
    def _unit(self) -> str:
        return "N m^2" if self.found.weighed else in_units("N m^2")

    def _beside(self) -> list[Section]:
        """How far markers sit beside the rope, where that was found; nothing elsewhere."""
        offsets = self.found.model.beside
        rows = [(str(k), *(_mm(x) for x in (a, b, math.hypot(a, b))), "mm") for k, (a, b) in enumerate(offsets, 1)]
        note = "the best estimates, from the axis of the rope, about its two directors; the first free marker is 1"
        headers = ("marker", "first", "second", "distance", "unit")
        return [Section("Markers beside the rope", headers, tuple(rows), (("first, second", note),))] if rows else []

    def sections(self) -> list[Section]:
        rows = [
            (
                s.name,
                _mm(s.fitted),
                _mm(s.others),
                "mm",
                "" if s.ratio is None else short(s.ratio),
                "" if s.ratio is None else f"{s.better} of {s.count}",
                "" if s.EI is None else short(s.EI),
                "yes" if s.stays else "no",
                f"{s.seconds:.1f}",
            )
            for s in self.found.steps
        ]
        meaning = "median of the mean absolute coordinate errors of recordings, predicted from their first frame"
        notes = (
            ("fitted, others", f"{meaning}: those that the step was fitted to, and those that it was not"),
            ("ratio", "median ratio of the errors of others with and without the step"),
            ("better", "how many of the others (or of their pieces) it predicts better"),
            ("EI", f"with the step, {self._unit}: it depends on what else the model has"),
        )
        headers = ("step", "fitted", "others", "unit", "ratio", "better", "EI", "kept", "seconds")
        stiffness = stiffness_section(self.result)
        return [
            *([] if stiffness is None else [stiffness]),
            *self._beside(),
            Section("Steps", headers, tuple(rows), notes),
            Section("What the motion does not determine by itself", notes=trades(self.result)),
            Section(
                "Errors that the intervals contain",
                notes=counted(self.result, spread_words(as_quantities(self.found.spread), self.found.values)),
            ),
        ]


def counted(result: FitResult, spread: str = "") -> tuple[tuple[str, str], ...]:
    """(counted or not, sentence) of what makes the intervals; `spread`: words on models that predict equally well."""
    refined = "".join(f", {made.name}" for made in result.refits)
    seen = "markers beside the rope by as much as the residuals show (systematic)"
    model = f", {spread}" if spread else ""
    density = next((p for p in result.premises if p.name == f"{NAME}_density" and p.sd and p.value), None)
    unseen = "an unobserved roll of the grips, noise of the grips"
    if any(e.name == f"{NAME}_yield_share" for e in result.estimates):
        unseen += ", an error of what had slid inside before a recording (its first frames determine it)"
    if density is not None and density.sd is not None and density.value is not None:
        model += f", the density to {short(100 * density.sd / density.value, 2)} % (1 sd, unweighed markers included)"
    elif not is_over_density(result):
        unseen += ", the weight"
    return (("counted", f"residuals that are correlated over time{refined}, {seen}{model}"), ("not counted", unseen))


def errors(unseen: Evaluation | None, without_twist: Evaluation | None) -> dict[str, Any]:
    """Mean errors in m over unseen recordings, None where there are none, and those of each."""
    found = None if unseen is None else unseen.scores
    bare = None if without_twist is None else without_twist.scores
    rows = {row.recording: {"error": row.error, "blend": row.blend} for row in (found.rows if found else ())}
    return {
        "error": None if found is None else found.error,
        "blend": None if found is None else found.blend,
        "without_twist": None if bare is None else bare.error,
        "unseen": rows,
    }


def overview(reports: list[RopeReport]) -> Section:
    """One line per rope: errors on unseen recordings, and the stiffness."""
    rows = []
    for r in reports:
        told, values = errors(r.unseen, r.without_twist), as_quantities(r.found.values)
        EI, GJ = values[f"{NAME}_EI"], values[f"{NAME}_GJ"]
        numbers = (_mm(told[key]) for key in ("blend", "without_twist", "error"))
        unit = "N m^2" if r.found.weighed else in_units("N m^2")
        rows.append((r.name, *numbers, "mm", short(EI), unit, short(GJ / EI)))
    headers = ("rope", "blend", "without twist", "fitted", "unit", "EI", "unit", "GJ/EI")
    notes = [("errors", "mean absolute coordinate error of recordings that were not fitted; blend: no physics")]
    if not all(r.found.weighed for r in reports):
        notes.append(("EI", f"in {in_units('N m^2')} it is that over the density, of ropes that were not weighed"))
    return Section("Ropes", headers, tuple(rows), tuple(notes))


def _mm(error: float | None) -> str:
    return "" if error is None else short(1e3 * error) if math.isfinite(error) else "diverges"


def _finite(value: Any) -> Any:
    return None if isinstance(value, float) and not math.isfinite(value) else value
