"""The base of all configuration sections, and the types of their keys."""

from __future__ import annotations

import copy
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from ..files.names import flaw

Finite = Annotated[float, Field(allow_inf_nan=False)]
Vector = Annotated[list[Finite], Field(min_length=3, max_length=3)]
Line = Annotated[list[Vector], Field(min_length=2, max_length=2)]
Counts = Annotated[list[Annotated[int, Field(ge=1, le=1000)]], Field(min_length=2, max_length=2)]
Pair = Annotated[list[Finite], Field(min_length=2, max_length=2)]
MOST_SEGMENTS, MOST_CELLS = 20_000, 2_000
"""Of a rope, and of a cloth along one direction: more is a slip of the pen, which must not take all memory."""
NAME, REFERENCE, AXES = r"^[A-Za-z][A-Za-z0-9_.-]*$", r"^[^:\s]+(:\S+)?$", "^[xyz]{1,3}$"


def _file_name(name: str) -> str:
    found = flaw(name)
    if found is not None:
        raise ValueError("|".join(found))
    return name


Name = Annotated[str, Field(pattern=NAME), AfterValidator(_file_name)]
"""Names results, and the files that are written of them."""
Reference = Annotated[str, Field(pattern=REFERENCE)]
"""A particle: "NAME:INDEX" (negative ones count from the end), "NAME:start" and "NAME:end" of a rope, "NAME:pivot" and
"NAME:end" of an arm or pendulum, "NAME:SET:INDEX" of a cloth (its mesh's corners are "NAME:corners:0" to
"NAME:corners:3"), "NAME" of a single particle."""


def _of_some_length(quaternion: list[float]) -> list[float]:
    if not any(quaternion):
        raise ValueError("has no length|give (x, y, z, w), such as [0, 0, 0, 1]")
    return quaternion


Quaternion = Annotated[list[Finite], Field(min_length=4, max_length=4), AfterValidator(_of_some_length)]


def _ascending(pair: list[float]) -> list[float]:
    if not pair[0] < pair[1]:
        raise ValueError("must ascend|give the smaller number first")
    return pair


Window = Annotated[Pair, AfterValidator(_ascending)]


class Section(BaseModel):
    """A table of the file: no unknown keys, no text where a number belongs, nothing infinite."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)


def key(default: Any, about: str, unit: str = "", **limits: Any) -> Any:
    """A key with its default (`...` = required), what it means, and its unit."""
    if isinstance(default, list | dict):
        return Field(
            default_factory=lambda: copy.copy(default), description=about, json_schema_extra={"unit": unit}, **limits
        )
    return Field(default, description=about, json_schema_extra={"unit": unit}, **limits)
