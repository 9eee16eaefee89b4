"""Checks of what the tests of a textile laboratory are given."""

from __future__ import annotations

from collections.abc import Mapping

from ..arrays.checks import check_count, check_kind, check_positive
from ..objects.fabric import Fabric

MOST_CELLS = 500  # along a side of a specimen, of a quarter of a million cells


def check_specimen(test: str, fabric: Fabric, sizes: Mapping[str, float], cells: int) -> None:
    """Refuse what is no fabric, size (positive, by argument) or number of cells or rings along a side.

    Raises:
        InputError: names the argument.
    """
    check_kind("fabric", fabric, Fabric, "make one: sb.Fabric(density=0.2, warp=2000, shear=50, bending=2e-5)")
    check_positive(test, sizes, {})
    check_count("rings" if test == "drape" else f"{test}.cells", cells, 1, MOST_CELLS)
