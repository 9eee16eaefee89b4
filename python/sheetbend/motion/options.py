"""Options: what a value may be stands beside its default, is checked here, and can be read by who lists them."""

from __future__ import annotations

import dataclasses
import inspect
import re
import types
import typing
from dataclasses import dataclass
from typing import Any

from ..arrays.checks import MOST_WHOLE, is_number
from ..errors import InputError

_KINDS = {int: "whole number", float: "number"}


@dataclass(frozen=True)
class Limits:
    """What an option may be, beside its type.

    Attributes:
        noun: what it is called in errors; "number" or "whole number" when left out.
        unit: of the value.
        above: it must be greater than this.
        least, most: it must be at least and at most these.
    """

    noun: str = ""
    unit: str = ""
    above: float | None = None
    least: float | None = None
    most: float | None = None

    @property
    def in_words(self) -> str:
        """The range, such as "greater than 0 and of at most 0.001"."""
        ends = (("greater than", self.above), ("of at least", self.least), ("of at most", self.most))
        return " and ".join(f"{word} {end:g}" for word, end in ends if end is not None)

    def hold(self, value: float) -> bool:
        """Whether a number is in the range."""
        return (
            is_number(value)
            and (self.above is None or value > self.above)
            and (self.least is None or value >= self.least)
            and (self.most is None or value <= self.most)
        )


@dataclass(frozen=True)
class Option:
    """One option as its owner declares it: a field of a dataclass.

    Attributes:
        name: of the field.
        annotation: its type: an int, a float or a Literal of texts, each perhaps with None; values of other types are
            not checked here.
        default: its value when it is left out.
        meaning: what the docstring of its owner says of it.
        limits: what it may be.
    """

    name: str
    annotation: Any
    default: Any
    meaning: str
    limits: Limits

    def check(self, owner: str, value: object) -> None:
        """Refuse a value that the option cannot take.

        Raises:
            InputError: it names `owner`.`name`.
        """
        field, branches = f"{owner}.{self.name}", _branches(self.annotation)
        if value is None and types.NoneType in branches:
            return
        choices = [c for b in branches if typing.get_origin(b) is typing.Literal for c in typing.get_args(b)]
        if choices:
            if value not in choices:
                raise InputError(field, "is unknown", value, f"use one of: {', '.join(choices)}")
            return
        kind = next((k for k in (float, int) if k in branches), None)
        if kind is None or str in branches:
            return
        number = isinstance(value, int if kind is int else int | float) and not isinstance(value, bool)
        if kind is int and number and value > MOST_WHOLE:  # type: ignore[operator]
            raise InputError(field, f"must be at most {MOST_WHOLE}", value, "give less")
        if not (number and self.limits.hold(typing.cast(float, value))):
            must = f"must be a {self.limits.noun or _KINDS[kind]} {self.limits.in_words}"
            usual = "" if self.default is None else f", such as {self.default:g}"
            unit = f" in {self.limits.unit}" if self.limits.unit else ""
            raise InputError(field, must, value, f"give a {_KINDS[kind]}{unit}{usual}")


def option(
    default: Any,
    noun: str = "",
    unit: str = "",
    *,
    above: float | None = None,
    least: float | None = None,
    most: float | None = None,
) -> Any:
    """A field of a dataclass with its default and its `Limits`."""
    return dataclasses.field(default=default, metadata={"limits": Limits(noun, unit, above, least, most)})


def options_of(owner: type) -> dict[str, Option]:
    """The options that a dataclass declares, by name and in order."""
    kinds, meanings = typing.get_type_hints(owner), meanings_of(owner)
    return {
        one.name: Option(
            one.name, kinds[one.name], one.default, meanings.get(one.name, ""), one.metadata.get("limits", Limits())
        )
        for one in dataclasses.fields(owner)
    }


def meanings_of(owner: type) -> dict[str, str]:
    """What the section "Attributes" of a class's docstring says of each attribute."""
    _, _, after = inspect.cleandoc(owner.__doc__ or "").partition("Attributes:\n")
    entries = re.split(r"\n(?=    \S)", re.split(r"\n(?=\S)", after)[0])
    pairs = (" ".join(entry.split()).partition(": ") for entry in entries)
    return {name: meaning for names, _, meaning in pairs for name in names.split(", ")}


def _branches(annotation: Any) -> tuple[Any, ...]:
    if typing.get_origin(annotation) in (typing.Union, types.UnionType):
        return typing.get_args(annotation)
    return (annotation,)
