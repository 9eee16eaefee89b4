"""The rungs of the recipe: what each adds to the model of a rope between two grips, and to its fit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from ..parameters import Parameter
from .model import NAME


@dataclass(frozen=True)
class Rung:
    """One step of the recipe.

    Attributes:
        name: for reports.
        options: what it adds to the model, fields of `RopeModel`.
        values: what it adds to the model's starting values.
        parameters: what it adds to the fit.
        look_first: whether it is costly, so that a look at shorter windows decides whether it is fitted to long ones.
    """

    name: str
    options: Mapping[str, object] = field(default_factory=dict)
    values: Mapping[str, float] = field(default_factory=dict)
    parameters: tuple[Parameter, ...] = ()
    look_first: bool = False


def _log(name: str, initial: float, unit: str, sd: float | None = None) -> Parameter:
    prior = None if sd is None else (initial, sd)
    return Parameter(name=f"{NAME}_{name}", initial=initial, log=True, unit=unit, prior=prior)


def _plain(name: str, unit: str, sd: float, scale: float) -> Parameter:
    return Parameter(name=f"{NAME}_{name}", initial=0.0, unit=unit, prior=(0.0, sd), scale=scale)


MODES = (0, 1, 2, 3)
TWIST = Rung(
    "straight, with twist",
    parameters=(
        _log("EI", 1e-3, "N m^2"),
        _log("GJ", 1e-3, "N m^2", sd=3.0),
        _log("bend_damping", 0.02, "s", sd=2.0),
        Parameter(name=f"{NAME}_twist_damping", tied_to=f"{NAME}_bend_damping", unit="s"),
        _log("drag_linear", 0.01, "N s/m^2", sd=3.0),
        _log("length", 1.0, "m", sd=0.02),
        _plain("roll", "rad", 1.0, 0.3),
    ),
)
TILTS = Rung(
    "tilts of the grips",
    options={"tilts": True},
    parameters=tuple(_plain(f"{end}_tilt_{k}", "rad", 0.1, 0.1) for end in ("start", "end") for k in (1, 2)),
)
REST = Rung(
    "rest curvature",
    options={"curvature_modes": MODES},
    parameters=tuple(_plain(f"curvature_{axis}_{k}", "1/m", 1.0, 1.0) for k in MODES for axis in (1, 2)),
)
YIELD = Rung(
    "yield",
    values={"yield_curvature": 3.0, "yield_share": 0.2},  # little yields at first
    parameters=(
        _log("yield_curvature", 3.0, "1/m", sd=1.0),
        Parameter(name=f"{NAME}_yield_share", initial=0.2, lower=0.01, upper=0.95, prior=(0.2, 0.3)),
    ),
    look_first=True,
)
VARYING = Rung(
    "stiffness along the rope",
    options={"softness_modes": (1, 2)},
    parameters=tuple(_plain(f"softness_{k}", "", 0.2, 0.3) for k in (1, 2)),
)
LADDER = (TWIST, TILTS, REST, YIELD, VARYING)
