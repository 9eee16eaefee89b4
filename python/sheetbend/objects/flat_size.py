"""The size of the flat cloth relative to its mesh, along warp and weft, as factors of what follows from its flat shape.

With both sizes a, b the material coordinates are (a u, b v). Areas grow by a b, and gradients of the shape functions of
a triangle shrink by a and b, exactly. The angle between two triangles of a given curvature also depends on how the edge
between them runs, see `of_edges`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..arrays.checks import is_number
from ..arrays.types import Array
from ..errors import SceneError
from ..mesh import TriangleMesh
from ..quantities.quantities import Term
from ..scene.scene import Scene

LIMITS = (0.8, 1.25)  # beyond them the mesh is the wrong one
POWERS = (-1, 0, 1, 2)  # of b/a, by which `of_edges` goes

Factors = tuple[tuple[str, str], ...]


class FlatSize(NamedTuple):
    """Names of the quantities of both sizes; None where the mesh's is the cloth's."""

    warp: str | None = None
    weft: str | None = None

    @classmethod
    def add(
        cls, scene: Scene, mesh: TriangleMesh, name: str, warp: float | None, weft: float | None, model: str | None
    ) -> FlatSize:
        """Add the quantities `<name>_warp_size` and `<name>_weft_size` where they are given.

        Args:
            model: of its bending; None = it has none.

        Raises:
            SceneError: a size is no plausible one, or the mesh or the model of bending takes none.
        """
        made: list[str | None] = []
        for field, value in (("warp_size", warp), ("weft_size", weft)):
            if value is None:
                made.append(None)
                continue
            where = f"{name}.{field}"
            if not is_number(value) or not LIMITS[0] <= value <= LIMITS[1]:
                fix = "give the size of the flat cloth over that of the mesh, such as 1.0, or make the mesh larger"
                raise SceneError(where, f"must lie between {LIMITS[0]} and {LIMITS[1]}", value, fix)
            if mesh.material.ndim != 2:
                fix = "leave it out, or give a mesh without seams, with one pair of material coordinates per vertex"
                raise SceneError(where, "needs a mesh of one piece", value, fix)
            if model not in (None, "curvature"):
                fix = f"keep bending_model = 'curvature' in place of '{model}', or leave it out"
                raise SceneError(where, "belongs to the curvature model", value, fix)
            made.append(scene.add_quantity(where.replace(".", "_"), value, "", limits=LIMITS))
        return cls(*made)

    def power(self, of_warp: int, of_weft: int) -> Factors:
        """Factors that make a^of_warp b^of_weft."""
        found: Factors = ()
        for quantity, power in ((self.warp, of_warp), (self.weft, of_weft)):
            if quantity is not None:
                found += ((quantity, "identity" if power > 0 else "inverse"),) * abs(power)
        return found

    def strains(self, scene: Scene, group: str, values: Array) -> None:
        """Make the gradients of shape functions (dN_1/du, dN_1/dv, dN_2/du, dN_2/dv), first in `rest` of a group whose
        parameters stand at `values`, follow the sizes."""
        for places, factors in (((0, 2), self.power(-1, 0)), ((1, 3), self.power(0, -1))):
            if factors:
                for place in places:
                    _move(scene, group, values, place, factors)

    def curvatures(self, scene: Scene, group: str, values: Array, corners: Array) -> None:
        """Add the terms of the matrices (3, 3) that make kappa_uu, kappa_vv and kappa_uv of the angles at the edges
        v0v1, v1v2, v2v0 of triangles with corners (count, 3, 2)."""
        if self == AS_MESH:
            return
        rest = scene.group(group)[0].rest
        by = of_edges(np.roll(corners, -1, axis=1) - corners)
        for row, (u, v) in enumerate(((-2, 0), (0, -2), (-1, -1))):
            for edge in range(3):
                place = 3 * row + edge
                own = rest[:, place].copy()
                rest[:, place] = 0.0
                scene.add_terms(
                    [
                        Term("rest", values[:, place], own * by[:, edge, k], self.power(u + 1 - m, v + m))
                        for k, m in enumerate(POWERS)
                    ]
                )


AS_MESH = FlatSize()


def of_edges(edges: Array) -> Array:
    """(..., 4) coefficients c of 1/l = a sum_m c_m (b/a)^m, over the powers m of `POWERS`.

    The surface of a given curvature in (a u, b v) has l = sqrt(n_u^2/a^2 + n_v^2/b^2) times the angle, at an edge of
    unit normal n, that the surface of the same second derivatives in (u, v) has. 1/l is no finite sum of products of
    powers; this one has its value and three derivatives with respect to ln(b/a) where a = b, and is exact where n is
    an axis. Elsewhere it is off by less than 2e-7 where b/a is 3 % off one, and 2e-5 where it is 10 % off.

    Args:
        edges: (..., 2) m.
    """
    n_v2 = edges[..., 0] ** 2 / (edges**2).sum(axis=-1)
    derivatives = [np.ones_like(n_v2), n_v2, n_v2 * (3.0 * n_v2 - 2.0), n_v2 * (4.0 + n_v2 * (15.0 * n_v2 - 18.0))]
    of_powers = np.array([[float(m) ** k for m in POWERS] for k in range(4)])
    return np.asarray(np.stack(derivatives, axis=-1) @ np.linalg.inv(of_powers).T)


def _move(scene: Scene, group: str, values: Array, place: int, factors: Factors) -> None:
    """Make a column of `rest` a term with factors, which it was without them."""
    rest = scene.group(group)[0].rest
    scene.add_terms([Term("rest", values[:, place], rest[:, place].copy(), factors)])
    rest[:, place] = 0.0
