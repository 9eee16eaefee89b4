"""Rotations as matrices (..., 3, 3), quaternions (..., 4) in the order (x, y, z, w), and rotation vectors (3,) rad."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..errors import SceneError
from .checks import finite
from .types import Array

ROUNDING = 1e-6  # of a matrix that was printed with six digits


def rotation_matrix(field: str, given: ArrayLike | None) -> Array:
    """(3, 3) from a matrix, a quaternion (4,) of any length, or a rotation vector (3,); None is no rotation.

    Raises:
        SceneError: another shape, NaN, a quaternion of no length, or a matrix that is no rotation.
    """
    if given is None:
        return np.eye(3)
    a = finite(field, given, None, SceneError)
    if a.shape == (3,):
        return matrices_of(quaternion_of(a))
    if a.shape == (4,):
        if not a.any():
            raise SceneError(field, "has no length", a.tolist(), "give a quaternion (x, y, z, w)")
        return matrices_of(a / np.linalg.norm(a))
    if a.shape != (3, 3):
        fix = "give a matrix (3, 3), a quaternion (x, y, z, w) or a rotation vector (3,) in rad"
        raise SceneError(field, "has the wrong shape", a.shape, fix)
    off = float(abs(a.T @ a - np.eye(3)).max())
    if off > ROUNDING or np.linalg.det(a) < 0:
        problem = "is a reflection" if off <= ROUNDING else "is not orthonormal"
        raise SceneError(field, problem, a.tolist(), "give a rotation: its columns are the body's axes")
    u, _, vt = np.linalg.svd(a)
    return np.asarray(u @ vt)


def quaternion_of(vector: Array) -> Array:
    """(4,) of a rotation vector (3,)."""
    angle = float(np.linalg.norm(vector))
    half = 0.5 * np.sinc(angle / (2.0 * np.pi))  # sin(angle/2)/angle
    return np.append(half * vector, np.cos(angle / 2.0))


def product(first: Array, second: Array) -> Array:
    """(4,) the rotation by the second quaternion, then by the first."""
    a, aw, b, bw = first[:3], first[3], second[:3], second[3]
    return np.append(aw * b + bw * a + np.cross(a, b), aw * bw - a @ b)


def matrices_of(quaternions: ArrayLike) -> Array:
    """(..., 3, 3) of unit quaternions (..., 4)."""
    x, y, z, w = np.moveaxis(np.asarray(quaternions, dtype=float), -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def quaternions_of(matrices: ArrayLike) -> Array:
    """Unit quaternions (..., 4) of rotations (..., 3, 3); of a sequence (n, 3, 3) each on the side of the one before.

    Each is the eigenvector of the largest eigenvalue of a symmetric matrix (Bar-Itzhack 2000, J. Guid. Control Dyn. 23,
    1085), which also takes the nearest rotation of a matrix that is one up to rounding.
    """
    m = np.asarray(matrices, dtype=float)
    k = np.empty((*m.shape[:-2], 4, 4))
    k[..., :3, :3] = m + np.swapaxes(m, -1, -2)
    trace = np.trace(m, axis1=-2, axis2=-1)
    k[..., :3, :3] -= trace[..., None, None] * np.eye(3)
    k[..., 3, 3] = trace
    k[..., :3, 3] = k[..., 3, :3] = np.stack(
        [m[..., 2, 1] - m[..., 1, 2], m[..., 0, 2] - m[..., 2, 0], m[..., 1, 0] - m[..., 0, 1]], axis=-1
    )
    q = np.asarray(np.linalg.eigh(k)[1][..., -1])
    if q.ndim == 2:
        return continuous(q if q[0, 3] >= 0 else -q)
    return q * np.where(q[..., 3:] < 0, -1.0, 1.0)


def continuous(quaternions: Array) -> Array:
    """Quaternions (n, 4), each on the side of the one before: q and -q are one rotation."""
    flips = np.where((quaternions[1:] * quaternions[:-1]).sum(axis=1) < 0, -1.0, 1.0)
    return quaternions * np.cumprod(np.append(1.0, flips))[:, None]


def rotation_vectors(quaternions: Array, first: Array) -> Array:
    """Unit quaternions (knots, 4), (x, y, z, w), as vectors (knots, 3) rad that are continuous from knot to knot; the
    first one is the nearest to `first`, (3,)."""
    found: list[Array] = []
    for q in quaternions:
        v, w = q[:3], q[3]
        sine = float(np.linalg.norm(v))
        angle = 2.0 * float(np.arctan2(sine, w))
        axis = v / sine if sine > 0.0 else np.array([0.0, 0.0, 1.0])
        near = found[-1] if found else first
        turns_more = np.round((near @ axis - angle) / (2.0 * np.pi))
        found.append(axis * (angle + 2.0 * np.pi * turns_more))
    return np.array(found)


def cross_matrix(v: ArrayLike) -> Array:
    """(3, 3) whose product with a vector is v x that vector."""
    return np.cross(np.asarray(v, dtype=float), np.eye(3)).T


def unit_quaternions(field: str, quaternions: ArrayLike, shape: tuple[int, ...]) -> Array:
    """Quaternions of a shape (..., 4), made to have length 1.

    Raises:
        SceneError: shapes, NaN, or one of no length.
    """
    q = finite(field, quaternions, shape, SceneError)
    size = np.linalg.norm(q, axis=-1, keepdims=True)
    if not (size > 0).all():
        raise SceneError(field, "has no length", int(np.argmin(size)), "give (x, y, z, w)")
    return np.asarray(q / size)


def rotated(quaternions: Array, vectors: Array) -> Array:
    """Vectors (..., 3) turned by unit quaternions (..., 4), (x, y, z, w); shapes broadcast."""
    xyz, w = quaternions[..., :3], quaternions[..., 3:]
    twice = 2.0 * np.cross(xyz, vectors)
    return np.asarray(vectors + w * twice + np.cross(xyz, twice))
