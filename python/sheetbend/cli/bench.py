"""sheetbend bench, for one version: where it went."""

from __future__ import annotations

from typing import Annotated

import typer
from rich.console import Console

from ..errors import InputError
from .outcome import Outcome, run


def bench(
    workload: Annotated[list[str] | None, typer.Argument(metavar="WORKLOAD", show_default=False)] = None,
    json: Annotated[bool, typer.Option("--json", help="One JSON object on stdout.")] = False,
) -> None:
    """Moved to the sources: experiments/bench/measure.py."""
    run(lambda console: _refuse(console, workload or []), json)


def _refuse(console: Console, given: list[str]) -> Outcome:
    fix = f"in a checkout of the sources run: python experiments/bench/measure.py {' '.join(given) or 'WORKLOAD'}"
    raise InputError("sheetbend bench", "is no longer part of the installed package", " ".join(given), fix)
