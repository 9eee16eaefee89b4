"""The report of a fit, as plain text and for rich terminals, both from the same sections."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Mapping
from typing import TYPE_CHECKING

from ..optional import require
from ..quantities.wording import figures, short
from ..result.estimate import UNSOUND, Estimate, Given
from ..result.motions import MotionGrowth
from ..result.result import FitData
from .dependence import PLAUSIBLE, Dependence, dependences
from .report_bootstrap import bootstrap
from .report_contact import contact_sections
from .report_driven import driven_sections
from .report_fields import stiffness_fields
from .report_over_time import inputs_over_time, without_modes
from .report_premises import premises
from .report_profiles import lopsided_profiles
from .report_recordings import forces, held_out_motion, recordings
from .report_shot import shot_motions
from .report_starts import groups_of_starts, starts_note
from .summary import summary
from .tables import WIDTH, Section, plain_section, rich_section, wide

if TYPE_CHECKING:
    from rich.console import Group

CORRELATION_SHOWN = 0.3
"""Smallest correlation (absolute value) that the report lists."""
CORRELATIONS_SHOWN = 15
"""Number of correlations that the report lists at most; fit.json has them all."""
GROWTH_SHOWN = 10.0
"""Growth of small displacements from which on the report tells it."""
IN_ALL = "+/- in all"  # heading of the half-width with errors of given values
FELT = 1.1  # half-widths: where errors of given values make them no wider, the report leaves them out
_SHAKEN = 0.1  # of a half-width: less adds next to nothing to it
FAR_BELOW = 0.02  # of sigma: residuals so small tell of a sigma in another unit


def sections(result: FitData) -> list[Section]:
    """The report as data, empty sections left out."""
    whole, result = result, without_modes(result)
    parts = [
        summary(result),
        _misfit(result),
        _parameters(result),
        _unsound(result),
        _interval_parts(result),
        _refits(result),
        premises(result),
        Section("How ropes are held", notes=tuple(_labeled(sentence) for sentence in result.assumed)),
        recordings(result),
        forces(result),
        held_out_motion(result),
        *driven_sections(result),
        *contact_sections(result),
        shot_motions(result),
        *stiffness_fields(result),
        *inputs_over_time(result),
        _unknown(result),
        _correlations(result),
        lopsided_profiles(result),
        bootstrap(result),
        groups_of_starts(result),
        _course(whole),
        Section("Warnings", notes=tuple(("", warning) for warning in result.warnings)),
    ]
    return [part for part in parts if part.rows or part.notes]


def _labeled(sentence: str) -> tuple[str, str]:
    label, _, rest = sentence.partition(": ")
    return label, rest


def headline(result: FitData) -> str:
    """How the fit ended, in one sentence."""
    if result.interrupted:
        end = "converged, then interrupted," if result.converged else "interrupted, best point so far,"
    else:
        end = "converged" if result.converged else "did NOT converge"
    turns = f"{result.iterations} iteration{'' if result.iterations == 1 else 's'}"
    return f"{end} after {turns}, {result.seconds:.3g} s, {result.optimizer}"


def plain(result: FitData) -> str:
    """The report as plain text, at most `WIDTH` columns where the names allow it."""
    lines = [f"Fit {headline(result)}"]
    if result.message:
        lines += textwrap.wrap(result.message, WIDTH, initial_indent="  ", subsequent_indent="  ")
    for section in sections(result):
        lines += ["", *plain_section(section)]
    return "\n".join(lines) + "\n"


def rich_report(result: FitData) -> Group:
    """The report as a rich renderable: `rich.print(rich_report(result))`.

    Raises:
        MissingExtraError: rich is not installed.
    """
    console = require("rich.console", "cli")
    text = require("rich.text", "cli").Text
    good = result.converged and not result.interrupted
    parts: list[object] = [text(f"Fit {headline(result)}", style="bold green" if good else "bold red")]
    if result.message:
        parts.append(text(result.message, style="dim"))
    for section in sections(result):
        parts += ["", *rich_section(section)]
    group: Group = console.Group(*parts)
    return group


def _misfit(result: FitData) -> Section:
    m = result.misfit
    if m is None:
        return Section("Misfit")
    told = [short(1e3 * sigma) for sigma in (m.smallest_sigma, m.largest_sigma)]
    sigma = f"{told[0]} mm" if told[0] == told[1] else f"{told[0]} to {told[1]} mm"
    beyond = f"{short(1e3 * m.model_error)} mm in each coordinate" if m.model_error > 0 else "residuals are below sigma"
    notes: tuple[tuple[str, str], ...] = (
        (
            "reduced chi-square",
            f"{short(m.reduced_chi_square)}; 1 if the residuals are as large as the given sigma of {sigma}",
        ),
        ("model error beyond sigma", beyond),
    )
    if 0 < m.reduced_chi_square < FAR_BELOW**2:
        times = short(m.reduced_chi_square**-0.5, 2)
        said = f"is {times} times the residuals. Check that it is in m: too large a sigma gives priors too much weight"
        notes += (("sigma", said),)
    return Section("Misfit", notes=notes)


def _unsound(result: FitData) -> Section:
    """What speaks against the fit, once for all parameters that it is true of."""
    words: dict[str, list[Estimate]] = {}
    for estimate in result.estimates:
        if estimate.verdict in UNSOUND:
            words.setdefault(estimate.words, []).append(estimate)
    notes = [(f"{', '.join(e.name for e in of)} ({of[0].verdict})", said) for said, of in words.items()]
    return Section("What contradicts this fit", notes=tuple(notes))


def _parameters(result: FitData) -> Section:
    rows = [estimate_row(estimate) for estimate in result.estimates]
    rows += [_given_row(given) for given in result.given]
    headers: tuple[str, ...] = ("parameter", "value", "+/-", "95 % interval", "unit", "verdict")
    notes = [("intervals", words) for words in result.not_counted]
    in_all = {e.name: _in_all(e) for e in result.estimates if e.in_all and e.in_all > FELT * (e.half_width or math.inf)}
    if in_all:
        beside = [(*row, in_all.get(row[0], "")) for row in rows]
        words = f"half-width that also allows for errors of given values: {PLAUSIBLE}, or less where residuals show it"
        if wide(((*headers, IN_ALL), *beside)):
            shared = [name for name in in_all if not name.endswith("]")] or list(in_all)
            others = "" if len(shared) == len(in_all) else " (parameters.csv has those of the other parameters)"
            words = f"{', '.join(f'{name} {in_all[name]}' for name in shared)}{others}: {words}"
        else:
            headers, rows = (*headers, IN_ALL), beside
        notes.insert(0, (IN_ALL, f"{words}{_most(dependences(result))}"))
    return Section("Parameters", headers, tuple(rows), tuple(notes))


def _most(found: Mapping[str, Dependence]) -> str:
    """Which given values count the most, for which parameters."""
    of: dict[str, list[str]] = {}
    for name, on in found.items():
        of.setdefault(on.name, []).append(name)
    most = ", ".join(f"{given} (for {', '.join(names)})" for given, names in of.items())
    return f". Most of it comes from {most}" if most else ""


def _in_all(estimate: Estimate) -> str:
    """Half-width with errors of given values, to the digits of the value's row."""
    return figures((estimate.value, estimate.in_all), estimate.in_all)[1]


