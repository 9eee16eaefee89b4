"""Where a recording's markers sit on a scene."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import prod
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import check_count, check_kind, finite, is_list, is_number, vectors
from ..arrays.types import Array
from ..errors import SceneError
from ..mesh import Places
from ..quantities.expression import Expression, expressions
from ..scene.body import Body
from ..scene.scene import Scene
from .cloth import Cloth
from .rope import Rope
from .solid import Solid, SolidSurface

MOST_MARKERS = 10**6


@dataclass(frozen=True)
class Place:
    """A material point, such as that of a marker: a weighted sum of particles, with or without an offset, or a point of
    a rigid body.

    Attributes:
        particles: up to eight, with an offset up to four; of a rigid body its four nodes.
        weights: of the particles in the point's position.
        tangent: of the particles in the rope's direction t there, which may have any length.
        offset: (3,) m along t, n and t x n, n being `normal` made perpendicular to t; on a body along the axes of its
            frame. None for no offset.
        normal: (3,) of unit length.
        body: the rigid body that the point belongs to, or None.
    """

    particles: tuple[int, ...]
    weights: tuple[float, ...]
    tangent: tuple[float, ...]
    offset: tuple[float, float, float] | None = None
    normal: tuple[float, float, float] = (0.0, 1.0, 0.0)
    body: Body | None = None

    def with_offset(self, offset: ArrayLike, normal: ArrayLike = (0.0, 1.0, 0.0)) -> Place:
        """The same place with an offset of `offset` (3,) m along (tangent, normal, tangent x normal)."""
        off = finite("offset", offset, (3,), SceneError)
        n = finite("normal", normal, (3,), SceneError)
        if not n.any():
            raise SceneError("normal", "has no length", n.tolist(), "give the normal of the plane of motion")
        return replace(self, offset=tuple(off.tolist()), normal=tuple((n / np.linalg.norm(n)).tolist()))

    def core(self, scene: Scene) -> dict[str, Any]:
        """The place for the compiled core: four coordinates or more, padded with zero weights."""
        pad = max(4 - len(self.particles), 0)
        dof = (3 * scene.places_of(self.particles)).tolist()
        return {
            "dof": dof + dof[-1:] * pad,
            "weight": [*self.weights, *[0.0] * pad],
            "tangent": [*self.tangent, *[0.0] * pad][:4],
            "normal": list(self.normal),
            "carries_offset": self.offset is not None,
            "on_axes": self.body is not None,
        }

    def offset_with(self, quantities: Sequence[str | None] = (None, None, None)) -> Array:
        """(3,) expressions of the offset as the core takes it, m: the given one and quantities that are added to it; on
        a body counted along its principal axes from the center of mass."""
        given = self.offset or (0.0, 0.0, 0.0)
        place = expressions([v if q is None else Expression.of(q) + v for v, q in zip(given, quantities, strict=True)])
        return place if self.body is None else self.body.coordinates(place)


def on_particle(particle: int) -> Place:
    """Place a marker on a particle.

    Raises:
        SceneError: not the number of a particle.
    """
    return Place((_number("particle", particle),), (1.0,), (0.0,))


def between(first: int, second: int, fraction: float) -> Place:
    """Place a marker on the line through two particles, `fraction` of the way (beyond them outside 0 to 1).

    Raises:
        SceneError: not the numbers of particles.
    """
    f = float(finite("fraction", fraction, (), SceneError))
    return Place((_number("first", first), _number("second", second)), (1.0 - f, f), (-1.0, 1.0))


def _number(field: str, particle: object) -> int:
    if isinstance(particle, bool) or not isinstance(particle, int | np.integer):
        fix = "give its number, such as rope.particles[-1] for the end of a rope"
        raise SceneError(field, "is not the number of a particle", particle, fix)
    return int(particle)


def on_body(body: Body, points: ArrayLike) -> tuple[Place, ...]:
    """Place markers at points (k, 3) m of a rigid body, in the body's frame."""
    check_kind("body", body, Body, "give what Scene.add_body returns", SceneError)
    x = np.atleast_2d(vectors("points", points))
    nodes = tuple(int(p) for p in body.particles)
    return tuple(Place(nodes, (1.0, 0.0, 0.0, 0.0), (0.0,) * 4, tuple(p), body=body) for p in x.tolist())


