"""What hinges make of a curvature: the mesh's own factor between the hinge coefficient k and the bending rigidity B.

Hinges of the energy k/2 * 3 |e|^2 / (A0 + A1) * theta^2 on a mesh that is bent to a cylinder of curvature kappa should
hold B/2 kappa^2 per area with B = 3 k in every direction (Grinspun et al. 2003; Tamstorf & Grinspun 2013). Small
curvatures are the height field z = x.H x / 2 sampled at the vertices: linear in H, so every hinge is three numbers.
"""

from __future__ import annotations

import numpy as np

from ..arrays.types import Array, Indices


def bending_form(corners: Array, twin: Indices, inside: bool) -> Array:
    """(3, 3) form Q with B/k = q.Q q, q = (cos^2, cos sin, sin^2) of the direction of curvature from the warp axis.

    Args:
        corners: (m, 3, 2) m, material coordinates of every triangle's corners.
        twin: (3 m,) of `topology.twins`.
        inside: sum over triangles with three neighbors alone, which no border weakens.
    """
    start, end, top = (np.roll(corners, -j, axis=1).reshape(-1, 2) for j in range(3))
    along = end - start
    length = np.linalg.norm(along, axis=1)
    t = along / length[:, None]
    foot = ((top - start) * t).sum(axis=1)
    height = t[:, 0] * (top - start)[:, 1] - t[:, 1] * (top - start)[:, 0]
    area = length * height / 2

    counted = twin >= 0
    if inside:
        counted &= np.repeat((twin.reshape(-1, 3) >= 0).all(axis=1), 3)
    half, other = np.flatnonzero(counted), twin[counted]
    total = area[::3][counted.reshape(-1, 3).any(axis=1)].sum() if inside else area[::3].sum()
    if total == 0:
        return np.full((3, 3), np.nan)

    size, sa, ha = length[half], foot[half], height[half]
    sb, hb = length[other] - foot[other], height[other]
    # the angle, per curvature along the edge, mixed, and across it
    angle = np.column_stack([(sa * (sa - size) / ha + sb * (sb - size) / hb) / 2, sa - sb, (ha + hb) / 2])
    c, s = t[half].T
    turn = np.stack(
        [
            np.column_stack([c * c, 2 * c * s, s * s]),
            np.column_stack([-c * s, c * c - s * s, c * s]),
            np.column_stack([s * s, -2 * c * s, c * c]),
        ],
        axis=1,
    )
    per_hinge = np.einsum("hi,hij->hj", angle, turn)
    stiffness = 3 * size**2 / (area[half] + area[other]) / 2  # half of the hinge: the other triangle counts it again
    form: Array = (per_hinge.T * stiffness) @ per_hinge / total
    return form


def ratio(form: Array, directions: Array) -> Array:
    """B/k for curvatures along `directions` (rad from the warp axis)."""
    c, s = np.cos(directions), np.sin(directions)
    q = np.stack([c * c, c * s, s * s], axis=-1)
    value: Array = np.einsum("...i,ij,...j->...", q, form, q)
    return value
