"""What ropes and rods share: a chain of equal links with masses, stretch and drag, given by physical quantities."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import check_count, check_label, finite, is_number, points
from ..arrays.timeseries import linear
from ..arrays.types import Array
from ..errors import SceneError
from ..quantities.quantities import ZERO_OR_MORE, product
from ..scene.scene import Scene

MOST_LINKS = 10**6
"""Of one rope: more is a slip of the pen. A configuration allows fewer, `config.section.MOST_SEGMENTS`."""

TimeConstant = tuple[float, dict[str, str]]
"""A constant and the functions of quantities that it multiplies."""


def resample(polyline: ArrayLike, segments: int) -> Array:
    """(segments + 1, 3) points at equal arc lengths along a polyline (k, 3)."""
    line = points("points", polyline)
    steps = np.linalg.norm(np.diff(line, axis=0), axis=1)
    if len(line) < 2 or steps.sum() <= 0:
        raise SceneError("points", "have no length", line.shape, "give at least two distinct points")
    s = np.concatenate([[0.0], np.cumsum(steps)])
    wanted = np.linspace(0.0, s[-1], segments + 1)
    return linear(s, line, wanted)


def straight_way(
    direction: ArrayLike | None, clamp_start: ArrayLike | None, clamp_end: ArrayLike | None
) -> tuple[str, ArrayLike]:
    """The direction of a straight rope, and the argument that gave it: `direction`, a clamp, or x by default."""
    ways = {"direction": direction, "clamp_start": clamp_start, "clamp_end": clamp_end}
    return next(((field, way) for field, way in ways.items() if way is not None), ("direction", (1.0, 0.0, 0.0)))


def straight_or_given(
    name: str,
    length: float | None,
    segments: int,
    start: ArrayLike,
    way: tuple[str, ArrayLike],
    given: ArrayLike | None,
) -> tuple[Array, float]:
    """(segments + 1, 3) nodes of a rope along a way, see `straight_way`, or through given points, and its length."""
    check_label("name", name)
    check_count(f"{name}.segments", segments, 1, MOST_LINKS)
    if length is not None and not (is_number(length) and length > 0):
        raise SceneError(f"{name}.length", "must be positive", length, "give m")
    if given is not None:
        shape = resample(given, segments)
        line = points("points", given)
        return shape, float(length if length is not None else np.linalg.norm(np.diff(line, axis=0), axis=1).sum())
    if length is None:
        raise SceneError(f"{name}.length", "is missing", None, "give the length in m, or initial points")
    along = unit_vector(f"{name}.{way[0]}", way[1])
    origin = finite(f"{name}.start", start, (3,), SceneError)
    return origin + np.linspace(0.0, length, segments + 1)[:, None] * along, float(length)


def unit_vector(field: str, vector: ArrayLike) -> Array:
    v = finite(field, vector, (3,), SceneError)
    size = np.linalg.norm(v)
    if size == 0:
        raise SceneError(field, "has no length", v.tolist(), "give a direction")
    return v / size


def voronoi_shares(segments: int) -> Array:
    """Voronoi lengths of the nodes over the rope's length."""
    share = np.full(segments + 1, 1.0 / segments)
    share[[0, -1]] /= 2.0
    return share


def add_masses(scene: Scene, name: str, nodes: Array, segments: int) -> None:
    factors = {f"{name}_density": "identity", f"{name}_length": "identity"}
    scene.add_terms(
        [product("mass", n, share, factors) for n, share in zip(nodes, voronoi_shares(segments), strict=True)]
    )


def check_damping(field: str, damping: float | None, needed: str, stiffness: float | None) -> None:
    """Refuse damping of what has no stiffness.

    Args:
        needed: the stiffness in words, such as "a finite EA", whose last word is its argument.

    Raises:
        SceneError: names the argument `field` of the damping.
    """
    if damping is not None and stiffness is None:
        raise SceneError(field, f"needs {needed}", stiffness, f"give {needed.split()[-1]}, or leave it out")


