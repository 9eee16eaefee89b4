"""From pydantic's and the package's errors to `ConfigError`: the path of the key, what it got, how to put it right."""

from __future__ import annotations

import difflib
import re
import types
import typing
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from ..errors import ConfigError, InputError
from .other_names import meant
from .section import AXES, NAME, REFERENCE

Location = Sequence[str | int]
T = TypeVar("T")


def from_validation(error: ValidationError, model: type[BaseModel]) -> ConfigError:
    """The first problem as an error; the others are its notes. Unknown keys come before missing ones, of which they may
    be other names."""
    by_path: dict[str, list[Mapping[str, Any]]] = {}
    for detail in error.errors():
        by_path.setdefault(dotted(_keys(detail["loc"], model)), []).append(dict(detail))
    # Every branch of a union complains; the one whose type fits knows more than the others.
    first, *others = (
        one(min(details, key=lambda d: d["type"].endswith("_type")), model)
        for details in sorted(by_path.values(), key=lambda details: details[0]["type"] != "extra_forbidden")
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
        return _unknown(path, got, model)
    if kind == "missing":
        return ConfigError(field, "is missing", None, f"add {path[-1]} to {_table(path[:-1])}")
    if kind == "value_error":
        problem, _, fix = str(limits["error"]).partition("|")
        return ConfigError(field, problem, _short(got), fix or "see docs/configuration.md")
    if kind == "string_pattern_mismatch":
        form, blank = _FORMS.get(limits["pattern"], f"match {limits['pattern']}"), " " in got.strip()
        fix = f'write "{"_".join(got.split())}": {form}' if limits["pattern"] == NAME and blank else form
        return ConfigError(field, "has the wrong form", got, fix)
    wanted = _WANTED.get(kind, "")
    if kind in _LIMITS:
        word, limit = _LIMITS[kind]
        return ConfigError(field, f"must be {word} {limits[limit]:g}", got, f"give a number {word} {limits[limit]:g}")
    numbers = _numbers(path, model) if kind in ("too_short", "too_long", "list_type") else None
    if numbers is not None:
        return ConfigError(field, *_of_numbers(path, got, *numbers))
    if kind in ("too_short", "too_long"):
        wanted = f"at least {limits['min_length']}" if kind == "too_short" else f"at most {limits['max_length']}"
        return ConfigError(field, f"has {limits['actual_length']} entries", got, f"give {wanted}")
    if kind == "literal_error":
        return ConfigError(field, "is not one of the choices", got, f"use {limits['expected']}")
    if kind == "list_type" and isinstance(got, Mapping) and _holds_tables(path, model):
        header = _table(path)[1:-1]
        return ConfigError(field, "must be a list of tables", _short(got), f"write [[{header}]] in place of [{header}]")
    if kind == "list_type" and isinstance(got, int | float | str) and not isinstance(got, bool):
        return ConfigError(field, "must be a list in [brackets]", got, f"write {path[-1]} = [{_toml(got)}]")
    if kind == "string_type" and isinstance(got, int | float):
        told = re.search(r'"[^"]*\d[^"]*"', _described(path, model))
        fix = 'put it in "quotes"' + (f", with its unit: {told[0]}" if told else "")
        return ConfigError(field, f"must be {wanted}", got, fix)
    if kind in ("float_type", "int_type") and isinstance(got, str):
        quotient = _quotient(got)
        fix = f"write {got.strip()} without quotes" if _is_number(got) else f"write {wanted}, without quotes and unit"
        fix = fix if quotient is None else f"write {quotient:.6g}: TOML has no fractions"
        return ConfigError(field, f"must be {wanted}", got, fix)
    return ConfigError(
        field,
        f"must be {wanted}" if wanted else detail["msg"],
        got,
        f"write {wanted}" if wanted else "see docs/configuration.md",
    )


def _of_numbers(path: Location, got: Any, count: int, example: str) -> tuple[str, Any, str]:
    """Problem, value and fix of what should be a list of so many numbers."""
    wanted = f"must be {count} numbers in [brackets]"
    if path[-1] != "gravity":
        return wanted, got, f"write {path[-1]} = {example}"
    size = f"{abs(got):g}" if isinstance(got, int | float) else "9.81"  # of which the sign and the axis are not told
    return wanted, got, f"write gravity = [0, 0, -{size}] if z points up, or [0, -{size}, 0] if y does, in m/s^2"


def _toml(got: float | str) -> str:
    return f'"{got}"' if isinstance(got, str) else f"{got:g}"


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _quotient(text: str) -> float | None:
    """Of a text such as "1/480"."""
    parts = text.split("/")
    if len(parts) != 2 or not all(_is_number(part) for part in parts) or float(parts[1]) == 0.0:
        return None
    return float(parts[0]) / float(parts[1])


_FORMS = {
    NAME: "use letters, digits, _ . and -, a letter first",
    REFERENCE: "write such as 'rope:0', 'rope:end', or the name of a single particle",
    AXES: "name some of x, y, z, such as 'xz'",
}
_EXAMPLES = {2: "[first, second]", 3: "[x, y, z]", 4: "[x, y, z, w]"}
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


def of_name(path: str, kind: str, name: str | None, known: Mapping[str, T], none: str = "none") -> T:
    """What has a name, such as a "rope of the scene".

    Args:
        none: what to do where nothing is known.

    Raises:
        ConfigError: nothing has this name.
    """
    if name is None or name not in known:
        raise ConfigError(path, f"is not a {kind}", name, f"name one of: {', '.join(known) or none}")
    return known[name]


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


def _unknown(path: list[str | int], got: Any, model: type[BaseModel]) -> ConfigError:
    known = _fields_at(path[:-1], model)
    name, keys = str(path[-1]), f"The keys of {_table(path[:-1])} are: "
    other = _elsewhere(path, got, known, model) or meant(name, known)
    if other is not None:
        return ConfigError(dotted(path), "is not a known key", name, f"{other} {keys}{', '.join(known)}")
    near = difflib.get_close_matches(name, known, n=1, cutoff=0.6) or [k for k in known if k.lower() == name.lower()]
    fix = f"did you mean '{near[0]}'? {keys}{', '.join(known)}" if near else f"use some of: {', '.join(known)}"
    return ConfigError(dotted(path), "is not a known key", name, fix)


def _elsewhere(path: list[str | int], got: Any, known: Sequence[str], model: type[BaseModel]) -> str | None:
    """How to write a table whose name lacks a part, or has a point too many; None where it is not such a one."""
    name = str(path[-1])
    if len(path) == 3 and path[0] == "parameters" and isinstance(got, Mapping):
        return f"write [parameters.{path[1]}_{name}]."
    inside = _fields_at(["scene"], model) if len(path) == 1 and "scene" in known else []
    return f"write [[scene.{name}]]." if name in inside and name not in known else None


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


def _numbers(path: Location, model: type[BaseModel]) -> tuple[int, str] | None:
    """How many numbers the list of a key must have, with an example; None where that is free."""
    owner = _owner(path, model)
    if owner is None:
        return None
    shape = owner.model_json_schema()["properties"].get(path[-1], {})
    kinds = [s for s in (shape, *shape.get("anyOf", ())) if s.get("items", {}).get("type") == "number"]
    lengths = {s.get("minItems") for s in kinds if s.get("minItems") == s.get("maxItems", -1)}
    if len(lengths) != 1 or not lengths <= set(_EXAMPLES):
        return None
    told = re.match(r"\[[^\]]+\]", _described(path, model))
    count = lengths.pop()
    return count, told[0] if told else _EXAMPLES[count]


def _owner(path: Location, model: type[BaseModel]) -> type[BaseModel] | None:
    """The section that a key belongs to; None of an entry of a list."""
    if not path or isinstance(path[-1], int):
        return None
    owners = _options(_annotation(path[:-1], model))
    return next((o for o in owners if isinstance(o, type) and issubclass(o, BaseModel)), None)


def _described(path: Location, model: type[BaseModel]) -> str:
    """What a key means."""
    owner = _owner(path, model)
    field = None if owner is None else owner.model_fields.get(str(path[-1]))
    return "" if field is None else field.description or ""


def _short(got: Any) -> Any:
    return sorted(got) if isinstance(got, Mapping) else got
