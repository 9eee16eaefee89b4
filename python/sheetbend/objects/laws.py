"""Laws of cloth: its tension grows with strain linearly, exponentially, as a hyperbolic sine, or along a curve of its
own, per strain component."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass

from ..arrays.checks import finite
from ..errors import SceneError

COMPONENTS = ("warp", "weft", "shear")


@dataclass(frozen=True)
class Linear:
    """St. Venant-Kirchhoff: tension proportional to Green strain."""

    kind = "strain"

    def coefficients(self) -> Iterator[tuple[str, float, bool]]:
        """Name, value and whether it can be fitted, of each coefficient in the constraint's order."""
        return iter(())


@dataclass(frozen=True)
class Stiffening(ABC):
    """A law with one number b per component.

    Attributes:
        warp, weft, shear: b, no unit; of the shear strain 2 E_uv.
    """

    warp: float
    weft: float
    shear: float

    def __post_init__(self) -> None:
        for component in COMPONENTS:
            value = getattr(self, component)
            if not (isinstance(value, int | float) and 0 < value < 1e6):
                fix = "give a positive number, or use Linear()"
                raise SceneError(f"law.{component}", "must be a positive stiffening", value, fix)

    def coefficients(self) -> Iterator[tuple[str, float, bool]]:
        """Name, value and whether it can be fitted, of each coefficient in the constraint's order."""
        return iter((f"{component}_stiffening", float(getattr(self, component)), True) for component in COMPONENTS)

    @staticmethod
    @abstractmethod
    def log_growth(b: float, strain: float) -> float:
        """Natural logarithm of the stress over k e."""


class Exponential(Stiffening):
    """Fung's law: of the Green strain e the energy k (exp(b e^2) - 1)/(2 b), of the tangent stiffness k at rest.

    The tangent grows by exp(b e^2) (1 + 2 b e^2), so stiffening shows from about e = 1/sqrt(b) on.
    """

    kind = "exponential_strain"

    @staticmethod
    def log_growth(b: float, strain: float) -> float:
        return b * strain**2


class Sinh(Stiffening):
    """The stress k sinh(b e)/b: exponential in the Green strain e itself, of the tangent stiffness k at rest.

    The tangent grows by cosh(b e), so stiffening shows from about e = 1/b on, and goes on more evenly than Fung's.
    """

    kind = "sinh_strain"

    @staticmethod
    def log_growth(b: float, strain: float) -> float:
        t = abs(b * strain)
        return t + math.log(-math.expm1(-2.0 * t) / (2.0 * t)) if t > 0.0 else 0.0


@dataclass(frozen=True)
class Spline:
    """A tangent stiffness in straight pieces: 1 at rest and in compression, then ratios to it at 1 to 4 spacings.

    Positive ratios make the tension rise monotonically; the last one holds beyond.

    Attributes:
        spacing: of Green strain, for warp, weft and shear.
        warp, weft, shear: four ratios each, no unit.
    """

    spacing: tuple[float, float, float]
    warp: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    weft: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    shear: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    kind = "spline_strain"

    def __post_init__(self) -> None:
        for field, shape in (("spacing", (3,)), *((c, (4,)) for c in COMPONENTS)):
            values = finite(f"law.{field}", getattr(self, field), shape, SceneError)
            if (values <= 0).any():
                raise SceneError(f"law.{field}", "must be positive", values.tolist(), "give positive numbers")

    def coefficients(self) -> Iterator[tuple[str, float, bool]]:
        """Name, value and whether it can be fitted, of each coefficient in the constraint's order."""
        for spacing, component in zip(self.spacing, COMPONENTS, strict=True):
            yield f"{component}_spacing", float(spacing), False
            for k, ratio in enumerate(getattr(self, component), start=1):
                yield f"{component}_ratio_{k}", float(ratio), True


Law = Linear | Exponential | Sinh | Spline