def estimate_row(estimate: Estimate) -> tuple[str, ...]:
    """Name, value, half-width, interval, unit and verdict, to two digits of the half-width."""
    ends = (estimate.lower, estimate.upper)
    numbers = (estimate.value, estimate.half_width, *ends)
    if _lopsided(*ends):
        value, half, lower, upper = ("" if number is None else short(number) for number in numbers)
    else:
        value, half, lower, upper = figures(numbers, estimate.half_width)
    interval = "" if estimate.lower is None and estimate.upper is None else f"[{lower or '-'}, {upper or '-'}]"
    return (estimate.name, value, half, interval, estimate.unit, estimate.verdict)


def _lopsided(lower: float | None, upper: float | None) -> bool:
    """Whether the ends are so far apart, or one of them so open, that no common digits suit them."""
    return lower is None or upper is None or 0 < 3 * lower < upper


def _given_row(given: Given) -> tuple[str, ...]:
    return (given.name, short(given.value, 6), "", "", given.unit, given.words)


def _interval_parts(result: FitData) -> Section:
    rows = []
    counted = any(e.systematic > 0 for e in result.estimates)
    moved = any(e.moved != 0 for e in result.estimates)
    shaken = any(e.driven > _SHAKEN * (e.half_width or math.inf) for e in result.estimates)
    for e in result.estimates:
        if e.discretization + e.systematic + shaken * e.driven > 0 and e.half_width is not None:
            parts = (e.half_width, e.statistical, *([e.driven] if shaken else []), e.discretization)
            parts += (*([e.systematic] if counted else []), *([e.moved] if moved else []))
            rows.append((e.name, *figures(parts, e.half_width), e.unit))
    more = (["systematic"] if counted else []) + (["value moved by"] if moved else [])
    driven = ["driven noise"] if shaken else []
    headers = ("parameter", "+/-", "statistical", *driven, "discretization", *more, "unit")
    meshes = " and fine meshes" if any(refit.left for refit in result.refits) else ""
    note = f'values are extrapolated to short substeps{meshes} ("value moved by"); this is the error that remains'
    notes = [("discretization", note)] if moved and rows else []
    if shaken and rows:
        words = "from the noise of what drives a scene; its square adds to that of the statistical part"
        notes.insert(0, ("driven noise", words))
    return Section("Where the intervals come from", headers, tuple(rows), tuple(notes))


