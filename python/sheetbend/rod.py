"""Rods: ropes that store twist. Every edge has a material frame, so that bending can differ by direction, a rest shape
turns with the rod, and what a grip rolls the rod feels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from .chain import add_drag, add_links, add_masses, is_number, resample
from .checks import finite
from .errors import SceneError
from .grip import Grip, any_across, carried
from .quantities import product
from .rod_joints import Joints
from .rod_junction import STUB, STUB_MASS, Facing, Junction
from .rope import GHOST, Rope
from .scene import Array, Scene

HOLD = (
    1e-4  # torque per angle that holds a director where it was, over GJ/length: keeps twist well posed, moves nothing
)


@dataclass(frozen=True)
class Rod(Rope):
    """A rope with material frames: `directors` are those of its edges, with the grips' own first and last."""

    directors: Array = field(default_factory=lambda: np.zeros(0, dtype=int))


def rod(
    length: float,
    segments: int = 40,
    *,
    density: float,
    EI: float,
    GJ: float,
    name: str = "rod",
    gravity: ArrayLike = (0.0, 0.0, -9.81),
    **options: object,
) -> Scene:
    """A scene with one rod; see `add_rod` for the options."""
    scene = Scene(name, gravity)
    add_rod(scene, name, length=length, segments=segments, density=density, EI=EI, GJ=GJ, **options)  # type: ignore[arg-type]
    return scene


