"""Shapes that ropes, cloths and bodies touch: planes, spheres, capsules, cylinders and boxes, at rest or moving."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import check_increasing, check_positive, finite
from ..arrays.rotations import product, quaternion_of, rotation_vectors
from ..arrays.types import Array
from ..errors import SceneError


@dataclass(frozen=True)
class Motion:
    """The poses of a collider's frame at knots.

    Attributes:
        times: (knots,) s.
        positions: (knots, 3) m, of the frame's origin.
        rotations: (knots, 3) rad, vectors along the axis of rotation that are as long as its angle.
        interpolation: "cubic" or "linear".
    """

    times: Array
    positions: Array
    rotations: Array
    interpolation: str = "cubic"


@dataclass(frozen=True, kw_only=True)
class Collider:
    """Base of the shapes.

    Attributes:
        shape: the name of the kind of shape in the core and in configurations.
        name: prefix of its quantities.
        motion: of its frame; None for a shape at rest.
    """

    shape: ClassVar[str]
    name: str = ""
    motion: Motion | None = field(default=None, repr=False)

    def moving(
        self,
        times: ArrayLike,
        displacements: ArrayLike,
        rotations: ArrayLike | None = None,
        interpolation: str = "cubic",
    ) -> Self:
        """The same shape with a motion, given relative to where it is now.

        Args:
            times: (knots,) s, increasing; the shape is at rest before the first and after the last one.
            displacements: (knots, 3) m, of its origin: the point of a plane, the center of any other shape.
            rotations: (knots, 3) rad, about its origin, as vectors along the axis that are as long as the angle;
                none by default. Turns beyond half a turn are followed where neighboring knots are less than that apart.
            interpolation: "cubic" (C1) or "linear" (kicks at every knot).

        Raises:
            SceneError: shapes, NaN, or times that do not increase.
        """
        where = f"{self.name or self.shape}.moving"
        t = finite(f"{where}.times", times, None, SceneError).ravel()
        check_increasing(f"{where}.times", t)
        shape = (len(t), 3)
        moved = finite(f"{where}.displacements", displacements, shape, SceneError)
        turned = np.zeros(shape) if rotations is None else finite(f"{where}.rotations", rotations, shape, SceneError)
        if interpolation not in ("cubic", "linear"):
            raise SceneError(f"{where}.interpolation", "is unknown", interpolation, "use 'cubic' or 'linear'")
        position, rotation = self._placed()
        return replace(self, motion=Motion(t, position + moved, _composed(turned, rotation), interpolation))

    @property
    def poses(self) -> Motion:
        """The motion of its frame; a single knot if it is at rest."""
        if self.motion is not None:
            return self.motion
        position, rotation = self._placed()
        return Motion(np.zeros(1), position[None], rotation[None])

    @property
    def reach(self) -> float:
        """m, the distance from its surface up to which distances are known; contact radii must be smaller."""
        return np.inf

    @property
    def half_thickness(self) -> float:
        """m, the smallest distance from its middle to its surface."""
        raise NotImplementedError

    @property
    def extent(self) -> float:
        """m, the largest distance of its surface from its origin."""
        raise NotImplementedError

    @property
    def specification(self) -> dict[str, Any]:
        """Its kind and its knots for the core; name, lengths and poses are handed over apart."""
        poses = self.poses
        return {"shape": self.shape, "times": poses.times.tolist(), "interpolation": poses.interpolation}

    @property
    def sizes(self) -> Mapping[str, float]:
        """Its lengths by name, m, in the order in which the core takes them."""
        raise NotImplementedError

    def _placed(self) -> tuple[Array, Array]:
        raise NotImplementedError

    def _vector(self, part: str, values: ArrayLike) -> Array:
        return finite(f"{self.name or self.shape}.{part}", values, (3,), SceneError)

    def _positive(self, **lengths: float) -> None:
        check_positive(self.name or self.shape, lengths, {})


@dataclass(frozen=True)
class Plane(Collider):
    """A half space: all below a plane is inside.

    Args:
        point: (3,) m, on the plane.
        normal: (3,) of any length, to the side that is free.
    """

    shape: ClassVar[str] = "plane"
    point: ArrayLike = (0.0, 0.0, 0.0)
    normal: ArrayLike = (0.0, 0.0, 1.0)

    def __post_init__(self) -> None:
        self._placed()

    @property
    def sizes(self) -> Mapping[str, float]:
        return {}

    @property
    def half_thickness(self) -> float:
        return np.inf

    @property
    def extent(self) -> float:
        return np.inf

    def _placed(self) -> tuple[Array, Array]:
        return self._vector("point", self.point), _turn_to(
            f"{self.name or self.shape}.normal", self._vector("normal", self.normal)
        )


@dataclass(frozen=True)
class Sphere(Collider):
    """A ball.

    Args:
        center: (3,) m.
        radius: m, the quantity `<name>_radius`.
    """

    shape: ClassVar[str] = "sphere"
    center: ArrayLike
    radius: float

    def __post_init__(self) -> None:
        self._positive(radius=self.radius)
        self._placed()

    @property
    def sizes(self) -> Mapping[str, float]:
        return {"radius": float(self.radius)}

    @property
    def half_thickness(self) -> float:
        return float(self.radius)

    @property
    def extent(self) -> float:
        return float(self.radius)

    def _placed(self) -> tuple[Array, Array]:
        return self._vector("center", self.center), np.zeros(3)


@dataclass(frozen=True)
class Capsule(Collider):
    """All points within a radius of a segment; a long one serves as a cylinder.

    Args:
        start, end: (3,) m, of the segment.
        radius: m, the quantity `<name>_radius`.
    """

    shape: ClassVar[str] = "capsule"
    start: ArrayLike
    end: ArrayLike
    radius: float

    def __post_init__(self) -> None:
        self._positive(radius=self.radius)
        self._placed()

    @property
    def sizes(self) -> Mapping[str, float]:
        return {"radius": float(self.radius), "half_length": _half_length(self, self.start, self.end)}

    @property
    def half_thickness(self) -> float:
        return float(self.radius)

    @property
    def extent(self) -> float:
        return sum(self.sizes.values())

    def _placed(self) -> tuple[Array, Array]:
        return _between(self, self.start, self.end)


@dataclass(frozen=True)
class Cylinder(Collider):
    """A cylinder with rounded rims; a flat one is a plate. As on a box, its rims meet particles, not the links between
    them.

    Args:
        start, end: (3,) m, the middles of its two flat ends.
        radius: m, the quantity `<name>_radius`.
        edge_radius: m, of its rims; less than the radius and less than half the distance of its ends.
    """

    shape: ClassVar[str] = "rounded_cylinder"
    start: ArrayLike
    end: ArrayLike
    radius: float
    edge_radius: float

    def __post_init__(self) -> None:
        self._placed()
        self._positive(radius=self.radius, edge_radius=self.edge_radius)
        if not self.edge_radius < self.half_thickness:
            problem = "is too large for the cylinder"
            fix = "give less than its radius and less than half the distance of its ends"
            raise SceneError(f"{self.name or self.shape}.edge_radius", problem, self.edge_radius, fix)

    @property
    def sizes(self) -> Mapping[str, float]:
        return {
            "radius": float(self.radius),
            "half_length": _half_length(self, self.start, self.end),
            "edge_radius": float(self.edge_radius),
        }

    @property
    def half_thickness(self) -> float:
        return min(float(self.radius), _half_length(self, self.start, self.end))

    @property
    def extent(self) -> float:
        return float(np.hypot(self.radius, _half_length(self, self.start, self.end)))

    def _placed(self) -> tuple[Array, Array]:
        return _between(self, self.start, self.end)


@dataclass(frozen=True)
class Box(Collider):
    """A box with rounded edges. Its edges meet particles, not the links between them: use a radius that is large
    against the links of what lies on them.

    Args:
        center: (3,) m.
        size: (3,) m, whole edges along the three axes before it is turned.
        edge_radius: m, of its edges and corners; less than half the shortest edge.
        rotation: (3,) rad, a vector along the axis that it is turned about, as long as the angle.
    """

    shape: ClassVar[str] = "rounded_box"
    center: ArrayLike
    size: ArrayLike
    edge_radius: float
    rotation: ArrayLike = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        half = 0.5 * self._vector("size", self.size)
        self._positive(**{f"size[{k}]": float(h) for k, h in enumerate(half)}, edge_radius=self.edge_radius)
        if not self.edge_radius < half.min():
            fix = "give less than half of the shortest edge"
            raise SceneError(
                f"{self.name or self.shape}.edge_radius", "is too large for the box", self.edge_radius, fix
            )
        self._placed()

    @property
    def sizes(self) -> Mapping[str, float]:
        half = 0.5 * self._vector("size", self.size)
        return {
            **{f"half_{axis}": float(h) for axis, h in zip("xyz", half, strict=True)},
            "radius": float(self.edge_radius),
        }

    @property
    def half_thickness(self) -> float:
        return 0.5 * float(self._vector("size", self.size).min())

    @property
    def extent(self) -> float:
        return 0.5 * float(np.linalg.norm(self._vector("size", self.size)))

    def _placed(self) -> tuple[Array, Array]:
        return self._vector("center", self.center), self._vector("rotation", self.rotation)


def _half_length(collider: Collider, start: ArrayLike, end: ArrayLike) -> float:
    """m, of a shape around a segment."""
    return 0.5 * float(np.linalg.norm(collider._vector("end", end) - collider._vector("start", start)))


def _between(collider: Collider, start: ArrayLike, end: ArrayLike) -> tuple[Array, Array]:
    """Origin and rotation of the frame of a shape along a segment: its middle, with the third axis along it."""
    first, last = collider._vector("start", start), collider._vector("end", end)
    return 0.5 * (first + last), _turn_to(f"{collider.name or collider.shape}.end", last - first)


def _turn_to(field_name: str, axis: Array) -> Array:
    """The shortest rotation of the third axis to a direction, (3,) rad."""
    length = float(np.linalg.norm(axis))
    if not length > 0.0:
        raise SceneError(field_name, "has no direction", axis.tolist(), "give a vector that is not zero")
    n = axis / length
    across = np.array([-n[1], n[0], 0.0])  # e3 x n
    sine = float(np.linalg.norm(across))
    angle = float(np.arctan2(sine, n[2]))
    return across * (angle / sine) if sine > 0.0 else np.array([angle, 0.0, 0.0])


def _composed(turns: Array, first: Array) -> Array:
    """Rotation vectors (knots, 3) of `first`, then each of `turns`, continuous from knot to knot."""
    if not first.any():
        return turns
    before = quaternion_of(first)
    return rotation_vectors(np.array([product(quaternion_of(turn), before) for turn in turns]), first)
