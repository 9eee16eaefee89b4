"""The kinds of constraints, as their C++ headers describe them."""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping
from typing import Any

from .. import _core

KINDS: Mapping[str, Mapping[str, Any]] = _core.constraint_kinds()
"""What is known of each kind, by name:

    about          one line
    arity          particles of one constraint
    points         how many of them are points in space; the others are directors or internal variables
    rows           scalar constraints
    unit           of C
    compliance     its unit, what it is made_of, its form ("scalar" or "matrix") and why it is never_zero (or None)
    damping        its unit
    parameters     by name: unit, least, most, source and value, see below
    periodic       whether C is an angle
    unilateral     whether it pushes only

A parameter's source is "given" (by `rest`; there is no other value), "measured" (by `rest`, else on the initial
positions), "usual" (by `rest`, else `value`), "normal" (by `normal`) or "preset" (`value`, until a quantity makes
it)."""
IN_REST = ("given", "measured", "usual")
"""The sources of parameters that `rest` holds, in the order of `parameters`."""
# A damping-only element keeps the product of compliance and damping while the compliance grows: what is left of its
# stiffness.
VISCOUS_COMPLIANCE = 1e12


def parameters_in_rest(kind: str) -> dict[str, Mapping[str, Any]]:
    """The parameters that `rest` holds, in the order of its columns."""
    return {name: p for name, p in KINDS[kind]["parameters"].items() if p["source"] in IN_REST}


def range_in_words(parameter: Mapping[str, Any]) -> str:
    """Such as "positive" or "between -1 and 1"; empty where all numbers are allowed."""
    least, most = parameter["least"], parameter["most"]
    unbounded = sys.float_info.max
    if (least, most) == (-unbounded, unbounded):
        return ""
    if most == unbounded:
        return "positive" if 0.0 < least <= math.nextafter(0.0, 1.0) else f"at least {least:g}"
    return f"between {least:g} and {most:g}"
