"""An end of a rod: free, in a grip, or in a junction with other rods."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..arrays.checks import is_several
from ..arrays.types import Array
from ..errors import SceneError
from ..quantities.quantities import Term
from ..scene.body import BodyPoint
from ..scene.in_frame import drive_in_frame
from ..scene.scene import Scene
from . import body_end
from .body_end import frame_at, hold_direction, hold_place
from .grip import Grip
from .grip_freedom import add_motion, add_shifts, add_tilts, axes_of
from .rod_junction import STUB, Facing, Junction
from .rope_grips import GHOST, placed

SERIES = 9  # powers of the roll in a start's frames: at half a turn they are off by 0.03 rad


class End:
    """What holds one end of a rod, and how far its pose may be off.

    Args:
        name: of the rod.
        label: "start" or "end".
        given: what holds it.
        tilts, shifts, roll: whether the tilts, the shifts and the roll of a grip are added, see `add_rod`.

    Raises:
        SceneError: it is neither a grip nor a junction.
    """

    def __init__(
        self,
        name: str,
        label: str,
        given: Grip | Junction | Facing | BodyPoint | None,
        tilts: bool,
        shifts: bool,
        roll: bool = False,
    ) -> None:
        if given is not None and not isinstance(given, Grip | Junction | Facing | BodyPoint):
            fix = "give sb.Grip.fixed, from_poses or from_markers, a junction, or a point of a body"
            raise SceneError(f"{name}.{label}", "is not a grip", given, fix)
        self.name, self.label, self.side = name, label, -1.0 if label == "start" else 1.0
        self.tilts, self.shifts, self.roll = tilts, shifts, roll
        self.grip = given if isinstance(given, Grip) else None
        self.point = given if isinstance(given, BodyPoint) else None
        self.way = Facing(given) if isinstance(given, Junction) else given if isinstance(given, Facing) else None

    @property
    def held(self) -> bool:
        on_body = self.point is not None and self.point.along is not None
        return self.grip is not None or self.way is not None or on_body

    def shared_node(self, scene: Scene) -> int | None:
        """The junction's particle; None where this is its first rod, or no junction."""
        return None if self.way is None else self.way.junction.node_in(scene, f"{self.name}.{self.label}")

    def place(self, scene: Scene) -> tuple[Array, Array] | None:
        """Place and direction (3,) that a grip or a junction's earlier rods give."""
        if (given := self.grip or self.point) is not None:
            return placed(given)
        node = self.shared_node(scene)
        if self.way is None or node is None:
            return None
        return scene.positions[node], self.way.junction.direction if self.way.direction is None else self.way.direction

    def along(self, link: Array) -> Array | None:
        """The direction (3,) in which a held end goes on: the grip's, the junction's, or that of its link (3,)."""
        if self.grip is not None:
            return np.asarray(self.grip.direction[0])
        if self.point is not None:
            return self.point.at_start()[1]
        if self.way is None:
            return None
        return np.asarray(link / np.linalg.norm(link)) if self.way.direction is None else self.way.direction

    def stub(self, link: float) -> float:
        """How far, m, along the rod the particle lies that holds the direction; negative before the start."""
        return self.side * (body_end.STUB if self.point else STUB if self.way else GHOST) * link

    def director(self, scene: Scene, along: Array | None) -> Array | None:
        """The frame axis (3,) that a grip or a junction's earlier rods give."""
        if self.grip is not None:
            return np.asarray(self.grip.director[0])
        if self.point is not None:
            return None if self.point.along is None else self.point.body.turned(frame_at(self.point)[0])
        if self.way is None or along is None or self.shared_node(scene) is None:
            return None
        return self.way.junction.carried(along)

    def hold(self, scene: Scene, node: int, ghost: int, director: int, normal: int | None, stub: float) -> None:
        """Give the end its pose, or join it to the other rods; the section of its stub stays across that."""
        if self.way is not None:
            self.way.junction.join(scene, f"{self.name}_{self.label}", node, ghost, director, normal, stub > 0)
        if self.point is not None:
            self._on_body(scene, self.point, ghost, director, normal, stub)
        if self.grip is None:
            return
        grip = self.grip
        section = [] if normal is None else [normal]
        if grip.stays:
            scene.pin([node, ghost, director, *section])
        else:
            poses = [grip.position, grip.position + stub * grip.direction, grip.director]
            motion = np.stack(poses + [grip.direction for _ in section], axis=1)
            nodes = [node, ghost, director, *section]
            vectors = [n in scene.directors for n in nodes]
            drive_in_frame(scene, grip.frame, nodes, grip.times, motion, vectors)
        end = f"{self.name}_{self.label}"
        if self.tilts:
            add_tilts(scene, grip, end, ghost, stub, section)
        if self.shifts:
            add_shifts(scene, grip, end, (node, ghost))
        if self.roll:  # cos and sin of it instead of the given director
            quantity = scene.add_quantity(f"{self.name}_roll", 0.0, "rad", positive=False, scale=0.3)
            add_motion(scene, grip, director, grip.director, {quantity: "cos"})
            add_motion(scene, grip, director, axes_of(grip)[1], {quantity: "sin"})
            add_motion(scene, grip, director, -grip.director, {})

    def _on_body(
        self, scene: Scene, point: BodyPoint, ghost: int, director: int, normal: int | None, stub: float
    ) -> None:
        """Let the ghost and the frame ride on a body, as the node does."""
        first, second = frame_at(point)
        label = f"{self.name}_{self.label}"
        hold_place(scene, point, ghost, f"{label}_stub", stub)
        hold_direction(scene, point, director, np.array([second]), f"{label}_roll")
        if normal is not None:
            hold_direction(scene, point, normal, np.array([first, second]), f"{label}_section")

    def hold_node(self, scene: Scene, node: int) -> None:
        """Let the end itself ride on a body, where it is on one."""
        if self.point is not None:
            hold_place(scene, self.point, node, f"{self.name}_{self.label}_on_{self.point.body.name}")


