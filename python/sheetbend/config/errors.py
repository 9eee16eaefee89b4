"""From pydantic's and the package's errors to `ConfigError`: the path of the key, what it got, how to put it right."""

from __future__ import annotations

import difflib
import types
import typing
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

from pydantic import BaseModel, ValidationError

from ..errors import ConfigError, InputError
from .section import AXES, NAME, REFERENCE

Location = Sequence[str | int]


def from_validation(error: ValidationError, model: type[BaseModel]) -> ConfigError:
    """The first problem as an error; the others are its notes."""
    by_path: dict[str, list[Mapping[str, Any]]] = {}
    for detail in error.errors():
        by_path.setdefault(dotted(_keys(detail["loc"], model)), []).append(dict(detail))
    # Every branch of a union complains; the one whose type fits knows more than the others.
    first, *others = (
        one(min(details, key=lambda d: d["type"].endswith("_type")), model) for details in by_path.values()
    )
    for other in others:
        first.add_note(str(other))
    return first


def one(detail: Mapping[str, Any], model: type[BaseModel]) -> ConfigError:
    """One pydantic error detail (`ValidationError.errors()`)."""
    path, got, kind = _keys(detail["loc"], model), detail["input"], detail["type"]
    limits = detail.get("ctx", {})
    field = dotted(path)
    if kind == "extra_forbidden":
        return _unknown(path, model)
    if kind == "missing":
        return ConfigError(field, "is missing", None, f"add {path[-1]} to {_table(path[:-1])}")
    if kind == "value_error":
        problem, _, fix = str(limits["error"]).partition("|")
        return ConfigError(field, problem, _short(got), fix or "see docs/configuration.md")
    if kind == "string_pattern_mismatch":
        return ConfigError(
            field, "has the wrong form", got, _FORMS.get(limits["pattern"], f"match {limits['pattern']}")
        )
    wanted = _WANTED.get(kind, "")
    if kind in _LIMITS:
        word, limit = _LIMITS[kind]
        return ConfigError(field, f"must be {word} {limits[limit]:g}", got, f"give a number {word} {limits[limit]:g}")
    if kind in ("too_short", "too_long"):
        wanted = f"at least {limits['min_length']}" if kind == "too_short" else f"at most {limits['max_length']}"
        return ConfigError(field, f"has {limits['actual_length']} entries", got, f"give {wanted}")
    if kind == "literal_error":
        return ConfigError(field, "is none of the choices", got, f"use {limits['expected']}")
    if kind == "list_type" and isinstance(got, Mapping) and _holds_tables(path, model):
        header = _table(path)[1:-1]
        return ConfigError(field, "must be a list of tables", _short(got), f"write [[{header}]] in place of [{header}]")
    if kind in ("float_type", "int_type") and isinstance(got, str):
        fix = f"write {got.strip()} without quotes" if _is_number(got) else f"write {wanted}, without quotes and unit"
        return ConfigError(field, f"must be {wanted}", got, fix)
    return ConfigError(
        field,
        f"must be {wanted}" if wanted else detail["msg"],
        got,
        f"write {wanted}" if wanted else "see docs/configuration.md",
    )


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


_FORMS = {
    NAME: "use letters, digits, _ . and -, a letter first",
    REFERENCE: "write such as 'rope:0', 'rope:end', or the name of a single particle",
    AXES: "name some of x, y, z, such as 'xz'",
}
_LIMITS = {
    "greater_than": ("greater than", "gt"),
    "greater_than_equal": ("at least", "ge"),
    "less_than": ("less than", "lt"),
    "less_than_equal": ("at most", "le"),
}
_WANTED = {
    "float_type": "a number",
    "int_type": "a whole number",
    "bool_type": "true or false",
    "string_type": 'a text in "quotes"',
    "list_type": "a list in [brackets]",
    "dict_type": "a table",
    "model_type": "a table",
    "model_attributes_type": "a table",
    "finite_number": "a finite number",
}


