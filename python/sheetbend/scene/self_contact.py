"""Ropes, cloths and bodies that touch themselves and each other."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..arrays.checks import check_label, is_number
from ..errors import SceneError
from ..moved import OldMethod
from .body import BodyCapsules
from .held import HeldScene
from .pieces import PairFriction, Piece


class SelfTouchingScene(HeldScene):
    """A scene under construction whose ropes, cloths and bodies may touch themselves and each other."""

    def add_self_contact(
        self,
        *pieces: Any,
        radius: float | Sequence[float],
        friction: float = 0.0,
        pairs: int | None = None,
        name: str = "self",
    ) -> None:
        """Let ropes, cloths and bodies touch themselves and each other; see docs/self_contact.md.

        Links of ropes, edges and triangles of cloths and capsules of bodies push each other apart and never pass
        through. Needs method "implicit". Once per scene, with all pieces.

        Args:
            pieces: ropes and cloths, such as `scene.ropes["rope"]`, and capsules of bodies, such as
                `bar.capsules([[(-0.1, 0, 0), (0.1, 0, 0)]])`; all ropes and cloths of the scene by default.
            radius: m, of a rope, of capsules, or half the thickness of a cloth; one for all
                (`<name>_contact_radius`), or one for each piece (`<name>_contact_radius_0` and so on). Of a rope at
                most half a link.
            friction: Coulomb's coefficient between any two (`<name>_friction`). Without friction, 0, there is no such
                quantity, and substeps are cheaper.
            pairs: with friction, how many pairs of edges and of particles and triangles may touch at a time; twice as
                many as there are edges and particles of cloths by default. A simulation in which more touch ends with
                an error. Each adds two hidden nodes to the scene.
            name: of its quantities.

        Raises:
            SceneError: what is no rope, cloth or capsules, radii, friction or pairs out of range; when it is compiled:
                a start too near to itself.
        """
        self._building()
        own = list(pieces) or [*self.ropes.values(), *self.cloths.values()]
        if self.contacts.pieces:
            raise SceneError("self_contact", "was given before", name, "give all pieces in one call")
        if not own:
            raise SceneError("self_contact.pieces", "are none", [], "add a rope or a cloth first")
        if not (is_number(friction) and friction >= 0):
            raise SceneError("self_contact.friction", "must not be negative", friction, "give a coefficient, or 0")
        if pairs is not None and not (is_number(pairs) and pairs == int(pairs) and pairs > 0):
            raise SceneError("self_contact.pairs", "must be a positive number", pairs, "give one, or leave it out")
        check_label("self_contact.name", name)
        given: Any = radius.tolist() if isinstance(radius, np.ndarray) else radius  # a number, where it has no axes
        radii: list[Any] = list(given) if isinstance(given, Sequence) else [given] * len(own)
        if len(radii) != len(own) or not all(is_number(r) and r > 0 for r in radii):
            fix = f"give m, one for all or {len(own)}, one for each piece"
            raise SceneError("self_contact.radius", "must be positive", radius, fix)
        names = [f"{name}_contact_radius"] * len(own)
        if np.ndim(radius):
            names = [f"{name}_contact_radius_{i}" for i in range(len(own))]
        found = [self._piece(p, r, q) for p, r, q in zip(own, radii, names, strict=True)]
        for quantity, value in dict(zip(names, radii, strict=True)).items():
            self.add_quantity(quantity, value, "m")
        self.contacts.pieces = found
        if friction > 0:
            cloths = sum(len(np.unique(p.triangles)) for p in found)
            count = int(pairs or 2 * (sum(len(p.edges) for p in found) + cloths))
            quantity = self.add_quantity(f"{name}_friction", friction, "")
            carried = self.add_hidden(np.zeros((2 * count, 3)), 1.0, pinned=True)
            self.contacts.pair_friction = PairFriction(name, quantity, carried)

    contact = OldMethod("add_contact")
    self_contact = OldMethod("add_self_contact")

    def _piece(self, piece: Any, radius: float, quantity: str) -> Piece:
        if isinstance(piece, BodyCapsules) and any(piece.body is body for body in self.bodies.values()):
            return Piece(piece.body.name, piece.edges, np.zeros((0, 3), dtype=int), quantity, piece)
        if any(piece is cloth for cloth in self.cloths.values()):
            triangles = np.asarray(piece.particles)[piece.mesh.triangles]
            edges = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
            return Piece(piece.name, np.unique(edges, axis=0), triangles, quantity)
        if not any(piece is rope for rope in self.ropes.values()):
            fix = "give scene.ropes[...], scene.cloths[...] and scene.bodies[...].capsules(...)"
            raise SceneError("self_contact.pieces", "hold no rope, cloth or capsules of the scene", piece, fix)
        nodes = np.asarray(piece.particles)
        edges = np.stack([nodes[:-1], nodes[1:]], axis=1)
        x = self.nodes
        shortest = float(np.linalg.norm(x[edges[:, 1]] - x[edges[:, 0]], axis=1).min())
        if radius > 0.5 * shortest * (1.0 + 1e-9):
            problem = f"is more than half a link of '{piece.name}', {0.5 * shortest:.3g} m"
            raise SceneError("self_contact.radius", problem, radius, "use fewer segments, or a smaller radius")
        return Piece(piece.name, edges, np.zeros((0, 3), dtype=int), quantity)
