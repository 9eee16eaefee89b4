"""Elements of solids: bricks of eight nodes and tetrahedra of four, their shape functions, quadrature and faces.

Nodes are numbered as in VTK and Gmsh: four of a brick counterclockwise around its lower face as seen from above, then
those above them; of a tetrahedron three counterclockwise as seen from the fourth.
"""

from __future__ import annotations

import numpy as np

from ..arrays.types import Array, Indices

CORNERS = np.array(
    [[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]], dtype=float
)
"""Of a brick in its own coordinates, -1 to 1."""
GAUSS = CORNERS / np.sqrt(3.0)
"""The 2 x 2 x 2 points of Gauss, each of weight 1."""
FACES = {
    8: np.array([[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]),
    4: np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]),
}
"""By number of nodes, counterclockwise as seen from outside."""


def brick_shape(own: Array) -> tuple[Array, Array]:
    """Shape functions (..., 8) of a brick at own coordinates (..., 3), and their derivatives (..., 8, 3)."""
    factors = 1.0 + own[..., None, :] * CORNERS
    x, y, z = np.moveaxis(factors, -1, 0)
    slopes = np.stack([CORNERS[:, 0] * y * z, CORNERS[:, 1] * x * z, CORNERS[:, 2] * x * y], axis=-1)
    return x * y * z / 8.0, slopes / 8.0


def quadrature(corners: Array) -> tuple[Array, Array, Array]:
    """Gradients of the shape functions with respect to the material's place, volumes, and volumes of nodes.

    Args:
        corners: (m, 8 or 4, 3) m, the elements' nodes.

    Returns:
        (m, q, n, 3) 1/m at the q quadrature points, 8 of a brick and 1 of a tetrahedron, the volumes (m, q) m^3 that
        they stand for, negative where an element is turned inside out, and each node's share (m, n) m^3.
    """
    if corners.shape[1] == 4:
        edges = corners[:, 1:] - corners[:, :1]
        volume = np.linalg.det(edges) / 6.0
        own = np.linalg.inv(np.where(volume[:, None, None] == 0.0, np.eye(3), edges))  # columns: of nodes 1 to 3
        gradients = np.concatenate([-own.sum(axis=2)[:, None], np.swapaxes(own, 1, 2)], axis=1)
        return gradients[:, None], volume[:, None], np.repeat(volume[:, None] / 4.0, 4, axis=1)
    values, slopes = brick_shape(GAUSS)
    stretch = np.einsum("mnx,qno->mqxo", corners, slopes)  # of the place by own coordinates
    volumes = np.linalg.det(stretch)
    inverse = np.linalg.inv(np.where(volumes[..., None, None] == 0.0, np.eye(3), stretch))
    gradients = np.einsum("qno,mqox->mqnx", slopes, inverse)
    return gradients, volumes, np.einsum("mq,qn->mn", volumes, values)


def own_coordinates(corners: Array, point: Array) -> Array:
    """(m, 8 or 4) weights of the nodes (m, 8 or 4, 3) at a point (3,): in an element where all are from 0 to 1."""
    if corners.shape[1] == 4:
        last = np.linalg.solve(np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2), (point - corners[:, 0])[..., None])
        return np.concatenate([1.0 - last[..., 0].sum(axis=1, keepdims=True), last[..., 0]], axis=1)
    own = np.zeros((len(corners), 3))
    for _ in range(30):
        values, slopes = brick_shape(own)
        off = point - np.einsum("mn,mnx->mx", values, corners)
        step = np.linalg.solve(np.einsum("mnx,mno->mxo", corners, slopes), off[..., None])[..., 0]
        own = np.clip(own + step, -2.0, 2.0)  # outside of the element the map may fold
        if np.abs(step).max(initial=0.0) < 1e-14:
            break
    far = np.abs(own).max(axis=1, keepdims=True) > 1.0 + 1e-6
    return np.where(far, -1.0, brick_shape(np.clip(own, -1.0, 1.0))[0])


def surface_faces(elements: Indices) -> Indices:
    """(f, 4 or 3) faces that belong to one element, counterclockwise as seen from outside."""
    faces = elements[:, FACES[elements.shape[1]]].reshape(-1, FACES[elements.shape[1]].shape[1])
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    found: Indices = faces[np.sort(first[count == 1])]
    return found
