"""The commands."""

from __future__ import annotations

from typing import Annotated

import typer

from .bench import bench
from .check import check
from .collect import collect
from .compare import compare
from .fabric import fabric
from .fit import fit
from .identify import identify
from .info import info
from .new import new
from .number_options import saying_numbers
from .schema import schema
from .simulate import simulate
from .textile import textile
from .view import view

app = typer.Typer(
    name="sheetbend",
    help="Simulate ropes, beams and cloth, and fit their physical parameters to recordings, with error bars.",
    epilog="Exit codes: 0 done, 2 bad input, 3 not identifiable, 4 did not converge or is doubtful, 5 a check failed, "
    "130 stopped by Ctrl-C, 143 stopped by SIGTERM.",
    rich_markup_mode="markdown",  # joins the lines of a docstring's paragraph
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)


def _version(wanted: bool) -> None:
    if wanted:
        from ..version import __version__

        typer.echo(f"sheetbend {__version__}")
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Simulate ropes, beams and cloth, and fit their physical parameters to recordings, with error bars."""


for command in (new, fit, simulate, view, check, info, identify, compare, collect, textile, fabric, schema):
    app.command(cls=saying_numbers(command))(command)
app.command(hidden=True, context_settings={"ignore_unknown_options": True})(bench)
