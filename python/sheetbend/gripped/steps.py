"""What a climb finds: the rope after each rung, and how the rung did."""

from __future__ import annotations

from dataclasses import dataclass, field

from ..quantities.parameters import Parameter
from .carried import Slopes
from .judging import Errors
from .ladder import Rung
from .model import RopeModel
from .motion import GrippedMotion

Parts = tuple[Parameter, ...]


@dataclass(frozen=True)
class Step:
    """How a rung did.

    Attributes:
        name: of the rung.
        fitted, others: median of the mean absolute coordinate errors of whole recordings that it was fitted to, and of
            those that it was not, m; without it where it was not tried, since one step promises nothing.
        stays: whether it is part of the final model.
        seconds: its time.
        ratio: median ratio of the errors with and without it, on what it was not fitted to; None of the first. To first
            order where it was not tried.
        better: number of recordings (or pieces of them) that it predicts better.
        count: of how many.
        EI: bending stiffness with it, N m^2.
    """

    name: str
    fitted: float
    others: float
    stays: bool
    seconds: float
    ratio: float | None = None
    better: int = 0
    count: int = 0
    EI: float | None = None


@dataclass(frozen=True)
class Rope:
    """A model with its fitted values, what is free in it, how it predicts, and the derivatives its fit ended with."""

    model: RopeModel
    parameters: Parts
    values: dict[str, float]
    errors: Errors = field(default_factory=Errors.none)
    slopes: Slopes | None = field(default=None, compare=False)

    def without(self, rung: Rung, motion: GrippedMotion) -> Rope:
        """The rope without what a rung added to a fit of such motions."""
        names = {p.name for p in rung.wanted(motion)}
        values = {name: value for name, value in self.values.items() if name not in names}
        return Rope(rung.taken_from(self.model), tuple(p for p in self.parameters if p.name not in names), values)
