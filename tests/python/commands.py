"""The command line in tests: run it in this process, and read its JSON line."""

from __future__ import annotations

import json
from typing import Any

from sheetbend.cli.app import app
from typer.testing import CliRunner, Result


def run(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(a) for a in arguments])


def last_line(result: Result) -> dict[str, Any]:
    """The JSON object that is all of stdout."""
    (line,) = result.stdout.splitlines()
    found = json.loads(line)
    assert isinstance(found, dict) and found["exit_code"] == result.exit_code, result.stderr
    return found
