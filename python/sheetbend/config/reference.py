"""The tables of docs/configuration.md and docs/fabric.md, made from the schema: `python -m sheetbend.config.reference
docs/configuration.md` renews them."""

from __future__ import annotations

import json
import sys
import types
import typing
from pathlib import Path
from typing import Any

from pydantic.fields import FieldInfo

from . import (
    body_schema,
    cloth_schema,
    contact_schema,
    fabric_schema,
    gripped_schema,
    rope_schema,
    scene_schema,
    schema,
    solid_schema,
    solver_schema,
)
from .section import AXES, NAME, REFERENCE, Section

HEADERS: dict[str, type[Section]] = {
    "[experiment]": schema.ExperimentSection,
    "[solver]": solver_schema.SolverSection,
    "[scene]": scene_schema.SceneSection,
    "[[scene.rope]]": rope_schema.Rope,
    "[[scene.rod]]": rope_schema.Rod,
    "[[scene.rope.grip]], [[scene.rod.grip]], [[recording.here.NAME.grip]]": rope_schema.RopeGrip,
    "[[scene.cloth]]": cloth_schema.Cloth,
    "[scene.cloth.mesh]": cloth_schema.ClothMesh,
    "[scene.cloth.law]": cloth_schema.ClothLaw,
    "[scene.cloth.volume]": cloth_schema.ClothVolume,
    "[[scene.cloth.set]]": cloth_schema.VertexSet,
    "[[scene.cloth.grip]]": cloth_schema.Grip,
    "[[scene.cloth.bar]]": cloth_schema.Bar,
    "[scene.cloth.grid], [recording.grids.NAME]": cloth_schema.MarkerGrid,
    "[[scene.solid]]": solid_schema.SolidSection,
    "[[scene.solid.grip]]": solid_schema.SolidGrip,
    "[[scene.solid.mean]]": solid_schema.SolidMean,
    "[[scene.solid.set]]": solid_schema.SolidSet,
    "[[scene.particles]]": scene_schema.Particles,
    "[[scene.pendulum]]": scene_schema.Pendulum,
    "[[scene.arm]]": scene_schema.Arm,
    "[[scene.body]]": body_schema.BodySection,
    "[[scene.joint]]": body_schema.JointSection,
    "[scene.joint.servo], [scene.joint.torque]": body_schema.Knots,
    "[[scene.constraints]]": scene_schema.Constraints,
    "[[scene.point_mass]]": scene_schema.PointMass,
    "[[scene.force]]": scene_schema.Force,
    "[[scene.unknown_force]]": scene_schema.UnknownForce,
    "[scene.wind]": scene_schema.Wind,
    "[scene.unknown_wind]": scene_schema.UnknownWind,
    "[[scene.tool]]": scene_schema.Tool,
    "[[scene.drive]]": scene_schema.Drive,
    "[[scene.collider]]": contact_schema.ColliderSection,
    "[[scene.contact]]": contact_schema.ContactSection,
    "[scene.self_contact]": contact_schema.SelfContactSection,
    "[scene.collisions]": contact_schema.CollisionsSection,
    "[scene.quantities.NAME]": scene_schema.ExtraQuantity,
    "[[recording]]": schema.RecordingSection,
    "[[recording.force]]": schema.ForceSection,
    "[recording.here.NAME]": rope_schema.RopeHere,
    "[[marker]], [[recording.marker]]": schema.Marker,
    "[parameters.NAME]": schema.ParameterSection,
    "[given.NAME]": schema.GivenSection,
    "[smooth.NAME]": schema.SmoothSection,
    "[fit]": schema.FitSection,
    "[output]": schema.OutputSection,
}
ROPE_HEADERS: dict[str, type[Section]] = {
    "[experiment]": schema.ExperimentSection,
    "[[gripped_rope]]": gripped_schema.GrippedRopeSection,
    "[fit]": gripped_schema.GrippedFitSection,
    "[output]": schema.OutputSection,
}
FABRIC_HEADERS: dict[str, type[Section]] = {
    "[fabric]": fabric_schema.FabricSection,
    "[weight]": fabric_schema.Weight,
    "[[pull]]": fabric_schema.Pull,
    "[[shear]]": fabric_schema.ShearTest,
    "[[bending]]": fabric_schema.BendingTest,
    "[drape]": fabric_schema.DrapeTest,
    "[given]": fabric_schema.Given,
}
START, END = "<!-- tables: start -->", "<!-- tables: end -->"


