"""Pieces of a scene, ropes, cloths and capsules of bodies, that may touch themselves and each other."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays.types import Array
from ..errors import SceneError
from ..quantities.expression import terms_of
from ..quantities.quantities import Term
from .body import BodyCapsules

TOUCHES = 1e-6  # m: so deep a pair may be at the start


@dataclass(frozen=True, eq=False)
class Piece:
    """A rope, a cloth, or capsules of a body, that may touch itself and the other pieces.

    Attributes:
        name: of the rope, the cloth or the body.
        edges: (n, 2) particles: links of a rope, edges of a cloth. Of capsules their places.
        triangles: (m, 3) particles; none of a rope or of capsules.
        quantity: its radius, or half its thickness.
        capsules: those that it is, whose ends are points of a body.
    """

    name: str
    edges: Array
    triangles: Array
    quantity: str
    capsules: BodyCapsules | None = None

    @property
    def points(self) -> int:
        """How many points of a body it has."""
        return 0 if self.capsules is None else len(self.capsules.places)


@dataclass(frozen=True, eq=False)
class PairFriction:
    """Friction between pieces.

    Attributes:
        name: under which its pairs are counted.
        quantity: Coulomb's coefficient.
        carried: (2 n,) hidden, pinned nodes, two for each pair that may touch at a time: the coordinates of the first
            say which pair and whether it slides, those of the second are the tangential force that is carried from
            substep to substep [N].
    """

    name: str
    quantity: str
    carried: Array

    @property
    def room(self) -> int:
        """How many pairs may touch at a time."""
        return len(self.carried) // 2


def piece_terms(pieces: Sequence[Piece], friction: PairFriction | None, first: int, first_weight: int) -> list[Term]:
    """What makes the radii of pieces and their friction, which stand in the inputs from `first` on, and the weights of
    points of bodies, from `first_weight` on."""
    terms = [Term("contact_radius", first + i, 1.0, ((p.quantity, "identity"),)) for i, p in enumerate(pieces)]
    for capsules in (p.capsules for p in pieces if p.capsules is not None):
        weights = capsules.body.weights(capsules.places)
        terms += terms_of("contact_weight", first_weight + np.arange(weights.size).reshape(weights.shape), weights)
        first_weight += weights.size
    return terms if friction is None else [*terms, Term("friction", first, 1.0, ((friction.quantity, "identity"),))]


def specification(
    pieces: Sequence[Piece], friction: PairFriction | None, places_of: Callable[[Array], Array], nodes: int
) -> dict[str, Any]:
    """The pieces as the compiled core is made from them: points of bodies count on after all nodes."""
    own: list[dict[str, Any]] = []
    on_bodies: list[list[int]] = []
    for p in pieces:
        edges = places_of(p.edges) if p.capsules is None else nodes + len(on_bodies) + p.edges
        own.append({"edges": edges.tolist(), "triangles": places_of(p.triangles).tolist()})
        if p.capsules is not None:
            on_bodies += [places_of(p.capsules.body.particles).tolist()] * p.points
    carried = np.zeros(0, dtype=int) if friction is None else places_of(friction.carried)
    return {"self_contact": own, "self_carried": carried, "self_on_bodies": on_bodies}


def expect_apart(core: Any, inputs: Array, name_of: Callable[[int], str]) -> None:
    """Refuse a start at which two are nearer to each other than they touch.

    Args:
        core: the compiled scene.
        name_of: a node, in words.
    """
    gaps, nodes = core.pair_gaps(inputs)
    if not len(gaps) or gaps.min() > -TOUCHES:
        return
    worst = int(np.argmin(gaps))
    where = ", ".join(dict.fromkeys(name_of(int(n)) for n in nodes[worst]))
    problem = f"starts {-gaps[worst]:.3g} m too near to itself, at {where}; pairs that are too near"
    fix = "let it start farther apart, or give a smaller radius (half the thickness of cloth) or longer edges"
    raise SceneError("self_contact", problem, int((gaps < -TOUCHES).sum()), fix)
