"""How a joint is made: its frame in both bodies, the start of the body that hangs on it, and its constraints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import check_label, finite, is_number
from ..arrays.types import Array
from ..errors import SceneError
from ..quantities.expression import Expression, cross, expressions, names_in, numbers, terms_of, vector
from ..quantities.quantities import ZERO_OR_MORE, Term
from ..scene.body import AXES, GROUND, PLACE, Body, FrameState, HasMotion, Values
from ..scene.given import check_scene
from ..scene.scene import Scene
from .chain import unit_vector
from .grip import any_across

TURN, SPIN, SPEED = 0.1, 1.0, 0.1  # rad, rad/s, m/s: sizes against which precision is judged


@dataclass(frozen=True, eq=False)
class Joint:
    """A joint of a scene.

    Attributes:
        name: its quantities and groups begin with it.
        kind: such as "hinge".
        upper, lower: the bodies.
        places: the joint's place in each body's frame, (3,) expressions, m.
        axes: directions (3, 3) in each body's frame, as rows: the joint's axis and two across it, which coincide in
            both bodies at the start as given.
    """

    name: str
    kind: str
    upper: Body
    lower: Body
    places: tuple[Array, Array] = field(repr=False)
    axes: tuple[Array, Array] = field(repr=False)

    def angle(self, motion: HasMotion | ArrayLike) -> Array:
        """(...,) rad, by which the lower body has turned about the joint's axis against the upper one, from how they
        were given; along a trajectory, or at positions (..., nodes, 3) m of all nodes of the scene."""
        sides = zip((self.upper, self.lower), self.axes, strict=True)
        first, second = (body.pose(motion)[1] @ own.T for body, own in sides)
        e, f, u = first[..., 1], first[..., 2], second[..., 1]
        return np.asarray(np.arctan2((f * u).sum(axis=-1), (e * u).sum(axis=-1)))

    def shift(self, motion: HasMotion | ArrayLike, values: Values = None) -> Array:
        """(...,) m, by which the lower body has slid along the joint's axis of the upper one, from how they were given;
        along a trajectory or at positions as of `angle`, with `values` as of `Body.pose`."""
        (x, turned), (y, frame) = (body.pose(motion, values) for body in (self.upper, self.lower))
        at = self.lower.values(values, names_in(self.places[0]) | names_in(self.places[1]))
        first, second = (numbers(place, at) for place in self.places)
        return np.asarray(((y + frame @ second - x - turned @ first) * (turned @ self.axes[0][0])).sum(axis=-1))


def ground(scene: Scene) -> Body:
    """Return the body that stands for the world: pinned at its origin, along its axes, without quantities."""
    check_scene(scene)
    if GROUND not in scene.bodies:
        x, mass = np.vstack([np.zeros(3), np.eye(3)]), np.array([1.0, 1e-12, 1e-12, 1e-12])
        nodes = scene.add_hidden(x, mass, pinned=True)
        zero, one = expressions(np.zeros(3)), expressions(np.eye(3))
        scene.bodies[GROUND] = Body(GROUND, nodes, zero, one, scene, FrameState(zero, one, zero, zero), "pinned")
    return scene.bodies[GROUND]


class Making:
    """A joint while it is made: its frame in both bodies, then its constraints."""

    def __init__(
        self,
        kind: str,
        upper: Body | None,
        lower: Body,
        at: ArrayLike,
        axis: ArrayLike,
        name: str,
        across: ArrayLike | None = None,
    ) -> None:
        check_label("joint.name", name)
        if not isinstance(lower, Body) or not isinstance(upper, Body | None):
            fix = "give what Scene.add_body returns; None is the ground, above"
            raise SceneError(f"{name}.lower", "is not a body", (upper, lower), fix)
        self.scene: Scene = lower.scene  # type: ignore[assignment]  # the one that bodies are made in
        self.upper = ground(self.scene) if upper is None else upper
        if self.upper.scene is not self.scene or self.upper is lower:
            problem = "is the upper one" if self.upper is lower else "is in another scene"
            raise SceneError(f"{name}.lower", problem, lower.name, "join two bodies of one scene")
        self.name, self.kind, self.lower = name, kind, lower
        place = finite(f"{name}.at", at, (3,), SceneError)
        n = unit_vector(f"{name}.axis", axis)
        e = any_across(n) if across is None else unit_vector(f"{name}.axes", across)
        if abs(n @ e) > 1e-6:
            fix = "give two directions at a right angle"
            raise SceneError(f"{name}.axes", "are not across each other", float(n @ e), fix)
        world = np.stack([n, e, np.cross(n, e)])
        self.places: list[Array] = []
        self.axes: list[Array] = []
        for body, label in ((self.upper, "upper"), (lower, "lower")):
            origin, frame = body.pose(self.scene.nodes)
            own = [f"{name}_{label}_{a}" for a in AXES]
            for quantity, value in zip(own, (place - origin) @ frame, strict=True):
                self.scene.add_quantity(quantity, float(value), "m", positive=False, scale=PLACE)
            self.places.append(vector(own))
            self.axes.append(world @ frame)
        self.nodes = self.upper.particles.tolist(), lower.particles.tolist()

    def joint(self) -> Joint:
        (x, y), (first, second) = self.places, self.axes
        return Joint(self.name, self.kind, self.upper, self.lower, (x, y), (first, second))

    def hang(self, turn: float | None = None, shift: float | None = None, fixed: bool = False) -> None:
        """Let the lower body start where the joint lets it be, unless it is held or hangs elsewhere already.

        Args:
            turn: rad/s of the angle about the axis, where the joint has one.
            shift: m/s along the axis, where it slides.
            fixed: the lower body cannot turn against the upper one, but for `turn`.
        """
        if self.lower.role != "free" or self.lower.start.carrier is not None or self._is_above():
            return
        u, low = self.upper.carrying(), self.lower.start
        n = u.frame @ self.axes[0][0]
        frame, spin = low.frame, low.spin
        if turn is not None or fixed:
            given = self.axes[0].T @ self.axes[1]  # the lower body's axes in the upper one's frame
            frame, spin = u.frame @ given, u.spin
        kept = [q for q in low.own if q in self._attitude()] if turn is None and not fixed else []
        for quantity in low.own:
            if quantity not in kept:
                del self.scene.quantities[quantity]
        own = list(kept)
        if turn is not None:
            angle = self._start("angle", 0.0, "rad", TURN)
            rate = self._start("rate", turn, "rad/s", SPIN)
            frame = u.frame @ self._turned(angle) @ self.axes[1]
            spin = u.spin + n * Expression.of(rate)
            own += [angle, rate]
        arm, drop = u.frame @ self.places[0], frame @ self.places[1]
        moved = cross(u.spin, arm)
        if shift is not None:
            along = self._start("shift", 0.0, "m", PLACE)
            speed = self._start("rate" if turn is None else "shift_rate", shift, "m/s", SPEED)
            by = n * Expression.of(along)
            arm, moved = arm + by, moved + cross(u.spin, by) + n * Expression.of(speed)
            own += [along, speed]
        self.lower.start = FrameState(
            u.origin + arm - drop,
            frame,
            u.velocity + moved - cross(spin, drop),
            spin,
            tuple(own),
            self.upper.name,
        )

    def _is_above(self) -> bool:
        """Whether the upper body hangs on the lower one."""
        body: Body | None = self.upper
        while body is not None:
            if body is self.lower:
                return True
            carrier = body.start.carrier
            body = None if carrier is None else self.scene.bodies[carrier]
        return False

    def _attitude(self) -> set[str]:
        return {f"{self.lower.name}_{key}_{a}" for key in ("turn", "spin") for a in AXES}

    def _start(self, label: str, value: float, unit: str, scale: float) -> str:
        if not is_number(value):
            raise SceneError(f"{self.name}.{label}", "must be a finite number", value, f"give {unit}")
        return self.scene.add_quantity(f"{self.name}_{label}", value, unit, positive=False, scale=scale)

    def _turned(self, angle: str) -> Array:
        """(3, 3) expressions, the joint's directions in the upper body's frame as columns, turned by a quantity."""
        n, e, f = self.axes[0]
        sin, cos = Expression.of(angle, "sin"), Expression.of(angle, "cos")
        return np.stack([expressions(n), e * cos + f * sin, f * cos - e * sin], axis=1)

    def coincide(self, compliance: float | None = None) -> None:
        """Hold the two places together."""
        (p, *a), (q, *b) = self.nodes
        weights = [*self.upper.coordinates(self.places[0]), *self.lower.coordinates(self.places[1])]
        self.constrain("coincide", "place", [[p, q, *a, *b]], [weights], compliance)

    def across(
        self, pairs: Sequence[tuple[int, int]], compliance: ArrayLike | None = None, damping: ArrayLike | None = None
    ) -> str:
        """Keep directions of the upper body across directions of the lower one, each by its number in `axes`; returns
        the group's name."""
        (_, *a), (_, *b) = self.nodes
        weights = [[*self.direction(0, i), *self.direction(1, j)] for i, j in pairs]
        return self.constrain("across", "turn", [[*a, *b]] * len(pairs), weights, compliance, damping)

    def along(self) -> None:
        """Keep the lower place on the line through the upper one."""
        for_both = [self.along_row(k) for k in (1, 2)]
        self.constrain("along", "line", [one for (one,), _ in for_both], [[*weights, 0.0] for _, weights in for_both])

    def along_row(self, which: int) -> tuple[list[list[int]], list[Expression | float]]:
        """How far the lower place lies from the upper one along one of `axes`: the stencil, and the weights of its
        points and of its direction."""
        (p, *a), (q, *b) = self.nodes
        places = [*self.upper.coordinates(self.places[0]), *self.lower.coordinates(self.places[1])]
        return [[p, q, *a, *b]], [*places, *self.direction(0, which)]

    def direction(self, side: int, which: int) -> Array:
        """(3,) expressions: one of `axes` along a body's principal axes."""
        return (self.upper, self.lower)[side].directions(expressions(self.axes[side][which]))

    def constrain(
        self,
        kind: str,
        label: str,
        stencil: list[list[int]],
        weights: Sequence[Sequence[Expression | float]],
        compliance: ArrayLike | None = None,
        damping: ArrayLike | None = None,
        viscosity: ArrayLike | None = None,
    ) -> str:
        """Add a group whose parameters (count, n) are expressions; returns its name."""
        group = f"{self.name}_{label}"
        constrain(self.scene, kind, group, stencil, expressions(weights), compliance, damping, viscosity)
        return group

    def name_stiffness(self, group: str, quantity: str, value: float, unit: str, at: str | None = None) -> None:
        """Make a quantity of the stiffness that all constraints of a group have, which was given a compliance; or of
        what they push with where they are strained by the quantity `at`."""
        places = self.scene.places_of_group(group)
        places.group.compliance[:] = 0.0
        self.scene.add_quantity(quantity, value, unit)
        strained = () if at is None else ((at, "identity"),)
        self.scene.add_terms([Term("compliance", places.constraints, 1.0, (*strained, (quantity, "inverse")))])

    def name_damping(self, group: str, quantity: str, value: float, unit: str) -> None:
        """Make a quantity of the damping that all constraints of a group have, which was given one of zero."""
        places = self.scene.places_of_group(group).constraints
        limits = None if value > 0.0 else ZERO_OR_MORE
        self.scene.add_quantity(quantity, value, unit, positive=value > 0.0, limits=limits)
        self.scene.add_terms([Term("damping", places, 1.0, ((quantity, "identity"),))])


def constrain(
    scene: Scene,
    kind: str,
    name: str,
    stencil: list[list[int]],
    parameters: Array,
    compliance: ArrayLike | None = None,
    damping: ArrayLike | None = None,
    viscosity: ArrayLike | None = None,
) -> None:
    """Add a group whose parameters (count, n) are expressions of the scene's quantities."""
    now = numbers(parameters, {name: scene.quantities[name].value for name in names_in(parameters)})
    given = {"compliance": compliance, "damping": damping, "viscosity": viscosity}
    scene.add_constraints(kind, stencil, name=name, rest=now, **given)
    index = scene.places_of_group(name).rest
    scene.add_terms([t for t in terms_of("rest", index, parameters - now) if np.any(t.coefficient)])
