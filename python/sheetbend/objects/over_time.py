"""Forces and winds that nobody measured, as smooth functions of time that a fit finds along with its parameters.

Between knots at equal distances the input is linear. Along each axis it is a sum of smooth modes with one quantity
each: eigenvectors of the Laplace operator over the knots with free ends, so that the first is constant. Under a prior
of zero mean, a size and a length in time they are independent (`shares`), as the modes of a field of stiffness are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import check_label, is_number
from ..arrays.types import Array
from ..errors import SceneError
from ..quantities.expression import Expression
from ..scene.body import BodyPoint
from ..scene.given import check_scene
from ..scene.scene import Scene
from .chain import voronoi_shares
from .rope import Rope
from .stiffness_field import modes_of_laplacian, shares, signed

AXES = "xyz"
MOST_KNOTS = 200  # three numbers for each, and a Jacobian takes a run with tangents for every eight numbers


@dataclass(frozen=True, eq=False)
class OverTime:
    """An unknown input over time.

    Attributes:
        name: of the input; its quantities are `<name>_x_1`, `<name>_y_1`, `<name>_z_1`, `<name>_x_2` and so on.
        kind: what it is.
        unit: of its values.
        scale: an order of magnitude of its values, in this unit.
        times: (knots,) s of the scene.
        modes: names of the quantities, smoothest first.
        eigenvalues: (modes,) 1/s^2, ascending.
        shapes: (3 knots, modes), knot by knot and axis by axis, of mean square 1 over the time.
    """

    name: str
    kind: Literal["force", "wind"]
    unit: str
    scale: float
    times: Array
    modes: tuple[str, ...]
    eigenvalues: Array
    shapes: Array

    @property
    def extent(self) -> float:
        """Of the knots, s."""
        return float(self.times[-1] - self.times[0])

    def deviations(self, size: float, length: float) -> Array:
        """(modes,) standard deviations of the prior of an input with a root mean square `size` along each axis and a
        length of correlation, s."""
        return np.asarray(size * np.repeat(shares(self.eigenvalues[::3], length), 3))

    def left_out(self, size: float, length: float) -> Array:
        """(3 knots,) variance that the prior expects of modes without a quantity: zero, as all have one."""
        return np.zeros(len(self.shapes))


def add_unknown_force(
    scene: Scene,
    particles: ArrayLike | BodyPoint | Rope,
    *,
    scale: float,
    spacing: float,
    duration: float,
    name: str = "push",
) -> OverTime:
    """Let an unknown force over time act on particles, on a point of a body, or along a rope.

    A fit of the scene finds the force along with its parameters, for each recording its own, under a prior of zero mean
    whose size and length in time are given by `smooth` of `fit` or found from the recordings. Until then it is zero.

    Args:
        particles: (k,), each of which bears the whole force; what `Body.point` returns; or a rope or rod, along which
            the force is spread evenly, as that of a draft is.
        scale: N, an order of magnitude of the force; sizes from a thousandth to ten times as much are looked at.
        spacing: s, between knots; the force is linear between them.
        duration: s, from the scene's start to the end of the recording.
        name: quantities are called `<name>_x_1` and so on, N.

    Returns:
        OverTime, also kept as `scene.over_time[name]`.

    Raises:
        SceneError: no such particle, numbers that are not positive, or a spacing that is longer than the motion.
    """
    check_scene(scene)
    found = _over_time(scene, name, "force", "N", scale, spacing, duration)
    if isinstance(particles, BodyPoint):
        if particles.body.scene is not scene:
            raise SceneError(f"{name}.particles", "are on a body of another scene", particles.body.name, "use its own")
        nodes = particles.body.particles.tolist()
        weights = [Expression({(): 1.0}), *particles.coordinates]
    elif isinstance(particles, Rope):
        if not any(rope is particles for rope in scene.ropes.values()):
            raise SceneError(f"{name}.particles", "are a rope of another scene", particles.name, "use its own")
        nodes = particles.particles.tolist()
        weights = [Expression({(): float(share)}) for share in voronoi_shares(len(nodes) - 1)]
    else:
        nodes = scene.node_array(f"{name}.particles", particles).tolist()
        weights = [Expression({(): 1.0}) for _ in nodes]
        if not nodes or len(set(nodes)) < len(nodes):
            raise SceneError(f"{name}.particles", "must be some, each once", nodes, "name the particles it acts on")
    _declare(scene, found)
    scene.forces.vary(nodes, weights, found.times, found.shapes[::3, ::3], _by_axis(found))
    return found


def add_unknown_wind(scene: Scene, *, scale: float, spacing: float, duration: float, name: str = "gust") -> OverTime:
    """Let an unknown wind over time blow on all triangles in air (`Scene.add_air`) and on what has drag, such as a rope
    with `drag_linear`, added to the scene's constant wind (`Scene.set_wind`).

    Args:
        scale: m/s, an order of magnitude of the wind.
        spacing, duration: as of `add_unknown_force`.
        name: quantities are called `<name>_x_1` and so on, m/s.

    Returns:
        OverTime, also kept as `scene.over_time[name]`.

    Raises:
        SceneError: nothing in air and nothing with drag, the wind changes already, numbers that are not positive, or a
            spacing that is longer than the motion.
    """
    check_scene(scene)
    found = _over_time(scene, name, "wind", "m/s", scale, spacing, duration)
    scene.air.vary(scene, found.times)
    _declare(scene, found)
    scene.air.blow_in(scene, found.shapes[::3, ::3], _by_axis(found))
    return found


def _by_axis(found: OverTime) -> Sequence[Sequence[str]]:
    """Names by mode and axis."""
    return [found.modes[k : k + 3] for k in range(0, len(found.modes), 3)]


def _declare(scene: Scene, found: OverTime) -> None:
    for mode in found.modes:
        scene.add_quantity(mode, 0.0, found.unit, positive=False, scale=found.scale)
    scene.over_time[found.name] = found


def _over_time(
    scene: Scene, name: str, kind: Literal["force", "wind"], unit: str, scale: float, spacing: float, duration: float
) -> OverTime:
    scene.add_terms(())  # refuses a frozen scene
    check_label(f"add_unknown_{kind}.name", name)
    if name in scene.over_time:
        raise SceneError(f"{name}.name", "is taken by another one", name, "give each a name of its own")
    fixes = {"scale": f"give an order of magnitude in {unit}", "spacing": "give s", "duration": "give s"}
    for field, value in (("scale", scale), ("spacing", spacing), ("duration", duration)):
        if not (is_number(value) and value > 0):
            raise SceneError(f"{name}.{field}", "must be a positive number", value, fixes[field])
    if spacing > duration:
        fix = f"give at most the {duration:g} s of the motion"
        raise SceneError(f"{name}.spacing", "is longer than the motion", spacing, fix)
    pieces = int(np.ceil(duration / spacing - 1e-9))
    if pieces >= MOST_KNOTS:
        fix = f"give at least {duration / (MOST_KNOTS - 1):.3g} s"
        raise SceneError(f"{name}.spacing", f"makes more than {MOST_KNOTS} knots", spacing, fix)
    values, shapes = modes_of_times(pieces + 1, spacing)
    modes = tuple(f"{name}_{axis}_{k}" for k in range(1, pieces + 2) for axis in AXES)
    times = np.asarray(spacing * np.arange(pieces + 1), dtype=float)
    every = np.asarray(np.kron(shapes, np.eye(3)), dtype=float)
    return OverTime(name, kind, unit, float(scale), times, modes, np.repeat(values, 3), every)


def modes_of_times(knots: int, spacing: float) -> tuple[Array, Array]:
    """Eigenvalues (knots,) 1/s^2 and eigenvectors (knots, knots) of mean square 1 of the Laplace operator over knots
    that are `spacing` s apart, with free ends, in linear finite elements."""
    laplacian, sizes = np.zeros((knots, knots)), np.full(knots, spacing)
    sizes[[0, -1]] *= 0.5
    for k in range(knots - 1):
        laplacian[k : k + 2, k : k + 2] += np.array([[1.0, -1.0], [-1.0, 1.0]]) / spacing
    values, shapes = modes_of_laplacian(laplacian, sizes, float(sizes.sum()))
    return values, signed(shapes)
