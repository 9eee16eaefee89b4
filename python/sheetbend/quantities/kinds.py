"""The kinds of constraints: what the core knows of each, and their units."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from .. import _core

KINDS: Mapping[str, Mapping[str, Any]] = _core.constraint_kinds()
# Kinds that have no rigid form, and why.
_SINGULAR = "is rigid, and a straight rigid joint has a singular projection (rank 2 of 3)"
NEEDS_COMPLIANCE: Mapping[str, tuple[str, str]] = {
    "bend": (_SINGULAR, "give a positive compliance, Voronoi length / EI"),
    "planar_bend": (_SINGULAR, "give a positive compliance, Voronoi length / EI"),
    "friction_hinge": ("is rigid, and would never slide", "give a positive compliance, yield angle / torque"),
}
# A damping-only element keeps the product of compliance and damping while the compliance grows: what is left of its
# stiffness.
VISCOUS_COMPLIANCE = 1e12
UNITS: Mapping[str, Mapping[str, str]] = {
    "distance": {"compliance": "m/N", "damping": "N s/m"},
    "attachment": {"compliance": "m/N", "damping": "N s/m"},
    "bend": {"compliance": "1/(N m)", "damping": "N m s"},
    "planar_bend": {"compliance": "1/(N m)", "damping": "N m s"},
    "hinge": {"compliance": "rad/(N m)", "damping": "N m s/rad"},
    "material_curvature": {"compliance": "1/(N m)", "damping": "N m s"},
    "yielding_curvature": {"compliance": "1/(N m)", "damping": "N m s"},
    "twist": {"compliance": "rad/(N m)", "damping": "N m s/rad"},
    "shear": {"compliance": "1/(N m)", "damping": "N m s"},
    "section_curvature": {"compliance": "1/(N m)", "damping": "N m s"},
    "section_yielding_curvature": {"compliance": "1/(N m)", "damping": "N m s"},
    "section_twist": {"compliance": "rad/(N m)", "damping": "N m s/rad"},
    "strain": {"compliance": "1/(N m)", "damping": "N m s"},
    "exponential_strain": {"compliance": "1/(N m)", "damping": "N m s"},
    "sinh_strain": {"compliance": "1/(N m)", "damping": "N m s"},
    "spline_strain": {"compliance": "1/(N m)", "damping": "N m s"},
    "dihedral": {"compliance": "rad/(N m)", "damping": "N m s/rad"},
    "isometric_bending": {"compliance": "1/(N m)", "damping": "N m s"},
    "sheet_curvature": {"compliance": "1/(N m^3)", "damping": "N m^3 s"},
    "area": {"compliance": "m^3/N", "damping": "N s/m^3"},
    "friction_hinge": {"compliance": "rad/(N m)", "damping": "N m s/rad"},
    "tether": {"compliance": "m/N", "damping": "N s/m"},
}
