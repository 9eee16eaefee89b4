"""A smoothness prior of a field: what a fit is asked for, and the parameters that come of it.

A field is a stiffness that varies from place to place, or a force or a wind over time that nobody measured. Its modes
are parameters with independent priors, whose deviations follow from a size and a length (`deviations`). Those that are
not given are found before a fit searches (`field_priors`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from dataclasses import field as of_field

import numpy as np

from ..arrays.checks import check_kind, is_number
from ..arrays.types import Array
from ..errors import InputError
from ..experiment.experiment import Experiment
from ..objects.over_time import OverTime
from ..objects.stiffness_field import StiffnessField
from ..quantities.parameters import Parameter, Parameters

FIRST_SIZE, FIRST_LENGTH = 0.5, 0.25  # of the scale, which is 1 for ln E; of the extent

Modes = StiffnessField | OverTime


@dataclass(frozen=True)
class Smooth:
    """A smoothness prior; what is None is found from the recordings.

    Attributes:
        size: root mean square of ln E about its mean, or of an unknown force (N) or wind (m/s) along each axis.
        length: m, over which neighbors are alike; of a force or wind the time, s.
    """

    size: float | None = None
    length: float | None = None

    def __post_init__(self) -> None:
        for field in ("size", "length"):
            value = getattr(self, field)
            if value is not None and not (is_number(value) and value > 0):
                raise InputError(f"smooth.{field}", "must be positive", value, "give a number, or leave it out")


@dataclass(frozen=True)
class Field:
    """A field with its prior.

    Attributes:
        modes: as the scene has them, of the first scene that does.
        wanted: as it was asked for.
        size, length: of the prior.
        size_ends, length_ends: of their 95 % intervals; (None, None) of what was given.
        own: by recording, its modes, where each has numbers of its own; empty where all share them.
    """

    modes: Modes
    wanted: Smooth
    size: float
    length: float
    size_ends: tuple[float | None, float | None] = (None, None)
    length_ends: tuple[float | None, float | None] = (None, None)
    own: Mapping[str, OverTime] = of_field(default_factory=dict)

    @property
    def each(self) -> Iterator[tuple[Modes, tuple[str, ...]]]:
        """The modes of each recording, or those of all, and the names of their parameters."""
        if not self.own:
            yield self.modes, self.modes.modes
        for recording, modes in self.own.items():
            yield modes, tuple(f"{mode}[{recording}]" for mode in modes.modes)

    @property
    def deviations(self) -> Array:
        """Standard deviations of the priors of all parameters."""
        return np.concatenate([modes.deviations(self.size, self.length) for modes, _ in self.each])

    def at(self, log_size: float, log_length: float) -> Field:
        """With another size and length."""
        return replace(self, size=math.exp(log_size), length=math.exp(log_length))

    def carried(self, parameters: Parameters) -> Parameters:
        """The parameters with this prior."""
        sds: dict[str, float] = {}
        for modes, names in self.each:
            own = modes.deviations(self.size, self.length).tolist()
            sds |= dict(zip((*names, *modes.modes), [*own, *own], strict=True))
        return Parameters(replace(p, prior=(0.0, sds[p.name])) if p.name in sds else p for p in parameters.values())


def with_fields(
    parameters: Parameters, experiments: Sequence[Experiment], smooth: Mapping[str, Smooth]
) -> tuple[Parameters, tuple[Field, ...]]:
    """The parameters with those of all fields, under the prior that a search for sizes and lengths begins with. Those
    of inputs over time need not be named in `smooth`, and are private where there are several recordings.

    Raises:
        InputError: no scene has such a field, a mode is a parameter already, a size or length is not positive, or an
            input over time does not suit a recording.
    """
    fitted = {e.name for e in experiments if e.predict is None}
    known: dict[str, Modes] = {field.name: field for field in _stiffness_fields(experiments)}
    over_time = inputs_over_time(experiments)
    known |= {name: next(iter(own.values())) for name, own in over_time.items()}
    fields = []
    check_kind("smooth", smooth, Mapping, "give sb.Smooth() by the names of fields")
    for name, wanted in ({name: Smooth() for name in over_time} | dict(smooth)).items():
        check_kind(f"smooth.{name}", wanted, Smooth, "give sb.Smooth()")
        if name not in known:
            none = "none, give a cloth or a solid of clusters stiffness_modes, or a rope softness_modes from 1 on"
            fix = f"name one of: {', '.join(known) or none}"
            raise InputError(f"smooth.{name}", "names no field of the scenes", name, fix)
        own = over_time.get(name, {})
        private = len(own) > 1 or not fitted.issuperset(own)  # what is only predicted has its own, too
        own = own if private else {}
        modes = max(own.values(), key=lambda m: len(m.modes)) if private else known[name]
        if twice := [mode for mode in modes.modes if mode in parameters]:
            fix = "leave them out of the parameters: smooth adds them"
            raise InputError(f"smooth.{name}", "has modes that are parameters already", twice, fix)
        size = wanted.size or FIRST_SIZE * modes.scale
        own = {recording: modes for recording, modes in own.items() if recording in fitted}
        length = wanted.length or FIRST_LENGTH * modes.extent
        field = Field(modes, wanted, size, length, _open(wanted.size), _open(wanted.length), own)
        if own or not private:
            fields.append(field)
        quantities = next(e.scene.quantities for e in experiments if modes.modes[-1] in e.scene.quantities)
        more = [
            Parameter(
                name=m,
                initial=None if private else quantities[m].value,
                scale=quantities[m].scale,
                private=private,
            )
            for m in modes.modes
        ]
        parameters = field.carried(Parameters([*parameters.values(), *more]))
    return parameters, tuple(fields)


def _open(given: float | None) -> tuple[float | None, float | None]:
    """The ends of a size or length before the recordings tell anything of it."""
    return (0.0, None) if given is None else (None, None)


def inputs_over_time(experiments: Sequence[Experiment]) -> dict[str, dict[str, OverTime]]:
    """The unknown inputs over time of the experiments' scenes, by name and recording.

    Raises:
        InputError: one of a recording of an equilibrium, one that ends before its recording, or whose knots are farther
            apart than the recording is long.
    """
    found: dict[str, dict[str, OverTime]] = {}
    for e in experiments:
        for name, own in e.scene.over_time.items():
            if e.static:
                raise InputError(f"{e.name}.static", f"has no time for the unknown {own.kind}", name, "leave it out")
            until = float((e.held() or e.fitted()).times[-1]) - e.t0
            spacing = float(own.times[1])
            if spacing > until:
                raise InputError(
                    f"{name}.spacing", "is longer than the recording", spacing, f"give at most {until:g} s"
                )
            if until > own.times[-1] + spacing:
                fix = f"give at least {until:g} s"
                raise InputError(f"{name}.duration", "ends before the recording", own.extent, fix)
            found.setdefault(name, {})[e.name] = own
    return found


def _stiffness_fields(experiments: Sequence[Experiment]) -> Iterator[StiffnessField]:
    for s in (e.scene for e in experiments):
        objects = (*s.solids.values(), *s.cloths.values(), *s.ropes.values())
        yield from (o.field for o in objects if o.field is not None)


def modes_of_fields(experiments: Sequence[Experiment]) -> set[str]:
    """The quantities that make up the fields of the experiments' scenes, unknown inputs over time among them."""
    stiffness = {mode for field in _stiffness_fields(experiments) for mode in field.modes}
    return stiffness | modes_over_time(experiments)


def modes_over_time(experiments: Sequence[Experiment]) -> set[str]:
    """The quantities that make up the unknown inputs over time of the experiments' scenes."""
    return {mode for e in experiments for own in e.scene.over_time.values() for mode in own.modes}
