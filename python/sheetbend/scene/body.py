"""A rigid body in a scene: the four nodes that it is, points on it, and what its motion shows.

The nodes are the center of mass p, a particle of the body's mass m, and three hidden axes a1, a2, a3 along the
principal axes of inertia, orthonormal and of masses J_k = (I1 + I2 + I3)/2 - I_k [kg m^2] (Betsch & Steinmann 2001,
Multibody Syst. Dyn. 6, 367). The material point X, counted from p along the principal axes, is at
p + X1 a1 + X2 a2 + X3 a3. The user's frame of the body lies anywhere: it has the center of mass c and the principal
axes R in it, so that X = R' (x - c).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import checks
from ..arrays.checks import check_label, finite
from ..arrays.rotations import quaternions_of
from ..arrays.types import Array
from ..errors import SceneError
from ..quantities.expression import cross, expressions, names_in, numbers, terms_of, vector
from ..quantities.quantities import Builder, Quantity, Term, intermediate

Values = Mapping[str, float] | None
AXES = "xyz"
GROUND = "ground"  # the name of the body that stands for the world
PLACE, TURN = 0.01, 0.1  # m, rad: the sizes against which the precision of places and angles is judged


class HasMotion(Protocol):
    """A trajectory: positions and velocities (..., nodes, 3) of all nodes."""

    @property
    def nodes(self) -> Array: ...

    @property
    def node_velocities(self) -> Array: ...


class InScene(Builder, Protocol):
    """A scene, as a body of it asks for numbers."""

    intermediates: int

    @property
    def quantities(self) -> dict[str, Quantity]: ...

    @property
    def gravity(self) -> Array: ...

    @property
    def node_count(self) -> int: ...


@dataclass(frozen=True, eq=False)
class FrameState:
    """The state of a body's frame at the start, expressions of quantities.

    Attributes:
        origin: (3,) m.
        frame: (3, 3), its axes as columns.
        velocity: (3,) m/s, of the origin.
        spin: (3,) rad/s, in the world's axes.
        own: names of the quantities that nothing else is made of.
        carrier: name of the body that a joint hangs this one on.
    """

    origin: Array
    frame: Array
    velocity: Array
    spin: Array
    own: tuple[str, ...] = ()
    carrier: str | None = None

    @property
    def numbers(self) -> Array:
        """All of it (18,), expressions."""
        return np.concatenate([self.origin, self.frame.ravel(), self.velocity, self.spin])


@dataclass(eq=False)
class Body:
    """A rigid body of a scene.

    Attributes:
        name: quantities are called `<name>_...`.
        particles: (4,) its nodes: the center of mass, a particle, and three axes, hidden nodes that have no place.
        center: (3,) expressions, the center of mass in the body's frame, m.
        axes: (3, 3) expressions, the principal axes of inertia in the body's frame, as columns.
        start: the state of its frame that it starts with.
        role: "free", "pinned" or "driven".
        spin_node: the hidden, pinned node that holds the angular momentum of a body that keeps it, or None.
        attached: particles that are fixed to it, with their places (3,) m in its frame, at which they start.
    """

    name: str
    particles: Array
    center: Array = field(repr=False)
    axes: Array = field(repr=False)
    scene: InScene = field(repr=False)
    start: FrameState = field(repr=False)
    role: str = "free"
    spin_node: int | None = None
    attached: dict[int, Array] = field(default_factory=dict, repr=False)
    _first: int | None = field(default=None, repr=False)  # of 18 intermediate values, the start as others see it

    def carrying(self) -> FrameState:
        """The start as intermediate values, of which a body that hangs on this one makes its own. Written out, the
        start of a body at the end of a chain of joints would double in length with each."""
        if all(set(e.parts) <= {()} for e in self.start.numbers):  # numbers, as of the ground
            return self.start
        if self._first is None:
            self._first, self.scene.intermediates = self.scene.intermediates, self.scene.intermediates + 18
        x = vector([intermediate(self._first + k) for k in range(18)])
        return FrameState(x[:3], x[3:12].reshape(3, 3), x[12:15], x[15:])

    def point(
        self, at: ArrayLike = (0.0, 0.0, 0.0), along: ArrayLike | None = None, name: str | None = None
    ) -> BodyPoint:
        """A point that moves with the body, where ropes, rods, joints and forces act.

        Args:
            at: (3,) m, in the body's frame.
            along: (3,) a direction there, such as that of a rod which leaves it.
            name: makes its place the quantities `<name>_x`, `_y`, `_z` m in the body's frame.

        Raises:
            SceneError: shapes, NaN, or a direction of no length.
        """
        where = f"{self.name}.point"
        x = finite(where, at, (3,), SceneError)
        place = expressions(x)
        if name is not None:
            check_label(f"{where}.name", name)
            names = [f"{name}_{a}" for a in AXES]
            for quantity, value in zip(names, x, strict=True):
                self.scene.add_quantity(quantity, value, "m", positive=False, scale=PLACE)
            place = vector(names)
        if along is None:
            return BodyPoint(self, place)
        way = finite(f"{where}.along", along, (3,), SceneError)
        if not way.any():
            raise SceneError(f"{where}.along", "has no length", way.tolist(), "give a direction")
        return BodyPoint(self, place, way / np.linalg.norm(way))

    def capsules(self, ends: ArrayLike) -> BodyCapsules:
        """Capsules that are part of the body, for `Scene.add_self_contact`, which gives them their radius.

        Args:
            ends: (n, 2, 3) m, both ends of the middle line of each in the body's frame, or (2, 3) of one. Capsules
                that meet may share ends, as the twelve edges of a box do.

        Raises:
            SceneError: shapes, NaN, or a middle line of no length.
        """
        where = f"{self.name}.capsules"
        lines = finite(where, ends, None, SceneError)
        lines = lines[None] if lines.ndim == 2 else lines
        if lines.ndim != 3 or lines.shape[1:] != (2, 3) or not len(lines):
            raise SceneError(where, "have the wrong shape", np.shape(ends), "give (n, 2, 3) m in the body's frame")
        places, edges = np.unique(lines.reshape(-1, 3), axis=0, return_inverse=True)
        edges = np.reshape(edges, (-1, 2))
        if short := np.flatnonzero(edges[:, 0] == edges[:, 1]).tolist():
            raise SceneError(where, "begin and end at one place", short, "give two ends, of a ball two near its middle")
        return BodyCapsules(self, places, edges)

    def weights(self, places: Array) -> Array:
        """(n, 4) expressions: weights of the body's nodes in the sums that make points (n, 3) m of its frame."""
        return np.stack([np.append(expressions(1.0), self.coordinates(place)) for place in places])

    def start_terms(self, given: Array, rates_given: Array) -> list[Term]:
        """Terms that make the nodes' initial positions and velocities depend on the quantities of the start: the
        expressions minus the numbers (nodes, 3) that are in the scene's arrays already. Before them, those of
        `carrying`."""
        carried: list[Term] = []
        if self._first is not None:
            all_18 = self._first + np.arange(18)
            carried = [Term("intermediate", all_18, 0.0, ()), *terms_of("intermediate", all_18, self.start.numbers)]
        s = self.start if self._first is None else self.carrying()
        own = [] if self.role == "driven" else [self.center, *self.axes.T]  # driven nodes start on their path
        nodes = np.array([*self.particles[: len(own)], *self.attached], dtype=self.particles.dtype)
        if not len(nodes):
            return carried
        index, point = 3 * nodes[:, None] + np.arange(3), np.ones(len(nodes), dtype=bool)
        point[1 : len(own)] = False  # the axes are directions
        arms = np.stack([s.frame @ x for x in (*own, *self.attached.values())])
        places = np.where(point[:, None], s.origin + arms, arms)
        found = carried + terms_of("position", index, places - given[nodes])
        if self.role == "pinned":
            return found
        rates = np.stack([cross(s.spin, arm) for arm in arms])
        rates = np.where(point[:, None], s.velocity + rates, rates)
        return found + terms_of("velocity", index, rates - rates_given[nodes])

    def coordinates(self, place: Array) -> Array:
        """(3,) expressions: a place (3,) m of the body's frame, from the center of mass along the principal axes."""
        return self.directions(place - self.center)

    def directions(self, way: Array) -> Array:
        """(3,) expressions: a direction (3,) of the body's frame, in components along the principal axes."""
        return np.asarray(self.axes.T @ way)

    def pose(self, motion: HasMotion | ArrayLike, values: Values = None) -> tuple[Array, Array]:
        """The pose of the body's frame in the world.

        Args:
            motion: a trajectory, or positions (..., nodes, 3) m of all nodes of the scene, such as `Scene.nodes`.
            values: quantities that the motion was simulated with, where they are not the scene's.

        Returns:
            Its origin (..., 3) m and its axes (..., 3, 3), as columns, in the world.

        Raises:
            SceneError: positions without the hidden nodes, which hold the axes.
        """
        p, turned = self._nodes(motion)
        at = self.values(values, names_in(self.axes) | names_in(self.center))
        frame = turned @ numbers(self.axes, at).T
        return p - frame @ numbers(self.center, at), frame

    def turned(self, way: ArrayLike) -> Array:
        """A direction (3,) of the body's frame in the world's axes (3,), at the initial positions of the scene."""
        return np.asarray(self.pose(self.scene.nodes)[1] @ finite(f"{self.name}.way", way, (3,), SceneError))

    def quaternions(self, motion: HasMotion | ArrayLike, values: Values = None) -> Array:
        """(..., 4), (x, y, z, w), from the body's axes to the world's. Of the two signs each frame of a motion has the
        one that is nearer to the frame before."""
        return quaternions_of(self.pose(motion, values)[1])

    def angular_velocity(self, motion: HasMotion) -> Array:
        """Angular velocity (frames, 3) rad/s, in the world's axes."""
        _, a = self._nodes(motion)
        _, v = self._nodes(motion, "node_velocities")
        return np.asarray(0.5 * np.cross(a, v, axis=-2).sum(axis=-1))

    def momentum(self, motion: HasMotion, values: Values = None) -> Array:
        """Linear momentum (frames, 3) kg m/s."""
        return np.asarray(self.inertia_of_nodes(values)[0] * self._nodes(motion, "node_velocities")[0])

    def angular_momentum(self, motion: HasMotion, values: Values = None, about: ArrayLike | None = None) -> Array:
        """Angular momentum (frames, 3) kg m^2/s, about the center of mass or about a fixed point (3,) m."""
        x, a = self._nodes(motion)
        v, rates = self._nodes(motion, "node_velocities")
        mass, *J = self.inertia_of_nodes(values)
        spin = np.asarray((np.cross(a, rates, axis=-2) * J).sum(axis=-1))
        if about is None:
            return spin
        return spin + mass * np.cross(x - finite(f"{self.name}.about", about, (3,), SceneError), v)

    def kinetic_energy(self, motion: HasMotion, values: Values = None) -> Array:
        """Kinetic energy (frames,) J, of translation and rotation."""
        v, rates = self._nodes(motion, "node_velocities")
        mass, *J = self.inertia_of_nodes(values)
        return np.asarray(0.5 * (mass * (v**2).sum(axis=-1) + ((rates**2).sum(axis=-2) * J).sum(axis=-1)))

    def energy(self, motion: HasMotion, values: Values = None) -> Array:
        """Kinetic and potential energy (frames,) J; that of the weight is zero at the world's origin."""
        x, _ = self._nodes(motion)
        return self.kinetic_energy(motion, values) - self.inertia_of_nodes(values)[0] * (x @ self.scene.gravity)

    def inertia_of_nodes(self, values: Values = None) -> Array:
        """Masses of the four nodes (4,): m in kg, and J1, J2, J3 in kg m^2."""
        at = self.values(values)
        moments = np.array([at[f"{self.name}_inertia_{k}"] for k in (1, 2, 3)])
        return np.append(at[f"{self.name}_mass"], 0.5 * moments.sum() - moments)

    def values(self, changed: Values = None, names: Collection[str] | None = None) -> dict[str, float]:
        """The scene's quantities by name, or those of some names; some of them changed."""
        if not isinstance(changed, Mapping | None):
            raise SceneError("values", "must be a mapping", changed, "give numbers by the names of quantities")
        known = self.scene.quantities
        return {name: known[name].value for name in (known if names is None else names)} | dict(changed or {})

    def _nodes(self, motion: HasMotion | ArrayLike, part: str = "nodes") -> tuple[Array, Array]:
        """The part of a motion's arrays (..., nodes, 3) that belongs to the center of mass, (..., 3), and to the axes,
        (..., 3, 3) as columns."""
        fix = f"give a trajectory, or the positions (..., {self.scene.node_count}, 3) of all its nodes"
        given: Any = getattr(motion, part, motion if part == "nodes" else None)
        x = checks.numbers(f"{self.name}.motion", given, SceneError)
        if x.ndim < 2 or x.shape[-2:] != (self.scene.node_count, 3):
            raise SceneError(f"{self.name}.motion", "needs the nodes that hold its axes", x.shape, fix)
        own = x[..., self.particles, :]
        return own[..., 0, :], np.swapaxes(own[..., 1:, :], -1, -2)


@dataclass(frozen=True, eq=False)
class BodyPoint:
    """A point on a body, and perhaps a direction there; `Body.point` makes it.

    Attributes:
        place: (3,) expressions, m, in the body's frame.
        along: (3,) unit vector in the body's frame, or None.
    """

    body: Body
    place: Array = field(repr=False)
    along: Array | None = None

    @property
    def coordinates(self) -> Array:
        """(3,) expressions, counted from the center of mass along the principal axes: the weights of the axes."""
        return self.body.coordinates(self.place)

    def at_start(self) -> tuple[Array, Array | None]:
        """The place (3,) m and the direction (3,) of the point in the world, as the scene was built."""
        origin, frame = self.body.pose(self.body.scene.nodes)
        return (
            origin + frame @ numbers(self.place, self.body.values()),
            None if self.along is None else frame @ self.along,
        )


@dataclass(frozen=True, eq=False)
class BodyCapsules:
    """Capsules that are part of a body; `Body.capsules` makes them.

    Attributes:
        places: (m, 3) m, their ends in the body's frame, each once.
        edges: (n, 2) places that each goes between.
    """

    body: Body
    places: Array = field(repr=False)
    edges: Array = field(repr=False)
