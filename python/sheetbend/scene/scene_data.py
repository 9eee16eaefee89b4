"""What a scene holds: particles, groups of constraints, motion, forces, air, and the quantities that they depend on."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import check_label, finite, node_array
from ..arrays.column import Column
from ..arrays.types import Array
from ..errors import SceneError
from ..quantities.quantities import Quantity, Term
from .air import Air
from .body import Body
from .boundary import Boundary
from .contacts import Contacts
from .forces import Forces
from .frames import Frame
from .group import Group, GroupPlaces, places_of_groups
from .means import start_terms
from .volume import Volumes


class Rows:
    """Where nodes start (n, 3) m, how fast they move (n, 3) m/s, and their masses (n,) kg, in the order of creation."""

    def __init__(self) -> None:
        self.positions, self.velocities, self.mass = Column(3), Column(3), Column()

    def moved(self, positions: Array, velocities: Array) -> Rows:
        """A copy with (n, 3) m and m/s added."""
        made = Rows()
        made.extend(self.positions.values + positions, self.velocities.values + velocities, self.mass.values)
        return made

    def extend(self, positions: Array, velocities: Array, mass: Array) -> None:
        self.positions.extend(positions)
        self.velocities.extend(velocities)
        self.mass.extend(mass)


class SceneData:
    """The content of a `Scene`, which adds to it and simulates it. SI units, z up."""

    def __init__(self, name: str = "scene", gravity: ArrayLike = (0.0, 0.0, -9.81)) -> None:
        check_label("scene.name", name)
        self.name = name
        self.quantities: dict[str, Quantity] = {}
        self.terms: list[Term] = []
        self.groups: list[Group] = []
        self.pinned: set[int] = set()
        self.directors: dict[int, Frame] = {}  # and the normals of sections
        self.boundary = Boundary()
        self.forces = Forces()
        self.has_drag = False
        self.air = Air()
        self.volumes = Volumes()
        self.contacts = Contacts()
        self.ropes: dict[str, Any] = {}
        self.cloths: dict[str, Any] = {}
        self.solids: dict[str, Any] = {}
        self.bodies: dict[str, Body] = {}
        self.means: dict[int, tuple[Array, Array]] = {}  # by node: particles, and their weights of sum one
        self.over_time: dict[str, Any] = {}  # unknown inputs
        self.intermediates = 0  # how many intermediate values the terms make
        self.rotors: dict[str, list[int | None]] = {}  # five nodes by joint, of which the second turns
        self._particles, self._hidden = Rows(), Rows()
        self._frozen = False
        self._drag: dict[str, Array] = {}
        self._gravity = finite("gravity", gravity, (3,), SceneError)

    def add_quantity(
        self,
        name: str,
        value: float,
        unit: str,
        positive: bool = True,
        scale: float | None = None,
        limits: tuple[float, float] | None = None,
        shared: bool = False,
        beyond: str = Quantity.beyond,
        unsure: float = Quantity.unsure,
    ) -> str:
        """Declare a named quantity; `add_terms` says what it makes.

        Args:
            shared: it may be there already, with the same value.

        Raises:
            SceneError: the name is taken or starts with a bracket, or the value is not finite (or not positive where
                it must be).
        """
        self._building()
        if isinstance(name, str) and name.startswith("["):
            raise SceneError(name, "starts with a bracket, as what a fit tries by itself does", value, "leave it out")
        quantity = Quantity(name, value, unit, positive, scale, limits, beyond, unsure)
        before = self.quantities.setdefault(name, quantity)
        if before is quantity or (shared and before == quantity):
            return name
        if shared:
            raise SceneError(name, f"is {before.value:g} already", value, "give what shares it the same value")
        raise SceneError(name, "is a quantity already", value, "give another name")

    def add_terms(self, terms: Sequence[Term]) -> None:
        """Add terms to the inputs (array names and order as in `CompiledScene.layout`)."""
        self._building()
        for t in terms:
            missing = [q for q in t.quantities if q not in self.quantities]
            if missing:
                raise SceneError("terms", "use unknown quantities", missing, "declare them with add_quantity")
        self.terms += terms

    @property
    def with_axes(self) -> list[list[int | None]]:
        """Five nodes of each body and of what else has axes: the center, three axes, and the node that keeps the spin,
        or None."""
        return [*([*b.particles.tolist(), b.spin_node] for b in self.bodies.values()), *self.rotors.values()]

    @property
    def body_nodes(self) -> Array:
        """(n, 4) nodes of the bodies and of what else has axes: the center and three axes."""
        return np.array([nodes[:4] for nodes in self.with_axes], dtype=np.int64).reshape(-1, 4)

    @property
    def every_term(self) -> list[Term]:
        """Those that were added, of the boundary, of the start of bodies, those first on which others hang, and of that
        of means."""
        x, v = self.nodes, self._of_nodes("velocities")
        starts = (t for body in sorted(self.bodies.values(), key=self._depth) for t in body.start_terms(x, v))
        found = [*self.terms, *self.boundary.terms(), *self.forces.terms(), *starts, *self.contacts.between_pieces()]
        return found + start_terms(self.means, found, x, v)

    def _depth(self, body: Body) -> int:
        """How many joints a body hangs on."""
        joints, carrier = 0, body.start.carrier
        while carrier is not None:
            joints, carrier = joints + 1, self.bodies[carrier].start.carrier
        return joints

    @property
    def sheets(self) -> list[Any]:
        """Cloths and the surfaces of solids: what has a `name`, a `mesh` of triangles, and `particles`."""
        return [*self.cloths.values(), *(solid.surface for solid in self.solids.values())]

    @property
    def frozen(self) -> bool:
        return self._frozen

    @property
    def particle_count(self) -> int:
        return len(self._particles.mass)

    @property
    def hidden_count(self) -> int:
        """How many nodes are no particles."""
        return len(self._hidden.mass)

    @property
    def node_count(self) -> int:
        """How many particles and hidden nodes there are."""
        return self.particle_count + self.hidden_count

    @property
    def positions(self) -> Array:
        """Initial positions of the particles as given, (particles, 3) m."""
        return self._particles.positions.values.copy()

    @property
    def nodes(self) -> Array:
        """Initial positions of all nodes as given, (nodes, 3) m: those of the particles, then those of the hidden
        nodes, which their own, negative numbers index."""
        return self._of_nodes("positions")

    def node_array(self, field: str, nodes: ArrayLike) -> Array:
        """Numbers of particles or hidden nodes as one array.

        Raises:
            SceneError: no such node.
        """
        return node_array(field, nodes, self.particle_count, self.hidden_count)

    def places_of(self, nodes: ArrayLike) -> Array:
        """Where particles or hidden nodes stand in arrays over all nodes, counted from 0."""
        own = np.asarray(nodes, dtype=np.int64)
        return np.where(own < 0, own + self.node_count, own)

    @property
    def gravity(self) -> Array:
        """(3,) m/s^2."""
        return self._gravity.copy()

    def node_in_words(self, place: int) -> str:
        """What stands at a place of an array over all nodes, counted from 0."""
        if place < self.particle_count:
            names = {int(b.particles[0]): b.name for b in self.bodies.values()}
            return f"the body '{names[place]}'" if place in names else f"particle {place}"
        node = place - self.node_count
        axes = {int(p): (k, b.name) for b in self.bodies.values() for k, p in enumerate(b.particles)}
        if node in axes:
            return "axis {} of the body '{}'".format(*axes[node])
        if node in self.directors:
            return "the frame of the edge from particle {} to {}".format(*self.directors[node][:2])
        return f"hidden node {node}"

    @property
    def free(self) -> Array:
        """Numbers of the particles that can move."""
        free = self.free_nodes
        return free[free < self.particle_count]

    @property
    def free_nodes(self) -> Array:
        """Where the nodes that can move stand in arrays over all nodes, counted from 0."""
        held = np.zeros(self.node_count, dtype=bool)
        held[self.held] = True
        return np.flatnonzero(~held)

    @property
    def held(self) -> list[int]:
        """Pinned and driven nodes in the order in which they stand in arrays over all nodes: particles first."""
        return sorted(self.pinned | set(self.boundary.driven), key=lambda n: n if n >= 0 else n + self.node_count)

    def group(self, name: str) -> tuple[Group, int, int]:
        """A group with its first constraint and its first multiplier row.

        Raises:
            SceneError: no such group.
        """
        places = self.places_of_group(name)
        return places.group, places.first, places.first_row

    def places_of_group(self, name: str) -> GroupPlaces:
        """Where a group's constraints stand in arrays over those of all groups.

        Raises:
            SceneError: no such group.
        """
        for places in places_of_groups(self.groups):
            if isinstance(name, str) and places.group.name == name:
                return places
        raise SceneError("group", "does not exist", name, f"name one of: {', '.join(g.name for g in self.groups)}")

    def base_arrays(self) -> dict[str, Array]:
        """The plain parts of all input arrays, to which the quantities' terms are added; over all nodes."""
        return {
            "position": self.nodes,
            "velocity": self._of_nodes("velocities"),
            "mass": self._of_nodes("mass"),
            "compliance": self._concatenated("compliance"),
            "damping": self._concatenated("damping"),
            "rest": self._concatenated("rest"),
            "boundary": self.boundary.values,
            "force": self.forces.values,
            "gravity": self._gravity,
            "drag_linear": self._drag_of("linear"),
            "drag_quadratic": self._drag_of("quadratic"),
            **self.air.arrays(),
            **self.volumes.arrays(),
            **self.contacts.arrays(),
        }

    def _building(self) -> None:
        if self._frozen:
            raise SceneError(
                self.name,
                "is frozen, it has been simulated or compiled",
                "frozen",
                "add everything first, or build a new scene",
            )

    def _concatenated(self, field: str) -> Array:
        return np.concatenate([np.ravel(getattr(g, field)) for g in self.groups]) if self.groups else np.zeros(0)

    def _of_nodes(self, field: str) -> Array:
        """Of all nodes: particles in their order, then hidden nodes, the first one last."""
        particles, hidden = (getattr(rows, field).values for rows in (self._particles, self._hidden))
        return np.concatenate([particles, hidden[::-1]])

    def _drag_of(self, field: str) -> Array:
        """Zero for hidden nodes, and for particles that came after the drag was set."""
        given = self._drag.get(field, np.zeros(0))
        return np.concatenate([given, np.zeros(self.node_count - len(given))])