def add_rod(
    scene: Scene,
    name: str = "rod",
    *,
    length: float,
    segments: int = 40,
    density: float,
    EI: float,
    GJ: float,
    EA: float | None = None,
    EI2: float | None = None,
    points: ArrayLike | None = None,
    velocity: ArrayLike | None = None,
    start: Grip | Junction | Facing | None = None,
    end: Grip | Junction | Facing | None = None,
    director: ArrayLike | None = None,
    turns: int = 0,
    tilts: bool = False,
    roll: bool = False,
    stretch_damping: float | None = None,
    bend_damping: float | None = None,
    twist_damping: float | None = None,
    drag_linear: float | None = None,
    drag_quadratic: float | None = None,
    yield_curvature: float | None = None,
    yield_share: float | None = None,
    curvature_modes: Sequence[int] = (),
    twist_modes: Sequence[int] = (),
    softness_modes: Sequence[int] = (),
) -> Rod:
    """Add a discrete elastic rod of `segments` equal links to a scene (Bergou et al. 2008, 2010).

    Quantities: `<name>_length` m, `<name>_density` kg/m, `_EI` and `_GJ` N m^2, and where given `_EA` N, `_EI2` N m^2,
    `_stretch_damping`, `_bend_damping` and `_twist_damping` s, `_drag_linear` N s/m^2, `_drag_quadratic` N s^2/m^3,
    `_start_tilt_1`, `_start_tilt_2`, `_end_tilt_1`, `_end_tilt_2`, `_roll` rad, `_curvature_1_<k>`,
    `_curvature_2_<k>` and `_twist_<k>` 1/m, `_yield_curvature` 1/m, `_yield_share`, `_softness_<k>`.

    Args:
        length: m, between the grips.
        density: kg/m; nodes carry it by their Voronoi length.
        EI, GJ: bending and torsional stiffness N m^2. For a section with two stiffnesses EI acts on the curvature about
            the frame's second axis, and EI2 about the first.
        EA: axial stiffness N; None = inextensible.
        points: (k, 3) m, the initial shape, resampled to equal links and fitted to the length; straight from the start
            otherwise.
        velocity: (k, 3) m/s at `points`; at rest by default.
        start, end: how the ends are held; None = free. A `Junction` holds the ends of several rods, or both of one, to
            each other.
        director: (3,) the first frame axis at a start without a grip; any by default.
        turns: whole turns by which the end's frame is ahead at the start, beside the part of a turn that grips give.
        tilts: add the four tilts: small angles by which the rod leaves a grip askew, about the frame's axes.
        roll: add the roll of the end grip about the rod: the twist built in when the rod was gripped.
        stretch_damping, bend_damping, twist_damping: Kelvin-Voigt time constants s.
        drag_linear, drag_quadratic: air drag per length, isotropic.
        yield_curvature: 1/m, the elastic curvature beyond which internal friction slides (in the frame's two axes; with
            EI2 the second one counts by sqrt(EI2/EI)); None = elastic. The set starts at zero.
        yield_share: the part of the bending stiffness that slides, between 0 and 1: beyond yield (1 - share) EI is
            left. Small motion shows EI.
        curvature_modes: k of rest-curvature modes cos(k pi s / length), about both frame axes; each starts at zero.
        twist_modes: the same of the rest twist per length.
        softness_modes: the same of the bending compliance, relative to length/EI: a rod that is stiffer in places.

    Returns:
        Rod, also kept as `scene.ropes[name]`.

    Raises:
        SceneError: wrong or missing values; the message names the field.
    """
    required = {"length": length, "density": density, "EI": EI, "GJ": GJ}
    optional = {"EA": EA, "EI2": EI2, "stretch_damping": stretch_damping}
    optional |= {"bend_damping": bend_damping, "twist_damping": twist_damping, "yield_curvature": yield_curvature}
    for given, value in (required | optional).items():
        if not (is_number(value) and value > 0) and not (value is None and given in optional):  # type: ignore[operator]
            fix = "give a positive number" + (", or leave it out" if given in optional else "")
            raise SceneError(f"{name}.{given}", "must be positive", value, fix)
    for label, grip in (("start", start), ("end", end)):
        if grip is not None and not isinstance(grip, Grip | Junction | Facing):
            fix = "give sb.Grip.fixed, from_poses or from_markers, or a junction"
            raise SceneError(f"{name}.{label}", "is no grip", grip, fix)
    if not isinstance(segments, int | np.integer) or segments < 2:
        raise SceneError(f"{name}.segments", "must be a whole number from 2 on", segments, "give at least 2")
    if stretch_damping is not None and EA is None:
        raise SceneError(f"{name}.stretch_damping", "needs a finite EA", EA, "give EA, or leave it out")
    if (yield_curvature is None) != (yield_share is None):
        fix = "give yield_curvature and yield_share, or neither"
        raise SceneError(f"{name}.yield_share", "and yield_curvature belong together", yield_share, fix)
    if yield_share is not None and not 0 < yield_share < 1:
        raise SceneError(f"{name}.yield_share", "must lie between 0 and 1", yield_share, "give a part of EI")
    if not isinstance(turns, int | np.integer):
        raise SceneError(f"{name}.turns", "must be a whole number", turns, "give whole turns; grips give the rest")
    grips = [grip if isinstance(grip, Grip) else None for grip in (start, end)]
    ways = [
        Facing(way) if isinstance(way, Junction) else way if isinstance(way, Facing) else None for way in (start, end)
    ]
    if tilts and grips == [None, None]:
        raise SceneError(f"{name}.tilts", "need a grip", tilts, "give start or end")
    if roll and grips[1] is None:
        raise SceneError(f"{name}.roll", "needs a grip at the end", roll, "give end")

    shared = [
        None if way is None else way.junction.node_in(scene, f"{name}.{label}")
        for label, way in zip(("start", "end"), ways, strict=True)
    ]
    ring = ways[0] is not None and ways[1] is not None and ways[0].junction is ways[1].junction
    if ring and (
        points is None or np.linalg.norm(np.subtract(*np.asarray(points, dtype=float)[[0, -1]])) > 1e-9 * length
    ):
        raise SceneError(f"{name}.points", "do not return to their first place", points, "give the points of a loop")
    shape, speeds = _initial(
        name, length, segments, points, velocity, _places(scene, grips, ways, shared), EA is not None
    )
    own = np.arange(int(shared[0] is not None), segments + int(shared[1] is None and not ring))
    nodes = np.full(segments + 1, -1)
    nodes[own] = scene.add_particles(shape[own], 0.0, None if speeds is None else speeds[own])
    nodes[[0, -1]] = [nodes[k] if node is None else node for k, node in zip((0, -1), shared, strict=True)]
    if ring:
        nodes[-1] = nodes[0]
    arc = length / segments * np.arange(segments + 1)
    scene.add_quantity(f"{name}_length", length, "m")
    scene.add_quantity(f"{name}_density", density, "kg/m")
    add_masses(scene, name, nodes, segments)
    stretch = None
    if stretch_damping is not None:
        stretch = (1.0, {scene.add_quantity(f"{name}_stretch_damping", stretch_damping, "s"): "identity"})
    add_links(scene, name, nodes, length / segments, EA, stretch)
    stubs = [
        side * (GHOST if way is None else STUB) * length / segments for side, way in zip((-1, 1), ways, strict=True)
    ]
    along = [_along(*held) for held in zip(grips, ways, (shape[1] - shape[0], shape[-1] - shape[-2]), strict=True)]
    ghosts = [
        None if way is None else int(scene.add_particles([at + stub * way], STUB_MASS * density * length / segments)[0])
        for way, at, stub in zip(along, (shape[0], shape[-1]), stubs, strict=True)
    ]
    chain = np.array([*(g for g in ghosts[:1] if g is not None), *nodes, *(g for g in ghosts[1:] if g is not None)])
    first, last = (None if grip is None else grip.director[0] for grip in grips)
    if first is None and director is not None:
        first = finite(f"{name}.director", director, (3,), SceneError)
    if ways[0] is not None and shared[0] is not None and along[0] is not None:
        first = ways[0].junction.carried(along[0])
    if ways[1] is not None and shared[1] is not None and along[1] is not None:
        last = ways[1].junction.carried(along[1])
    if ring and last is None and along[0] is not None and along[1] is not None:
        first = any_across(along[0]) if first is None else first
        last = carried(first - (first @ along[0]) * along[0], along[0], along[1][None])[0]
    directors = scene.add_directors(
        np.stack([chain[:-1], chain[1:]], axis=1), _frames(name, scene.positions[chain], first, last, turns)
    )
    scene.add_quantity(f"{name}_GJ", GJ, "N m^2")
    hold = {f"{name}_GJ": "identity", f"{name}_length": "inverse"}
    scene.add_terms([product("mass", d, HOLD, hold) for d in directors])
    for label, grip, way, ghost, node, held, stub in (
        ("start", grips[0], ways[0], ghosts[0], nodes[0], directors[0], stubs[0]),
        ("end", grips[1], ways[1], ghosts[1], nodes[-1], directors[-1], stubs[1]),
    ):
        if way is not None and ghost is not None:
            way.junction.join(scene, f"{name}_{label}", int(node), ghost, int(held), stub > 0)
        if grip is not None and ghost is not None:
            _hold(scene, f"{name}_{label}" if tilts else None, grip, int(node), ghost, int(held), stub)
            if roll and label == "end":
                _roll(scene, f"{name}_roll", grip, int(held))
    at = np.arange(1, len(chain) - 1)
    stencils = np.stack([chain[at - 1], chain[at], chain[at + 1], directors[at - 1], directors[at]], axis=1)
    joints = Joints(scene, name, stencils, at - int(ghosts[0] is not None), segments)
    joints.bend(EI, EI2, bend_damping, yield_curvature, yield_share)
    joints.twist(twist_damping)
    joints.rest(curvature_modes, twist_modes)
    joints.soften(softness_modes)
    add_drag(scene, name, nodes, segments, drag_linear, drag_quadratic)
    built = Rod(name, nodes, arc, ghosts[0], ghosts[1], directors)
    scene.ropes[name] = built
    return built


