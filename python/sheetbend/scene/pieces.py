"""Pieces of a scene, ropes and cloths, that may touch themselves and each other."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import SceneError
from ..quantities.quantities import Term

Array = np.ndarray
TOUCHES = 1e-6  # m: so deep a pair may be at the start


@dataclass(frozen=True, eq=False)
class Piece:
    """A rope or a cloth that may touch itself and the other pieces.

    Attributes:
        name: of the rope or cloth.
        edges: (n, 2) particles: links of a rope, edges of a cloth.
        triangles: (m, 3) particles; none of a rope.
        quantity: its radius, or half its thickness.
    """

    name: str
    edges: Array
    triangles: Array
    quantity: str


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


def piece_terms(pieces: Sequence[Piece], friction: PairFriction | None, first: int) -> list[Term]:
    """What makes the radii of pieces and their friction, which stand in the inputs from `first` on."""
    terms = [Term("contact_radius", first + i, 1.0, ((p.quantity, "identity"),)) for i, p in enumerate(pieces)]
    return terms if friction is None else [*terms, Term("friction", first, 1.0, ((friction.quantity, "identity"),))]


def specification(
    pieces: Sequence[Piece], friction: PairFriction | None, places_of: Callable[[Array], Array]
) -> dict[str, Any]:
    """The pieces as the compiled core is made from them."""
    own = [{"edges": places_of(p.edges).tolist(), "triangles": places_of(p.triangles).tolist()} for p in pieces]
    return {"self_contact": own, "self_carried": [] if friction is None else places_of(friction.carried)}


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
    problem = (
        f"starts {-gaps[worst]:.3g} m too near to itself, at {', '.join(name_of(int(n)) for n in nodes[worst])}; "
        "pairs that are too near"
    )
    fix = "let it start farther apart, or give a smaller radius (half the thickness of cloth) or longer edges"
    raise SceneError("self_contact", problem, int((gaps < -TOUCHES).sum()), fix)
