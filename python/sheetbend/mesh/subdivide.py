"""The same fabric on a finer mesh."""

from __future__ import annotations

import numpy as np

from . import topology
from .triangle_mesh import TriangleMesh


def subdivided(mesh: TriangleMesh) -> TriangleMesh:
    """Every triangle split in four at the middles of its edges; shape and fabric stay as they are.

    Vertices keep their numbers, middles follow them. A middle is in the sets that hold both ends of its edge, where
    that edge is on the border or the set holds a triangle of it.
    """
    edges, count = topology.edges(mesh.triangles), len(mesh.vertices)
    sides = np.sort(np.stack([mesh.triangles, np.roll(mesh.triangles, -1, axis=1)], axis=-1), axis=-1)
    keys = edges @ [count, 1]  # ascending, as the edges are
    middle = count + np.searchsorted(keys, sides @ [count, 1])  # (m, 3) of the sides 01, 12, 20
    a, b, c = mesh.triangles.T
    ab, bc, ca = middle.T
    children = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
    triangles = np.stack([np.stack(child, axis=1) for child in children], axis=1).reshape(-1, 3)
    vertices = np.vstack([mesh.vertices, mesh.vertices[edges].mean(axis=1)])
    if mesh.material.ndim == 2:
        material = np.vstack([mesh.material, mesh.material[edges].mean(axis=1)])
    else:
        p, q, r = np.moveaxis(mesh.material, 1, 0)
        pq, qr, rp = (p + q) / 2, (q + r) / 2, (r + p) / 2
        corners = [[p, pq, rp], [pq, q, qr], [rp, qr, r], [pq, qr, rp]]
        material = np.stack([np.stack(child, axis=1) for child in corners], axis=1).reshape(-1, 3, 2)
    borders = np.isin(keys, np.sort(mesh.borders, axis=1) @ [count, 1])
    sets = {}
    for name, members in mesh.sets.items():
        inside = np.zeros(count, dtype=bool)
        inside[members] = True
        covered = np.unique(middle[inside[mesh.triangles].all(axis=1)] - count)
        joined = inside[edges].all(axis=1) & borders
        joined[covered] = True
        sets[name] = np.concatenate([members, count + np.flatnonzero(joined)])
    return TriangleMesh(vertices, triangles, material, sets)
