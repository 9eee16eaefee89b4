"""The report of a fit as one HTML file: the motion in space, residuals, and everything that the text report says."""

from __future__ import annotations

import json
import platform
from collections.abc import Sequence
from datetime import UTC, datetime
from typing import Any

import numpy as np

from ..doubts.prediction import Comparison
from ..errors import SheetbendError
from ..fitting.fit import Fit
from ..quantities.wording import short
from ..report.fit_result import FitResult
from ..report.report import headline, sections
from ..report.report_over_time import without_modes
from ..report.tables import Section
from ..result.estimate import UNSOUND
from ..result.result import Start
from .packed import packed_motions
from .profile_curves import HEIGHT, WIDTH, profile_pictures
from .render import compressed, render, table
from .shown import Shown, fitted_motion

MOST_MATRIX = 60  # parameters whose correlations are drawn; the table has the strongest of more
_FIRST = ("Summary", "Misfit", "Parameters", "What contradicts this fit", "Warnings")


def fit_page(
    found: Fit, title: str, *, about: str = "", configuration: str = "", command: str = "", version: str = ""
) -> str:
    """The page of a fit as HTML text. Each recording of a motion costs one simulation.

    Args:
        found: a fit, a failed one too.
        title, about, configuration, command, version: see `result_page`.

    Raises:
        MissingExtraError: jinja2 is not installed.
    """
    motions, remarks = _motions(found)
    return result_page(
        found.result,
        motions,
        title,
        remarks=remarks,
        about=about,
        configuration=configuration,
        command=command,
        version=version,
    )


def result_page(
    result: FitResult,
    motions: Sequence[Shown],
    title: str,
    *,
    more: Sequence[Section] = (),
    remarks: Sequence[str] = (),
    about: str = "",
    configuration: str = "",
    command: str = "",
    version: str = "",
) -> str:
    """The page of a result as HTML text.

    Args:
        result: of a fit.
        motions: what is drawn.
        title: of the page.
        more: further sections of the report.
        remarks: sentences below the motion.
        about: what the experiment is, a sentence.
        configuration: the TOML that the fit was made from; shown as it is.
        command: what repeats the fit.
        version: of sheetbend.

    Raises:
        MissingExtraError: jinja2 is not installed.
    """
    told_of = without_modes(result)
    told = [table(section) for section in (*sections(result), *more)]
    return render(
        "fit.html",
        title=title,
        about=about,
        headline=headline(result),
        message="" if result.converged else result.message,
        tone=_tone(told_of),
        counts=_counts(told_of),
        first=[part for part in told if part["title"] in _FIRST],
        rest=[part for part in told if part["title"] not in _FIRST],
        starts=_starts(told_of),
        profiles=profile_pictures(told_of),
        box=(WIDTH, HEIGHT),
        data={
            "motions": packed_motions(motions),
            "correlations": _matrix(told_of),
            "fit": compressed(json.dumps(result.to_dict(), indent=2, allow_nan=False)),
        },
        remarks=remarks,
        configuration=configuration,
        command=command,
        version=version,
        made=datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
        machine=f"Python {platform.python_version()}, NumPy {np.__version__}",
    )


def _motions(found: Fit) -> tuple[list[Shown], list[str]]:
    """All recordings' motions; where one diverges at the fitted values, its markers alone, with a remark."""
    motions, remarks = [], []
    for c in found.comparisons:
        try:
            motions.append(fitted_motion(found, c))
        except SheetbendError as error:
            motions.append(_markers_alone(c))
            remarks.append(f"{c.experiment.name}: only its markers are drawn. {error}")
    return motions, remarks


def _markers_alone(c: Comparison) -> Shown:
    x = c.recording.positions[:1] if c.experiment.static else c.recording.positions
    times = c.recording.times[: len(x)]
    names, is_cloud = tuple(c.recording.markers), c.experiment.is_cloud
    return Shown(c.experiment.name, times, markers=names, is_cloud=is_cloud, measured=x, held_out=c.held_out)


def _tone(result: FitResult) -> str:
    """Color of the headline, which tells how the fit ended; doubts about values have colors of their own."""
    if not result.converged or result.interrupted:
        return "bad"
    return "good" if all(e.verdict == "identified" for e in result.estimates) else "mixed"


def _counts(result: FitResult) -> list[tuple[str, int, bool]]:
    """How often each verdict is given, and whether nothing should rest on it."""
    verdicts = [e.verdict for e in result.estimates]
    return [(verdict, verdicts.count(verdict), verdict in UNSOUND) for verdict in dict.fromkeys(verdicts)]


def _starts(result: FitResult) -> dict[str, Any] | None:
    """A table of the starts' ends, best first."""
    if len(result.starts) < 2:
        return None
    names, raced = list(result.starts[0].values), any(start.first for start in result.starts)
    rows = [
        (
            "diverged" if start.cost is None else short(start.cost, 6),
            str(start.iterations),
            "yes" if start.converged else "no",
            *(short(start.values[name]) for name in names),
            *_raced(start, names, raced),
        )
        for start in result.starts
    ]
    headers = ("cost", "iterations", "converged", *names)
    headers += ("group", "raced to", *(f"{name} at first" for name in names)) if raced else ()
    return {"title": "Starts", "headers": headers, "rows": rows, "left": [False] * len(headers), "notes": ()}


def _raced(start: Start, names: Sequence[str], shown: bool) -> tuple[str, ...]:
    """The end of its race, and where it began."""
    if not shown:
        return ()
    group = "" if start.group is None else str(start.group)
    cost = "" if start.raced is None else short(start.raced, 6)
    return (group, cost, *(short(start.first[name]) if start.first else "" for name in names))


def _matrix(result: FitResult) -> dict[str, Any] | None:
    """Correlations as a full matrix of the determined parameters."""
    names = list(dict.fromkeys(name for pair in result.correlations for name in (pair.first, pair.second)))
    if not 2 <= len(names) <= MOST_MATRIX:
        return None
    place = {name: k for k, name in enumerate(names)}
    matrix = np.eye(len(names))
    for pair in result.correlations:
        i, j = place[pair.first], place[pair.second]
        matrix[i, j] = matrix[j, i] = round(pair.value, 3)
    return {"names": names, "values": matrix.tolist()}
