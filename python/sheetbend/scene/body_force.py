"""Forces on points of rigid bodies: f at the point X is f on the center of mass and X_k f on the k-th axis."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import finite
from ..errors import SceneError
from ..quantities.expression import Expression, expressions
from ..quantities.quantities import Builder
from .body import AXES, BodyPoint
from .forces import Forces, spread_over

MOST_NAMED = 50  # knots of a force that are quantities


def push_body(
    scene: Builder, forces: Forces, point: BodyPoint, given: ArrayLike, times: ArrayLike, name: str | None
) -> None:
    """See `Scene.add_force`.

    Raises:
        SceneError: a body of another scene, shapes, NaN, or more named knots than `MOST_NAMED`.
    """
    if point.body.scene is not scene:
        raise SceneError("add_force.particles", "are on a body of another scene", point.body.name, "use its own scene")
    t = finite("add_force.times", times, None, SceneError).ravel()
    f = spread_over(given, (len(t), 3))
    own = expressions(f)
    if name is not None:
        if len(t) > MOST_NAMED:
            fix = f"give at most {MOST_NAMED} knots, or no name"
            raise SceneError("add_force.name", "names the forces of too many knots", len(t), fix)
        size = float(abs(f).max()) or 1.0
        for knot, axis in np.ndindex(f.shape):
            label = f"{name}_{AXES[axis]}" + (f"_{knot}" if len(t) > 1 else "")
            scene.add_quantity(label, float(f[knot, axis]), "N", positive=False, scale=size)
            own[knot, axis] = Expression.of(label)
    push_point(forces, point, own, t)


def push_point(forces: Forces, point: BodyPoint, given: np.ndarray, times: ArrayLike) -> None:
    """Let expressions (knots, 3) N act on a point."""
    weights = np.array([Expression({(): 1.0}), *point.coordinates], dtype=object)
    forces.push(point.body.particles.tolist(), given[:, None] * weights[None, :, None], times)
