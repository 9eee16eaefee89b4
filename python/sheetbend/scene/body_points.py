"""The points of a body that may touch shapes: corners of a box, vertices of a mesh, the middle of a ball."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import product

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import finite
from ..arrays.types import Array
from ..errors import SceneError
from ..mesh.triangle_mesh import TriangleMesh
from .body import Body


def box_corners(sides: ArrayLike, center: ArrayLike = (0.0, 0.0, 0.0)) -> Array:
    """Return the corners (8, 3) m of a box along the axes of a body's frame, for `Scene.add_contact(..., points=...)`.

    Args:
        sides: (3,) m, whole.
        center: (3,) m.

    Raises:
        SceneError: shapes, NaN, or a side that is not positive.
    """
    whole = finite("sides", sides, (3,), SceneError)
    if not (whole > 0).all():
        raise SceneError("sides", "must be positive", whole.tolist(), "give the whole sides of the box in m")
    signs = np.array(list(product((-0.5, 0.5), repeat=3)))
    return np.asarray(finite("center", center, (3,), SceneError) + signs * whole)


@dataclass(frozen=True, eq=False)
class BodyPoints:
    """Points of a body.

    Attributes:
        places: (n, 3) m, in the body's frame.
    """

    body: Body
    places: Array = field(repr=False)

    def weights(self) -> Array:
        """(n, 4) expressions: of the body's nodes in the sum that a point is."""
        return self.body.weights(self.places)


def points_of(what: object, points: ArrayLike | TriangleMesh | None, name: str | None) -> BodyPoints | None:
    """The points of a body that `Scene.add_contact` was given, checked; None of anything else.

    Raises:
        SceneError: points of what is no body, none of a body, shapes, NaN, or two at one place.
    """
    where = f"{name or 'contact'}.points"
    if not isinstance(what, Body):
        if points is not None:
            raise SceneError(where, "are given of what is not a body", type(what).__name__, "leave them out")
        return None
    if points is None:
        fix = "give those that may touch, (n, 3) m in its frame, such as points=sb.box_corners(sides)"
        raise SceneError(where, f"are missing: '{what.name}' is a body", None, fix)
    given = points.vertices if isinstance(points, TriangleMesh) else points
    places = np.atleast_2d(finite(where, given, None, SceneError))
    if places.ndim != 2 or places.shape[1] != 3 or not len(places):
        raise SceneError(where, "have the wrong shape", places.shape, "give (n, 3) m in the body's frame")
    if len(np.unique(places, axis=0)) < len(places):
        raise SceneError(where, "are at one place twice", places.tolist(), "list each point once")
    return BodyPoints(what, places)
