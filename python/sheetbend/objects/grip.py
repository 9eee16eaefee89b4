"""Grips: how a rod's end is held and moved."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import check_kind, finite, is_number, numbers
from ..arrays.rigid import rigid_motion
from ..arrays.rotations import rotated, unit_quaternions
from ..arrays.smoothing import smoothed
from ..arrays.types import Array
from ..errors import SceneError
from .hand_eye import HandEye


@dataclass(frozen=True, eq=False)
class Grip:
    """The pose of a gripped end over time: it holds the rod's place, direction and roll.

    Attributes:
        times: (knots,) s; none for a grip that stays.
        position: (knots, 3) m, where the rod enters the grip; (1, 3) for a grip that stays.
        direction: the same shape, unit vectors, the rod's direction of travel there (from its start to its end).
        director: the same shape, unit vectors across direction, the first axis of the material frame.
        frame: the frame of the poses, whose correction moves the grip; None where they are in the recording's frame.
    """

    times: Array
    position: Array
    direction: Array
    director: Array
    frame: HandEye | None = None

    @classmethod
    def fixed(cls, position: ArrayLike, direction: ArrayLike, director: ArrayLike | None = None) -> Grip:
        """A grip that stays: (3,) m, and directions (3,) of any length; any director across by default."""
        x, d = finite("position", position, (3,), SceneError), _units("direction", direction, (1, 3))
        q = any_across(d[0]) if director is None else finite("director", director, (3,), SceneError)
        return cls(np.zeros(0), x[None], d, _across(d, q[None]))

    @classmethod
    def from_poses(
        cls,
        times: ArrayLike,
        positions: ArrayLike,
        quaternions: ArrayLike,
        direction: ArrayLike = (1.0, 0.0, 0.0),
        director: ArrayLike = (0.0, 0.0, 1.0),
        offset: ArrayLike = (0.0, 0.0, 0.0),
        frame: HandEye | None = None,
    ) -> Grip:
        """Recorded poses, roll included.

        Args:
            times: (knots,) s.
            positions: (knots, 3) m.
            quaternions: (knots, 4), (x, y, z, w), from the gripper's own axes to the world's.
            direction: (3,), the rod's direction from start to end, in the gripper's axes.
            director: (3,), the first axis of the rod's frame, in the gripper's axes.
            offset: (3,) m, where the rod enters the grip, in the gripper's axes.
            frame: of the poses, where that is not the recording's: its six quantities then correct the transform.

        Raises:
            SceneError: shapes, NaN, times that do not increase, quaternions of no length, a director along the
                direction.
        """
        t = _knots(times)
        x = finite("positions", positions, (len(t), 3), SceneError)
        q = unit_quaternions("quaternions", quaternions, (len(t), 4))
        d = _units("direction", direction, (3,))
        x = x + rotated(q, finite("offset", offset, (3,), SceneError))
        along, second = rotated(q, d), rotated(q, finite("director", director, (3,), SceneError))
        if frame is not None:
            check_kind("frame", frame, HandEye, "give sb.HandEye(name, position, quaternion)", SceneError)
            x, along, second = frame.points(x), frame.directions(along), frame.directions(second)
        return cls(t, x, along, _across(along, second), frame)

    @classmethod
    def from_markers(
        cls,
        times: ArrayLike,
        first: ArrayLike,
        second: ArrayLike,
        *,
        end: bool = False,
        nominal: ArrayLike | None = None,
        director: ArrayLike | None = None,
    ) -> Grip:
        """Two markers on the gripped piece, in the order in which the rod passes them; roll is not recorded.

        The director is carried by the shortest rotation of a nominal direction onto the recorded one, so that
        material frames agree between recordings that share the nominal direction.

        Args:
            times: (knots,) s.
            first, second: (knots, 3) m.
            end: False, at the rod's start: it becomes free at `second`. True, at its end: it is free up to `first`.
            nominal: (3,) the mean recorded direction by default; give one for recordings that are compared.
            director: (3,) the frame's first axis at the nominal direction; any across it by default.

        Raises:
            SceneError: shapes, NaN, times that do not increase, markers that coincide, a recorded direction opposite to
                the nominal one.
        """
        t = _knots(times)
        a, b = (finite(field, x, (len(t), 3), SceneError) for field, x in (("first", first), ("second", second)))
        along = _units("first, second", b - a, (len(t), 3), "give two markers that never coincide")
        from_ = _units("nominal", along.mean(axis=0) if nominal is None else nominal, (3,))
        q = any_across(from_) if director is None else finite("director", director, (3,), SceneError)
        return cls(t, a if end else b, along, carried(_across(from_, q), from_, along))

    @classmethod
    def from_body(
        cls,
        times: ArrayLike,
        markers: ArrayLike,
        position: ArrayLike,
        direction: ArrayLike,
        director: ArrayLike | None = None,
    ) -> Grip:
        """Three or more markers on the gripped piece or on the hand that holds it, which move as a rigid body.

        Args:
            times: (knots,) s.
            markers: (knots, k, 3) m, not on one line; NaN where a marker was not seen.
            position: (3,) m, where the rope enters the grip at the first knot.
            direction: (3,) the rope's direction of travel there, at the first knot.
            director: (3,) the frame's first axis at the first knot; any across the direction by default.

        Raises:
            SceneError: shapes, times that do not increase, fewer than three markers seen in a frame, markers on a line.
        """
        t = _knots(times)
        x = numbers("markers", markers, SceneError)
        if x.ndim != 3 or len(x) != len(t) or x.shape[1] < 3 or x.shape[2] != 3:
            raise SceneError("markers", "have the wrong shape", x.shape, f"give ({len(t)}, 3 or more, 3) in m")
        turns, centers, _ = rigid_motion(x)
        d = _units("direction", direction, (3,))
        q = any_across(d) if director is None else finite("director", director, (3,), SceneError)
        arm = finite("position", position, (3,), SceneError) - centers[0]
        return cls(t, centers + turns @ arm, turns @ d, turns @ _across(d, q))

    def smoothed(self, width: float) -> Grip:
        """The same grip with its motion smoothed over `width` s (`smoothing.smoothed`); a grip that does not move is
        returned as it is."""
        if not is_number(width):
            raise SceneError("width", "must be a number", width, "give s; 0 leaves the motion as it is")
        if self.stays or width <= 0 or len(self.times) < 2:
            return self
        x, d, q = (smoothed(self.times, v, width)[0] for v in (self.position, self.direction, self.director))
        along = d / np.linalg.norm(d, axis=1, keepdims=True)
        return replace(self, position=x, direction=along, director=_across(along, q))

    @property
    def stays(self) -> bool:
        """Whether the grip does not move."""
        return len(self.times) == 0


def carried(vector: Array, nominal: Array, directions: Array) -> Array:
    """(knots, 3): `vector` (3,) turned by the shortest rotations of the unit vector `nominal` onto unit `directions`.

    Raises:
        SceneError: a direction opposite to the nominal one, to which no rotation is the shortest.
    """
    cosine = directions @ nominal
    if (cosine < -1.0 + 1e-9).any():
        bad = int(np.argmin(cosine))
        fix = "give a nominal direction that the grip stays away from by less than half a turn"
        raise SceneError("nominal", f"is opposite to the grip's direction at knot {bad}", nominal.tolist(), fix)
    both = nominal + directions
    share = (both @ vector) / (1.0 + cosine)
    return np.asarray(vector - share[:, None] * both + 2.0 * (nominal @ vector) * directions)


def any_across(direction: Array) -> Array:
    """A unit vector across a direction, from the coordinate axis that is farthest from it."""
    axis = np.eye(3)[int(np.argmin(np.abs(direction)))]
    return _across(direction / np.linalg.norm(direction), axis)


def _across(along: Array, vector: Array) -> Array:
    """The unit part of vectors (..., 3) across unit vectors `along`."""
    across = vector - np.sum(vector * along, axis=-1, keepdims=True) * along
    size = np.linalg.norm(across, axis=-1, keepdims=True)
    if (size <= 1e-9 * np.linalg.norm(vector, axis=-1, keepdims=True)).any():
        raise SceneError(
            "director", "has no part across the direction", np.ravel(vector)[:3].tolist(), "give a vector across it"
        )
    return np.asarray(across / size)


def _knots(times: ArrayLike) -> Array:
    t = finite("times", times, None, SceneError).ravel()
    if len(t) == 0 or (np.diff(t) <= 0).any():
        raise SceneError("times", "must increase", t[:5].tolist(), "sort the knots and drop repeated ones")
    return t


def _units(
    field: str, vectors: ArrayLike, shape: tuple[int, ...], fix: str = "give a vector that has a length"
) -> Array:
    given = finite(field, vectors, None, SceneError)
    if given.shape not in (shape, shape[-1:]):
        wanted = shape[-1:] if shape[0] == 1 else shape
        raise SceneError(field, "has the wrong shape", given.shape, f"give {wanted}")
    v = np.reshape(given, shape)
    size = np.linalg.norm(v, axis=-1, keepdims=True)
    if (size == 0).any():
        raise SceneError(field, "has no length", v[np.argmin(size)].tolist() if v.ndim > 1 else v.tolist(), fix)
    return np.asarray(v / size)
