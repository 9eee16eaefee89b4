"""The HTML page that `sheetbend fit` writes."""

from __future__ import annotations

import shlex
from pathlib import Path

from rich.console import Console

from ..config import Config
from ..files.whole import write_text
from ..fitting.fit import Fit
from ..gripped import Evaluation, RopeReport
from ..optional import require
from ..page import fit_page, predicted_motion, result_page
from ..version import __version__

PAGE = "report.html"


def page_possible(console: Console) -> bool:
    """Whether a page can be made; where jinja2 is missing or does not load, this says so before the work."""
    try:
        require("jinja2", "cli")
    except Exception as error:  # a broken installation may raise anything while it loads
        console.print(f"no {PAGE} will be written: {error}", markup=False, soft_wrap=True)
        return False
    return True


def write_rope_page(report: RopeReport, drawn: Evaluation, folder: Path) -> list[str]:
    """Write the page of a fitted rope with the recordings that it predicts; gives its name."""
    motions = [predicted_motion(r, x) for r, x in zip(drawn.recordings, drawn.predicted, strict=True)]
    unseen = drawn is report.unseen
    about = (
        f"a rope between two grips; drawn are the {'unseen' if unseen else 'fitted'} recordings, predicted open loop"
    )
    page = result_page(report.result, motions, report.name, more=report.sections(), about=about, version=__version__)
    write_text(folder / PAGE, page)
    return [PAGE]


def write_fit_page(found: Fit, config: Config, source: Path, folder: Path) -> list[str]:
    """Write the page of a fit that was made from a configuration file; gives its name."""
    page = fit_page(
        found,
        config.experiment.name,
        about=config.experiment.about,
        configuration=source.read_text(encoding="utf-8"),
        command=shlex.join(["sheetbend", "fit", str(source)]),
        version=__version__,
    )
    write_text(folder / PAGE, page)
    return [PAGE]