def fitted_to_length(shape: Array, link: float, held: Sequence[int]) -> Array:
    """The nearest chain (nodes, 3) whose links have the given length, with some nodes held.

    A start that is longer than the rod would be pulled together in its first substep, a kick.

    Raises:
        SceneError: the held nodes are farther apart than the chain reaches, or the shape is straight and too short.
    """
    x = shape.copy()
    free = np.setdiff1d(np.arange(len(x)), held)
    for _ in range(50):
        edges = np.diff(x, axis=0)
        lengths = np.linalg.norm(edges, axis=1)
        if np.abs(lengths - link).max() < 1e-12 * link:
            return x
        J = np.zeros((len(edges), len(x), 3))
        units = edges / lengths[:, None]
        J[np.arange(len(edges)), np.arange(len(edges))] = -units
        J[np.arange(len(edges)), np.arange(1, len(x))] = units
        step = np.linalg.lstsq(J[:, free].reshape(len(edges), -1), link - lengths, rcond=1e-9)[0]
        x[free] += step.reshape(-1, 3)
    reach, apart = link * (len(x) - 1), float(np.linalg.norm(shape[-1] - shape[0]))
    if apart < reach:
        fix = "give points of a bent shape between the held ends"
        raise SceneError("points", "cannot be bent to the length", reach, fix)
    fix = f"give EA or a length above {apart:.9g} m, or check the grips' places"
    raise SceneError("length", "does not reach between the held ends", reach, fix)


