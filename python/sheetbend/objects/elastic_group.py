"""A group of a cloth's constraints that share one stiffness and one time constant."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..arrays.types import Array
from ..quantities.quantities import Term
from ..scene.scene import Scene
from .flat_size import AS_MESH, FlatSize


def add_elastic_group(
    scene: Scene,
    kind: str,
    stencils: Array,
    *,
    name: str,
    rest: Array,
    scale: Array,
    stiffness: tuple[str, float, str],
    damping: tuple[str, float | None],
    size: FlatSize = AS_MESH,
    varies: Sequence[tuple[str, Array]] = (),
) -> Array:
    """Add constraints of compliance 1/(scale stiffness), damped by stiffness times a Kelvin-Voigt time constant.

    Args:
        stencils: (count, arity) particles.
        name: of the group.
        rest: (count,) or (count, parameters), see `Scene.add_constraints`.
        scale: (count,) what the stiffness counts in each, such as areas.
        stiffness: name, value and unit of its quantity, which groups of equal value share.
        damping: name and value, s, of the time constant's, likewise; None = undamped.
        size: of the flat cloth, with whose area the scale grows.
        varies: quantities and their weights (count,), whose sum is added to the logarithm of the stiffness of each.

    Returns:
        (count, parameters) where the constraints' own parameters stand in the input array "rest".
    """
    count = len(stencils)
    quantity, value, unit = stiffness
    label, constant = damping
    scene.add_constraints(
        kind,
        stencils,
        name=name,
        compliance=np.zeros(count),
        damping=None if constant is None else np.zeros(count),
        rest=rest,
    )
    places = scene.places_of_group(name)
    at = places.constraints
    scene.add_quantity(quantity, value, unit, shared=True)
    less = tuple((mode, -weight) for mode, weight in varies)
    scene.add_terms([Term("compliance", at, 1.0 / scale, ((quantity, "inverse"), *size.power(-1, -1)), less)])
    if constant is not None:
        scene.add_quantity(label, constant, "s", shared=True)
        factors = ((label, "identity"), (quantity, "identity"), *size.power(1, 1))
        scene.add_terms([Term("damping", at, scale, factors, tuple(varies))])
    return places.rest
