"""A baseline for what is driven: every marker moves rigidly with the grip, or with a blend of several grips.

A grip is a set of driven or pinned particles that constraints connect. Its rigid motion from one frame to another is
the rotation and translation that fit its particles best (Kabsch 1976, Acta Cryst. A32, 922). One particle translates;
particles on a line turn by the smallest rotation that fits. With several grips, a marker goes to the mean of where each
grip would carry it, weighted by one over its distance from each: on a straight rope, its share of the arc length.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..arrays.timeseries import interpolate, mean_position
from ..arrays.types import Array
from ..recording.recording import Recording
from ..scene.scene import Scene
from .experiment import Experiment

_NEAREST_TO_IDENTITY = 1e-9  # share of a grip's spread that decides between rotations that fit equally well
_CLOSEST = 1e-9  # m: a marker on a grip moves with that grip


Source = tuple[Experiment, Recording]
"""An experiment, and the part of its recording that the fit saw."""
Values = Mapping[str, Mapping[str, float]]
"""By experiment, values of quantities of its scene."""


def carried_baselines(
    e: Experiment, fitted: Sequence[Source], target: Recording, values: Values | None = None
) -> dict[str, Array]:
    """Predictions (frames, markers, 3) m of a recording's markers from the motion of its scene's grips.

    Args:
        e: the experiment that is predicted; its scene drives particles.
        fitted: what the fit saw, of the same recording or of others with the markers of `target`; may be empty. Those
            whose scene does not hold the same particles are left out.
        target: the part to predict.
        values: fitted quantities; those of a tool's frame and of a recording's clock count, so that the baseline knows
            the grips as well as the simulation does. As given by default.

    Returns:
        "carried" (from each marker's first sight in `target`) and, where `fitted` shows every marker, "carried shape";
        empty for an equilibrium, for a cloud and for a scene in which nothing is driven.
    """
    grips = [] if e.static or e.is_cloud else _grips(e.scene)
    if not grips:
        return {}
    values = values or {}
    moving = [_motion(e, grip, target.times, values) for grip in grips]
    first = np.argmax(target.mask, axis=0)
    start = target.positions[first, np.arange(len(first))]
    weights = _weights(start, [points[first] for points in moving])
    carried = np.empty((len(grips), *target.positions.shape))
    for frame in np.unique(first):
        seen = first == frame
        for g, points in enumerate(moving):
            carried[g][:, seen] = _rigid(points[frame], points, start[seen])
    found = {"carried": _blended(carried, weights)}
    alike = [source for source in fitted if _grips(source[0].scene) == grips]
    shapes = [_mean_in_grip(grip, alike, values) for grip in grips] if alike else []
    if shapes and not any(np.isnan(x).any() for _, x in shapes):
        placed = [_rigid(at, points, x) for (at, x), points in zip(shapes, moving, strict=True)]
        found["carried shape"] = _blended(np.stack(placed), weights)
    return found


def _grips(scene: Scene) -> list[list[int]]:
    """Held particles in sets that constraints connect, each with more than directors; empty where none is driven. A
    pinned hidden node is no place but a number, such as what has slid in a joint, unless a body is made of it."""
    if not scene.boundary.driven:
        return []
    bodies = set(scene.body_nodes.ravel().tolist())
    pinned = sorted((p for p in scene.pinned if p >= 0 or p in bodies), key=scene.places_of)
    owner = {p: p for p in (*scene.boundary.driven, *pinned)}

    def root(p: int) -> int:
        while owner[p] != p:
            p = owner[p]
        return p

    links = [row for g in scene.groups for row in g.particles.tolist()]
    links += [[d, *frame] for d, frame in scene.directors.items()] + scene.body_nodes.tolist()
    for link in links:
        held = [p for p in link if p in owner]
        for other in held[1:]:
            owner[root(other)] = root(held[0])
    sets: dict[int, list[int]] = {}
    for p in owner:
        sets.setdefault(root(p), []).append(p)
    return [grip for grip in sets.values() if any(p not in scene.directors for p in grip)]


def _motion(e: Experiment, grip: Sequence[int], times: Array, every: Values) -> Array:
    """(frames, points, 3) m of a grip's particles at times of the recording. A director counts as a point one edge away
    from the node that its edge starts from, an axis of a body as one a meter from its center."""
    scene, boundary = e.scene, e.scene.boundary
    values = {name: value for name, value in every.get(e.name, {}).items() if name in scene.quantities}
    inputs = scene.compiled.inputs(scene.compiled.values(values))
    knots = scene.compiled.unpack(inputs)["boundary"].reshape(len(boundary.times), -1, 3)
    at = np.clip(e.scene_times(times, values), boundary.times[0], boundary.times[-1])
    driven = interpolate(boundary.times, knots, at, "cubic", np.inf)
    slot = {p: i for i, p in enumerate(boundary.driven)}

    def path(p: int) -> Array:
        return driven[:, slot[p]] if p in slot else np.broadcast_to(scene.nodes[p], (len(at), 3))

    center = {int(axis): int(p) for p, *axes in scene.body_nodes for axis in axes}
    points = []
    for p in grip:
        if p in center:
            points.append(path(center[p]) + path(p))
        elif p not in scene.directors:
            points.append(path(p))
        elif (start := scene.directors[p][0]) in grip:
            length = np.linalg.norm(scene.nodes[scene.directors[p][1]] - scene.nodes[start])
            points.append(path(start) + length * path(p))
    return np.stack(points, axis=1)


def _rigid(before: Array, after: Array, x: Array) -> Array:
    """Points (frames, markers, 3) carried along by the rigid motions of a grip.

    Args:
        before, after: (points, 3) or (frames, points, 3), the grip.
        x: (markers, 3) or (frames, markers, 3) beside `before`.
    """
    from_, to = before.mean(axis=-2, keepdims=True), after.mean(axis=-2, keepdims=True)
    spread = np.swapaxes(before - from_, -1, -2) @ (after - to)
    size = np.linalg.norm(spread, axis=(-2, -1), keepdims=True)
    u, _, vt = np.linalg.svd(spread + _NEAREST_TO_IDENTITY * np.where(size > 0, size, 1.0) * np.eye(3))
    flip = np.ones((*spread.shape[:-2], 3))
    flip[..., 2] = np.sign(np.linalg.det(u @ vt))
    return np.asarray((x - from_) @ ((u * flip[..., None, :]) @ vt) + to)


def _weights(x: Array, grips: Sequence[Array]) -> Array:
    """(grips, markers): one over the distance of markers x (markers, 3) from the nearest point of each grip, with the
    sum 1. Each grip is (markers, points, 3), its state when the marker is at x."""
    distance = np.stack([np.linalg.norm(points - x[:, None], axis=2).min(axis=1) for points in grips])
    nearness = 1.0 / np.maximum(distance, _CLOSEST)
    return np.asarray(nearness / nearness.sum(axis=0))


def _blended(predictions: Array, weights: Array) -> Array:
    return np.asarray(np.einsum("gm,gfmk->fmk", weights, predictions))


def _mean_in_grip(grip: Sequence[int], fitted: Sequence[Source], values: Values) -> tuple[Array, Array]:
    """A grip's points (points, 3) at the first fitted frame, and the markers' mean (markers, 3) after each frame is
    brought back to that one; NaN for a marker that is never seen."""
    moving = [_motion(e, grip, r.times, values) for e, r in fitted]
    at = moving[0][0]
    back = [_rigid(motion, at, r.positions) for motion, (_, r) in zip(moving, fitted, strict=True)]
    return at, mean_position(np.concatenate(back))
