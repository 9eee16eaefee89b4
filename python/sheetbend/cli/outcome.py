"""How a command ends: its exit code, what it prints for people, and the JSON object on the last line of stdout."""

from __future__ import annotations

import json
import math
import sys
import traceback
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import IntEnum
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.text import Text

from ..errors import InputError, SheetbendError
from ..files.door import noting
from ..optional import MissingExtraError
from ..report.fit_result import FitResult
from ..report.report_over_time import without_modes
from .notices import noticed
from .screen import Screen, silence
from .stopping import Stopping

Json = Annotated[bool, typer.Option("--json", help="One JSON object on stdout; everything else goes to stderr.")]

_SHOWN = 2000  # characters of what was wrong


class Code(IntEnum):
    """Exit codes."""

    DONE = 0
    DEFECT = 1
    BAD_INPUT = 2
    NOT_IDENTIFIABLE = 3
    NOT_CONVERGED = 4
    CHECK_FAILED = 5
    INTERRUPTED = 130  # by Ctrl-C
    TERMINATED = 143  # by SIGTERM


@dataclass(frozen=True)
class Outcome:
    """What a command found."""

    data: Mapping[str, Any] = field(default_factory=dict)
    code: Code = Code.DONE


def run(command: Callable[[Console], Outcome], as_json: bool) -> None:
    """Run a command, report its errors, and exit with its code. SIGTERM stops it as Ctrl-C does.

    With `as_json` stdout holds one JSON object and nothing else; everything for people goes to stderr.
    """
    console = Screen(stderr=as_json)
    stopping = Stopping()
    try:
        with noting(), stopping, noticed(_warn):
            outcome = command(console)
    except (InputError, MissingExtraError) as error:
        outcome = _failed(error, Code.BAD_INPUT)
    except SheetbendError as error:
        outcome = _failed(error, Code.NOT_CONVERGED)
    except KeyboardInterrupt:
        _complain("interrupted", [])
        outcome = Outcome({"error": {"message": "interrupted"}}, Code.INTERRUPTED)
    except Exception as error:  # no bad input, which ends in errors of the package where it is read
        traceback.print_exc()
        outcome = Outcome({"error": {"message": f"a defect of sheetbend: {error!r}"[:_SHOWN]}}, Code.DEFECT)
    if outcome.code is Code.INTERRUPTED and stopping.terminated:
        outcome = replace(outcome, code=Code.TERMINATED)
    if as_json:
        outcome = _print_json(outcome)
    raise typer.Exit(int(outcome.code))


def _print_json(outcome: Outcome) -> Outcome:
    """Print an outcome as JSON and return it; if stdout is full, the outcome is that of bad input."""
    try:
        print(json.dumps(strict({**outcome.data, "exit_code": int(outcome.code)}), allow_nan=False), flush=True)
    except OSError as error:
        silence(sys.stdout)
        if not isinstance(error, BrokenPipeError):
            _complain(f"stdout cannot be written: {error.strerror}", [])
            return replace(outcome, code=Code.BAD_INPUT)
    return outcome


def code_of(results: Sequence[FitResult], strictly: bool) -> Code:
    """The exit code of fits: whether all ended by themselves, all converged to sound verdicts, and each found at least
    one parameter that is identifiable (strictly: found all so)."""
    if any(result.interrupted for result in results):
        return Code.INTERRUPTED
    if not all(result.converged and result.sound for result in results):
        return Code.NOT_CONVERGED
    unknown = [[e.verdict == "not identifiable" for e in without_modes(result).estimates] for result in results]
    return Code.NOT_IDENTIFIABLE if any(any(u) if strictly else all(u) for u in unknown) else Code.DONE


def strict(value: Any) -> Any:
    """Plain JSON values: no NaN and no infinity, None in their place."""
    if isinstance(value, Mapping):
        return {key: strict(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [strict(part) for part in value]
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    return value


def _failed(error: SheetbendError, code: Code) -> Outcome:
    more = list(getattr(error, "__notes__", []))
    _complain(str(error), more)
    told: dict[str, Any] = {"message": str(error)}
    if isinstance(error, InputError):
        told |= {"field": error.field, "problem": error.problem, "got": repr(error.got)[:_SHOWN], "fix": error.fix}
    return Outcome({"error": told | ({"more": more} if more else {})}, code)


def _warn(message: str) -> None:
    Screen(stderr=True).print(Text.assemble(("warning ", "bold yellow"), message), soft_wrap=True)


def _complain(message: str, more: list[str]) -> None:
    console = Screen(stderr=True)
    console.print(Text.assemble(("error ", "bold red"), message), soft_wrap=True)
    for other in more:
        console.print(Text.assemble(("  and ", "red"), other), soft_wrap=True)
