"""Where a rod starts: its nodes, fitted to its length, and the frames of its links."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import finite
from ..arrays.timeseries import linear
from ..arrays.types import Array
from ..errors import SceneError
from ..quantities.quantities import Term
from ..scene.scene import Scene
from .chain import resample
from .grip import any_across, carried
from .rope_grips import Chain

SMOOTH = 0.1  # of a length: bends along less of it are those of noise, and stay
FARTHEST = 5.0  # times the change of its length, by which a measured start moves that follows it


def initial_shape(
    name: str,
    length: float,
    segments: int,
    points: ArrayLike | None,
    velocity: ArrayLike | None,
    ends: Sequence[tuple[Array, Array] | None],
    stretches: bool,
) -> tuple[Array, Array | None]:
    """Initial places and velocities of the nodes between two ends, whose place and direction is given where they are
    held; what `stretches` may start straight and too long between them."""
    start, end = ends
    held = [*([0] if start is not None else []), *([segments] if end is not None else [])]
    if points is None:
        if velocity is not None:
            raise SceneError(f"{name}.velocity", "needs points", None, "give the points that have these velocities")
        origin, along = (np.zeros(3), np.array([1.0, 0.0, 0.0])) if start is None else start
        line = np.stack([origin, origin + length * along])
        if end is not None:
            line[1] = end[0]
    else:
        line = finite(f"{name}.points", points, None, SceneError)
        if line.ndim != 2 or line.shape[1] != 3:
            raise SceneError(f"{name}.points", "has the wrong shape", line.shape, "give (k, 3) in m")
    shape = resample(line, segments)
    for k, given in ((0, start), (segments, end)):
        if given is not None:
            shape[k] = given[0]
    if stretches and len(held) == 2 and np.linalg.norm(shape[-1] - shape[0]) > length:
        shape = np.linspace(shape[0], shape[-1], segments + 1)
    else:
        shape = fitted_to_length(shape, length / segments, held)
    if velocity is None:
        return shape, None
    v = finite(f"{name}.velocity", velocity, line.shape, SceneError)
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    wanted = np.linspace(0.0, s[-1], segments + 1)
    return shape, linear(s, v, wanted)


def fitted_to_length(shape: Array, link: float, held: Sequence[int]) -> Array:
    """The nearest chain (nodes, 3) whose links have the given length, with some nodes held.

    A start that is longer than the rod would be pulled together in its first substep, a kick.

    Raises:
        SceneError: the held nodes are farther apart than the chain reaches, or the shape is straight and too short.
    """
    x = shape.copy()
    free = np.setdiff1d(np.arange(len(x)), held)
    for _ in range(50):
        edges = np.diff(x, axis=0)
        lengths = np.linalg.norm(edges, axis=1)
        if np.abs(lengths - link).max() < 1e-12 * link:
            return x
        if lengths.min() < 1e-9 * link:  # such a link has no direction to grow in
            break
        J = _of_lengths(x)[:, free].reshape(len(edges), -1)
        x[free] += np.linalg.lstsq(J, link - lengths, rcond=1e-9)[0].reshape(-1, 3)
    reach, apart = link * (len(x) - 1), float(np.linalg.norm(shape[-1] - shape[0]))
    if apart < reach:
        fix = "give points of a bent shape between the held ends"
        raise SceneError("points", "cannot be bent to the length", reach, fix)
    fix = f"give EA or a length above {apart:.9g} m, or check the grips' places"
    raise SceneError("length", "does not reach between the held ends", reach, fix)


def follow_length(scene: Scene, chain: Chain) -> None:
    """Let a measured start follow the quantity `<name>_length`: where a fit changes the length, nodes that are not held
    and not joined to other objects start on a chain so long near by, whose bends change smoothly, to first order.

    Otherwise rigid links that are longer than the nodes are apart would throw them apart in the first substep, where a
    rope that lies straight cannot choose how it buckles and forces do not balance. A chain that is almost straight
    between two ends that stay keeps its start: how far it sags grows with the root of its length, not linearly."""
    nodes, length = chain.particles, float(chain.arc_length[-1])
    x, free = scene.nodes[nodes], np.flatnonzero(~np.isin(nodes, [*scene.held, *_joined(scene, nodes)]))
    J = _of_lengths(x)[:, free].transpose(0, 2, 1)
    bends = np.diff(np.eye(len(x)), n=2, axis=0)[:, free] * (SMOOTH * (len(x) - 1)) ** 2
    way = np.tensordot(J, np.linalg.inv(np.eye(len(free)) + bends.T @ bends), 1)
    met = np.tensordot(J, way, ((1, 2), (1, 2)))
    pull = np.linalg.lstsq(met, np.full(len(met), 1.0 / len(met)), rcond=1e-9)[0]
    rate = np.tensordot(pull, way, 1).T.ravel()
    if np.abs(rate).max(initial=0.0) > FARTHEST:
        return
    at = (3 * nodes[free, None] + np.arange(3)).ravel()
    grown = Term("position", at, rate, ((f"{chain.name}_length", "identity"),))
    scene.add_terms([grown, Term("position", at, -length * rate, ())])


def _joined(scene: Scene, nodes: Array) -> list[int]:
    """Those of a chain's nodes that constraints join to bodies or to particles of other objects."""
    bodies = [body.particles for body in scene.bodies.values()]
    others = np.setdiff1d([*range(len(scene.positions)), *np.ravel(bodies)], nodes)
    joined = [g.particles[np.isin(g.particles, others).any(axis=1)] for g in scene.groups]
    return np.intersect1d(np.concatenate([np.ravel(j) for j in joined]), nodes).tolist()