def _refits(result: FitData) -> Section:
    rows = []
    for e in result.estimates if result.refits else ():
        moved = [refit.moved.get(e.name) for refit in result.refits]
        if e.half_width is not None:
            rows.append((e.name, *figures(moved, e.half_width / 10), e.unit))
    headers = ("parameter", *(refit.name for refit in result.refits), "unit")
    return Section("How much a finer discretization changes the values", headers, tuple(rows))


def _unknown(result: FitData) -> Section:
    notes = []
    for gauge in result.gauges:
        members = [e.name for e in result.estimates if gauge in e.words]
        notes.append((" and ".join(members), f"{gauge}; fix one of them or give it a prior"))
    for estimate in result.estimates:
        if estimate.verdict not in ("identified", *UNSOUND) and not any(
            gauge in estimate.words for gauge in result.gauges
        ):
            notes.append((estimate.name, estimate.words))
    if any(e.verdict == "at its floor" for e in result.estimates):
        others = [e.name for e in result.estimates if e.verdict in ("identified", "weak")]
        if others:
            notes.append(
                (", ".join(others), "doubtful too, because the solver's own stiffness or damping shifts them as well")
            )
    return Section("What the data cannot tell", notes=tuple(notes))


def _correlations(result: FitData) -> Section:
    strong = [pair for pair in result.correlations if abs(pair.value) >= CORRELATION_SHOWN]
    strong.sort(key=lambda pair: -abs(pair.value))
    rows = tuple((pair.first, pair.second, f"{pair.value:+.2f}") for pair in strong[:CORRELATIONS_SHOWN])
    left_out = f"those below {CORRELATION_SHOWN:g} are left out"
    if len(strong) > len(rows):
        left_out = f"the {len(rows)} strongest of {len(strong)} above {CORRELATION_SHOWN:g}"
    return Section(f"Correlations ({left_out})", ("parameter", "with", "correlation"), rows)


def _grown(growth: MotionGrowth) -> str:
    """How small displacements grow along one motion, at the end of the fit."""
    largest = growth.largest[1]
    size = "without limit" if largest is None else f"{largest:.2g} times"
    until = "" if growth.until[1] is None else f"; beyond {growth.until[1]:.3g} s derivatives are of no use"
    return f"small disturbances grow {size}{until}"


def _course(result: FitData) -> Section:
    notes = [("cost", f"{result.cost:.6g} over {result.rows:,} residuals, {len(result.estimates)} free parameters")]
    if result.first_cost is not None:
        fell = f", {result.first_cost / result.cost:,.3g} times that at the end" if result.cost > 0 else ""
        notes.append(("cost at the start", f"{result.first_cost:.6g}{fell}"))
    if result.evaluations:
        notes.append(("simulations", f"{result.evaluations:,}, {result.jacobians:,} of them with a Jacobian"))
    if result.judging[0] > 0:
        more = f"{result.judging[0]:,}, {result.judging[1]:,} of them with a Jacobian"
        notes.append(("more simulations, for intervals and checks", more))
    if result.windows:
        notes.append(("windows fitted first", ", ".join(f"{length:.3g}" for length in result.windows) + " s"))
    notes += [(f"growth in {g.name}", _grown(g)) for g in result.growth if (g.largest[1] or math.inf) > GROWTH_SHOWN]
    if result.jacobian_seconds is not None:
        notes.append(("time per Jacobian", f"{result.jacobian_seconds:.3g} s"))
    if result.autocorrelation_time > 1.05:
        time = result.autocorrelation_time
        words = f"{time:.3g} of them count as one independent residual in the intervals"
        notes.append(("neighboring residuals are correlated", words))
    if result.condition:
        notes.append(("Jacobian at the start", result.condition))
    notes += starts_note(result)
    return Section("Search", notes=tuple(notes))