def time_constant(scene: Scene, name: str, kind: str, value: float | None) -> TimeConstant | None:
    """The new quantity `<name>_<kind>_damping`, s, as a time constant; None where it is not given."""
    return None if value is None else (1.0, {scene.add_quantity(f"{name}_{kind}_damping", value, "s"): "identity"})


def time_constants(
    scene: Scene,
    name: str,
    factor: float | None,
    frequency: float | None,
    EA: float | None,
    EI: float | None,
    stretch: float | None,
    bend: float | None,
) -> tuple[TimeConstant | None, TimeConstant | None]:
    """Kelvin-Voigt time constants of stretching and bending, as terms; adds their quantities."""
    if factor is None and frequency is None:
        return time_constant(scene, name, "stretch", stretch), time_constant(scene, name, "bend", bend)
    if factor is None or not is_number(factor) or not factor > 0:
        raise SceneError(f"{name}.loss_factor", "must be positive", factor, "give it together with loss_frequency")
    if frequency is None or not is_number(frequency) or not frequency > 0:
        raise SceneError(
            f"{name}.loss_frequency", "must be positive", frequency, "give the frequency of the motion in Hz"
        )
    if stretch is not None or bend is not None:
        fix = "leave out stretch_damping and bend_damping, or it"
        raise SceneError(f"{name}.loss_factor", "stands beside a time constant", factor, fix)
    if EA is None and EI is None:
        raise SceneError(f"{name}.loss_factor", "needs EA or EI", factor, "give a stiffness, or leave it out")
    eta = scene.add_quantity(f"{name}_loss_factor", factor, "")
    tau = (0.5 / np.pi, {eta: "identity", scene.add_quantity(f"{name}_loss_frequency", frequency, "Hz"): "inverse"})
    return (None if EA is None else tau), (None if EI is None else tau)


def add_links(
    scene: Scene, name: str, nodes: Array, link: float, EA: float | None, damping: TimeConstant | None
) -> None:
    segments = len(nodes) - 1
    group = f"{name}_stretch"
    pairs = np.stack([nodes[:-1], nodes[1:]], axis=1)
    scene.add_constraints(
        "distance",
        pairs,
        name=group,
        rest=link,
        compliance=np.zeros(segments),
        damping=None if damping is None else np.zeros(segments),
    )
    places = scene.places_of_group(group)
    places.group.rest[:] = 0.0
    length = f"{name}_length"
    terms = [product("rest", at, 1.0 / segments, {length: "identity"}) for at in places.rest.ravel()]
    if EA is not None:
        scene.add_quantity(f"{name}_EA", EA, "N")
        terms += [
            product("compliance", at, 1.0 / segments, {length: "identity", f"{name}_EA": "inverse"})
            for at in places.constraints
        ]
    if damping is not None:
        scale, tau = damping
        factors = {**tau, f"{name}_EA": "identity", length: "inverse"}
        terms += [product("damping", at, scale * segments, factors) for at in places.constraints]
    scene.add_terms(terms)


def add_drag(
    scene: Scene, name: str, nodes: Array, segments: int, linear: float | None, quadratic: float | None
) -> None:
    for kind, value, unit in (("linear", linear, "N s/m^2"), ("quadratic", quadratic, "N s^2/m^3")):
        if value is None:
            continue
        if not (is_number(value) and value >= 0):
            raise SceneError(f"{name}_drag_{kind}", "must be zero or more", value, f"give a number in {unit}")
        scene.has_drag = True
        limits = None if value > 0 else ZERO_OR_MORE
        quantity = scene.add_quantity(f"{name}_drag_{kind}", value, unit, positive=value > 0, limits=limits)
        factors = {quantity: "identity", f"{name}_length": "identity"}
        scene.add_terms(
            [
                product(f"drag_{kind}", n, share, factors)
                for n, share in zip(nodes, voronoi_shares(segments), strict=True)
            ]
        )
