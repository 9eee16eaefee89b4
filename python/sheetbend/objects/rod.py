"""Rods: ropes that store twist. Every edge has a material frame, so that bending can differ by direction, a rest shape
turns with the rod, and what a grip rolls the rod feels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import check_count, check_label, check_positive
from ..arrays.types import Array
from ..errors import SceneError
from ..quantities.quantities import product
from ..scene.body import BodyPoint
from ..scene.given import check_scene
from ..scene.scene import Scene
from .along_rope import softness_field
from .chain import MOST_LINKS, add_drag, add_links, add_masses, check_damping, time_constant
from .grip import Grip
from .grip_freedom import spread_shift
from .rod_end import End, check_roll, spread_roll
from .rod_frames import Frames, Line, add_frames
from .rod_joints import Joints, shear, weigh
from .rod_junction import STUB_MASS, Facing, Junction
from .rod_shape import initial_shape
from .rope import Rope
from .yielding import check_yield

HOLD = 1e-4
"""Torque per angle that holds a director where it was going, over GJ/length: keeps twist well posed and moves nothing.
That of a section's normal is over EI/length."""


@dataclass(frozen=True)
class Rod(Rope):
    """A rope with material frames, in a scene. Its attributes are those of a `Rope`, and two more.

    Attributes:
        directors: the first axes of the frames of its links, with those of the grips first and last: hidden nodes,
            whose numbers index `Trajectory.nodes`.
        normals: likewise, the normals of its sections; empty where sections do not shear.
    """

    directors: Array = field(default_factory=lambda: np.zeros(0, dtype=int))
    normals: Array = field(default_factory=lambda: np.zeros(0, dtype=int))


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
    """Make a scene with one rod.

    Args:
        length: m, between the grips.
        segments: number of equal links.
        density: kg/m.
        EI, GJ: bending and torsional stiffness N m^2.
        name: of the rod and of the scene; the prefix of its quantities.
        gravity: (3,) m/s^2.
        options: those of `add_rod`.

    Raises:
        SceneError: wrong or missing values; the message names the field.
    """
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
    GA: float | None = None,
    EI2: float | None = None,
    points: ArrayLike | None = None,
    velocity: ArrayLike | None = None,
    start: Grip | Junction | Facing | BodyPoint | None = None,
    end: Grip | Junction | Facing | BodyPoint | None = None,
    director: ArrayLike | None = None,
    hold_roll: Sequence[str] = (),
    turns: int = 0,
    tilts: bool = False,
    shifts: bool = False,
    roll: bool = False,
    stretch_damping: float | None = None,
    bend_damping: float | None = None,
    twist_damping: float | None = None,
    shear_damping: float | None = None,
    drag_linear: float | None = None,
    drag_quadratic: float | None = None,
    yield_curvature: float | None = None,
    yield_share: float | None = None,
    curvature_modes: Sequence[int] = (),
    twist_modes: Sequence[int] = (),
    softness_modes: Sequence[int] = (),
    density_modes: Sequence[int] = (),
    slid_modes: Sequence[int] = (),
) -> Rod:
    """Add a discrete elastic rod of `segments` equal links to a scene (Bergou et al. 2008, 2010).

    Quantities: `<name>_length` m, `<name>_density` kg/m, `_EI` and `_GJ` N m^2, and where given `_EA` and `_GA` N,
    `_EI2` N m^2, `_stretch_damping`, `_bend_damping`, `_twist_damping` and `_shear_damping` s, `_drag_linear` N s/m^2,
    `_drag_quadratic` N s^2/m^3, `_start_tilt_1`, `_start_tilt_2`, `_end_tilt_1`, `_end_tilt_2`, `_roll` rad,
    `_start_shift_1` to `_3` and `_end_shift_1` to `_3` m,
    `_curvature_1_<k>`, `_curvature_2_<k>` and `_twist_<k>` 1/m, `_yield_curvature` 1/m, `_yield_share`,
    `_softness_<k>`, `_density_<k>`, `_slid_1_<k>`, `_slid_2_<k>` 1/m.

    Args:
        length: m, between the grips.
        density: kg/m; nodes carry it by their Voronoi length.
        EI, GJ: bending and torsional stiffness N m^2. For a section with two stiffnesses EI acts on the curvature about
            the frame's second axis, and EI2 about the first.
        EA: axial stiffness N; None = inextensible.
        GA: shear stiffness N, shear coefficient times G times the section's area (5/6 G A for a rectangle: Timoshenko);
            None = sections stay across the rod. A grip holds the section, and the link next to it may lean against it.
        points: (k, 3) m, the initial shape, resampled to equal links and fitted to the length; straight from the start
            otherwise. They stay where a fit changes the length: see `add_rope`.
        velocity: (k, 3) m/s at `points`; at rest by default.
        start, end: how the ends are held; None = free. A point of a body (`Body.point`) holds the end there, as a ball
            joint or, where it has a direction `along` (the rod's direction of travel), firmly. A `Junction` holds the
            ends of several rods, or both of one, to each other.
        director: (3,) the first frame axis at a start without a grip; any by default.
        hold_roll: ends ("start", "end") without a grip at which the rod does not spin about its own axis. It turns
            there in every direction, as on a universal joint: the frame's first axis stays in the plane of the edge and
            of the direction that it has at the start. Elsewhere an end spins freely, and frames have no inertia.
        turns: whole turns by which the end's frame is ahead at the start, beside the part of a turn that grips give.
        tilts: add the four tilts: small angles by which the rod leaves a grip askew, about the frame's axes.
        shifts: add the three shifts of each grip: how far beside the given place the rod leaves it, along the frame's
            first and second axis and along the rod. The initial shape follows, less and less towards the other end.
        roll: add the roll of the end grip about the rod: the twist built in when the rod was gripped.
        stretch_damping, bend_damping, twist_damping, shear_damping: Kelvin-Voigt time constants s.
        drag_linear, drag_quadratic: air drag per length, N s/m^2 and N s^2/m^3, isotropic.
        yield_curvature: 1/m, the elastic curvature beyond which internal friction slides (in the frame's two axes; with
            EI2 the second one counts by sqrt(EI2/EI)); None = elastic. The set starts at zero.
        yield_share: the part of the bending stiffness that slides, between 0 and 1: beyond yield (1 - share) EI is
            left. Small motion shows EI.
        curvature_modes: k of rest-curvature modes cos(k pi s / length), about both frame axes; each starts at zero.
        twist_modes: the same of the rest twist per length.
        softness_modes: the same of the logarithm of the bending compliance over length/EI: a rod that is stiffer in
            places. The compliance is length/EI exp(sum of modes), so it stays positive.
        density_modes: the same of the density, relative to it: a rod that is heavier in places; from k = 1 on they
            leave its weight as it is. Values that make a mass negative are refused.
        slid_modes: k of modes of the curvature by which internal friction has slid before the motion starts, about both
            frame axes; each starts at zero. They need a rod that yields.

    Returns:
        Rod, also kept as `scene.ropes[name]`.

    Raises:
        SceneError: wrong or missing values; the message names the field.
    """
    needed = {"length": length, "density": density, "EI": EI, "GJ": GJ}
    damping = {"stretch_damping": stretch_damping, "bend_damping": bend_damping}
    damping |= {"twist_damping": twist_damping, "shear_damping": shear_damping}
    optional = {"EA": EA, "GA": GA, "EI2": EI2, **damping, "yield_curvature": yield_curvature}
    check_positive(name, needed, optional)
    check_yield(name, yield_curvature, yield_share, "EI")
    check_label("rod.name", name)
    check_scene(scene)
    check_count(f"{name}.segments", segments, 2, MOST_LINKS)
    check_count(f"{name}.turns", turns, -MOST_LINKS, MOST_LINKS)
    check_damping(f"{name}.stretch_damping", stretch_damping, "a finite EA", EA)
    check_damping(f"{name}.shear_damping", shear_damping, "a finite GA", GA)
    ends = End(name, "start", start, tilts, shifts), End(name, "end", end, tilts, shifts, roll)
    _check_grips(name, ends)
    ring = _is_ring(name, ends, points, length)
    check_roll(name, hold_roll, [e.label for e in ends if e.held])

    held = [e.place(scene) for e in ends]
    shape, speeds = initial_shape(name, length, segments, points, velocity, held, EA is not None)
    nodes = _add_nodes(scene, ends, shape, speeds, ring)
    line = Line(name, nodes, shape, length / segments, ring)
    scene.add_quantity(f"{name}_length", length, "m")
    scene.add_quantity(f"{name}_density", density, "kg/m")
    add_masses(scene, name, nodes, segments)
    weigh(scene, name, nodes, segments, density_modes)
    add_links(scene, name, nodes, line.link, EA, time_constant(scene, name, "stretch", stretch_damping))

    frames = add_frames(scene, line, ends, director, turns, GA is not None, STUB_MASS * density * line.link)
    scene.add_quantity(f"{name}_GJ", GJ, "N m^2")
    _hold_axes(scene, name, "GJ", frames.directors)
    _hold_ends(scene, line, ends, frames, hold_roll)

    joints = Joints(scene, name, frames.joints, frames.at - frames.first, segments)
    joints.bend(EI, EI2, bend_damping, yield_curvature, yield_share, softness_modes)
    if frames.normals is not None and GA is not None:
        _hold_axes(scene, name, "EI", frames.normals)
        shear(scene, name, frames.sections(segments), GA, shear_damping)
    joints.twist(twist_damping)
    joints.rest(curvature_modes, twist_modes)
    joints.slid(slid_modes)
    add_drag(scene, name, nodes, segments, drag_linear, drag_quadratic)
    normals = np.zeros(0, dtype=int) if frames.normals is None else frames.normals
    varying = softness_field(name, softness_modes, (frames.at - frames.first) / segments, length)
    arc = line.link * np.arange(segments + 1)
    built = Rod(name, nodes, arc, *frames.ghosts, frames.directors, normals, field=varying)
    scene.ropes[name] = built
    return built


