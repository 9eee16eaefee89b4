"""Clamped ends of ropes that are driven: the clamp moves with the end and keeps its direction."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .scene_data import SceneData


def clamped_ends(scene: SceneData, particles: Sequence[int]) -> list[tuple[int, int]]:
    """(slot, ghost) of those particles (k,) that are ends held by a clamp at rest, whose ghost gives them their
    direction; ghosts that are among the particles themselves are left out."""
    ghosts: dict[int, int] = {}
    for rope in scene.ropes.values():
        for node, ghost in ((rope.particles[0], rope.start_ghost), (rope.particles[-1], rope.end_ghost)):
            if ghost is not None and ghost in scene.pinned and ghost not in particles:
                ghosts[int(node)] = int(ghost)
    return [(slot, ghosts[p]) for slot, p in enumerate(particles) if p in ghosts]


def let_go(scene: SceneData, particles: Sequence[int], ends: Sequence[tuple[int, int]]) -> None:
    """Unpin ends of ropes and their ghosts before they are driven."""
    scene.pinned -= {p for slot, ghost in ends for p in (particles[slot], ghost)}


def keep_direction(scene: SceneData, particles: Sequence[int], ends: Sequence[tuple[int, int]]) -> None:
    """Hold ghosts that are driven with the motion of their ends where they stand off them, and let the angle of a clamp
    turn them as before."""
    start, knots = scene.nodes, (len(scene.boundary.times), 1)
    for slot, ghost in ends:
        scene.boundary.add_term(ghost, np.tile(start[ghost] - start[particles[slot]], knots), {}, scene.quantities)
        for term in [t for t in scene.terms if t.array == "position"]:
            at = np.atleast_1d(term.index) - 3 * ghost
            own = (at >= 0) & (at < 3)
            if own.any():
                offset = np.zeros(3)
                offset[at[own]] = np.broadcast_to(term.coefficient, at.shape)[own]
                scene.boundary.add_term(ghost, np.tile(offset, knots), dict(term.factors), scene.quantities)
