"""The membrane of a cloth: tension along warp and weft and shear of its triangles, elastic or with friction between
yarns that shear."""

from __future__ import annotations

import numpy as np

from ..quantities.quantities import Term
from ..scene.scene import Array
from .cloth_cut import Cut, Stretching
from .elastic_group import add_elastic_group
from .stiffness_field import StiffnessField

_OF_LAW = 7  # parameters of a triangle before those of its law, or of its yield


def add_membrane(cut: Cut, kept: Array, stretches: Stretching, field: StiffnessField | None) -> None:
    """Add tension and shear of the triangles that can move to the cut's scene, as the group `<name>_membrane`.

    The quantities are `<fabric>_warp`, `_shear` and where given `_weft`, N/m, `_poisson`, those of the law, and of what
    yields `<fabric>_yield_shear` and `_yield_shear_share`. Each triangle that yields has a set, a hidden node, zero at
    first.

    Args:
        kept: (count,) those triangles.
        field: how the stiffness varies from triangle to triangle.
    """
    scene, fabric, size, law, slides = cut.scene, cut.fabric, cut.size, stretches.law, stretches.slides
    corners, areas = cut.mesh.corners[kept], cut.mesh.areas[kept]
    count, group = len(kept), f"{cut.name}_membrane"
    coefficients = list(law.coefficients())
    kind, stencils, own_numbers = law.kind, cut.particles[cut.mesh.triangles[kept]], len(coefficients)
    if slides is not None:
        kind, own_numbers = "yielding_strain", 2
        stencils = np.column_stack([stencils, scene.add_hidden(np.zeros((count, 3)), 1.0, pinned=True)])
    rest = np.zeros((count, _OF_LAW + own_numbers))
    rest[:, :4] = np.linalg.inv(np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2)).reshape(count, 4)
    if stretches.weft is None:
        rest[:, 5] = 1.0
    if slides is not None:
        rest[:, 8], rest[:, 7] = slides
    values = add_elastic_group(
        scene,
        kind,
        stencils,
        name=group,
        rest=rest,
        scale=areas,
        stiffness=(f"{fabric}_warp", stretches.warp, "N/m"),
        damping=(f"{fabric}_membrane_damping", stretches.damping),
        size=size,
        varies=() if field is None else tuple(zip(field.modes, field.shapes.T, strict=True)),
    )
    size.strains(scene, group, values)
    terms = []
    over_warp = (f"{fabric}_warp", "inverse_sqrt")
    for place, label, value in ((5, "weft", stretches.weft), (6, "shear", stretches.shear)):
        if value is not None:
            scene.add_quantity(f"{fabric}_{label}", value, "N/m", shared=True)
            terms.append(Term("rest", values + place, 1.0, ((f"{fabric}_{label}", "sqrt"), over_warp)))
    scene.add_quantity(
        f"{fabric}_poisson", stretches.poisson, "", positive=False, scale=0.1, limits=(-1.0, 1.0), shared=True
    )
    terms.append(Term("rest", values + 4, 1.0, ((f"{fabric}_poisson", "identity"),)))
    own = scene.groups[-1].rest
    if slides is not None:
        own[:, _OF_LAW:] = 0.0
        at, share = f"{fabric}_yield_shear", f"{fabric}_yield_shear_share"
        scene.add_quantity(at, slides[0], "", shared=True)
        scene.add_quantity(share, slides[1], "", shared=True)
        as_row = ((at, "identity"), (f"{fabric}_shear", "sqrt"), over_warp)  # the row of shear is scaled
        terms += [Term("rest", values + 7, 1.0, ((share, "identity"),)), Term("rest", values + 8, 1.0, as_row)]
    for place, (label, value, fittable) in enumerate(coefficients, start=_OF_LAW):
        if fittable:
            scene.add_quantity(f"{fabric}_{label}", value, "", shared=True)
            terms.append(Term("rest", values + place, 1.0, ((f"{fabric}_{label}", "identity"),)))
        else:
            own[:, place] = value
    scene.add_terms(terms)
