"""What about a mesh can be simulated but is seldom meant."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..arrays.types import Array, Indices
from . import topology
from .unfold import warp_turns
from .validate import signed_areas

_SPLINTER = np.radians(5.0)  # smallest angle below which a triangle is named
_SMALL = 1e-3  # of the median area
_WARP_JUMP = np.radians(20.0)  # more than a curved fabric turns from triangle to triangle
_GATHERED = 1e-3  # relative difference of an edge's length in the material of its two triangles
_MANY = 10_000  # vertices that do not stay in a processor's cache
_FAR = 4.0  # mean distance of neighbors' numbers, over the root of the number of vertices; a square grid has 0.7


def doubts(vertices: Array, triangles: Indices, corners: Array, twin: Indices) -> tuple[str, ...]:
    """Sentences on splinters, loose parts, cracks, numbers that jump, and material that does not fit along edges."""
    found = []
    areas, angle = signed_areas(corners), _smallest_angle(corners)
    splinters = np.flatnonzero((angle < _SPLINTER) | (areas < _SMALL * np.median(areas)))
    if splinters.size:
        worst = splinters[angle[splinters].argmin()]
        found.append(
            f"{splinters.size} of {len(areas)} triangles are splinters, the worst is {worst} with "
            f"{np.degrees(angle[worst]):.2g} degrees and {areas[worst]:.2g} m^2: they make the problem stiff. "
            "Remesh them."
        )
    edges = topology.edges(triangles)
    parts = np.unique(topology.components(len(vertices), edges))
    if len(parts) > 1:
        found.append(
            f"the mesh has {len(parts)} parts that do not hang together (their first vertices: {_few(parts)})."
        )
    distinct, index = np.unique(vertices, axis=0, return_inverse=True)
    if len(distinct) < len(vertices):
        shared = np.flatnonzero(np.bincount(index.ravel())[index.ravel()] > 1)
        found.append(
            f"{shared.size} vertices lie on top of others ({_few(shared)}): the mesh may be cracked there. "
            "Merge them if so (`read_mesh(..., merge=True)`)."
        )
    apart = np.abs(edges[:, 1] - edges[:, 0]).mean()
    if len(vertices) > _MANY and apart > _FAR * np.sqrt(len(vertices)):
        found.append(
            f"neighbors stand {apart:.0f} vertices apart on average: sweeps take up to 1.5 times longer than on "
            "`sheetbend.mesh.renumbered(mesh)`."
        )
    return (*found, *_misfit(corners, twin))


def _misfit(corners: Array, twin: Indices) -> list[str]:
    """Sentences on edges whose two triangles disagree on their length or direction in the material."""
    lengths = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).ravel()[topology.hinge_half_edges(twin)]
    gathered = (np.ptp(lengths, axis=1) > _GATHERED * lengths.max(axis=1)).sum()
    turns = np.abs(warp_turns(corners, twin))
    jumps = turns[turns > _WARP_JUMP]
    found = []
    if gathered:
        found.append(
            f"{gathered} edges have different lengths in the material of their two triangles (gathered seams)."
        )
    if jumps.size:
        found.append(
            f"the warp direction jumps across {jumps.size} edges, by up to {np.degrees(jumps.max()):.2g} degrees "
            "(a seam, or a place where it is perpendicular to the surface)."
        )
    return found


def _smallest_angle(corners: Array) -> Array:
    """(m,) rad."""
    u, v = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    angles = np.arctan2(np.abs(u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]), (u * v).sum(-1))
    smallest: Array = angles.min(axis=1)
    return smallest


def _few(found: NDArray[np.generic]) -> str:
    return ", ".join(map(str, found[:5].tolist())) + (", ..." if len(found) > 5 else "")
