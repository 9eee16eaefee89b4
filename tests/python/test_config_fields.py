"""Every key of every section of a configuration, taken from the schema: wrong type, missing, not finite, beyond its
limit, misspelled."""

from __future__ import annotations

import copy
import math
import re
import types
import typing
from pathlib import Path
from typing import Any

import pytest
import sheetbend as sb
import tomli_w
from sheetbend.config import parse_any
from sheetbend.config.reference import HEADERS, ROPE_HEADERS
from sheetbend.config.section import Finite

WHOLE: dict[str, Any] = {
    "experiment": {"name": "all"},
    "solver": {},
    "scene": {
        "rope": [{"density": 0.05, "grip": [{"at": "start", "markers": ["m0"]}]}],
        "rod": [
            {
                "length": 1.0,
                "density": 0.05,
                "EI": 1e-3,
                "GJ": 1e-3,
                "grip": [{"at": "start", "markers": ["m0"]}],
            }
        ],
        "cloth": [
            {
                "density": 0.1,
                "warp": 100.0,
                "shear": 10.0,
                "air_normal": 0.6,
                "volume": {},
                "mesh": {"kind": "grid", "width": 0.3, "height": 0.3, "nx": 3, "ny": 3},
                "law": {"kind": "exponential", "warp": 10.0, "weft": 10.0, "shear": 5.0},
                "set": [{"name": "clips", "points": [[0, 0, 0]]}],
                "grip": [{"set": "left", "markers": ["m0"]}],
                "bar": [{"set": "left", "marker": "m0", "direction": [0, 1, 0]}],
                "shape": "recording",
                "grid": {"first": [0, 0], "last": [0.1, 0.1], "counts": [2, 2]},
            }
        ],
        "solid": [
            {
                "size": [0.1, 0.1, 0.1],
                "cells": [1, 1, 1],
                "density": 1e3,
                "E": 1e5,
                "poisson": 0.3,
                "law": "neo_hookean",
                "set": [{"name": "low", "lower": [0, 0, 0], "upper": [1, 1, 0]}],
                "grip": [{"set": "x_min", "body": "plug"}],
                "mean": [{"name": "tip", "set": "x_max"}],
            }
        ],
        "particles": [{"name": "a", "positions": [[0, 0, 0]]}],
        "pendulum": [{"length": 1.0}],
        "arm": [{"mass": 1.0, "first_moment": 0.1, "inertia": 0.1, "length": 0.5}],
        "constraints": [{"kind": "distance", "particles": [["a", "rope:0"]]}],
        "point_mass": [{"name": "p", "particle": "a", "mass": 1.0}],
        "force": [{"particles": ["a"], "force": [0, 0, 1]}],
        "unknown_force": [{"particles": ["a"], "scale": 0.1, "spacing": 0.1}],
        "unknown_wind": {"scale": 1.0, "spacing": 0.1},
        "wind": {"velocity": [1, 0, 0]},
        "tool": [{"name": "t"}],
        "drive": [{"particles": ["a"], "markers": ["m0"]}],
        "body": [
            {"name": "plug", "mass": 0.1, "box": [0.1, 0.1, 0.1], "capsules": [[[-0.1, 0.0, 0.0], [0.1, 0.0, 0.0]]]}
        ],
        "joint": [
            {
                "kind": "hinge",
                "name": "door",
                "lower": "plug",
                "at": [0, 0, 0],
                "axis": [0, 0, 1],
                "servo": {"times": [0.0], "values": [0.0]},
                "torque": {"times": [0.0], "values": [0.1]},
                "rotor": 1e-5,
                "friction": 1e-3,
                "slip_angle": 1e-3,
                "limits": [-1.0, 1.0],
                "limit_stiffness": 10.0,
                "limit_damping": 0.1,
                "limit_depth": 0.01,
                "tilt_stiffness": 30.0,
                "tilt_damping": 0.01,
            }
        ],
        "collider": [{"name": "table", "shape": "plane"}],
        "contact": [{"of": "rope", "collider": "table", "friction": 0.3}],
        "self_contact": {"of": "rope", "radius": 0.001, "friction": 0.3, "pairs": 40},
        "collisions": {"of": "a", "radius": 0.01, "restitution": 0.5},
        "quantities": {"NAME": {}},
    },
    "marker": [{"marker": "m0", "particle": "a"}],
    "recording": [
        {
            "file": "r.npz",
            "marker": [{"marker": "m0", "particle": "a"}],
            "here": {"NAME": {"grip": [{"at": "start", "markers": ["m0"]}]}},
            "grids": {"NAME": {"first": [0, 0], "last": [0.1, 0.1], "counts": [2, 2]}},
            "force": [{"file": "f.csv", "at": ["a"], "sigma": 0.1}],
        }
    ],
    "parameters": {"NAME": {}},
    "given": {"NAME": {"sd": 0.1}},
    "smooth": {"NAME": {"size": 0.3}},
    "fit": {},
    "output": {},
}
"""One table of every section, with what it must have; a configuration that parses."""

