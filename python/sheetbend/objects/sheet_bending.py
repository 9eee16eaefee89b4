"""The bending of a cloth by the curvature of its triangles, with rigidities along warp and weft that hold on every
regular mesh."""

from __future__ import annotations

import warnings

import numpy as np

from ..arrays.types import Array
from ..errors import SceneError
from ..mesh import TriangleMesh
from ..quantities.quantities import Term
from .cloth_cut import Cut
from .elastic_group import add_elastic_group
from .hinges import rest_angles

IRREGULAR = 0.2  # share of inner vertices without six neighbors above which a user is told
WEAKER = (
    "of the inner vertices do not have six neighbors; a bent sheet will resist with as little as 0.75 of `bending`. "
    "Use sheetbend.mesh.equilateral, or a grid of one-way diagonals"
)


class SheetCurvature:
    """The triangles of a mesh that have three neighbors, as core/constraints/sheet_curvature.h takes them.

    Triangles at a border have the curvature of their neighbors: their area counts there, unless no hinge of theirs can
    move, and only on neighbors with one that can. A clamp of two rows of held vertices or more acts in the middle
    between the last row and the one before it: the hinges on the last row count half a row of triangles on either side.

    Attributes:
        stencils: (count, 6) vertices: the triangle's, then those opposite across its edges v0v1, v1v2, v2v0.
        corners: (count, 3, 2) m, of the triangle in material coordinates.
        matrix: (count, 3, 3) 1/m: kappa_uu, kappa_vv and kappa_uv from the three angles.
        area: (count,) m^2.
        angles: (count, 3) rad, of the mesh's shape in space.
    """

    def __init__(self, mesh: TriangleMesh, free: Array) -> None:
        self.mesh = mesh
        hinge = _hinges_of_triangles(mesh)
        full = (hinge >= 0).all(axis=1)
        if not full.any():
            why = "needs triangles with three neighbors"
            raise SceneError("bending", why, mesh, "use a mesh of at least two cells across, or the dihedral model")
        moves = free[mesh.triangles].any(axis=1)
        moves |= ((hinge >= 0) & free[mesh.hinges[hinge]].any(axis=2)).any(axis=1)
        area = _with_borders(mesh, hinge, moves)[full]
        hinge, corners = hinge[full], mesh.corners[full]
        side = (mesh.hinge_triangles[hinge, 0] != np.flatnonzero(full)[:, None]).astype(
            int
        )  # which side the triangle is
        across = np.take_along_axis(mesh.hinges[hinge], 3 - side[..., None], axis=2)[..., 0]
        stencils = np.column_stack([mesh.triangles[full], across])
        kept = free[stencils].any(axis=1)
        self.stencils, self.area = stencils[kept], area[kept]
        self.corners = corners[kept]
        self.matrix = _curvature_matrix(corners, _unfolded(mesh, hinge, side, corners))[kept]
        self.angles = rest_angles(mesh, mesh.hinges)[hinge][kept]

    def add(self, cut: Cut, curved: bool) -> None:
        """Add them to the cut's scene as the group `<name>_bend`.

        The quantities are `<fabric>_bending`, where given `_bending_weft` and `_bending_twist`, N m, and of what yields
        `<fabric>_yield_curvature`, 1/m, and `_yield_share`. Each triangle that yields has a set, a hidden node, zero at
        first. Another size of the flat cloth leaves angles at rest as they are.
        """
        scene, name, fabric, given = cut.scene, cut.name, cut.fabric, cut.numbers
        yields = given["yield_curvature"] is not None
        irregular = _irregular(self.mesh)
        if irregular > IRREGULAR:
            warnings.warn(f"{name}: {irregular:.0%} {WEAKER}", UserWarning, stacklevel=3)
        count = len(self.stencils)
        rest = np.zeros((count, 16 if yields else 14))
        rest[:, :9] = self.matrix.reshape(count, 9)
        rest[:, 9:11] = (1.0, np.sqrt(2.0))
        if curved:
            rest[:, 11:14] = self.angles
        bending = f"{fabric}_bending"
        ratios = [(9, "bending_weft", 1.0), (10, "bending_twist", np.sqrt(2.0))]
        ratios = [ratio for ratio in ratios if given[ratio[1]] is not None]
        for place, _, _ in ratios:
            rest[:, place] = 0.0
        kind, stencils = "sheet_curvature", cut.particles[self.stencils]
        if yields:
            kind = "yielding_sheet_curvature"
            stencils = np.column_stack([stencils, scene.add_hidden(np.zeros((count, 3)), 1.0, pinned=True)])
            rest[:, 14:] = given["yield_share"], given["yield_curvature"]
        values = add_elastic_group(
            scene,
            kind,
            stencils,
            name=f"{name}_bend",
            rest=rest,
            scale=self.area,
            stiffness=(bending, given["bending"], "N m"),
            damping=(f"{fabric}_bend_damping", given["bend_damping"]),
            size=cut.size,
        )
        cut.size.curvatures(scene, f"{name}_bend", values, self.corners)
        for place, label, factor in ratios:
            rigidity = scene.add_quantity(f"{fabric}_{label}", given[label], "N m", shared=True)
            scene.add_terms([Term("rest", values[:, place], factor, ((rigidity, "sqrt"), (bending, "inverse_sqrt")))])
        if yields:
            scene.group(f"{name}_bend")[0].rest[:, 14:] = 0.0
            for place, label, unit in ((14, "yield_share", ""), (15, "yield_curvature", "1/m")):
                quantity = scene.add_quantity(f"{fabric}_{label}", given[label], unit, shared=True)
                scene.add_terms([Term("rest", values[:, place], 1.0, ((quantity, "identity"),))])


