"""Commands whose errors say what is wrong with a number: it has a unit, or a decimal comma."""

from __future__ import annotations

import re
import typing
from collections.abc import Callable
from typing import Any

from typer.core import TyperCommand
from typer.models import OptionInfo

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"


def saying_numbers(function: Callable[..., Any]) -> type[TyperCommand]:
    """Make the class of a command that refuses a text in place of a number. The error shows the text and the fix.

    Args:
        function: the function of the command, with its options as annotations.
    """
    kinds = _kinds(function)

    class Command(TyperCommand):
        def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
            for k, arg in enumerate(args):
                option, equals, value = arg.partition("=")
                given = [value] if equals else args[k + 1 : k + 2]
                if option in kinds and given and not _reads(given[0], kinds[option]):
                    ctx.fail(f"{option}: must be {_WANTED[kinds[option]]} (got {given[0]!r}). Fix: {_fix(given[0])}.")
            return super().parse_args(ctx, args)

    return Command


_WANTED: dict[type, str] = {float: "a number", int: "a whole number"}


def _kinds(function: Callable[..., Any]) -> dict[str, type]:
    """The options that take one number, by their names."""
    kinds: dict[str, type] = {}
    for name, hint in typing.get_type_hints(function, include_extras=True).items():
        annotation, *more = typing.get_args(hint) or (hint,)
        kind = next((k for k in _WANTED if k is annotation or k in typing.get_args(annotation)), None)
        option = next((info for info in more if isinstance(info, OptionInfo)), None)
        if kind is not None and option is not None:
            kinds |= dict.fromkeys(option.param_decls or (f"--{name.replace('_', '-')}",), kind)
    return kinds


def _reads(text: str, kind: type) -> bool:
    try:
        kind(text)
    except ValueError:
        return False
    return True


def _fix(text: str) -> str:
    """How to write a number that somebody wrote with a unit, or with a comma."""
    bare = text.strip().replace(",", ".", 1)
    found = re.match(_NUMBER, bare)
    if found is None:
        return "give a number"
    if found[0] == bare and bare != text:
        return f"write {bare}, with a point as decimal mark"
    return "give a whole number" if found[0] == bare else "write the number without its unit; --help names the unit"
