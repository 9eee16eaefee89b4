"""How rigid bodies enter a scene: their nodes, and the quantities that these are made of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import check_increasing, finite, is_number
from ..arrays.rotations import matrices_of, rotation_matrix
from ..arrays.types import Array
from ..errors import SceneError
from ..quantities.expression import Expression, by_factors, expressions, numbers, rotation, terms_of, vector
from ..quantities.quantities import ZERO_OR_MORE, Term
from .body import AXES, PLACE, TURN, Body, FrameState
from .held import HeldScene
from .in_frame import HasCorrection, add_motion_in_frame, drive_in_frame
from .inertia import Inertia
from .nodes import SceneNodes
from .scene_data import SceneData

KNOTS = 3  # at least, of poses that drive a body
SPEED, SPIN = 0.1, 1.0  # m/s, rad/s: sizes against which precision is judged


class HasPoses(Protocol):
    """Poses over time, such as a tool's; a `frame` (`HandEye`) among its attributes corrects them."""

    @property
    def times(self) -> Array: ...

    @property
    def positions(self) -> Array: ...

    @property
    def quaternions(self) -> Array: ...


@dataclass(frozen=True)
class Start:
    """The state of a body's frame at the start: place (3,) m, axes (3, 3), velocity (3,) m/s of its origin and angular
    velocity (3,) rad/s."""

    at: Array
    frame: Array
    velocity: Array
    spin: Array


def check_name(scene: SceneData, name: str, pinned: bool, poses: object) -> None:
    """Refuse a body's name that is taken, and one that is both pinned and driven."""
    if not isinstance(name, str) or not name or name in scene.bodies:
        raise SceneError("body.name", "is taken, or no name", name, "give each body a name of its own")
    if pinned and poses is not None:
        raise SceneError(f"{name}.poses", "move a body that is pinned", pinned, "either pin or drive a body")


def checked_inertia(
    name: str, mass: float | None, inertia: ArrayLike | None, center: ArrayLike, of: Inertia | Sequence[Inertia] | None
) -> Inertia:
    """The inertia that `Scene.add_body` was given in one of its ways."""
    if of is not None:
        if mass is not None or inertia is not None:
            fix = "leave out mass and inertia, or `of`"
            raise SceneError(f"{name}.of", "stands beside mass or inertia", (mass, inertia), fix)
        return of if isinstance(of, Inertia) else Inertia.welded(of)
    if mass is None or inertia is None:
        fix = "give mass and inertia, or of=sb.Inertia.box(mass, sides) and the like"
        raise SceneError(f"{name}.inertia", "is missing", (mass, inertia), fix)
    return Inertia(mass, inertia, center)


def nodes_of(inertia: Inertia, start: Start) -> tuple[Array, Array]:
    """Initial positions (4, 3) and velocities (4, 3) of a body's nodes."""
    arms = np.array([start.frame @ inertia.center, *(start.frame @ inertia.principal()[1]).T])
    x, v = arms.copy(), np.cross(start.spin, arms)
    x[0] += start.at
    v[0] += start.velocity
    return x, v


def add_nodes(scene: SceneNodes, x: Array, v: Array) -> Array:
    """The numbers (4,) of a body's nodes, which start at x, v (4, 3): its center, a particle, and three hidden axes."""
    return np.concatenate([scene.add_particles(x[:1], 0.0, v[:1]), scene.add_hidden(x[1:], 0.0, v[1:])])


def make_body(scene: SceneData, name: str, inertia: Inertia, nodes: Array, start: FrameState, role: str) -> Body:
    """A body on nodes (4,) of a scene, and the quantities of its inertia."""
    moments, principal = inertia.principal()
    names = names_of(name)
    _declare(
        scene, names, {"mass": [inertia.mass], "inertia": moments, "center": inertia.center, "axes_turn": np.zeros(3)}
    )
    axes = rotation(names["axes_turn"]) @ expressions(principal)
    body = Body(name, nodes, vector(names["center"]), axes, scene, start, role)
    about = vector(names["inertia"])
    masses = [Expression.of(names["mass"][0]), *(about.sum() * 0.5 - about[k] for k in range(3))]
    scene.add_terms(terms_of("mass", nodes, expressions(masses)))
    scene.bodies[name] = body
    return body


def names_of(name: str) -> dict[str, list[str]]:
    vectors = ("center", "axes_turn", "turn", "velocity", "spin")
    return {
        "mass": [f"{name}_mass"],
        "inertia": [f"{name}_inertia_{k}" for k in (1, 2, 3)],
        "place": [f"{name}_{a}" for a in AXES],
        **{key: [f"{name}_{key}_{a}" for a in AXES] for key in vectors},
    }


UNITS = {
    "mass": ("kg", None),
    "inertia": ("kg m^2", None),
    "center": ("m", PLACE),
    "axes_turn": ("rad", TURN),
    "place": ("m", PLACE),
    "turn": ("rad", TURN),
    "velocity": ("m/s", SPEED),
    "spin": ("rad/s", SPIN),
}


def _declare(scene: SceneData, names: Mapping[str, Sequence[str]], values: Mapping[str, ArrayLike]) -> None:
    for key, numbers_ in values.items():
        unit, scale = UNITS[key]
        for quantity, value in zip(names[key], np.asarray(numbers_, dtype=float), strict=True):
            scene.add_quantity(quantity, float(value), unit, positive=scale is None, scale=scale)


def driven_start(scene: SceneData, start: Start, frame: HasCorrection | None) -> FrameState:
    """The state of a frame at the start, as the frame of its poses corrects it."""
    at, axes, velocity, spin = (expressions(v) for v in (start.at, start.frame, start.velocity, start.spin))
    shown = FrameState(at, axes, velocity, spin)
    return shown if frame is None else frame.corrected_start(scene, shown)


