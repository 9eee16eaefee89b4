"""The rungs of the recipe: what each adds to the model of a rope between two grips, and to its fit.

Fields along the rope (rest curvature, softness) are sums of modes cos(k pi s / length). Their priors are smooth: the
standard deviation of mode k is that of mode 0 divided by 1 + k/2. So fall the modes of a field that has kinks and jumps
at worst, and a fine mode has to be shown by the motion.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace

from ..quantities.parameters import Parameter
from .model import NAME, RopeModel
from .motion import GrippedMotion
from .rolls import ORDERS

TURN = 2.0 * math.pi


@dataclass(frozen=True)
class Rung:
    """One step of the recipe.

    Attributes:
        name: for reports.
        options: what it adds to the model, fields of `RopeModel`.
        values: what it adds to the model's starting values.
        parameters: what it adds to the fit.
        each_marker: what it adds to the fit for each free marker; `{}` in a name is the marker's number.
        small: whether its effect is nearly linear; then it is not tried where one step promises nothing
            (`first_order`).
        beside: whether it moves the recordings onto the rope's axis, beside which the markers sit (`beside`).
        late: whether it takes the grips as so much earlier as their markers come late (`clock`).
        starts: other values to start from, by option; `EI` as a factor. The end that fits best is taken.
    """

    name: str
    options: Mapping[str, object] = field(default_factory=dict)
    values: Mapping[str, float] = field(default_factory=dict)
    parameters: tuple[Parameter, ...] = ()
    each_marker: tuple[Parameter, ...] = ()
    small: bool = False
    beside: bool = False
    late: bool = False
    starts: tuple[Mapping[str, float], ...] = ()

    def added_to(self, model: RopeModel) -> RopeModel:
        """The model with what the rung adds."""
        return replace(model, **dict(self.options), values={**model.values, **self.values})  # type: ignore[arg-type]

    def taken_from(self, model: RopeModel) -> RopeModel:
        """The model without what the rung adds."""
        known = {f.name: f.default for f in fields(RopeModel)}
        values = {k: v for k, v in model.values.items() if k not in self.values}
        return replace(model, **{k: known[k] for k in self.options}, values=values)  # type: ignore[arg-type]

    def within(self, model: RopeModel) -> bool:
        """Whether the model has what the rung adds."""
        return (
            all(getattr(model, k) == v for k, v in self.options.items()) and self.values.keys() <= model.values.keys()
        )

    @property
    def offsets(self) -> bool:
        """Whether it tells how the rope is held and marked, not what the rope is."""
        return self.small or self.beside

    def wanted(self, motion: GrippedMotion) -> tuple[Parameter, ...]:
        """What it adds to the fit of motions with these markers."""
        each = (replace(p, name=p.name.format(k)) for k in motion.free for p in self.each_marker)
        return (*self.parameters, *each)


AND = " and "


def together(rungs: Sequence[Rung]) -> Rung:
    """One rung of several."""
    return Rung(
        AND.join(rung.name for rung in rungs),
        {key: value for rung in rungs for key, value in rung.options.items()},
        {key: value for rung in rungs for key, value in rung.values.items()},
        tuple(p for rung in rungs for p in rung.parameters),
        tuple(p for rung in rungs for p in rung.each_marker),
        all(rung.small for rung in rungs),
        starts=tuple(start for rung in rungs for start in rung.starts),
    )


def smooth(first: float, k: int) -> float:
    """Standard deviation of mode k of a field whose mode 0 has the standard deviation `first`."""
    return first / (1.0 + 0.5 * k)


def _log(name: str, initial: float, unit: str, sd: float | None = None) -> Parameter:
    prior = None if sd is None else (initial, sd)
    return Parameter(name=f"{NAME}_{name}", initial=initial, log=True, unit=unit, prior=prior)


def _plain(name: str, unit: str, sd: float, scale: float, most: float = math.inf) -> Parameter:
    return Parameter(
        name=f"{NAME}_{name}", initial=0.0, unit=unit, prior=(0.0, sd), scale=scale, lower=-most, upper=most
    )


CURVATURE_MODES = tuple(range(9))
SOFTNESS_MODES = tuple(range(1, 7))  # mode 0 is EI itself
TWIST = Rung(
    "straight, with twist",
    parameters=(
        _log("EI", 1e-3, "N m^2"),
        _log("GJ", 1e-3, "N m^2", sd=3.0),
        _log("bend_damping", 0.02, "s", sd=2.0),
        Parameter(name=f"{NAME}_twist_damping", tied_to=f"{NAME}_bend_damping", unit="s"),
        _log("drag_linear", 0.01, "N s/m^2", sd=3.0),
        _log("length", 1.0, "m", sd=0.02),
        _plain("roll", "rad", 1.0, 0.3, most=TURN),
    ),
)
TILTS = Rung(
    "tilts of the grips",
    options={"tilts": True},
    parameters=tuple(_plain(f"{end}_tilt_{k}", "rad", 0.1, 0.1) for end in ("start", "end") for k in (1, 2)),
    small=True,
)
REST = Rung(
    "rest curvature",
    options={"curvature_modes": CURVATURE_MODES},
    parameters=tuple(
        _plain(f"curvature_{axis}_{k}", "1/m", smooth(2.0, k), 1.0) for k in CURVATURE_MODES for axis in (1, 2)
    ),
)
VARYING = Rung(
    "stiffness along the rope",
    options={"softness_modes": SOFTNESS_MODES},
    parameters=tuple(_plain(f"softness_{k}", "", smooth(0.45, k), 0.3) for k in SOFTNESS_MODES),
)
YIELD = Rung(
    "yield",
    values={"yield_curvature": 3.0, "yield_share": 0.2},  # little yields at first
    parameters=(
        _log("yield_curvature", 3.0, "1/m", sd=1.0),
        Parameter(name=f"{NAME}_yield_share", initial=0.2, lower=0.01, upper=0.95, prior=(0.2, 0.3), scale=0.2),
    ),
    starts=({"yield_curvature": 1.0, "yield_share": 0.5, "EI": 1.5},),
)
ROLLS = Rung(
    "grips that roll as they lean",
    options={"rolls": True},
    parameters=tuple(_plain(f"{end}_roll_{order}", "rad", 0.5, 0.3) for end in ("start", "end") for order in ORDERS),
    small=True,
)
CLOCK = Rung("clock of the grips", late=True)
BESIDE = Rung("markers beside the rope", beside=True)
SHIFTS = Rung(
    "places of the grips",
    options={"shifts": True},
    # not along the rope: there the length and the places of the markers do the same
    parameters=tuple(_plain(f"{end}_shift_{k}", "m", 0.005, 0.005) for end in ("start", "end") for k in (1, 2)),
    small=True,
)
MARKERS = Rung(
    "places of the markers",
    options={"places": True},
    each_marker=(_plain("place_{}", "m", 0.005, 0.005),),
    small=True,
)
RATIO = 0.01  # GJ/EI that counts as none: thrice as much moves errors by 3 %, a tenth lets motions diverge
WITHOUT_TWIST = Rung(
    "straight, without twist",
    parameters=(
        *(p for p in TWIST.parameters if p.name not in (f"{NAME}_GJ", f"{NAME}_roll")),
        Parameter(name=f"{NAME}_GJ", tied_to=f"{NAME}_EI", factor=RATIO, unit="N m^2"),
    ),
)
"""A first rung for comparison, of a rope that bends, but does not resist torsion: with GJ negligible; a built-in twist
then does nothing, so no roll is fitted."""
LADDER = (TWIST, TILTS, REST, VARYING, YIELD, ROLLS, CLOCK, BESIDE, SHIFTS, MARKERS)
