"""Directions in which grips, clamps and driven bodies hold, and what a turn of each changes in the inputs of a scene.

A grip that is turned against its poses stays turned by the same angle in its own axes. So the axis of the turn moves
with the grip, from its direction at the start of the motion. A rope without twist shows only one direction of its
grip; the grip's axes are then carried along by the shortest rotations.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from ..arrays.types import Array
from ..objects.grip import any_across, carried
from ..objects.rod import Rod
from ..objects.rope import Rope
from ..scene.scene import Scene
from .tangents import Input


@dataclass(frozen=True)
class Turn:
    """A turn of what is held about an axis of the world at the start.

    Attributes:
        who: is held.
        axis: 0 to 2.
        moves: whether the axis moves.
        added: what 1 rad adds to inputs.
    """

    who: str
    axis: int
    moves: bool
    added: list[Input]


@dataclass(frozen=True)
class _Held:
    """What turns together.

    Attributes:
        who: its name.
        vectors: each as the node that ends it and the one that begins it (None: it is itself a direction), that along
            the grip first.
        rolled: directors of a rod that begin as the grip has them, and their shares of its roll.
    """

    who: str
    vectors: list[tuple[int, int | None]]
    rolled: dict[int, float] = field(default_factory=dict)


def held_directions(scene: Scene, inputs: Array) -> list[Turn]:
    """Of each held direction that no quantity turns, three turns. None of a scene in which all that is held is one end
    that stays: to turn that is to turn the scene (`told._observe`).

    Args:
        inputs: of the scene.
    """
    every = [*_held_ends(scene), *_bodies(scene)]
    if len(every) == 1 and not scene.boundary.driven:
        own = {n for vector in every[0].vectors for n in vector}
        if scene.pinned <= own:
            return []
    return [turn for held in every for turn in _turns(scene, inputs, held)]


def _held_ends(scene: Scene) -> Iterator[_Held]:
    held = set(scene.held)
    for rope in scene.ropes.values():
        for end, k, ghost in (("start", 0, rope.start_ghost), ("end", -1, rope.end_ghost)):
            who = f"{rope.name}_{end}"
            if ghost not in held or {f"{who}_tilt_1", f"{who}_angle"} & set(scene.quantities):
                continue
            axes = [int(own[k]) for own in (rope.directors, rope.normals) if len(own)] if isinstance(rope, Rod) else []
            vectors: list[tuple[int, int | None]] = [(int(ghost), int(rope.particles[k]))]
            yield _Held(who, vectors + [(n, None) for n in axes if n in held], _rolled(scene, rope, k))


def _rolled(scene: Scene, rope: Rope, k: int) -> dict[int, float]:
    """Directors of a rod that are free to turn, with shares that fall to none where the other end is held as well."""
    if not isinstance(rope, Rod):
        return {}
    held, directors = set(scene.held), [int(n) for n in rope.directors[:: 1 if k == 0 else -1]]
    last = 0.0 if directors[-1] in held else 1.0
    shares = np.linspace(1.0, last, len(directors)).tolist()
    return {n: share for n, share in zip(directors, shares, strict=True) if n not in held}


def _bodies(scene: Scene) -> Iterator[_Held]:
    held = set(scene.held)
    for body in scene.bodies.values():
        axes = [int(n) for n in body.particles[1:]]
        if set(axes) <= held:
            yield _Held(body.name, [(n, None) for n in axes])


def _turns(scene: Scene, inputs: Array, held: _Held) -> Iterator[Turn]:
    slot = {p: k for k, p in enumerate(scene.boundary.driven)}
    driven = [n in slot for n, _ in held.vectors]
    if any(driven) != all(driven):
        return  # held in part, by something else than a grip
    array = "boundary" if driven[0] else "position"

    def place(n: int) -> int:
        return slot[n] if driven[0] else int(scene.places_of(n))

    layout = scene.compiled.layout
    start = inputs[slice(layout["position"][0], sum(layout["position"]))].reshape(-1, 3)
    first, size = layout[array]
    x = inputs[first : first + size].reshape(len(scene.boundary.times) if driven[0] else 1, -1, 3)
    own = np.stack([x[:, place(n)] - (0.0 if of is None else x[:, place(of)]) for n, of in held.vectors], axis=1)
    frames = _frames(own)
    places = 3 * np.array([place(n) for n, _ in held.vectors])[:, None] + np.arange(3)
    entries = x[0].size * np.arange(len(x))[:, None, None] + places
    for axis in range(3):
        about = np.einsum("kij,mj,m->ki", frames, frames[0], np.eye(3)[axis])
        by = np.cross(about[:, None], own)
        if np.abs(by).max() > 1e-12 * np.abs(own).max():
            added: list[Input] = [(array, entries.ravel(), by.ravel())]
            if held.rolled:
                added.append(_start(scene, start, held.rolled, frames[0, :, 2], axis))
            yield Turn(held.who, axis, driven[0] and len(x) > 1, added)


def _start(scene: Scene, x: Array, rolled: dict[int, float], grip: Array, axis: int) -> Input:
    """What a turn of the grip, whose rod goes along `grip` (3,) or against it, changes of where directors start, for x
    (nodes, 3): without it the first substep would turn them, and damping would make a kick of that."""
    nodes = scene.places_of(list(rolled))
    edges = scene.places_of([scene.directors[n][:2] for n in rolled])
    along = x[edges[:, 1]] - x[edges[:, 0]]
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    roll = grip[axis] * np.sign(grip @ along[0])
    by = roll * np.array(list(rolled.values()))[:, None] * np.cross(along, x[nodes])
    return "position", (3 * nodes[:, None] + np.arange(3)).ravel(), by.ravel()


def _frames(vectors: Array) -> Array:
    """(knots, 3, 3) axes, as columns, that turn with vectors (knots, k, 3); the last column is the first of them."""
    along = vectors[:, 0] / np.linalg.norm(vectors[:, 0], axis=1, keepdims=True)
    if vectors.shape[1] > 1:
        across = vectors[:, 1] - np.sum(vectors[:, 1] * along, axis=1, keepdims=True) * along
        across /= np.linalg.norm(across, axis=1, keepdims=True)
    else:
        across = np.empty_like(along)
        across[0] = any_across(along[0])
        for k in range(1, len(along)):
            across[k] = carried(across[k - 1], along[k - 1], along[k : k + 1])[0]
    return np.stack([across, np.cross(along, across), along], axis=2)