def _places(
    scene: Scene, grips: Sequence[Grip | None], ways: Sequence[Facing | None], shared: Sequence[int | None]
) -> list[tuple[Array, Array] | None]:
    """Place and direction (3,) of each end that a grip or a junction's earlier rods hold."""
    found: list[tuple[Array, Array] | None] = []
    for grip, way, node in zip(grips, ways, shared, strict=True):
        if grip is not None:
            found.append((grip.position[0], grip.direction[0]))
        elif way is not None and node is not None:
            along = way.junction.direction if way.direction is None else way.direction
            found.append((scene.positions[node], along))
        else:
            found.append(None)
    return found


def _along(grip: Grip | None, way: Facing | None, link: Array) -> Array | None:
    """The direction (3,) in which a held end goes on: the grip's, the junction's, or that of the end's link (3,)."""
    if grip is not None:
        return np.asarray(grip.direction[0])
    if way is None:
        return None
    return np.asarray(link / np.linalg.norm(link)) if way.direction is None else way.direction


def _initial(
    name: str,
    length: float,
    segments: int,
    points: ArrayLike | None,
    velocity: ArrayLike | None,
    ends: Sequence[tuple[Array, Array] | None],
    stretches: bool,
) -> tuple[Array, Array | None]:
    """Initial places and velocities of the nodes between two ends, whose place and direction is given where they are
    held; what `stretches` may start straight and too long between them."""
    start, end = ends
    held = [*([0] if start is not None else []), *([segments] if end is not None else [])]
    if points is None:
        if velocity is not None:
            raise SceneError(f"{name}.velocity", "needs points", None, "give the points that have these velocities")
        origin, along = (np.zeros(3), np.array([1.0, 0.0, 0.0])) if start is None else start
        line = np.stack([origin, origin + length * along])
        if end is not None:
            line[1] = end[0]
    else:
        line = finite(f"{name}.points", points, None, SceneError)
        if line.ndim != 2 or line.shape[1] != 3:
            raise SceneError(f"{name}.points", "has the wrong shape", line.shape, "give (k, 3) in m")
    shape = resample(line, segments)
    for k, given in ((0, start), (segments, end)):
        if given is not None:
            shape[k] = given[0]
    if stretches and len(held) == 2 and np.linalg.norm(shape[-1] - shape[0]) > length:
        shape = np.linspace(shape[0], shape[-1], segments + 1)
    else:
        shape = fitted_to_length(shape, length / segments, held)
    if velocity is None:
        return shape, None
    v = finite(f"{name}.velocity", velocity, line.shape, SceneError)
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    wanted = np.linspace(0.0, s[-1], segments + 1)
    return shape, np.stack([np.interp(wanted, s, v[:, k]) for k in range(3)], axis=1)


