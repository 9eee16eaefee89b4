"""Checks the arguments of yield: a curvature (of a cloth also a shear strain) and a share, which belong together, of a
rod and a cloth; a stress and its hardening of a solid."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..arrays.checks import check_positive, is_number
from ..errors import SceneError
from ..mesh import SolidMesh


def check_yield(
    name: str,
    at: float | None,
    share: float | None,
    stiffness: str,
    fields: tuple[str, str] = ("yield_curvature", "yield_share"),
) -> None:
    """Refuse one of them without the other, and a share that is none.

    Args:
        at: the deformation at which it yields.
        stiffness: the argument that they are a part of.
        fields: the arguments that gave `at` and `share`.

    Raises:
        SceneError: names the argument of the share.
    """
    where = f"{name}.{fields[1]}"
    if (at is None) != (share is None):
        fix = f"give {fields[0]} and {fields[1]}, or neither"
        raise SceneError(where, f"and {fields[0]} belong together", share, fix)
    if share is not None and not (is_number(share) and 0 < share < 1):
        raise SceneError(where, "must lie between 0 and 1", share, f"give a part of {stiffness}")


def check_plastic(
    name: str, stress: float | None, hardening: float | None, mesh: SolidMesh, numbers: Mapping[str, Any]
) -> dict[str, float | None]:
    """The numbers of a solid's yield, those left out too.

    Args:
        numbers: of its material.

    Raises:
        SceneError: numbers that are not positive, or a solid that cannot yield.
    """
    check_positive(name, {}, {"yield_stress": stress, "hardening": hardening})
    if stress is None:
        if hardening is not None:
            raise SceneError(
                f"{name}.hardening", "needs a yield stress", hardening, "give yield_stress, or leave it out"
            )
        return {"yield_stress": None, "hardening": None}
    field, leave = f"{name}.yield_stress", "or leave yield_stress out"
    if "law" not in numbers:
        beside = "orthotropic" if "orthotropic" in numbers else "clusters"
        raise SceneError(field, f"is given beside {beside}", stress, f"give E and poisson of one material, {leave}")
    if mesh.elements.shape[1] != 8:
        why = "needs bricks: linear tetrahedra lock where a solid flows at constant volume"
        raise SceneError(field, why, stress, f"use sb.mesh.bricks or hexahedra, {leave}")
    if numbers["law"] != "strain":
        raise SceneError(field, 'needs law = "strain"', stress, f'give law = "strain", {leave}')
    if not numbers["volume_row"]:
        raise SceneError(field, "needs the volume row that a positive poisson has", stress, f"give one, {leave}")
    return {"yield_stress": stress, "hardening": hardening}