ROPES: dict[str, Any] = {
    "experiment": {"name": "all"},
    "gripped_rope": [{"name": "a", "density": 0.05, "train": "there"}],
    "fit": {},
    "output": {},
}
"""The same of ropes between grips."""

KINDS = {"scene": (WHOLE, HEADERS), "ropes": (ROPES, ROPE_HEADERS)}
SECTIONS = [
    ((kind, path.strip("[]")), model)
    for kind, (_, headers) in KINDS.items()
    for header, model in headers.items()
    for path in header.split(", ")
]
FIELDS = [
    pytest.param(place, name, id=f"{place[0]}-{place[1]}.{name}")
    for place, model in SECTIONS
    for name in model.model_fields
]
Place = tuple[str, str]  # kind of configuration, and path of a section


def section(config: dict[str, Any], path: str) -> tuple[dict[str, Any], str]:
    """The table of a section (of a list, the first), and its dotted path in errors."""
    here: Any = config
    told = ""
    for part in path.split("."):
        here, told = here[part], f"{told}.{part}" if told else part
        if isinstance(here, list):
            here, told = here[0], f"{told}[0]"
    return here, told


def refused(folder: Path, place: Place, name: str, *value: Any) -> sb.ConfigError:
    """The error about a key that is set to a value, or left out."""
    kind, path = place
    config = copy.deepcopy(KINDS[kind][0])
    table, told = section(config, path)
    table.pop(name, None)
    if value:
        table[name] = value[0]
    file = folder / "all.toml"
    file.write_text(tomli_w.dumps(config))
    with pytest.raises(sb.ConfigError) as caught:
        parse_any(file)
    error = caught.value
    assert re.match(re.escape(f"{told}.{name}") + r"(\[|\.|$)", error.field), (place, name, value, str(error))
    assert error.problem and len(error.fix) > 3 and "Fix: " in str(error)
    return error


def model_of(place: Place) -> Any:
    return dict(SECTIONS)[place]


def branches(annotation: Any) -> list[Any]:
    """The types that a key may have, without None and without their limits."""
    if typing.get_origin(annotation) is typing.Annotated:
        return branches(typing.get_args(annotation)[0])
    if typing.get_origin(annotation) in (typing.Union, types.UnionType):
        return [branch for part in typing.get_args(annotation) for branch in branches(part)]
    return [] if annotation is type(None) else [annotation]


def is_number(annotation: Any) -> bool:
    return branches(annotation) == [float]


def is_vector(annotation: Any) -> bool:
    """Whether a key is a list of numbers of a given length; all of them have two or three."""
    return [str(branch) for branch in branches(annotation)] == [str(list[Finite])]


def limits(place: Place, name: str) -> dict[str, float]:
    """gt and ge of a key that is one number."""
    field = model_of(place).model_fields[name]
    return {bound: getattr(part, bound) for part in field.metadata for bound in ("gt", "ge") if hasattr(part, bound)}


@pytest.mark.parametrize("kind", KINDS)
def test_the_whole_configuration_parses(tmp_path: Path, kind: str) -> None:
    file = tmp_path / "all.toml"
    file.write_text(tomli_w.dumps(KINDS[kind][0]))
    parse_any(file)


@pytest.mark.parametrize(("place", "name"), FIELDS)
def test_a_value_of_another_type(tmp_path: Path, place: Place, name: str) -> None:
    annotation = model_of(place).model_fields[name].annotation
    refused(tmp_path, place, name, 1.5 if typing.get_origin(annotation) is dict else {"not": ["at", "all"]})
    if is_number(annotation):
        refused(tmp_path, place, name, "1.0")
        refused(tmp_path, place, name, True)


@pytest.mark.parametrize(("place", "name"), FIELDS)
def test_missing_out_of_range_and_not_finite(tmp_path: Path, place: Place, name: str) -> None:
    field = model_of(place).model_fields[name]
    if field.is_required():
        error = refused(tmp_path, place, name)
        assert error.problem == "is missing"
    for bound, limit in limits(place, name).items():
        beyond = int(limit) - (bound == "ge")
        error = refused(tmp_path, place, name, beyond)
        assert f"{limit:g}" in error.fix
    if is_number(field.annotation):
        for value in (math.nan, math.inf, -math.inf):
            refused(tmp_path, place, name, value)
    any_length = ("times", "values", "factors", "windows")
    if is_vector(field.annotation) and name not in any_length:
        for vector in ([], [0.0], [0.0] * 4, [0.0, math.nan], [0.0, 0.0, math.inf]):
            refused(tmp_path, place, name, vector)


@pytest.mark.parametrize(("place", "name"), FIELDS)
def test_a_misspelled_key_is_guessed(tmp_path: Path, place: Place, name: str) -> None:
    error = refused(tmp_path, place, f"{name}x", 1.0)
    assert error.problem == "is not a known key" and name in error.fix