def on_rope(rope: Rope, arc_length: float, interpolation: str = "cubic") -> Place:
    """Place a marker on a rope.

    Args:
        rope: as `add_rope` returned it.
        arc_length: m, from the rope's start along the rope at rest.
        interpolation: "cubic" through the four nearest nodes (for ropes that bend smoothly), or "linear".

    Raises:
        SceneError: beyond the ends, or an unknown interpolation.
    """
    _check_rope(rope)
    s, nodes = rope.arc_length, rope.particles
    if not is_number(arc_length) or not -1e-9 * s[-1] <= arc_length <= s[-1] * (1.0 + 1e-9):
        raise SceneError("arc_length", f"lies beyond the rope '{rope.name}'", arc_length, f"use 0 to {s[-1]:g} m")
    if interpolation not in ("cubic", "linear"):
        raise SceneError("interpolation", "is unknown", interpolation, "use 'cubic' or 'linear'")
    width = 4 if interpolation == "cubic" and len(nodes) >= 4 else 2
    link = int(np.clip(np.searchsorted(s, arc_length, side="right") - 1, 0, len(s) - 2))
    first = int(np.clip(link - (width // 2 - 1), 0, len(s) - width))
    knots = s[first : first + width]
    weights, slopes = _lagrange(knots.tolist(), float(arc_length))
    return Place(tuple(int(n) for n in nodes[first : first + width]), tuple(weights), tuple(slopes))


def along_rope(rope: Rope, count: int, interpolation: str = "cubic") -> tuple[Place, ...]:
    """Place markers at equal distances along a rope, the first and the last on its ends.

    Args:
        rope: as `add_rope` returned it.
        count: number of markers.
        interpolation: as of `on_rope`.
    """
    _check_rope(rope)
    check_count("count", count, 1, MOST_MARKERS)
    return tuple(on_rope(rope, s, interpolation) for s in np.linspace(0.0, rope.length, count))


def _check_rope(rope: object) -> None:
    if isinstance(rope, Scene):
        known = " or ".join(f"scene.ropes[{name!r}]" for name in rope.ropes) or "what sb.add_rope returns"
        raise SceneError("rope", "is a scene", rope.name, f"give one rope of it, {known}")
    check_kind("rope", rope, Rope, "give what sb.add_rope or sb.add_rod returns", SceneError)


def on_cloth(cloth: Cloth, points: ArrayLike) -> tuple[Place, ...]:
    """Place markers on a cloth.

    Args:
        cloth: as `add_cloth` returned it.
        points: (k, 2) m, material coordinates along warp and weft.

    Raises:
        MeshError: a point lies outside of the cloth.
    """
    check_kind("cloth", cloth, Cloth, "give what sb.add_cloth returns", SceneError)
    return on_mesh(cloth, cloth.mesh.at(points))


def on_mesh(cloth: Cloth | SolidSurface, places: Places) -> tuple[Place, ...]:
    """Markers at places of a cloth's mesh, such as `cloth.mesh.project` finds for points in space."""
    return tuple(
        Place(tuple(cloth.particles[vertices].tolist()), tuple(weights.tolist()), (0.0, 0.0, 0.0))
        for vertices, weights in zip(places.vertices, places.weights, strict=True)
    )


def on_solid(solid: Solid, points: ArrayLike) -> tuple[Place, ...]:
    """Place markers at points (k, 3) m of a solid's shape at rest, on its surface or inside.

    For points near the surface use `on_mesh(solid.surface, solid.surface.mesh.project(points))`.

    Raises:
        MeshError: a point lies outside of the solid.
    """
    check_kind("solid", solid, Solid, "give what sb.add_solid returns", SceneError)
    places = solid.mesh.at(points)
    found = []
    for vertices, weights in zip(solid.particles[places.vertices].tolist(), places.weights.tolist(), strict=True):
        own = [(p, w) for p, w in zip(vertices, weights, strict=True) if w != 0.0]
        found.append(Place(tuple(p for p, _ in own), tuple(w for _, w in own), (0.0,) * len(own)))
    return tuple(found)


def places_for(
    scene: Scene,
    markers: Mapping[str, Place] | Sequence[Place | None] | None,
    names: Sequence[str],
    positions: np.ndarray | None = None,
) -> tuple[Place | None, ...]:
    """One place per marker of a recording, None for markers that are not compared.

    Args:
        markers: by marker name, in the recording's order, or None: equally spaced along the only rope, or where the
            recording shows the stubs of its clamps behind its particles, as exports of earlier versions do, on these.
        positions: (frames, markers, 3) m, what was recorded.

    Raises:
        SceneError: unknown names, a wrong number, what is no place, particles that do not exist, or no rope (or
            several) to spread markers along.
    """
    if markers is None and positions is not None and _shows_ghosts(scene, positions):
        markers = [on_particle(p) for p in _as_created(scene)]
    places = _places_for(scene, markers, names)
    for name, place in zip(names, places, strict=True):
        if place is not None and not isinstance(place, Place):
            fix = "give sb.on_particle(3) for a particle, a point of a rope, cloth or body, or None"
            raise SceneError("markers", f"has no place for '{name}'", place, fix)
        if place is not None and not all(-scene.hidden_count <= p < scene.particle_count for p in place.particles):
            fix = f"use particles 0 to {scene.particle_count - 1}"
            raise SceneError("markers", f"put '{name}' on particles that do not exist", place.particles, fix)
    return places


def _as_created(scene: Scene) -> list[int]:
    """Particles, then hidden nodes, in the order in which they were added."""
    return [*range(scene.particle_count), *range(-1, -1 - scene.hidden_count, -1)]


def _shows_ghosts(scene: Scene, positions: np.ndarray) -> bool:
    """Whether a recording has as many markers as the scene with one clamped rope has nodes, and that of each ghost
    beside the rope's end that it belongs to: a marker that far along the rope would be a rope's length away."""
    if len(scene.ropes) != 1 or positions.shape[1] != scene.node_count:
        return False
    positions = positions[:, np.argsort(scene.places_of(_as_created(scene)))]
    (rope,) = scene.ropes.values()
    first, last = rope.particles[0], rope.particles[-1]
    ghosts = [(g, end) for g, end in ((rope.start_ghost, first), (rope.end_ghost, last)) if g is not None]
    near = np.diff(rope.arc_length).min() / 2
    away = [np.linalg.norm(positions[:, ghost] - positions[:, end], axis=1) for ghost, end in ghosts]
    return bool(ghosts) and all(np.isfinite(d).any() and np.nanmedian(d) < near for d in away)


def _places_for(
    scene: Scene, markers: Mapping[str, Place] | Sequence[Place | None] | None, names: Sequence[str]
) -> tuple[Place | None, ...]:
    if markers is None:
        if len(scene.ropes) != 1:
            raise SceneError(
                "markers",
                "are not placed, and the scene has not exactly one rope",
                len(scene.ropes),
                "give a place per marker, markers=[sb.on_particle(0), ...], or sb.on_cloth(cloth, points) for a cloth",
            )
        (only,) = scene.ropes.values()
        return along_rope(only, len(names))
    if isinstance(markers, Mapping):
        unknown = [name for name in markers if name not in names]
        if unknown:
            raise SceneError("markers", "are not in the recording", unknown, f"name some of: {', '.join(names)}")
        return tuple(markers.get(name) for name in names)
    if not is_list(markers):
        raise SceneError("markers", "must be places", markers, "give a list of places, or a mapping by name")
    if len(markers) != len(names):
        raise SceneError(
            "markers", "do not match the recording's", len(markers), f"give {len(names)} places, or a mapping by name"
        )
    return tuple(markers)


def _lagrange(knots: list[float], x: float) -> tuple[list[float], list[float]]:
    """Lagrange weights at x and their derivatives."""
    weights, slopes = [], []
    for i in range(len(knots)):
        others = [k for j, k in enumerate(knots) if j != i]
        scale = prod(knots[i] - k for k in others)
        weights.append(prod(x - k for k in others) / scale)
        slopes.append(
            sum(prod(x - k for j, k in enumerate(others) if j != skip) for skip in range(len(others))) / scale
        )
    return weights, slopes
