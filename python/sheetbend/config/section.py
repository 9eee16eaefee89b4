"""The base of all configuration sections, and the types of their keys."""

from __future__ import annotations

import copy
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

Finite = Annotated[float, Field(allow_inf_nan=False)]
Vector = Annotated[list[Finite], Field(min_length=3, max_length=3)]
Window = Annotated[list[Finite], Field(min_length=2, max_length=2)]
Name = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_.-]*$")]


class Section(BaseModel):
    """A table of the file: no unknown keys, no text where a number belongs, nothing infinite."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)


def key(default: Any, about: str, unit: str = "", **limits: Any) -> Any:
    """A key with its default (`...` = required), what it means, and its unit."""
    if isinstance(default, list | dict):
        return Field(default_factory=lambda: copy.copy(default), description=about, json_schema_extra={"unit": unit}, **limits)
    return Field(default, description=about, json_schema_extra={"unit": unit}, **limits)