@contextmanager
def located(path: str, prefix: str = "") -> Iterator[None]:
    """Errors from inside get the dotted path of the table that they come from; `prefix` is the group's name, which
    they start with."""
    try:
        yield
    except ConfigError:
        raise
    except InputError as error:
        inner = error.field.removeprefix(f"{prefix}.") if prefix else error.field
        raise ConfigError(path if inner == path else f"{path}.{inner}", error.problem, error.got, error.fix) from error


def dotted(path: Location) -> str:
    """scene.rope[0].EI"""
    text = ""
    for part in path:
        text += f"[{part}]" if isinstance(part, int) else f".{part}" if text else part
    return text


def _table(path: Location) -> str:
    """The table's header as it stands in the file."""
    if not path:
        return "the file"
    header = ".".join(part for part in path if isinstance(part, str))
    return f"[[{header}]]" if isinstance(path[-1], int) else f"[{header}]"


def _keys(location: Location, model: type[BaseModel]) -> list[str | int]:
    """The location without the tags that pydantic adds for the branches of a union."""
    kept: list[str | int] = []
    here: Any = model
    for part in location:
        options = list(_options(here))
        if isinstance(part, int):
            here = next((typing.get_args(o)[0] for o in options if typing.get_origin(o) is list), None)
        else:
            models = [o for o in options if isinstance(o, type) and issubclass(o, BaseModel)]
            tables = [o for o in options if typing.get_origin(o) is dict]
            if models and part in models[0].model_fields:
                here = models[0].model_fields[part].annotation
            elif tables:
                here = typing.get_args(tables[0])[1]
            elif models:
                here = None  # an unknown key
            else:
                continue  # a branch of a union
        kept.append(part)
    return kept


def _options(annotation: Any) -> list[Any]:
    """The branches of a union, without Annotated."""
    if typing.get_origin(annotation) is typing.Annotated:
        return _options(typing.get_args(annotation)[0])
    if typing.get_origin(annotation) in (typing.Union, types.UnionType):
        return [o for a in typing.get_args(annotation) for o in _options(a)]
    return [annotation]


def _unknown(path: list[str | int], model: type[BaseModel]) -> ConfigError:
    known = _fields_at(path[:-1], model)
    name = str(path[-1])
    near = difflib.get_close_matches(name, known, n=1, cutoff=0.6) or [k for k in known if k.lower() == name.lower()]
    fix = (
        f"did you mean '{near[0]}'? The keys of {_table(path[:-1])} are: {', '.join(known)}"
        if near
        else f"use some of: {', '.join(known)}"
    )
    return ConfigError(dotted(path), "is no known key", name, fix)


def _fields_at(path: Location, model: type[BaseModel]) -> list[str]:
    here = _annotation(path, model)
    return list(next(o for o in _options(here) if isinstance(o, type) and issubclass(o, BaseModel)).model_fields)


def _holds_tables(path: Location, model: type[BaseModel]) -> bool:
    """Whether a key holds a list of tables."""
    lists = [typing.get_args(o)[0] for o in _options(_annotation(path, model)) if typing.get_origin(o) is list]
    return any(isinstance(o, type) and issubclass(o, BaseModel) for item in lists for o in _options(item))


def _annotation(path: Location, model: type[BaseModel]) -> Any:
    """The type of a key."""
    here: Any = model
    for part in path:
        options = _options(here)
        if isinstance(part, int):
            here = next(typing.get_args(o)[0] for o in options if typing.get_origin(o) is list)
            continue
        models = [o for o in options if isinstance(o, type) and issubclass(o, BaseModel)]
        here = (
            models[0].model_fields[part].annotation
            if models
            else typing.get_args(next(o for o in options if typing.get_origin(o) is dict))[1]
        )
    return here


def _short(got: Any) -> Any:
    return sorted(got) if isinstance(got, Mapping) else got
