"""What a fit says of its parameters: estimates with intervals and verdicts, and the given numbers that they rest on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ..errors import InputError

UNSOUND = ("rough", "no minimum", "doubtful")
"""Verdicts of an estimate that nothing should rest on; a command that fits exits with 4 for each of them."""

VERDICTS = ("identified", "weak", "one-sided", "at a bound", "at its floor", "not identifiable", *UNSOUND)
"""identified: 95 % half-width at most 20 % of the value; weak: above; one-sided: bounded from one side only;
at a bound: of the user; at its floor: the solver's own stiffness or damping; not identifiable: gauge or flat;
rough: derivatives of the motion grow so fast that nothing follows from them; no minimum: the optimizer ended where the
cost still falls; doubtful: a minimum that separate parts of the data, another start or held-out motion contradict.
Rough and no minimum have no interval."""


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """One fitted parameter.

    Attributes:
        name, value, unit: physical value in SI units.
        lower, upper: 95 % interval, all parts together; None where it is open.
        half_width: half of it, None where it is open.
        statistical: half-width from the residuals alone, None where it is open.
        driven: half-width from noise of what drives the scenes, to first order; its square and that of `statistical`
            add up. 0 without such noise.
        discretization: half-width of what the time step, the mesh and sweeps leave open, see `FitResult.refits`; 0 when
            that was not measured.
        systematic: half-width of what else the interval counts; 0 when nothing.
        verdict: one of `VERDICTS`.
        words: the verdict as a sentence.
        moved: how far the value was moved to the limit of short substeps and fine meshes, in `unit`; it is contained in
            `value`.
        in_all: half-width that also contains errors of given numbers, as large as they may well be without showing in
            the residuals; None where these were not looked at, or where the verdict is neither "identified" nor "weak".
    """

    name: str
    value: float
    unit: str
    lower: float | None
    upper: float | None
    half_width: float | None
    statistical: float | None
    discretization: float
    verdict: str
    words: str
    systematic: float = 0.0
    moved: float = 0.0
    driven: float = 0.0
    in_all: float | None = None

    def __post_init__(self) -> None:
        if self.verdict not in VERDICTS:
            raise InputError(f"{self.name}.verdict", "is unknown", self.verdict, f"use one of: {', '.join(VERDICTS)}")


def check_widths(estimate: Estimate, where: str) -> Estimate:
    """The estimate, as a file has it: half-widths must not be negative.

    Args:
        where: its path in the file.
    """
    for part in ("half_width", "statistical", "driven", "discretization", "systematic", "in_all"):
        width = getattr(estimate, part)
        if width is not None and width < 0:
            raise InputError(f"{where}.{part}", "must not be negative", width, "give a half-width")
    return estimate


def estimate_of(estimates: Sequence[Estimate], name: str) -> Estimate:
    """The estimate of that name; KeyError names the ones there are."""
    for estimate in estimates:
        if estimate.name == name:
            return estimate
    raise KeyError(f"no estimate of {name!r}; there are: {', '.join(e.name for e in estimates)}")


@dataclass(frozen=True, kw_only=True)
class Given:
    """A parameter that was not fitted: fixed, or tied to another; `words` says which."""

    name: str
    value: float
    unit: str
    words: str


@dataclass(frozen=True, kw_only=True)
class Premise:
    """A number that the fit took as given, and what an error in it moves.

    Attributes:
        name: of a quantity, or such as "gravity toward x", "clamps along z", "markers".
        value: in `unit`; None for what is a place or a direction.
        off_by: the error, in `unit`, whose effect is told; `words` says it, such as "1 %".
        moved: of each fitted parameter that is determined, in its unit, by that error (of several independent errors
            the root of the sum of squares).
        leaves: what that error leaves in the residuals, which no parameter takes up: root of the sum of squares, in
            sigma. 0 where the residuals are not asked for it.
        sd: its standard deviation in `unit`, which then counts in the intervals; None where none was given.
    """

    name: str
    value: float | None
    unit: str
    off_by: float
    words: str
    moved: Mapping[str, float]
    sd: float | None = None
    leaves: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Correlation:
    """Correlation of two estimates in internal coordinates."""

    first: str
    second: str
    value: float


@dataclass(frozen=True, kw_only=True)
class ProfileCurve:
    """How the cost rises with one parameter held beside its estimate and all others fitted again.

    Attributes:
        name: of the parameter.
        values: in its unit, ascending; the estimate is among them.
        rises: of the cost over that at the estimate, at each value; 1 is that at the ends of the interval from the
            residuals, driven noise included. Between the ends it is interpolated between the points that were computed.
        parabola: the rises at the same values in the linear picture.
    """

    name: str
    values: tuple[float, ...]
    rises: tuple[float, ...]
    parabola: tuple[float, ...]
