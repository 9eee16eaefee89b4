"""JSON schemas: of configurations, for editors, and of fit.json, for programs that read it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from pydantic import TypeAdapter

from ..report.fit_result import FORMAT, FitResult
from .cloth_schema import FABRIC
from .fabric_schema import FabricConfig
from .gripped_schema import GrippedConfig
from .schema import Config

DIALECT = "https://json-schema.org/draft/2020-12/schema"


def scene_schema() -> dict[str, Any]:
    """Of a configuration with a scene."""
    found = Config.model_json_schema()
    cloth = found["$defs"]["Cloth"]  # its numbers may be those of another cloth, or of a file
    own = [key for key in cloth["required"] if key in FABRIC]
    cloth["required"] = [key for key in cloth["required"] if key not in FABRIC]
    cloth["anyOf"] = [{"required": keys} for keys in (own, ["fabric"], ["fabric_file"])]
    return {"$schema": DIALECT, **found, "title": "sheetbend configuration"}


def ropes_schema() -> dict[str, Any]:
    """Of a configuration of ropes between grips."""
    return {"$schema": DIALECT, **GrippedConfig.model_json_schema(), "title": "sheetbend ropes between grips"}


def fabric_schema() -> dict[str, Any]:
    """Of a file of `sheetbend fabric`."""
    return {"$schema": DIALECT, **FabricConfig.model_json_schema(), "title": "sheetbend tests of a fabric"}


def fit_schema() -> dict[str, Any]:
    """Of fit.json (`FitResult.to_dict`): parameters and recordings are objects by name, an interval is a pair."""
    whole = TypeAdapter(FitResult).json_schema()
    parts, fields = whole["$defs"], whole["properties"]
    end = {"anyOf": [{"type": "number"}, {"type": "null"}]}
    pair = {"type": "array", "prefixItems": [end, end], "minItems": 2, "maxItems": 2}
    parts["Estimate"] = _without(parts["Estimate"], ("name", "lower", "upper"), interval=pair)
    parts["RecordingFit"] = _without(parts["RecordingFit"], ("name",))
    named = {
        "format": {"const": FORMAT},
        "parameters": {"type": "object", "additionalProperties": {"$ref": "#/$defs/Estimate"}},
        "recordings": {"type": "object", "additionalProperties": {"$ref": "#/$defs/RecordingFit"}},
        "held_out": {"type": "object", "additionalProperties": end},
        "baseline": {"type": "object", "additionalProperties": end},
        "baseline_is": fields["baseline"],
    }
    kept = {name: part for name, part in fields.items() if name not in ("estimates", "recordings", "baseline")}
    return {
        "$schema": DIALECT,
        "title": "sheetbend fit.json",
        "type": "object",
        "properties": {**named, **kept},
        "required": ["format", "parameters", "recordings", "cost", "rows", "converged"],
        "$defs": parts,
    }


SCHEMAS: dict[str, Callable[[], dict[str, Any]]] = {
    "scene": scene_schema,
    "ropes": ropes_schema,
    "fabric": fabric_schema,
    "fit": fit_schema,
}


def _without(part: dict[str, Any], names: tuple[str, ...], **more: Any) -> dict[str, Any]:
    properties = {k: v for k, v in part["properties"].items() if k not in names} | more
    required = [k for k in part.get("required", ()) if k not in names] + list(more)
    return part | {"properties": properties, "required": required}
