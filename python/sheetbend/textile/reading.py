"""What a laboratory reads off a test, with its derivatives with respect to the fabric's numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

GRAM_FORCE = 9.80665e-3
"""N; textile laboratories give forces in gf and gf/cm."""


@dataclass(frozen=True)
class Reading:
    """One number of a test.

    Attributes:
        value: in `unit`.
        unit: SI.
        gradient: derivative of `value` with respect to every named quantity of the fabric, such as "cloth_bending".
        laboratory_unit: the unit in which laboratories give it.
        per: laboratory units per SI unit.
    """

    value: float
    unit: str
    gradient: Mapping[str, float]
    laboratory_unit: str
    per: float

    @property
    def laboratory(self) -> float:
        """The number in the laboratory's unit."""
        return self.value * self.per

    def __str__(self) -> str:
        return f"{self.laboratory:.4g} {self.laboratory_unit}".rstrip()


def combined(*parts: tuple[float, Mapping[str, float]], leave: tuple[str, ...] = ()) -> dict[str, float]:
    """Sum of factors times gradients, without the quantities `leave` that are the test's own."""
    names = [name for name in parts[0][1] if name not in leave]
    return {name: sum(factor * gradient[name] for factor, gradient in parts) for name in names}
