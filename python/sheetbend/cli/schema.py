"""sheetbend schema: JSON schemas for editors and programs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Literal

import typer
from rich.console import Console

from ..config.json_schemas import SCHEMAS
from ..files.whole import write_text
from .folders import made
from .outcome import Outcome, run
from .targets import check_targets

Kind = Literal["scene", "ropes", "fabric", "fit"]


def schema(
    kind: Annotated[
        Kind,
        typer.Argument(
            help="scene or ropes (between grips): a configuration; fabric: a file of `sheetbend fabric`; fit: fit.json."
        ),
    ] = "scene",
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="The file to write. Default: the schema is printed.", show_default=False),
    ] = None,
) -> None:
    """Print the JSON schema of a file, with which editors complete and check keys.

    Example: sheetbend schema --output sheetbend.schema.json

    A TOML file that begins with the line #:schema ./sheetbend.schema.json is then completed and checked.
    """
    text = json.dumps(SCHEMAS[kind](), indent=2)

    def command(console: Console) -> Outcome:
        if output is None:
            console.out(text, highlight=False)
        else:
            check_targets("--output", output.parent, [output])
            made("--output", output.parent)
            write_text(output, text + "\n")
            console.print(f"written to {output}", soft_wrap=True)
        return Outcome()

    run(command, False)
