"""The parameters of a fit as a table that spreadsheets and scripts read."""

from __future__ import annotations

import csv
import io

from ..result.result import FitData

TABLE = "parameters.csv"
COLUMNS = (
    "parameter",
    "value",
    "unit",
    "lower",
    "upper",
    "half_width",
    "statistical",
    "discretization",
    "systematic",
    "in_all",
    "verdict",
    "words",
)


def parameter_table(result: FitData) -> str:
    """CSV text with a row for each estimate: SI units, full digits, an empty cell where an interval is open or where
    the half-width with errors of given values (`in_all`) is not known.

    Names and words come from files: a cell that a spreadsheet would take for a formula begins with an apostrophe.
    """
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(COLUMNS)
    for e in result.estimates:
        numbers = {c: getattr(e, c) for c in COLUMNS[3:10]}
        cells = [_plain(e.name), repr(e.value), _plain(e.unit)]
        cells += ["" if v is None else repr(float(v)) for v in numbers.values()]
        rows.writerow([*cells, e.verdict, _plain(e.words)])
    return text.getvalue()


def _plain(text: str) -> str:
    return f"'{text}" if text[:1] in ("=", "+", "-", "@") else text