def _frames(name: str, chain: Array, first: ArrayLike | None, last: ArrayLike | None, turns: int) -> Array:
    """Directors of a chain's edges: carried along it from the first, with the twist to the last spread evenly.

    Raises:
        SceneError: a director along its edge, a chain that folds back, or half a turn of twist in a joint.
    """
    edges = np.diff(chain, axis=0)
    tangents = edges / np.linalg.norm(edges, axis=1, keepdims=True)
    folded = (tangents[1:] * tangents[:-1]).sum(axis=1) < -1.0 + 1e-9
    if folded.any():
        where = chain[1 + int(np.argmax(folded))].tolist()
        raise SceneError(f"{name}.points", "fold back on themselves", where, "give a shape without a cusp")
    if first is not None and np.linalg.norm(np.cross(tangents[0], np.asarray(first))) <= 1e-9 * np.linalg.norm(
        np.asarray(first)
    ):
        given = np.asarray(first).tolist()
        raise SceneError(f"{name}.director", "has no part across the rod", given, "give a vector across its start")
    q = [any_across(tangents[0]) if first is None else np.asarray(first, dtype=float)]
    for before, after in pairwise(tangents):
        q.append(carried(q[-1] - (q[-1] @ before) * before, before, after[None])[0])
    frames = np.array([v / np.linalg.norm(v) for v in q])
    across = np.cross(tangents, frames)
    missing = 2.0 * np.pi * turns
    if last is not None:
        missing += float(np.arctan2(np.asarray(last) @ across[-1], np.asarray(last) @ frames[-1]))
    if abs(missing) >= np.pi * (len(edges) - 1):
        most = "a joint holds less than half a turn: give more segments or fewer turns"
        raise SceneError(f"{name}.turns", "are more than the joints hold", turns, most)
    angle = np.linspace(0.0, missing, len(edges))[:, None]
    return np.asarray(np.cos(angle) * frames + np.sin(angle) * across)


def _hold(scene: Scene, tilts: str | None, grip: Grip, node: int, ghost: int, director: int, reach: float) -> None:
    """Give an end its pose; a tilt moves the ghost, by which the direction is held."""
    second = np.cross(grip.direction, grip.director)
    if grip.stays:
        scene.pin([node, ghost, director])
    else:
        motion = np.stack([grip.position, grip.position + reach * grip.direction, grip.director], axis=1)
        scene.drive([node, ghost, director], grip.times, motion)
    if tilts is None:
        return
    for k, axis in ((1, grip.director), (2, second)):
        tilt = scene.add_quantity(f"{tilts}_tilt_{k}", 0.0, "rad", positive=False, scale=0.1)
        _add_motion(scene, grip, ghost, reach * axis, {tilt: "identity"})


def _roll(scene: Scene, name: str, grip: Grip, director: int) -> None:
    """Turn the end's director by a quantity: cos and sin of it instead of the given director."""
    quantity = scene.add_quantity(name, 0.0, "rad", positive=False, scale=0.3)
    for axis, function in ((grip.director, "cos"), (np.cross(grip.direction, grip.director), "sin")):
        _add_motion(scene, grip, director, axis, {quantity: function})
    _add_motion(scene, grip, director, -grip.director, {})


def _add_motion(scene: Scene, grip: Grip, node: int, by: Array, factors: dict[str, str]) -> None:
    if not grip.stays:
        scene.add_motion_term(node, by, factors)
    else:
        scene.add_terms([product("position", 3 * node + k, by[0, k], factors) for k in range(3)])
