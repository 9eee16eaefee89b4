"""Errors in the spelling of the command line: an option where Python has an argument."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager

from ..errors import InputError

_ARGUMENT = re.compile(r"\b(\w+)=(?:\{'(\w+)': \.\.\.\}|\{\.\.\.\}|(?=\W|$))")


@contextmanager
def options(**names: str) -> Iterator[None]:
    """Name options in errors that are raised inside, such as `--column load=...` for `columns={'load': ...}`.

    Args:
        names: options by the argument that they give.
    """
    try:
        yield
    except InputError as error:
        fix = _ARGUMENT.sub(lambda found: _option(found, names), error.fix)
        raise type(error)(names.get(error.field, error.field), error.problem, error.got, fix) from error


def _option(found: re.Match[str], names: dict[str, str]) -> str:
    option = names.get(found[1])
    if option is None:
        return found[0]
    return f"{option} {found[2]}=..." if found[2] else option
