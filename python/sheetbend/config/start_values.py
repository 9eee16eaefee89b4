"""Where the quantities of a scene start, and what a fit is told of its parameters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from ..errors import ConfigError, choices
from ..experiment.experiment import Experiment
from ..scene.scene import Scene
from . import schema
from .errors import located


def check_names(config: schema.Config, experiments: tuple[Experiment, ...]) -> None:
    """Parameters and published values name quantities of the scenes.

    Raises:
        ConfigError: one does not.
    """
    known = sorted({q for e in experiments for q in e.scene.quantities})
    for section in ("parameters", "published"):
        for name in getattr(config, section):
            base = name.partition("[")[0]
            if base not in known:
                fix = _left_out(config, base) or choices(base, known)
                raise ConfigError(f"{section}.{name}", "is not a quantity of the scenes", name, fix)


def _left_out(config: schema.Config, name: str) -> str | None:
    """What to write for a quantity that an object of the scene would have if its key were given."""
    scene = config.scene
    for table, objects in (("rope", scene.rope), ("rod", scene.rod), ("cloth", scene.cloth)):
        for one in objects:
            key = name.removeprefix(f"{one.name}_")
            if key != name and getattr(one, key, 0) is None:
                return f"give {key} in the [[scene.{table}]] named '{one.name}', where the fit starts"
    return None


def set_start_values(scene: Scene, config: schema.Config, values: Mapping[str, float], path: str) -> None:
    """Start quantities where the parameters do, and at what is known of this recording.

    Raises:
        ConfigError: a value names no quantity of the scene, or a parameter that all recordings share.
    """
    for name, value in values.items():
        if name not in scene.quantities:
            fix = _left_out(config, name) or choices(name, scene.quantities)
            raise ConfigError(f"{path}.values.{name}", "is not a quantity of the scene", name, fix)
        p = config.parameters.get(name)
        if p is not None and not p.private:
            fix = f"set parameters.{name}.initial, or make it private = true"
            raise ConfigError(f"{path}.values.{name}", "is a parameter shared by all recordings", value, fix)
    initial = {
        name: p.initial for name, p in config.parameters.items() if p.initial is not None and name in scene.quantities
    }
    for name, value in {**initial, **values}.items():
        with located(f"{path}.values" if name in values else "parameters"):
            scene.quantities[name] = replace(scene.quantities[name], value=float(value))
    for name in config.parameters:
        root, factor = _root(config, name)
        if root == name or name not in scene.quantities:
            continue
        here, shared = scene.quantities.get(root), config.parameters.get(root)
        start = here.value if here is not None else None if shared is None else shared.initial
        if start is not None:
            scene.quantities[name] = replace(scene.quantities[name], value=factor * start)


def _root(config: schema.Config, name: str) -> tuple[str, float]:
    """The end of a parameter's ties and the factor to it; circles and loose ends, which `Parameters` reports, lead
    back to itself."""
    at, factor, passed = name, 1.0, {name}
    while (p := config.parameters.get(at)) is not None and p.tied_to is not None:
        if p.tied_to in passed:
            return name, 1.0
        at, factor = p.tied_to, factor * p.factor
        passed.add(at)
    return at, factor


def at_finer_values(config: schema.Config) -> schema.Config:
    """The configuration whose parameters start at their values on the finer mesh, where it has these."""
    parameters = {
        name: p if p.finer is None else p.model_copy(update={"initial": p.finer})
        for name, p in config.parameters.items()
    }
    recordings = [r.model_copy(update={"values": {**r.values, **r.finer}}) for r in config.recording]
    return config.model_copy(update={"parameters": parameters, "recording": recordings})


def fields_of_parameter(section: schema.ParameterSection) -> dict[str, Any]:
    """The fields of `Parameter` that the configuration sets; a private one starts at its own scene's value."""
    fields = section.model_dump(exclude_unset=True, exclude_none=True, exclude={"finer"})
    if section.private:
        fields.pop("initial", None)
    if "prior" in fields:
        fields["prior"] = tuple(fields["prior"])
    return fields