def named_start(scene: SceneData, name: str, start: Start, role: str) -> FrameState:
    """The state of a frame at the start, as quantities of place, attitude and velocity make it."""
    names = names_of(name)
    given = {"place": np.zeros(3), "turn": np.zeros(3)}
    if role == "free":
        given |= {"velocity": start.velocity, "spin": start.spin}
    _declare(scene, names, given)
    return FrameState(
        expressions(start.at) + vector(names["place"]),
        rotation(names["turn"]) @ expressions(start.frame),
        vector(names["velocity"]) if role == "free" else expressions(np.zeros(3)),
        vector(names["spin"]) if role == "free" else expressions(np.zeros(3)),
        tuple(name for key in given for name in names[key]),
    )


@dataclass(frozen=True, eq=False)
class Path:
    """Poses over time in the recording's frame: times (knots,) s, origins (knots, 3) m, axes (knots, 3, 3)."""

    times: Array
    origins: Array
    frames: Array

    @classmethod
    def of(cls, name: str, poses: HasPoses) -> Path:
        """Checked, as a tool's frame places them.

        Raises:
            SceneError: no poses, shapes, NaN, fewer than three, or times that do not increase.
        """
        if not all(hasattr(poses, a) for a in ("times", "positions", "quaternions")):
            fix = "give sb.Tool(times, positions, quaternions)"
            raise SceneError(f"{name}.poses", "are not poses over time", type(poses).__name__, fix)
        t = finite(f"{name}.poses.times", poses.times, None, SceneError).ravel()
        check_increasing(f"{name}.poses.times", t)
        if len(t) < KNOTS:
            raise SceneError(f"{name}.poses.times", "are fewer than three", len(t), "pin a body that does not move")
        x = finite(f"{name}.poses.positions", poses.positions, (len(t), 3), SceneError)
        frames = matrices_of(finite(f"{name}.poses.quaternions", poses.quaternions, (len(t), 4), SceneError))
        frame = getattr(poses, "frame", None)
        if frame is not None:
            x, frames = frame.points(x), np.swapaxes(frame.directions(np.swapaxes(frames, 1, 2)), 1, 2)
        return cls(t, x, frames)

    def start(self) -> Start:
        """The state at 0 s, where the scene starts, or at the nearest knot."""
        (place, velocity), (axes, rates) = self._at_start(self.origins), self._at_start(self.frames)
        left, _, right = np.linalg.svd(axes)
        frame = left @ right  # the nearest rotation: between knots the axes are a little off one
        return Start(place, frame, velocity, 0.5 * np.cross(frame, rates, axis=0).sum(axis=1))

    def _at_start(self, values: Array) -> tuple[Array, Array]:
        """Values (knots, ...) and their rates at 0 s, on the curve that driven nodes follow (core/scene/motion.h)."""
        t = self.times
        k = min(max(int(np.searchsorted(t, 0.0, side="right")) - 1, 0), len(t) - 2)
        width = t[k + 1] - t[k]
        (a, b), (u, v) = values[k : k + 2], width * np.gradient(values, t, axis=0)[k : k + 2]
        s = float(np.clip(-t[k] / width, 0.0, 1.0))
        bend, twist = 3.0 * (b - a) - 2.0 * u - v, u + v - 2.0 * (b - a)
        return a + s * (u + s * (bend + s * twist)), (u + s * (2.0 * bend + 3.0 * s * twist)) / width


def drive_body(scene: HeldScene, body: Body, path: Path, frame: HasCorrection | None) -> None:
    """Let the nodes ride on a path, which a frame may correct."""
    own = np.stack([body.center, *body.axes.T])  # in the body's frame
    known = numbers(own, body.values())
    motion = np.einsum("tab,kb->tka", path.frames, known)
    motion[:, 0] += path.origins
    drive_in_frame(scene, frame, body.particles, path.times, motion, vectors=[False, True, True, True])
    for factors, c in by_factors(own - known).items():
        by = np.einsum("tab,kb->tka", path.frames, c)
        add_motion_in_frame(scene, frame, body.particles, by, dict(factors))


def checked_start(name: str, at: ArrayLike, turned: ArrayLike | None, velocity: ArrayLike, spin: ArrayLike) -> Start:
    """Checked; `turned` is a matrix (3, 3), a quaternion or a rotation vector."""
    return Start(
        finite(f"{name}.at", at, (3,), SceneError),
        rotation_matrix(f"{name}.rotation", turned),
        finite(f"{name}.velocity", velocity, (3,), SceneError),
        finite(f"{name}.spin", spin, (3,), SceneError),
    )


def add_drag(scene: SceneData, body: Body, linear: float | None, rotational: float | None) -> None:
    """Linear drag of the center [N s/m], and drag against turning [N m s], alike about all axes: half of it on each of
    the three axes."""
    for label, value, unit, nodes, share in (
        ("drag", linear, "N s/m", body.particles[:1], 1.0),
        ("turn_drag", rotational, "N m s", body.particles[1:], 0.5),
    ):
        if value is None:
            continue
        if not (is_number(value) and value >= 0):
            raise SceneError(f"{body.name}.{label}", "must not be negative", value, f"give {unit}, or 0")
        limits = None if value > 0 else ZERO_OR_MORE
        quantity = scene.add_quantity(f"{body.name}_{label}", value, unit, positive=value > 0, limits=limits)
        scene.has_drag = True
        scene.add_terms([Term("drag_linear", nodes, share, ((quantity, "identity"),))])
