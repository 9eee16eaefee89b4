"""Shape matching: vertices of a solid in clusters, each of which is drawn to its own shape at rest, turned and moved to
where it fits best (Mueller, Heidelberger, Teschner & Gross 2005, ACM Trans. Graph. 24, 471).

A cluster has a frame, four nodes like those of a body: a center p and axes a_k that stay orthonormal. A vertex with the
place X in the cluster at rest is drawn to p + X_k a_k, by the energy 3 E v |x - p - X_k a_k|^2/(2 R^2): v is its share
of the cluster's volume V, and R^2 = sum v |X|^2/V. At rest the axes are the rotation of the polar decomposition of
sum v x X'. A cluster of equal extents that strains evenly has Young's modulus E and Poisson's ratio 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import check_kind, finite, indices
from ..arrays.types import Array
from ..errors import SceneError
from ..mesh import SolidMesh
from ..quantities.quantities import Term
from ..scene.scene import Scene
from .stiffness_field import StiffnessField, field_of_modes, modes_of

SHARE = 1e-3
"""The part of the mass that moves with the frames. A frame without inertia would not be found by every method; one with
this share of its cluster's mass follows within a 30th of the slowest period. What it has, the vertices have not, so
that the solid keeps its mass and its moments of inertia."""
FLAT = 1e-6  # the least over the largest second moment of a cluster


def cluster_boxes(mesh: SolidMesh, size: float) -> list[Array]:
    """Group the vertices of a mesh into clusters: boxes of a grid, each of which overlaps the next by half.

    Args:
        size: m, of a box; several elements.

    Returns:
        Vertices of each cluster. Boxes whose vertices lie in one plane are left out.

    Raises:
        SceneError: a size that is not positive, or no box with vertices in all directions.
    """
    check_kind("clusters.mesh", mesh, SolidMesh, "give such as sb.mesh.bricks(size, cells)", SceneError)
    length = float(finite("clusters.size", size, (), SceneError))
    if not length > 0:
        raise SceneError("clusters.size", "must be positive", length, "give m, several elements")
    x = mesh.vertices
    lower, extent = x.min(axis=0), np.ptp(x, axis=0)
    counts = np.maximum(np.ceil(2.0 * extent / length - 1.0 - 1e-9), 1).astype(int)
    found = []
    for cell in np.ndindex(*counts):
        first = lower + 0.5 * length * np.array(cell)
        inside = np.flatnonzero(((x >= first - 1e-9 * length) & (x <= first + (1.0 + 1e-9) * length)).all(axis=1))
        if len(inside) > 3 and not _is_flat(_moments(x[inside], np.ones(len(inside)))):
            found.append(inside)
    if not found:
        raise SceneError("clusters.size", "leaves no cluster with vertices in all directions", length, "give more")
    return found


class SolidClusters:
    """Adds the clusters of a solid to a scene.

    Args:
        volumes: (n,) m^3, of the vertices.
        free: (n,) which vertices can move; clusters that have none are left out.
    """

    def __init__(
        self,
        scene: Scene,
        mesh: SolidMesh,
        name: str,
        material: str,
        particles: Array,
        free: Array,
        clusters: Sequence[ArrayLike],
    ) -> None:
        self.scene, self.mesh, self.name, self.material, self.particles = scene, mesh, name, material, particles
        count = len(mesh.vertices)
        every = [np.unique(indices(f"{name}.clusters[{c}]", own, count)) for c, own in enumerate(clusters)]
        times = np.bincount(np.concatenate([*every, np.zeros(0, dtype=int)]), minlength=count)
        alone = np.flatnonzero((times == 0) & free)
        if len(alone):
            fix = "put every vertex that is not held into a cluster"
            raise SceneError(f"{name}.clusters", "leave vertices out", alone[:5].tolist(), fix)
        self.clusters = {c: own for c, own in enumerate(every) if free[own].any()}
        self.volumes = volumes_of(mesh) / np.maximum(times, 1)
        self.arms: dict[int, Array] = {}
        self.moments: dict[int, Array] = {}
        for c, own in self.clusters.items():
            r, v = mesh.vertices[own], self.volumes[own]
            moments, axes = np.linalg.eigh(_moments(r, v))
            if _is_flat(np.diag(moments)):
                fix = "give clusters of more vertices, in all directions"
                raise SceneError(f"{name}.clusters[{c}]", "lies in a plane", own[:8].tolist(), fix)
            axes[:, 0] *= np.linalg.det(axes)
            self.arms[c], self.moments[c] = (r - v @ r / v.sum()) @ axes, moments

    def add(
        self, E: ArrayLike, modes: int, damping: float | None, positions: Array, velocities: Array | None
    ) -> StiffnessField | None:
        """The frames, where they fit the positions (n, 3), and the rows that hold the vertices to them.

        Args:
            modes: by how many smooth modes the logarithm of one E varies over the clusters.
        """
        tau, names = f"{self.material}_damping", self._moduli(E)
        field = self._field(names[0], modes) if modes else None
        if damping is not None:
            self.scene.add_quantity(tau, damping, "s", shared=True)
        stencils, places, terms, axes = [], [], [], []
        for c, own in self.clusters.items():
            frame = self._frame(c, positions, np.zeros_like(positions) if velocities is None else velocities)
            stencils += [[frame[0], int(p), *frame[1:]] for p in self.particles[own]]
            places.append(self.arms[c])
            axes.append(frame[1:])
            terms += self._masses(c, frame)
        self.scene.add_constraints("rigid", axes, name=f"{self.name}_frames")
        none, group = np.zeros(len(stencils)), f"{self.name}_matching"
        self.scene.add_constraints(
            "coincide_particle",
            stencils,
            name=group,
            compliance=none,
            damping=none if damping is not None else None,
            rest=np.concatenate(places),
        )
        at = self.scene.places_of_group(group).first
        for k, (c, own) in enumerate(self.clusters.items()):
            v = self.volumes[own]
            stiff, rows = 3.0 * v * v.sum() / self.moments[c].sum(), at + np.arange(len(own))
            more = () if field is None else tuple(zip(field.modes, field.shapes[k].tolist(), strict=True))
            less = tuple((mode, -shape) for mode, shape in more)
            terms.append(Term("compliance", rows, 1.0 / stiff, ((names[c], "inverse"),), less))
            if damping is not None:
                terms.append(Term("damping", rows, stiff, ((tau, "identity"), (names[c], "identity")), more))
            at += len(own)
        self.scene.add_terms(terms)
        return field

    def _field(self, stiffness: str, modes: int) -> StiffnessField:
        """Over the clusters that can move; those that share vertices are neighbors."""
        every = list(self.clusters.values())
        if modes >= len(every):
            most = f"give at most {len(every) - 1}, one fewer than clusters that can move"
            raise SceneError(f"{self.name}.stiffness_modes", "are more than the clusters have", modes, most)
        weights = [self.volumes[own] / self.volumes[own].sum() for own in every]
        centers = np.array([w @ self.mesh.vertices[own] for w, own in zip(weights, every, strict=True)])
        sets = [set(own.tolist()) for own in every]
        linked = [(a, b) for a, b in combinations(range(len(every)), 2) if sets[a] & sets[b]]
        values, shapes = modes_of(centers, np.array(linked, dtype=np.intp).reshape(-1, 2))
        return field_of_modes(self.scene, self.material, stiffness, modes, values, shapes, centers)

    def _moduli(self, E: ArrayLike) -> list[str]:
        """The quantity of each cluster."""
        whole = f"{self.material}_E"
        given = np.asarray(E, dtype=float)
        if given.ndim == 0:
            self.scene.add_quantity(whole, float(given), "Pa", shared=True)
            return [whole] * (max(self.clusters) + 1)
        return [self.scene.add_quantity(f"{whole}_{c}", float(e), "Pa", shared=True) for c, e in enumerate(given)]

    def _frame(self, c: int, positions: Array, velocities: Array) -> list[int]:
        """Adds the center and the axes of a cluster, as its vertices turn and move."""
        own, arms = self.clusters[c], self.arms[c]
        v = self.volumes[own] / self.volumes[own].sum()
        x, u = positions[own], velocities[own]
        center, mean = v @ x, v @ u
        left, _, right = np.linalg.svd((x - center).T @ (v[:, None] * arms))
        axes = (left * [1.0, 1.0, np.linalg.det(left @ right)]) @ right
        r = x - center
        spin = np.linalg.solve(
            (v * (r * r).sum(axis=1)).sum() * np.eye(3) - r.T @ (v[:, None] * r), v @ np.cross(r, u - mean)
        )
        nodes = [
            *self.scene.add_particles([center], 0.0, [mean]).tolist(),
            *self.scene.add_hidden(axes.T, 0.0, np.cross(spin, axes.T)).tolist(),
        ]
        self.scene.rotors[f"{self.name}_{c}"] = [*nodes, None]
        return nodes

    def _masses(self, c: int, frame: list[int]) -> list[Term]:
        density = ((f"{self.material}_density", "identity"),)
        shares = SHARE * np.array([self.volumes[self.clusters[c]].sum(), *self.moments[c]])
        return [Term("mass", np.array(frame), shares, density)]


def volumes_of(mesh: SolidMesh) -> Array:
    """(n,) m^3, of the vertices: each has its share of the elements around it."""
    return np.bincount(mesh.elements.ravel(), mesh.points[2].ravel(), len(mesh.vertices))


def _moments(x: Array, v: Array) -> Array:
    """(3, 3) second moments about the center."""
    r = x - v @ x / v.sum()
    found: Array = r.T @ (v[:, None] * r)
    return found


def _is_flat(moments: Array) -> bool:
    w = np.linalg.eigvalsh(moments)
    return bool(w[0] <= FLAT * w[-1])