def tables() -> str:
    """Markdown: a heading, what the section is, and a table of its keys, for every section."""
    with_scene = [_section(header, model) for header, model in HEADERS.items()]
    ropes = [_section(header, model) for header, model in ROPE_HEADERS.items() if HEADERS.get(header) is not model]
    about = "`[experiment]` and `[output]` are as above. The others:"
    return "\n".join([*with_scene, f"## All keys of ropes between grips\n\n{about}\n", *ropes])


def fabric_tables() -> str:
    """The same of the files of `sheetbend fabric`."""
    return "\n".join(_section(header, model) for header, model in FABRIC_HEADERS.items())


def renewed(text: str, made: str | None = None) -> str:
    """A document with the part between the markers replaced by tables, by default `tables()`."""
    before, rest = text.split(START)
    _, after = rest.split(END)
    return f"{before}{START}\n\n{tables() if made is None else made}\n{END}{after}"


def _section(header: str, model: type[Section]) -> str:
    about = " ".join((model.__doc__ or "").split()).removeprefix(f"{header}: ")
    about = about[0].upper() + about[1:]
    lines = [
        f"### `{header}`",
        "",
        about,
        "",
        "| key | type | default | unit | meaning |",
        "| --- | --- | --- | --- | --- |",
    ]
    lines += [_row(name, field) for name, field in model.model_fields.items()]
    return "\n".join([*lines, ""])


def _row(name: str, field: FieldInfo) -> str:
    extra = field.json_schema_extra
    unit = str(extra.get("unit", "")) if isinstance(extra, dict) else ""
    cells = (f"`{name}`", _type(field.annotation, field.metadata), _default(field), unit, field.description or "")
    return "| " + " | ".join(cell.replace("|", "\\|").replace("<", "\\<") for cell in cells) + " |"


def _default(field: FieldInfo) -> str:
    if field.is_required():
        return "**required**"
    value: Any = field.get_default(call_default_factory=True, validated_data={})
    return "" if value is None or value == {} or value == "" else f"`{json.dumps(value)}`"


_PLAIN = {float: "number", int: "whole number", str: "text", bool: "true or false"}


def _type(annotation: Any, metadata: list[Any]) -> str:
    origin, parts = typing.get_origin(annotation), typing.get_args(annotation)
    if origin is typing.Annotated:
        return _type(parts[0], list(parts[1:]))
    if origin in (typing.Union, types.UnionType):
        return " or ".join(_type(part, []) for part in parts if part is not types.NoneType)
    if origin is typing.Literal:
        return ", ".join(f"`{json.dumps(part)}`" for part in parts)
    if origin is list and _count(metadata):
        return f"{_count(metadata)} numbers"
    if origin is list:
        return "list of tables" if _is_section(parts[0]) else f"list of {_type(parts[0], [])}"
    if origin is dict:
        return "tables by name" if _is_section(parts[1]) else f"{_type(parts[1], [])} by name"
    if _is_section(annotation):
        return "table"
    if annotation is str:
        pattern = _pattern(metadata)
        return {NAME: "name", REFERENCE: "particle", AXES: "axes"}.get(pattern, "text")
    return _PLAIN.get(annotation, str(annotation))


def _count(metadata: list[Any]) -> int:
    """The number of entries where it is fixed."""
    inner = [part for one in metadata for part in [one, *getattr(one, "metadata", [])]]
    least = {part.min_length for part in inner if hasattr(part, "min_length")}
    most = {part.max_length for part in inner if hasattr(part, "max_length")}
    return least.pop() if least and least == most else 0


def _is_section(annotation: Any) -> bool:
    return isinstance(annotation, type) and issubclass(annotation, Section)


def _pattern(metadata: list[Any]) -> str:
    for part in metadata:
        for inner in [part, *getattr(part, "metadata", [])]:
            if getattr(inner, "pattern", None):
                return str(inner.pattern)
    return ""


if __name__ == "__main__":
    document = Path(sys.argv[1])
    of_fabric = fabric_tables() if document.name == "fabric.md" else None
    document.write_text(renewed(document.read_text(encoding="utf-8"), of_fabric), encoding="utf-8")
