"""Strain and elastic energy of a cloth, triangle by triangle: what pictures and mesh files show."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import check_kind, finite
from ..arrays.types import Array
from ..errors import SceneError
from ..mesh import TriangleMesh
from ..motion.values import elastic_energy
from ..objects.cloth import Cloth
from ..scene.scene import Scene


def green_strain(mesh: TriangleMesh, positions: ArrayLike) -> Array:
    """(m, 3) E_uu along the warp, E_vv along the weft and the shear 2 E_uv of every triangle.

    Args:
        positions: (vertices, 3) m.

    Raises:
        SceneError: positions of another shape.
    """
    check_kind("mesh", mesh, TriangleMesh, "give such as sb.mesh.grid(width, height, nx, ny)", SceneError)
    x = finite("positions", positions, mesh.vertices.shape, SceneError)[mesh.triangles]
    sides, flat = x[:, 1:] - x[:, :1], mesh.corners[:, 1:] - mesh.corners[:, :1]
    F = np.linalg.solve(flat, sides)  # rows: where a meter along u and along v has gone
    u, v = F[:, 0], F[:, 1]
    return np.stack([((u * u).sum(-1) - 1) / 2, ((v * v).sum(-1) - 1) / 2, (u * v).sum(-1)], axis=-1)


def largest_strain(mesh: TriangleMesh, positions: ArrayLike) -> Array:
    """(m,) the larger principal Green strain of every triangle where it is positive, else 0.

    Raises:
        SceneError: positions of another shape than (vertices, 3).
    """
    u, v, shear = green_strain(mesh, positions).T
    return np.maximum((u + v) / 2 + np.hypot((u - v) / 2, shear / 2), 0.0)


def strain_fields(
    scene: Scene, cloth: Cloth, positions: ArrayLike, values: Mapping[str, float] | None = None
) -> dict[str, Array]:
    """Fields of every triangle by name: `strain_warp`, `strain_weft`, `strain_shear`, and `membrane_energy`, J/m^2.

    Args:
        scene: frozen by this call.
        positions: (particles, 3) m, of the whole scene, or of all its nodes (nodes, 3) m.
        values: quantities to change, by name.

    Returns:
        (m,) each; the energy is NaN on triangles that are held by all corners.
    """
    check_kind("scene", scene, Scene, "give the scene of the cloth")
    check_kind("cloth", cloth, Cloth, "give one of its cloths")
    given = finite("positions", positions, None, SceneError)
    if given.shape not in ((scene.particle_count, 3), (scene.node_count, 3)):
        raise SceneError("positions", "has the wrong shape", given.shape, f"give {(scene.particle_count, 3)}")
    x = scene.nodes  # a cloth has no hidden ones
    x[: len(given)] = given
    strain = green_strain(cloth.mesh, x[cloth.particles])
    fields = {f"strain_{name}": strain[:, k] for k, name in enumerate(("warp", "weft", "shear"))}
    group, _, _ = scene.group(f"{cloth.name}_membrane")
    place = {corners: k for k, corners in enumerate(map(tuple, cloth.particles[cloth.mesh.triangles].tolist()))}
    own = [place[tuple(corners)] for corners in group.particles.tolist()]
    energy = np.full(len(cloth.mesh.triangles), np.nan)
    energy[own] = elastic_energy(scene, x, values)[group.name] / cloth.mesh.areas[own]
    return {**fields, "membrane_energy": energy}
