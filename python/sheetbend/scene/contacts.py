"""Which particles of a scene and points of its bodies may touch which shapes, and how rough and stiff that is."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import check_label, is_number, node_array
from ..arrays.types import Array
from ..errors import SceneError
from ..quantities.expression import terms_of
from ..quantities.quantities import ZERO_OR_MORE, Builder, Term
from .balls import Balls
from .body_points import BodyPoints
from .colliders import Collider
from .pieces import PairFriction, Piece, piece_terms

ARRAYS = (
    *("friction", "contact_radius", "contact_stiffness", "collider_pose", "collider_size", "restitution"),
    *("contact_weight", "contact_dissipation"),
)
TOUCHES = 1e-6  # m: so deep a particle may be at the start, as under its own weight


@runtime_checkable
class HasParticles(Protocol):
    """A rope, a cloth, or anything else that knows its particles."""

    @property
    def particles(self) -> Array: ...


@dataclass(frozen=True, eq=False)
class Contact:
    """Particles, or points of a body, that may touch a collider.

    Attributes:
        name: of its quantities.
        collider: place in `Contacts.colliders`.
        nodes: (n, 1) particles, or (n, 4) the nodes of the body, again for each of its points. A point is the sum of
            its nodes times the weights of the input array "contact_weight".
        carried: (n,) hidden, pinned nodes whose coordinates are the tangential forces that are carried from substep to
            substep [N], in the collider's frame.
        rigid: whether it is as stiff as masses and substeps allow.
        bounces: whether it has a restitution.
        dissipates: whether it has a dissipation.
    """

    name: str
    collider: int
    nodes: Array
    carried: Array
    rigid: bool
    bounces: bool
    dissipates: bool = False

    @property
    def particles(self) -> Array:
        """(n,) the particle of each point, which is the center of mass for a body."""
        return np.asarray(self.nodes[:, 0])

    @property
    def of_body(self) -> bool:
        """Whether it is points of a body that touch."""
        return bool(self.nodes.shape[1] > 1)


@dataclass(frozen=True)
class ContactNumbers:
    """What describes a contact, as `Scene.add_contact` takes it.

    Attributes:
        friction: Coulomb's coefficient.
        radius: m.
        stiffness: N/m; None where it is rigid.
        restitution: None where nothing bounces.
        dissipation: s/m; None where it is elastic.
    """

    friction: float
    radius: float
    stiffness: float | None
    restitution: float | None
    dissipation: float | None = None

    def check(self, name: str) -> None:
        """Raises SceneError where a number is none that it could be."""
        needed = (("friction", self.friction, "a coefficient, or 0"), ("radius", self.radius, "m, or 0"))
        for label, value, unit in needed:
            if not (is_number(value) and value >= 0):
                raise SceneError(f"{name}.contact.{label}", "must be a number, not negative", value, f"give {unit}")
        if self.stiffness is not None and not (is_number(self.stiffness) and self.stiffness > 0):
            fix = "give N/m, or leave it out for a rigid contact"
            raise SceneError(f"{name}.contact.stiffness", "must be positive", self.stiffness, fix)
        if self.restitution is not None and not (is_number(self.restitution) and 0 <= self.restitution <= 1):
            fix = "give the speed after an impact over that before, or leave it out"
            raise SceneError(f"{name}.contact.restitution", "must be between 0 and 1", self.restitution, fix)
        if self.dissipation is None:
            return
        field = f"{name}.contact.dissipation"
        if not (is_number(self.dissipation) and self.dissipation >= 0):
            fix = "give s/m, 0 for an elastic contact, or leave it out"
            raise SceneError(field, "must be a number, not negative", self.dissipation, fix)
        if self.stiffness is None:
            raise SceneError(field, "is of a rigid contact", self.dissipation, "give a stiffness, N/m, too")
        if self.restitution is not None:
            fix = f"leave out the dissipation, or the restitution of {self.restitution}"
            raise SceneError(field, "is of a contact with a restitution", self.dissipation, fix)


class Contacts:
    """The colliders and contacts of a scene, each in the order in which they were added."""

    def __init__(self) -> None:
        self.colliders: dict[str, Collider] = {}
        self.contacts: list[Contact] = []
        self.settling: set[str] = set()  # those that move what starts inside to the surface
        self.pieces: list[Piece] = []  # what may touch itself
        self.pair_friction: PairFriction | None = None  # of these
        self.balls: Balls | None = None  # that hit each other

    @property
    def weights(self) -> int:
        """How many weights the points of bodies in contacts with colliders have; those of pieces follow them."""
        return sum(c.nodes.size for c in self.contacts if c.of_body)

    def counted(self) -> dict[str, int]:
        """By name of a contact, how many particles may touch; for pairs with friction, how many pairs; of balls all."""
        sizes = {c.name: len(c.particles) for c in self.contacts}
        if self.pair_friction is not None:
            sizes[self.pair_friction.name] = self.pair_friction.room
        if self.balls is not None:
            sizes[self.balls.name] = len(self.balls.particles)
        return sizes

    def between_pieces(self) -> list[Term]:
        """What makes the inputs of pieces and of balls, which stand behind those of contacts with colliders."""
        first = len(self.contacts)
        terms = piece_terms(self.pieces, self.pair_friction, first, self.weights)
        if self.balls is not None:
            terms += self.balls.terms(first + len(self.pieces), sum(c.bounces for c in self.contacts))
        return terms

    def check_name(self, field: str, name: str) -> None:
        """Raises SceneError where a contact or collisions have the name."""
        check_label(field, name)
        if any(c.name == name for c in self.contacts) or (self.balls is not None and self.balls.name == name):
            raise SceneError(field, "is taken by another contact", name, "give each contact a name of its own")

    def _place(self, scene: Builder, collider: Collider) -> int:
        """The place of a collider, which is added unless it is there."""
        for place, known in enumerate(self.colliders.values()):
            if known is collider:
                return place
        name = collider.name or collider.shape
        if name in self.colliders:
            fix = "give each collider a name of its own, such as sb.Plane(name='table')"
            raise SceneError("collider.name", "is taken by another collider", name, fix)
        first_pose = 6 * sum(len(c.poses.times) for c in self.colliders.values())
        first_size = sum(len(c.sizes) for c in self.colliders.values())
        knots = first_pose + 6 * np.arange(len(collider.poses.times))
        for axis, label in enumerate("xyz"):
            scene.add_quantity(f"{name}_{label}", 0.0, "m", positive=False, scale=0.01)
            scene.add_terms([Term("collider_pose", knots + axis, 1.0, ((f"{name}_{label}", "identity"),))])
        for k, (label, value) in enumerate(collider.sizes.items()):
            scene.add_quantity(f"{name}_{label}", value, "m")
            scene.add_terms([Term("collider_size", first_size + k, 1.0, ((f"{name}_{label}", "identity"),))])
        self.colliders[name] = collider
        return len(self.colliders) - 1

    def check(
        self,
        what: ArrayLike | HasParticles | BodyPoints,
        collider: Collider,
        count: int,
        numbers: ContactNumbers,
        name: str | None,
    ) -> tuple[Array, str]:
        """The nodes (n, k) of the points of a new contact, of `count` particles in the scene, and its name."""
        if not isinstance(collider, Collider):
            raise SceneError(
                "contact.collider",
                "is not a shape",
                collider,
                "give a Plane, Sphere, Capsule, Cylinder, Box or DistanceField",
            )
        name = collider.name or collider.shape if name is None else name
        self.check_name("contact.name", name)
        if isinstance(what, BodyPoints):
            which = np.tile(what.body.particles, (len(what.places), 1))
        else:
            particles = what.particles if isinstance(what, HasParticles) else what
            which = node_array(f"{name}.contact.particles", particles, count)[:, None]
            if len(np.unique(which)) < len(which):
                fix = "list each particle once"
                raise SceneError(f"{name}.contact.particles", "are listed twice", which.ravel().tolist(), fix)
        numbers.check(name)
        if not numbers.radius < collider.reach:
            problem = f"is not below the {collider.reach:.3g} m around '{collider.name}' in which distances are known"
            raise SceneError(
                f"{name}.contact.radius", problem, numbers.radius, "give the DistanceField a larger margin"
            )
        return which, name

    def add(
        self,
        scene: Builder,
        collider: Collider,
        which: Array,
        carried: Array,
        numbers: ContactNumbers,
        name: str,
        points: BodyPoints | None = None,
    ) -> None:
        """See `Scene.add_contact`; `points` are those of a body."""
        at, place = len(self.contacts), self._place(scene, collider)
        self._name(scene, f"{name}_friction", "friction", at, numbers.friction, "")
        if numbers.radius > 0:
            self._name(scene, f"{name}_contact_radius", "contact_radius", at, numbers.radius, "m")
        if numbers.stiffness is not None:
            soft = sum(not c.rigid for c in self.contacts)
            self._name(scene, f"{name}_contact_stiffness", "contact_stiffness", soft, numbers.stiffness, "N/m")
        if numbers.restitution is not None:
            bouncing = sum(c.bounces for c in self.contacts)
            quantity = f"{name}_restitution"
            scene.add_quantity(quantity, numbers.restitution, "", positive=False, scale=0.1, limits=(0.0, 1.0))
            scene.add_terms([Term("restitution", bouncing, 1.0, ((quantity, "identity"),))])
        if numbers.dissipation is not None:
            losing = sum(c.dissipates for c in self.contacts)
            self._name(scene, f"{name}_contact_dissipation", "contact_dissipation", losing, numbers.dissipation, "s/m")
        if points is not None:
            weights = points.weights()
            index = self.weights + np.arange(weights.size).reshape(weights.shape)
            scene.add_terms(terms_of("contact_weight", index, weights))
        flags = numbers.stiffness is None, numbers.restitution is not None, numbers.dissipation is not None
        self.contacts.append(Contact(name, place, which, carried, *flags))

    def _name(self, scene: Builder, quantity: str, array: str, at: int, value: float, unit: str) -> None:
        scene.add_quantity(
            quantity,
            value,
            unit,
            positive=value > 0,
            limits=None if value > 0 else ZERO_OR_MORE,
            scale=None if value > 0 else 0.1,
        )
        scene.add_terms([Term(array, at, 1.0, ((quantity, "identity"),))])

    def specification(self, places_of: Callable[[Array], Array]) -> dict[str, Any]:
        """The topology, as the compiled core is made from it, with the places of nodes in arrays over all of them."""
        return {
            "colliders": [{"name": name, **c.specification} for name, c in self.colliders.items()],
            "contacts": [
                {
                    "name": c.name,
                    "collider": c.collider,
                    "arity": c.nodes.shape[1],
                    "nodes": places_of(c.nodes).ravel(),
                    "carried": places_of(c.carried),
                    "rigid": c.rigid,
                    "bounces": c.bounces,
                    "dissipates": c.dissipates,
                }
                for c in self.contacts
            ],
            "balls": places_of(np.zeros(0, dtype=int) if self.balls is None else self.balls.particles),
        }

    def arrays(self) -> Mapping[str, Array]:
        """The plain parts of the input arrays: poses, and zero for what quantities make."""
        poses = [
            np.concatenate([c.poses.positions, c.poses.rotations], axis=1).ravel() for c in self.colliders.values()
        ]
        balls = 0 if self.balls is None else len(self.balls.particles)
        return {
            "friction": np.zeros(len(self.contacts) + (self.pair_friction is not None)),
            "contact_radius": np.zeros(len(self.contacts) + len(self.pieces) + balls),
            "contact_stiffness": np.zeros(sum(not c.rigid for c in self.contacts)),
            "collider_pose": np.concatenate([np.zeros(0), *poses]),
            "collider_size": np.zeros(sum(len(c.sizes) for c in self.colliders.values())),
            "restitution": np.zeros(sum(c.bounces for c in self.contacts) + (balls > 0)),
            "contact_weight": np.zeros(self.weights + 4 * sum(p.points for p in self.pieces)),
            "contact_dissipation": np.zeros(sum(c.dissipates for c in self.contacts)),
        }

    def expect_apart(self, core: Any, inputs: Array, masses: Array, gravity: Array, held: set[int]) -> None:
        """Refuse a start at which particles are inside a collider, deeper than they lie under their weight."""
        soft = iter(inputs[core.layout["contact_stiffness"][0] :])
        for k, c in enumerate(self.contacts):
            gaps = core.contact_gaps(inputs, 0.0, k)[:, 0]
            stiffness = np.inf if c.rigid else next(soft)
            allowed = TOUCHES + 2.0 * masses[c.particles] * np.linalg.norm(gravity) / stiffness
            depth = np.where(np.isin(c.particles, sorted(held)), 0.0, -gaps) - allowed
            worst = int(np.argmax(depth))
            if depth[worst] > 0:
                name = list(self.colliders)[c.collider]
                point = f"point {worst} of a body" if c.of_body else f"particle {c.particles[worst]}"
                problem = f"starts with {point} inside '{name}', which is {-gaps[worst]:.3g} m deep"
                fix = (
                    "let it start outside, counted from the contact's radius, or give settle=True (settle = true in a "
                    f"configuration), which moves {'the body' if c.of_body else 'such particles'} to the surface "
                    "before the motion starts"
                )
                raise SceneError(f"{c.name}.contact", problem, int((depth > 0).sum()), fix)