def _of_lengths(x: Array) -> Array:
    """(links, nodes, 3), the derivative of the lengths of a chain's links."""
    edges = np.diff(x, axis=0)
    units, each = edges / np.linalg.norm(edges, axis=1, keepdims=True), np.arange(len(edges))
    J = np.zeros((len(edges), len(x), 3))
    J[each, each], J[each, each + 1] = -units, units
    return J


def initial_frames(name: str, chain: Array, first: ArrayLike | None, last: ArrayLike | None, turns: int) -> Array:
    """Directors of a chain's edges: carried along it from the first, with the twist to the last spread evenly.

    Raises:
        SceneError: a director along its edge, a chain that folds back, or half a turn of twist in a joint.
    """
    edges = np.diff(chain, axis=0)
    tangents = edges / np.linalg.norm(edges, axis=1, keepdims=True)
    folded = (tangents[1:] * tangents[:-1]).sum(axis=1) < -1.0 + 1e-9
    if folded.any():
        where = chain[1 + int(np.argmax(folded))].tolist()
        raise SceneError(f"{name}.points", "fold back on themselves", where, "give a shape without a cusp")
    if first is not None and np.linalg.norm(np.cross(tangents[0], np.asarray(first))) <= 1e-9 * np.linalg.norm(
        np.asarray(first)
    ):
        given = np.asarray(first).tolist()
        raise SceneError(f"{name}.director", "has no part across the rod", given, "give a vector across its start")
    q = [any_across(tangents[0]) if first is None else np.asarray(first, dtype=float)]
    for before, after in pairwise(tangents):
        q.append(carried(q[-1] - (q[-1] @ before) * before, before, after[None])[0])
    frames = np.array([v / np.linalg.norm(v) for v in q])
    across = np.cross(tangents, frames)
    missing = 2.0 * np.pi * turns
    if last is not None:
        missing += float(np.arctan2(np.asarray(last) @ across[-1], np.asarray(last) @ frames[-1]))
    if abs(missing) >= np.pi * (len(edges) - 1):
        most = "a joint holds less than half a turn: give more segments or fewer turns"
        raise SceneError(f"{name}.turns", "are more than the joints hold", turns, most)
    angle = np.linspace(0.0, missing, len(edges))[:, None]
    return np.asarray(np.cos(angle) * frames + np.sin(angle) * across)