def check_roll(name: str, ends: Sequence[str], held: Sequence[str]) -> None:
    """Raises SceneError where `hold_roll` names something else than an end, or one that a grip, a junction or a body
    holds."""
    if not is_several(ends):
        raise SceneError(f"{name}.hold_roll", "must be a list of ends", ends, 'give ("start",), ("end",) or both')
    for end in ends:
        if not isinstance(end, str) or end not in ("start", "end"):
            raise SceneError(f"{name}.hold_roll", "names no end", end, 'give "start", "end" or both')
        if end in held:
            raise SceneError(f"{name}.hold_roll", "names an end whose roll is held already", end, "leave it out")


def spread_roll(scene: Scene, roll: str, directors: Array, shares: Array) -> None:
    """Turn frames about their edges by shares of a roll, by the series of sine and cosine.

    Without it the first substep would turn them, and the damping of the bent joints would make a kick of that.

    Args:
        directors: (k,) at their places without roll.
        shares: (k,) of the quantity `roll`.
    """
    axes = _turning_axes(scene, directors)
    for power in range(1, SERIES + 1):
        weight = (-1) ** (power // 2) / math.factorial(power) * shares**power
        _turn_start(scene, directors, weight[:, None] * axes[power % 2], _power(roll, power))


def spread_turn(scene: Scene, turn: str, weights: Array, directors: Array, roll: str | None, shares: Array) -> None:
    """Turn frames further by a small angle, to first order, beside their shares of a roll.

    Args:
        turn: quantity.
        weights: (k,) of the angle, rad, in that quantity.
        directors: (k,) at their places without roll.
        roll: quantity; None = there is none.
        shares: (k,) of it.
    """
    axes = _turning_axes(scene, directors)
    for power in range(SERIES + 1 if roll else 1):  # the derivative of the series of `spread_roll`
        weight = (-1) ** ((power + 1) // 2) / math.factorial(power) * shares**power * weights
        factors = ((turn, "identity"), *(_power(roll, power) if roll else ()))
        _turn_start(scene, directors, weight[:, None] * axes[(power + 1) % 2], factors)


def _turning_axes(scene: Scene, directors: Array) -> tuple[Array, Array]:
    """(k, 3) each: the directors, and the axes across them and their edges."""
    edges = np.array([scene.directors[int(d)][:2] for d in directors])
    x = scene.nodes
    along = x[edges[:, 1]] - x[edges[:, 0]]
    return x[directors], np.cross(along / np.linalg.norm(along, axis=1, keepdims=True), x[directors])


def _power(quantity: str, power: int) -> tuple[tuple[str, str], ...]:
    return ((quantity, "identity"),) * (power % 2) + ((quantity, "square"),) * (power // 2)


def _turn_start(scene: Scene, directors: Array, by: Array, factors: tuple[tuple[str, str], ...]) -> None:
    index = (3 * np.asarray(directors)[:, None] + np.arange(3)).ravel()
    scene.add_terms([Term("position", index, by.ravel(), factors)])
