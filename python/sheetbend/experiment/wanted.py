"""The parameters of a fit, completed from what a user wrote and from the scenes of its experiments."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from ..arrays.checks import is_several
from ..errors import InputError, choices
from ..quantities.parameters import Parameter, Parameters
from ..quantities.quantities import Quantity
from .experiment import Experiment

ParameterLike = Parameter | Mapping[str, Any] | None


def quantities_of(experiments: Sequence[Experiment]) -> dict[str, Quantity]:
    """Every named quantity of the experiments' scenes, the first scene's value first."""
    found: dict[str, Quantity] = {}
    for e in experiments:
        for name, quantity in e.scene.quantities.items():
            found.setdefault(name, quantity)
    return found


def as_parameters(
    wanted: Mapping[str, ParameterLike] | Iterable[str | Parameter], experiments: Sequence[Experiment]
) -> Parameters:
    """Complete what a user wrote: initial value, unit, log scale and natural scale come from the scenes' quantities.

    Args:
        wanted: names, `Parameter`s, or a mapping from name to `Parameter`, to a mapping of its fields, or to None.

    Raises:
        InputError: a name that no scene has; the message lists the known ones.
    """
    if isinstance(wanted, str):
        raise InputError("parameters", "must be a list of names", wanted, f"write ['{wanted}']")
    if not is_several(wanted):
        raise InputError("parameters", "must be a list of names", wanted, "write ['rope_EI']")
    known = quantities_of(experiments)
    each = ((p.name, p) if isinstance(p, Parameter) else (p, None) for p in wanted)
    items = wanted.items() if isinstance(wanted, Mapping) else each
    complete = []
    for name, given in items:
        if not isinstance(name, str) or name not in known:
            raise InputError("parameters", "name no quantity of the scenes", name, choices(name, known))
        if isinstance(given, Parameter):
            complete.append(given)
            continue
        if not isinstance(given, Mapping | None):
            fix = "give such as {'initial': 1e-3, 'lower': 1e-5, 'upper': 1.0}"
            raise InputError(f"parameters.{name}", "must be a mapping of the fields of Parameter", given, fix)
        fields: dict[str, Any] = dict(given or {})
        unknown = set(fields) - set(Parameter.__dataclass_fields__)
        if unknown:
            fix = f"use: {', '.join(Parameter.__dataclass_fields__)}"
            raise InputError(f"parameters.{name}", "has unknown fields", sorted(unknown), fix)
        q = known[name]
        if "tied_to" not in fields and not fields.get("private"):
            fields.setdefault("initial", q.value)
        defaults: dict[str, Any] = {"unit": q.unit, "log": q.positive, "scale": q.scale}
        if q.limits is not None and "tied_to" not in fields:
            defaults |= {"lower": q.limits[0], "upper": q.limits[1]}
        merged = defaults | fields
        if q.positive and not merged["log"]:
            merged.setdefault("lower", 0.0)
        complete.append(Parameter(name=name, **merged))
    return Parameters(complete)
