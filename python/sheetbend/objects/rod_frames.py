"""The material frames of a rod: hidden nodes beside its particles, and before and behind them where an end is held."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import finite
from ..arrays.types import Array
from ..errors import SceneError
from ..scene.scene import Scene
from .grip import any_across, carried
from .rod_end import End
from .rod_shape import initial_frames


class Line(NamedTuple):
    """The particles of a rod, which has no frames yet.

    Attributes:
        name: of the rod.
        nodes: (segments + 1,) their numbers; the last one of a ring is its first.
        shape: (segments + 1, 3) m, where they start.
        link: m, the length of a link at rest.
        ring: whether both ends are in one junction.
    """

    name: str
    nodes: Array
    shape: Array
    link: float
    ring: bool


@dataclass(frozen=True)
class Frames:
    """The frames of a rod's links and of the short links ("stubs") that hold the directions of its ends.

    Attributes:
        ghosts: the hidden nodes before the start and behind the end; None where an end is free.
        stubs: m, how far along the rod they are from its ends; negative before the start.
        chain: (n,) nodes: the rod's own, with the ghosts before and behind them.
        directors: (n - 1,) hidden nodes, the first axes of the frames of the chain's edges.
        normals: (n - 1,) hidden nodes, the normals of the edges' sections; None where sections do not shear.
    """

    ghosts: tuple[int | None, int | None]
    stubs: tuple[float, float]
    chain: Array
    directors: Array
    normals: Array | None

    @property
    def edges(self) -> Array:
        """(n - 1, 2) nodes of the chain's edges."""
        return edges_of(self.chain)

    @property
    def at(self) -> Array:
        """(joints,) places in the chain of the nodes at which the rod bends."""
        return np.arange(1, len(self.chain) - 1)

    @property
    def first(self) -> int:
        """Place of the rod's first node in the chain."""
        return int(self.ghosts[0] is not None)

    @property
    def joints(self) -> Array:
        """(joints, 5) three points and two directors, or (joints, 4) two normals and two directors."""
        at, before = self.at, self.at - 1
        if self.normals is None:
            axes = [self.chain[before], self.chain[at], self.chain[at + 1]]
        else:
            axes = [self.normals[before], self.normals[at]]
        return np.stack([*axes, self.directors[before], self.directors[at]], axis=1)

    def sections(self, segments: int) -> Array:
        """(segments, 4) of each of the rod's own links its two nodes, its normal and its director."""
        assert self.normals is not None
        links = slice(self.first, self.first + segments)
        return np.column_stack([self.edges[links], self.normals[links], self.directors[links]])


def edges_of(chain: Array) -> Array:
    """(n - 1, 2) neighbors in a chain of nodes (n,)."""
    return np.stack([chain[:-1], chain[1:]], axis=1)


def add_frames(
    scene: Scene,
    line: Line,
    ends: tuple[End, End],
    director: ArrayLike | None,
    turns: int,
    shears: bool,
    stub_mass: float,
) -> Frames:
    """Give a rod its ghosts and frames.

    Args:
        director: (3,) the first frame axis at a start that nothing holds; any by default.
        turns: whole turns by which the last frame is ahead.
        shears: whether sections have normals of their own.
        stub_mass: kg, of each ghost.

    Raises:
        SceneError: a director that is none, or more turns than the joints hold.
    """
    x = line.shape
    along = [e.along(edge) for e, edge in zip(ends, (x[1] - x[0], x[-1] - x[-2]), strict=True)]
    stubs = ends[0].stub(line.link), ends[1].stub(line.link)
    start, end = (
        None if way is None else int(scene.add_hidden([place + stub * way], stub_mass)[0])
        for way, place, stub in zip(along, (x[0], x[-1]), stubs, strict=True)
    )
    chain = np.array([*([] if start is None else [start]), *line.nodes, *([] if end is None else [end])])
    first, last = (e.director(scene, way) for e, way in zip(ends, along, strict=True))
    if first is None and director is not None:
        first = finite(f"{line.name}.director", director, (3,), SceneError)
    if line.ring and last is None and along[0] is not None and along[1] is not None:
        first = any_across(along[0]) if first is None else first
        last = carried(first - (first @ along[0]) * along[0], along[0], along[1][None])[0]
    edges = edges_of(chain)
    axes = initial_frames(line.name, scene.nodes[chain], first, last, turns)
    normals = scene.add_normals(edges) if shears else None
    return Frames((start, end), stubs, chain, scene.add_directors(edges, axes, normals), normals)
