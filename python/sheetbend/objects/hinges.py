"""The bending of a cloth: its inner edges as hinges of one rigidity B."""

from __future__ import annotations

import numpy as np

from ..arrays.types import Array
from ..errors import SceneError
from ..mesh import TriangleMesh
from .cloth_cut import Cut
from .elastic_group import add_elastic_group


class Hinges:
    """The hinges of a mesh that can move, with their rest geometry.

    Attributes:
        stencils: (count, 4) vertices [v0, v1, a, b], of the triangles (v0, v1, a) and (v1, v0, b).
        length: (count,) m, of the edges in the material.
        area: (count,) m^2, of both triangles.
    """

    def __init__(self, mesh: TriangleMesh, free: Array) -> None:
        kept = np.flatnonzero(free[mesh.hinges].any(axis=1))
        self.mesh, self.stencils, self._triangles = mesh, mesh.hinges[kept], mesh.hinge_triangles[kept]
        self.area = mesh.areas[self._triangles].sum(axis=1)
        first = self._corners(0)
        self.length = np.linalg.norm(first[:, 1] - first[:, 0], axis=1)

    def _corners(self, side: int) -> Array:
        """(count, 3, 2) m, material coordinates of v0, v1 and the vertex opposite, in one of the two triangles."""
        triangles = self._triangles[:, side]
        wanted = self.stencils[:, [0, 1, 2 + side]]
        place = (self.mesh.triangles[triangles][:, None, :] == wanted[:, :, None]).argmax(axis=2)
        corners: Array = np.take_along_axis(self.mesh.corners[triangles], place[:, :, None], axis=1)
        return corners

    def _cotangents(self) -> Array:
        """(count, 3) of v1, a and b: the coefficients of quadratic bending (Bergou et al. 2006), over sqrt(area)."""
        at_0, at_1 = [], []
        for side in (0, 1):
            p0, p1, top = np.swapaxes(self._corners(side), 0, 1)
            at_0.append(_cotangent(p1 - p0, top - p0))
            at_1.append(_cotangent(p0 - p1, top - p1))
        k = np.stack([at_0[0] + at_0[1], -at_0[0] - at_1[0], -at_0[1] - at_1[1]], axis=1)
        return k / np.sqrt(self.area)[:, None]

    def add(self, cut: Cut, curved: bool) -> None:
        """Add them to the cut's scene as the group `<name>_bend`, with the quantity `<fabric>_bending` (B, N m).

        Raises:
            SceneError: a mesh with one-way diagonals, or a curved rest shape of quadratic bending.
        """
        model, bending = cut.numbers["bending_model"], cut.numbers["bending"]
        if self.mesh.one_way_diagonals:
            why = f"bend {self.mesh.diagonal_bias:.1f} times as hard in one direction as in another on this mesh"
            fix = "use the curvature model, or an equilateral mesh"
            raise SceneError(f"{cut.name}.bending", why, bending, fix)
        dihedral = model == "dihedral"
        if curved and not dihedral:
            fix = "use the dihedral model"
            raise SceneError(f"{cut.name}.curved", "is not possible for quadratic bending, flat at rest", True, fix)
        count = len(self.stencils)
        if dihedral:
            scale = self.length**2 / self.area
            rest = rest_angles(self.mesh, self.stencils) if curved else np.zeros(count)
        else:
            scale, rest = np.ones(count), self._cotangents()
        add_elastic_group(
            cut.scene,
            model,
            cut.particles[self.stencils],
            name=f"{cut.name}_bend",
            rest=rest,
            scale=scale,
            stiffness=(f"{cut.fabric}_bending", bending, "N m"),
            damping=(f"{cut.fabric}_bend_damping", cut.numbers["bend_damping"]),
        )


def rest_angles(mesh: TriangleMesh, stencils: Array) -> Array:
    """(count,) rad, of the mesh's shape in space at hinges [v0, v1, a, b]; as in core/constraints/hinge_angle.h."""
    x0, x1, a, b = np.swapaxes(mesh.vertices[stencils], 0, 1)
    edge = x1 - x0
    normal_a, normal_b = np.cross(edge, a - x0), np.cross(b - x0, edge)
    length = np.linalg.norm(edge, axis=1)
    angles: Array = np.arctan2(length * (normal_a * (b - x0)).sum(axis=1), (normal_a * normal_b).sum(axis=1))
    return angles


def _cotangent(a: Array, b: Array) -> Array:
    cotangent: Array = (a * b).sum(axis=1) / np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    return cotangent
