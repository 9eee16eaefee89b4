"""Tests how far a rope sticks out of a clamp or a grip, if this differs from the given length.

A rope sticks out of its clamp by some millimeters more or less than was measured, while the distances of its markers
from each other are right. These are three errors at once: of the place of the clamp along the rope, of the rope's
length, and of how far all markers are from the clamp. One of the three alone does not explain the residuals.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..arrays.types import Array
from ..objects.markers import Place
from ..quantities.wording import short
from ..scene.scene import Scene
from .tangents import Input

MESH = 0.25  # of a link: a coarse mesh makes a clamp that is off by less (a tenth in a rope of ten links)


@dataclass(frozen=True)
class Lead:
    """A held end of a rope.

    Attributes:
        who: its name.
        rope: name of the rope.
        from_start: the end is where places along the rope are counted from.
        link: length of the link there, m.
        added: what 1 m more of it adds to inputs, beside the rope's length.
    """

    who: str
    rope: str
    from_start: bool
    link: float
    added: list[Input]

    @property
    def label(self) -> str:
        return f"free length at {self.who}"

    def moves(self, scene: Scene, place: Place) -> float:
        """m, by which a marker then sits farther along the rope as it was told, per m of the lead: it keeps its
        distance from the other end, and the rope as told is shorter."""
        rope = scene.ropes[self.rope]
        at = dict(zip(rope.particles.tolist(), rope.arc_length.tolist(), strict=True))
        if not (self.from_start and set(place.particles) <= set(at)):
            return 0.0
        return 1.0 - sum(w * at[n] for n, w in zip(place.particles, place.weights, strict=True)) / rope.length

    def says(self, size: float) -> str:
        how = "more" if size > 0 else "less"
        words = f"{self.rope} stuck out of what holds it at {self.who} by {short(1e3 * abs(size), 2)} mm {how}"
        if abs(size) > MESH * self.link:
            return words
        return f"{words} (links of {short(1e3 * self.link, 2)} mm can look like that where no finer mesh is counted)"


def leads(scene: Scene, inputs: Array) -> Iterator[Lead]:
    """The held ends of ropes whose direction is held and that have no quantity for it.

    Args:
        inputs: of the scene.
    """
    held, slot = set(scene.held), {p: k for k, p in enumerate(scene.boundary.driven)}
    layout = scene.compiled.layout
    start, motion = (inputs[layout[a][0] : sum(layout[a])] for a in ("position", "boundary"))
    x = start.reshape(-1, 3)
    for rope in scene.ropes.values():
        for end, nodes, ghost in (
            ("start", rope.particles, rope.start_ghost),
            ("end", rope.particles[::-1], rope.end_ghost),
        ):
            who, node = f"{rope.name}_{end}", int(nodes[0])
            if ghost not in held or node not in held or f"{who}_lead" in scene.quantities:
                continue
            shares = np.linspace(1.0, 0.0, len(nodes))[1:]  # of the links that grow, behind each node
            behind = x[nodes[:-1]] - x[nodes[1:]]
            behind *= shares[:, None] / np.linalg.norm(behind, axis=1, keepdims=True)
            free = [k for k, n in enumerate(nodes[1:].tolist()) if n not in held]
            added: list[Input] = [("position", _entries(nodes[1:][free]), behind[free].ravel())]
            both = [node, int(ghost)]
            if node in slot and ghost in slot:
                at = motion.reshape(len(scene.boundary.times), -1, 3)[:, [slot[n] for n in both]]
                where = _entries(np.array([slot[n] for n in both])) + 3 * len(slot) * np.arange(len(at))[:, None]
                added.append(
                    ("boundary", where.ravel(), np.repeat(_back(at, x[nodes[1]] - x[node]), 2, axis=1).ravel())
                )
            elif node not in slot and ghost not in slot:
                at = x[scene.places_of(both)][None]
                back = np.repeat(_back(at, x[nodes[1]] - x[node]), 2, axis=1)
                added.append(("position", _entries(scene.places_of(both)), back.ravel()))
            else:
                continue
            link = float(np.linalg.norm(x[nodes[1]] - x[node]))
            yield Lead(who, rope.name, end == "start", link, added)


def _back(at: Array, along: Array) -> Array:
    """(knots, 1, 3) unit vectors from a rope back into its grip, for the end and its ghost (knots, 2, 3), and a vector
    along the rope at the start."""
    back = at[:, 1] - at[:, 0]
    back /= np.linalg.norm(back, axis=1, keepdims=True)
    return np.asarray((back if back[0] @ along < 0 else -back)[:, None])


def _entries(nodes: Array) -> Array:
    return (3 * np.asarray(nodes)[:, None] + np.arange(3)).ravel()