def _hinges_of_triangles(mesh: TriangleMesh) -> Array:
    """(m, 3) the hinge on each triangle's edges v0v1, v1v2, v2v0; -1 at a border."""
    found = np.full((len(mesh.triangles), 3), -1)
    for side in (0, 1):
        triangles = mesh.hinge_triangles[:, side]
        first = mesh.hinges[:, side]  # v0 of the one, v1 of the other: where the triangle's own edge starts
        place = (mesh.triangles[triangles] == first[:, None]).argmax(axis=1)
        found[triangles, place] = np.arange(len(mesh.hinges))
    return found


def _with_borders(mesh: TriangleMesh, hinge: Array, moves: Array) -> Array:
    """(m,) m^2, areas after every triangle that lacks a neighbor has given its own to those nearer to complete ones.

    Args:
        moves: (m,) whether a hinge of the triangle can; the area of the others, inside a clamp, does not count.
    """
    neighbor = np.where(hinge[..., None] >= 0, mesh.hinge_triangles[hinge], -1)
    own = np.arange(len(hinge))[:, None]
    neighbor = np.where(neighbor[..., 0] == own, neighbor[..., 1], neighbor[..., 0])
    distance = np.where((hinge >= 0).all(axis=1) & moves, 0, -1)
    step = 0
    while (distance < 0).any():
        near = ((neighbor >= 0) & (distance[neighbor] == step)).any(axis=1) & (distance < 0)
        if not near.any():
            if not moves[distance < 0].any():
                break
            raise SceneError("bending", "cannot reach a part of the mesh", mesh, "leave out parts of a triangle or two")
        step += 1
        distance[near] = step
    area = np.where(moves, mesh.areas, 0.0)
    for d in range(step, 0, -1):
        for t in np.flatnonzero((distance == d) & (area > 0)):
            to = [n for n in neighbor[t] if n >= 0 and distance[n] == d - 1]
            area[to] += area[t] / len(to)
    return area


def _unfolded(mesh: TriangleMesh, hinge: Array, side: Array, corners: Array) -> Array:
    """(count, 3, 2) m, the vertices opposite, each neighbor laid flat beside the triangle."""
    places = np.empty_like(corners)
    for k in range(3):
        other = mesh.hinge_triangles[hinge[:, k], 1 - side[:, k]]
        start = np.take_along_axis(mesh.hinges[hinge[:, k]], side[:, k, None], axis=1)
        local = (mesh.triangles[other] == start).argmax(axis=1)
        ring = mesh.corners[other][np.arange(len(other))[:, None], (local[:, None] + np.arange(3)) % 3]
        # in the neighbor the edge runs the other way: it ends at `start`, and the vertex after that is opposite
        start_there, top, end_there = ring[:, 0], ring[:, 1], ring[:, 2]
        along = start_there - end_there
        length2 = (along**2).sum(axis=1)
        s = ((top - end_there) * along).sum(axis=1) / length2
        t = (along[:, 0] * (top - end_there)[:, 1] - along[:, 1] * (top - end_there)[:, 0]) / length2
        edge = corners[:, k] - corners[:, (k + 1) % 3]
        places[:, k] = (
            corners[:, (k + 1) % 3] + s[:, None] * edge + t[:, None] * np.column_stack([-edge[:, 1], edge[:, 0]])
        )
    return places


def _curvature_matrix(corners: Array, across: Array) -> Array:
    """(count, 3, 3) the inverse of what the three angles are on surfaces z = (kappa_uu u^2 + 2 kappa_uv u v + kappa_vv
    v^2)/2, which are linear in small curvatures."""
    heights = np.concatenate([_quadratics(corners), _quadratics(across)], axis=1)  # (count, 6, 3)
    own = _gradients(corners, heights[:, :3])
    angles = np.empty((len(corners), 3, 3))
    for k in range(3):
        a, b = corners[:, k], corners[:, (k + 1) % 3]
        edge = b - a
        outward = np.column_stack([edge[:, 1], -edge[:, 0]]) / np.linalg.norm(edge, axis=1)[:, None]
        there = np.stack([b, a, across[:, k]], axis=1)
        theirs = _gradients(there, np.stack([heights[:, (k + 1) % 3], heights[:, k], heights[:, 3 + k]], axis=1))
        angles[:, k] = np.einsum("ni,nij->nj", outward, theirs - own)
    return np.linalg.inv(angles)


def _quadratics(points: Array) -> Array:
    """Heights (count, points, 3) of the surfaces of unit kappa_uu, kappa_vv and kappa_uv."""
    u, v = points[..., 0], points[..., 1]
    return np.stack([u * u / 2.0, v * v / 2.0, u * v], axis=-1)


def _gradients(corners: Array, heights: Array) -> Array:
    """(count, 2, 3) of the planes through the heights (count, 3, 3) of three points."""
    solved: Array = np.linalg.solve(corners[:, 1:] - corners[:, :1], heights[:, 1:] - heights[:, :1])
    return solved


def _irregular(mesh: TriangleMesh) -> float:
    """Share of the inner vertices that do not have six neighbors."""
    inner = np.ones(len(mesh.vertices), dtype=bool)
    inner[mesh.borders.ravel()] = False
    neighbors = np.bincount(mesh.edges.ravel(), minlength=len(inner))
    return float((neighbors[inner] != 6).mean()) if inner.any() else 0.0
