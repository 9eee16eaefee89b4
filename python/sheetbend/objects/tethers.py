"""Long-range attachments of a cloth (Kim, Chentanez & Mueller-Fischer 2012)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import check_kind, indices, is_number
from ..errors import SceneError
from ..optional import require
from ..scene.given import check_scene
from ..scene.scene import Scene
from .cloth import Cloth


def add_tethers(
    scene: Scene, cloth: Cloth, anchors: ArrayLike | None = None, *, stretch: float = 0.0, compliance: float = 0.0
) -> str:
    """Keep every vertex of a cloth within reach of its nearest anchor, and return the group's name, `<cloth>_tethers`.

    They keep Gauss-Seidel from stretching a stiff cloth with few sweeps, and need that method. Where they are taut they
    hide the fabric's own stiffness: leave them out of fits of it.

    Args:
        scene: of the cloth.
        cloth: as `add_cloth` returned it.
        anchors: (k,) numbers of vertices; those that are pinned or driven by default.
        stretch: how much longer a tether is than the way along the mesh's edges to the anchor, which is never shorter
            than that across the fabric.
        compliance: m/N, of a taut tether.

    Raises:
        SceneError: no anchors, or a negative stretch or compliance.
        MissingExtraError: scipy is not installed (extra `fit`).
    """
    check_scene(scene)
    check_kind("cloth", cloth, Cloth, "give what sb.add_cloth returns")
    name = f"{cloth.name}_tethers"
    if not (is_number(stretch) and stretch >= 0):
        raise SceneError(f"{name}.stretch", "must not be negative", stretch, "give a strain such as 0.02")
    if not (is_number(compliance) and compliance >= 0):
        raise SceneError(f"{name}.compliance", "must not be negative", compliance, "give m/N, or 0")
    count = len(cloth.mesh.vertices)
    fixed = np.isin(cloth.particles, [*scene.pinned, *scene.boundary.driven])
    chosen = np.flatnonzero(fixed) if anchors is None else indices(f"{name}.anchors", anchors, count)
    if not len(chosen):
        raise SceneError(f"{name}.anchors", "are none", 0, "pin or drive vertices first, or give anchors")
    edges = cloth.mesh.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    corners = cloth.mesh.corners
    lengths = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).ravel()
    # an edge of two triangles has one length, and csgraph would add the two
    _, first = np.unique(np.sort(edges, axis=1), axis=0, return_index=True)
    graph = require("scipy.sparse", "fit").coo_array((lengths[first], edges[first].T), (count, count)).tocsr()
    dijkstra = require("scipy.sparse.csgraph", "fit").dijkstra
    reach, _, nearest = dijkstra(graph, directed=False, indices=chosen, return_predecessors=True, min_only=True)
    tied = np.flatnonzero(~fixed & np.isfinite(reach) & (reach > 0))
    pairs = cloth.particles[np.column_stack([nearest[tied], tied])]
    return scene.add_constraints(
        "tether", pairs, name=name, rest=reach[tied] * (1.0 + stretch), compliance=np.full(len(tied), compliance)
    )
