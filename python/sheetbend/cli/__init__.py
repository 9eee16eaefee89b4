"""The command line. `main` is what the console script calls, also where the packages that it needs are missing."""

from __future__ import annotations

import io
import sys

from ..optional import MissingExtraError, require

NEEDS = ("typer", "rich", "pydantic", "tomli_w")


def main() -> None:
    """Run the command line; exits."""
    try:
        for package in NEEDS:
            require(package, "cli")
    except MissingExtraError as error:
        print(f"sheetbend: {error}", file=sys.stderr)
        sys.exit(2)
    from .app import app

    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")  # where the terminal's encoding lacks a character
    app()
