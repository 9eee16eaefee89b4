"""The HTML page that `sheetbend fit` writes."""

from __future__ import annotations

import shlex
from pathlib import Path

from rich.console import Console

from .. import __version__
from ..config import Config
from ..fit import Fit
from ..optional import require
from ..page import fit_page
from ..whole import write_text

PAGE = "report.html"


def page_possible(console: Console) -> bool:
    """Whether a page can be made; where jinja2 is missing or does not load, this says so before the work."""
    try:
        require("jinja2", "cli")
    except Exception as error:  # a broken installation may raise anything while it loads
        console.print(f"no {PAGE} will be written: {error}", markup=False, soft_wrap=True)
        return False
    return True


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
