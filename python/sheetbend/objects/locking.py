"""By how much a mesh of linear tetrahedra is too stiff: its slowest motion beside that of quadratic ones."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arrays.types import Array
from ..mesh import SolidMesh
from ..optional import MissingExtraError, require

_MOST = 5_000  # tetrahedra, above which the answer takes more than some seconds
_EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))
_A, _B = (5.0 + 3.0 * np.sqrt(5.0)) / 20.0, (5.0 - np.sqrt(5.0)) / 20.0


class LockingWarning(UserWarning):
    """The elements of a solid are too stiff."""


def locking(mesh: SolidMesh, poisson: float, held: Array) -> float | None:
    """The factor by which tetrahedra make E look larger: the square of the lowest frequency of the mesh over that of
    quadratic tetrahedra of ten nodes with one mean volume each on the same mesh, in linear elasticity.

    Args:
        held: (n,) which vertices do not move; a mesh that nothing holds is clamped at one end of its longest side.

    Returns:
        The factor; None without SciPy, and for meshes of more than 5,000 elements.
    """
    try:
        linalg = require("scipy.sparse.linalg", "fit")
    except MissingExtraError:
        return None
    if len(mesh.elements) > _MOST or mesh.elements.shape[1] != 4:
        return None
    if not held.any():
        axis = int(np.ptp(mesh.vertices, axis=0).argmax())
        along = mesh.vertices[:, axis]
        held = along <= along.min() + 0.02 * np.ptp(along)
    try:
        return _lowest(mesh, poisson, held, linear=True) / _lowest(mesh, poisson, held, linear=False)
    except (linalg.ArpackError, RuntimeError, np.linalg.LinAlgError):  # nothing that holds it, or no convergence
        return None


def _lowest(mesh: SolidMesh, poisson: float, held: Array, *, linear: bool) -> float:
    """The lowest eigenvalue omega^2 for E = 1 and density 1."""
    linalg = require("scipy.sparse.linalg", "fit")
    gradients, volumes, _ = (part if part.ndim < 3 else part[:, 0] for part in mesh.points)
    volume = volumes[:, 0]
    if linear:
        elements, still = mesh.elements, held
        strain = _strain(gradients)[None]
        weights = [1.0]
    else:
        elements, still = _with_midpoints(mesh, held)
        points = np.full((4, 4), _B) + (_A - _B) * np.eye(4)
        strain = np.stack([_strain(_quadratic_gradients(own, gradients)) for own in points])
        weights = [0.25] * 4
    mu2, lame = 1.0 / (1.0 + poisson), poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson))
    weight = mu2 * np.array([1.0, 1.0, 1.0, 0.5, 0.5, 0.5])
    mean = sum(w * s[:, :3].sum(axis=1) for w, s in zip(weights, strain, strict=True))
    K = lame * np.einsum("m,mi,mj->mij", volume, mean, mean)
    for w, s in zip(weights, strain, strict=True):
        K += w * np.einsum("m,mci,c,mcj->mij", volume, s, weight, s)
    dofs = (3 * elements[:, :, None] + np.arange(3)).reshape(len(elements), -1)
    rows, columns = np.repeat(dofs, dofs.shape[1], axis=1), np.tile(dofs, dofs.shape[1])
    size = 3 * len(still)
    free = np.flatnonzero(np.repeat(~still, 3))
    from_parts = require("scipy.sparse", "fit").coo_matrix
    whole: Any = from_parts((K.ravel(), (rows.ravel(), columns.ravel())), shape=(size, size)).tocsc()
    mass = _masses(elements, volume, len(still))
    scale = 1.0 / np.sqrt(np.repeat(mass, 3)[free])
    scaled = whole[free][:, free].multiply(scale[:, None]).multiply(scale[None, :]).tocsc()
    symmetric = {"permc_spec": "MMD_AT_PLUS_A", "diag_pivot_thresh": 0.0, "options": {"SymmetricMode": True}}
    inverse = linalg.LinearOperator(scaled.shape, linalg.splu(scaled, **symmetric).solve, dtype=float)
    (lowest,) = linalg.eigsh(scaled, k=1, sigma=0.0, which="LM", OPinv=inverse, tol=1e-6, return_eigenvectors=False)
    return float(lowest)


def _masses(elements: Array, volume: Array, count: int) -> Array:
    """Lumped: of four nodes a quarter each; of ten as the diagonal of
    the consistent matrix has it (Hinton, Rock & Zienkiewicz 1976)."""
    if elements.shape[1] == 4:
        share = np.full(4, 0.25)
    else:
        diagonal = np.array([6.0] * 4 + [32.0] * 6)
        share = diagonal / diagonal.sum()
    return np.bincount(elements.ravel(), (volume[:, None] * share).ravel(), count)


def _strain(gradients: Array) -> Array:
    """(m, 6, 3 n) from displacements to (e_11, e_22, e_33, 2 e_23, 2 e_13, 2 e_12), of gradients (m, n, 3)."""
    m, n, _ = gradients.shape
    B = np.zeros((m, 6, n, 3))
    for c in range(3):
        B[:, c, :, c] = gradients[:, :, c]
    for c, (a, b) in enumerate(((1, 2), (0, 2), (0, 1)), start=3):
        B[:, c, :, a], B[:, c, :, b] = gradients[:, :, b], gradients[:, :, a]
    return B.reshape(m, 6, 3 * n)


def _quadratic_gradients(own: Array, gradients: Array) -> Array:
    """(m, 10, 3) at the barycentric coordinates (4,), from their gradients (m, 4, 3)."""
    corners = (4.0 * own - 1.0)[None, :, None] * gradients
    sides = [4.0 * (own[i] * gradients[:, j] + own[j] * gradients[:, i]) for i, j in _EDGES]
    return np.concatenate([corners, np.stack(sides, axis=1)], axis=1)


def _with_midpoints(mesh: SolidMesh, held: Array) -> tuple[Array, Array]:
    """Elements (m, 10) and which of all nodes are held: a midpoint is where both ends are."""
    pairs = np.sort(mesh.elements[:, np.array(_EDGES)], axis=2)
    distinct, place = np.unique(pairs.reshape(-1, 2), axis=0, return_inverse=True)
    middle = len(mesh.vertices) + place.reshape(len(mesh.elements), 6)
    return np.hstack([mesh.elements, middle]), np.concatenate([held, held[distinct].all(axis=1)])