def _add_nodes(scene: Scene, ends: tuple[End, End], shape: Array, speeds: Array | None, ring: bool) -> Array:
    """(segments + 1,) numbers of a rod's particles: new ones, but for those that a junction has already."""
    shared = [e.shared_node(scene) for e in ends]
    nodes = np.full(len(shape), -1)
    own = np.arange(int(shared[0] is not None), len(shape) - 1 + int(shared[1] is None and not ring))
    nodes[own] = scene.add_particles(shape[own], 0.0, None if speeds is None else speeds[own])
    nodes[[0, -1]] = [nodes[k] if node is None else node for k, node in zip((0, -1), shared, strict=True)]
    if ring:
        nodes[-1] = nodes[0]
    return nodes


def _hold_axes(scene: Scene, name: str, stiffness: str, axes: Array) -> None:
    """Hold hidden axes where they were going, see HOLD, by a share of a stiffness of the rod."""
    hold = {f"{name}_{stiffness}": "identity", f"{name}_length": "inverse"}
    scene.add_terms([product("mass", axis, HOLD, hold) for axis in axes])


def _hold_ends(scene: Scene, line: Line, ends: tuple[End, End], frames: Frames, hold_roll: Sequence[str]) -> None:
    """Hold the ends by their grips, junctions and bodies; spread shifts and roll of grips along the initial shape."""
    nodes, normals = line.nodes, frames.normals
    for e, k, ghost, stub in zip(ends, (0, -1), frames.ghosts, frames.stubs, strict=True):
        node, director = int(nodes[k]), int(frames.directors[k])
        e.hold_node(scene, node)
        if ghost is not None:
            normal = None if normals is None else int(normals[k])
            e.hold(scene, node, ghost, director, normal, stub)
        if e.label in hold_roll:
            scene.pin([director])
        if e.shifts and e.grip is not None:
            share = np.linspace(float(k == 0), float(k == -1), len(nodes))
            spread_shift(scene, e.grip, f"{line.name}_{e.label}", nodes[1:-1], share[1:-1])
    if ends[1].roll:
        shares = np.linspace(0.0 if ends[0].held else 1.0, 1.0, len(frames.directors))
        spread_roll(scene, f"{line.name}_roll", frames.directors[:-1], shares[:-1])


def _check_grips(name: str, ends: tuple[End, End]) -> None:
    """Raises SceneError where there is no grip whose pose could be off as is asked for."""
    start, end = ends
    for nuisance, asked in (("tilts", end.tilts), ("shifts", end.shifts)):
        if asked and start.grip is None and end.grip is None:
            raise SceneError(f"{name}.{nuisance}", "need a grip", asked, "give start or end")
    if end.roll and end.grip is None:
        raise SceneError(f"{name}.roll", "needs a grip at the end", end.roll, "give end")


def _is_ring(name: str, ends: tuple[End, End], points: ArrayLike | None, length: float) -> bool:
    """Whether both ends lie in one junction; the shape has to be a loop then."""
    first, last = (e.way for e in ends)
    if first is None or last is None or first.junction is not last.junction:
        return False
    if points is None or np.linalg.norm(np.subtract(*np.asarray(points, dtype=float)[[0, -1]])) > 1e-9 * length:
        raise SceneError(f"{name}.points", "do not return to their first place", points, "give the points of a loop")
    return True
