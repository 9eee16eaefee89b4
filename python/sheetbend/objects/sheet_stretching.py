"""The membrane of a cloth: tension along warp and weft and shear of its triangles, elastic or with friction between
yarns that shear."""

from __future__ import annotations

import numpy as np

from ..arrays.types import Array
from ..quantities.quantities import Term
from .cloth_cut import Cut
from .elastic_group import add_elastic_group
from .stiffness_field import StiffnessField

_OF_LAW = 7  # parameters of a triangle before those of its law, or of its yield


def add_membrane(cut: Cut, kept: Array, field: StiffnessField | None) -> None:
    """Add tension and shear of the triangles that can move to the cut's scene, as the group `<name>_membrane`.

    The quantities are `<fabric>_warp`, `_shear` and where given `_weft`, N/m, `_poisson`, those of the law, and of what
    yields `<fabric>_yield_shear` and `_yield_shear_share`. Each triangle that yields has a set, a hidden node, zero at
    first.

    Args:
        kept: (count,) those triangles.
        field: how the stiffness varies from triangle to triangle.
    """
    scene, fabric, given, group = cut.scene, cut.fabric, cut.numbers, f"{cut.name}_membrane"
    law, yields = given["law"], given["yield_shear"] is not None
    coefficients = list(law.coefficients())
    kind, stencils, own_numbers = law.kind, cut.particles[cut.mesh.triangles[kept]], len(coefficients)
    if yields:
        kind, own_numbers = "yielding_strain", 2
        stencils = np.column_stack([stencils, scene.add_hidden(np.zeros((len(kept), 3)), 1.0, pinned=True)])
    corners = cut.mesh.corners[kept]
    rest = np.zeros((len(kept), _OF_LAW + own_numbers))
    rest[:, :4] = np.linalg.inv(np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2)).reshape(-1, 4)
    if given["weft"] is None:
        rest[:, 5] = 1.0
    if yields:
        rest[:, _OF_LAW:] = given["yield_shear_share"], given["yield_shear"]
    values = add_elastic_group(
        scene,
        kind,
        stencils,
        name=group,
        rest=rest,
        scale=cut.mesh.areas[kept],
        stiffness=(f"{fabric}_warp", given["warp"], "N/m"),
        damping=(f"{fabric}_membrane_damping", given["membrane_damping"]),
        size=cut.size,
        varies=() if field is None else tuple(zip(field.modes, field.shapes.T, strict=True)),
    )
    cut.size.strains(scene, group, values)
    terms = []

    def follow(place: int, label: str, value: float, unit: str, function: str, *over: tuple[str, str]) -> None:
        """Let a parameter of every triangle be a function of a new quantity of the fabric."""
        quantity = scene.add_quantity(f"{fabric}_{label}", value, unit, shared=True)
        terms.append(Term("rest", values[:, place], 1.0, ((quantity, function), *over)))

    over_warp = (f"{fabric}_warp", "inverse_sqrt")
    if given["weft"] is not None:
        follow(5, "weft", given["weft"], "N/m", "sqrt", over_warp)
    follow(6, "shear", given["shear"], "N/m", "sqrt", over_warp)
    poisson = scene.add_quantity(
        f"{fabric}_poisson", given["poisson"], "", positive=False, scale=0.1, limits=(-1.0, 1.0), shared=True
    )
    terms.append(Term("rest", values[:, 4], 1.0, ((poisson, "identity"),)))
    own = scene.groups[-1].rest
    if yields:
        own[:, _OF_LAW:] = 0.0  # the row of shear is scaled, and the strain at which it yields with it
        follow(8, "yield_shear", given["yield_shear"], "", "identity", (f"{fabric}_shear", "sqrt"), over_warp)
        follow(7, "yield_shear_share", given["yield_shear_share"], "", "identity")
    for place, (label, value, fittable) in enumerate(coefficients, start=_OF_LAW):
        own[:, place] = 0.0 if fittable else value
        if fittable:
            follow(place, label, value, "", "identity")
    scene.add_terms(terms)
