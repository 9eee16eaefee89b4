"""The numbers of a fabric, which hold for any piece of it."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any

from ..arrays.checks import check_positive, is_number
from ..errors import SceneError
from .laws import COMPONENTS, Exponential, Law, Linear, Sinh, Spline, Stiffening

# The laws stood here before, and pickles find them here.
__all__ = ["COMPONENTS", "Exponential", "Fabric", "Law", "Linear", "Sinh", "Spline", "Stiffening"]


@dataclass(frozen=True, kw_only=True)
class Fabric:
    """The material parameters of a cloth, which hold for any piece of it. `add_cloth` describes each.

    Attributes:
        density: kg/m^2.
        warp, weft, shear: tension and shear stiffness, N/m; weft = warp where left out.
        poisson: sqrt(nu_uv nu_vu).
        law: how tension grows with strain.
        bending, bending_weft, bending_twist: rigidities, N m; those left out are `bending`.

    Raises:
        SceneError: a number that must be positive is not.
    """

    density: float
    warp: float
    weft: float | None = None
    shear: float
    poisson: float = 0.0
    law: Law = field(default_factory=Linear)
    bending: float
    bending_weft: float | None = None
    bending_twist: float | None = None

    def __post_init__(self) -> None:
        given = {field: getattr(self, field) for field in ("density", "warp", "shear", "bending")}
        left_out = {field: getattr(self, field) for field in ("weft", "bending_weft", "bending_twist")}
        check_positive("fabric", given, left_out)
        if not (is_number(self.poisson) and -1 < self.poisson < 1):
            raise SceneError("fabric.poisson", "must lie between -1 and 1", self.poisson, "give sqrt(nu_uv nu_vu)")
        if not isinstance(self.law, Law):
            raise SceneError("fabric.law", "is not a law", self.law, "give such as sb.laws.Sinh(warp, weft, shear)")

    def options(self) -> dict[str, Any]:
        """What `add_cloth` takes: `add_cloth(scene, mesh, **fabric.options())`."""
        return {field.name: getattr(self, field.name) for field in fields(self)}
