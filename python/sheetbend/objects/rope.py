"""Ropes: chains of particles with axial and bending stiffness, given and fitted by physical parameters that do not
depend on the mesh."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from dataclasses import field as of_field

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import check_positive, some_indices
from ..arrays.types import Array
from ..scene.body import BodyPoint
from ..scene.given import check_scene
from ..scene.scene import Scene
from .chain import (
    add_drag,
    add_links,
    add_masses,
    check_damping,
    straight_or_given,
    straight_way,
    time_constants,
    unit_vector,
)
from .grip import Grip
from .rod_shape import initial_shape
from .rope_grips import checked_ends, placed
from .rope_joints import add_joints, check_modes
from .stiffness_field import StiffnessField


@dataclass(frozen=True)
class Rope:
    """A rope in a scene.

    Attributes:
        name: quantities are called `<name>_...`.
        particles: (n,) their numbers, in order from the start of the rope to its end.
        arc_length: (n,) m, how far each particle is from the start along the rope at rest.
        start_ghost, end_ghost: hidden nodes that give a clamped end its direction, whose numbers index
            `Trajectory.nodes`; None where the end is not clamped.
        field: how EI varies along it; None = it does not.
    """

    name: str
    particles: Array
    arc_length: Array
    start_ghost: int | None = None
    end_ghost: int | None = None
    field: StiffnessField | None = of_field(default=None, kw_only=True)

    @property
    def length(self) -> float:
        """m, at rest."""
        return float(self.arc_length[-1])


def rope(
    length: float | None = None,
    segments: int = 40,
    *,
    density: float,
    EA: float | None = None,
    EI: float | None = None,
    name: str = "rope",
    gravity: ArrayLike = (0.0, 0.0, -9.81),
    pinned: Sequence[int] = (0,),
    **options: object,
) -> Scene:
    """Make a scene with one rope.

    Examples:
        >>> scene = sb.rope(0.6, 20, density=0.05, EI=1e-3, clamp_start=(1, 0, 0))  # clamped, along x
        >>> print(scene.ropes["rope"].particles[-1])  # the number of its free end
        20

    Args:
        length: m.
        segments: number of equal links.
        density: kg/m.
        EA: axial stiffness N; None = inextensible.
        EI: bending stiffness N m^2; None = no bending.
        name: of the rope and of the scene; the prefix of its quantities.
        gravity: (3,) m/s^2.
        pinned: numbers of particles along the rope that stay in place; -1 is the last one.
        options: those of `add_rope`.

    Raises:
        SceneError: wrong or missing values; the message names the field.
    """
    scene = Scene(name, gravity)
    built = add_rope(scene, name, length=length, segments=segments, density=density, EA=EA, EI=EI, **options)  # type: ignore[arg-type]
    if held := some_indices("rope.pinned", pinned, len(built.particles)):
        scene.pin(built.particles[held])
    return scene


def add_rope(
    scene: Scene,
    name: str = "rope",
    *,
    length: float | None = None,
    segments: int = 40,
    density: float,
    EA: float | None = None,
    EI: float | None = None,
    start: ArrayLike = (0.0, 0.0, 0.0),
    direction: ArrayLike | None = None,
    points: ArrayLike | None = None,
    velocity: ArrayLike | None = None,
    stretch_damping: float | None = None,
    bend_damping: float | None = None,
    loss_factor: float | None = None,
    loss_frequency: float | None = None,
    drag_linear: float | None = None,
    drag_quadratic: float | None = None,
    clamp_start: ArrayLike | None = None,
    clamp_end: ArrayLike | None = None,
    clamp_angles: bool = False,
    grip_start: Grip | BodyPoint | None = None,
    grip_end: Grip | BodyPoint | None = None,
    tilts: bool = False,
    shifts: bool = False,
    start_lead: float | None = None,
    end_lead: float | None = None,
    plane: ArrayLike | None = None,
    set_modes: Sequence[int] = (),
    softness_modes: Sequence[int] = (),
) -> Rope:
    """Add a rope of `segments` equal links to a scene.

    Quantities: `<name>_length` m, `<name>_density` kg/m, and where given `_EA` N, `_EI` N m^2, `_stretch_damping` s,
    `_bend_damping` s, `_loss_factor`, `_loss_frequency` Hz, `_drag_linear` N s/m^2, `_drag_quadratic` N s^2/m^3,
    `_start_angle` and `_end_angle` rad, `_set_<k>` 1/m, `_softness_<k>`, `_start_tilt_1`, `_start_tilt_2` and so on
    rad, `_start_shift_1` to `_3` and `_end_shift_1` to `_3` m, `_start_lead` and `_end_lead` m.

    Args:
        length: m; the length of `points` by default.
        density: kg/m; nodes carry it by their Voronoi length.
        EA: axial stiffness N; None = inextensible.
        EI: bending stiffness N m^2; None = no bending.
        start: (3,) m, where a straight initial shape begins; a `grip_end` alone moves it, so that the rope ends there.
        direction: (3,), of a straight initial shape; that of `clamp_start`, or else `clamp_end`, or x by default.
        points: (k, 3) m, an initial shape instead, resampled to equal links. It stays where a fit changes the length:
            rigid links then jump to their length in the first substep. Give `EA` or start at rest (`sb.equilibrium`).
        velocity: (k, 3) m/s at `points`, which are then fitted to the length; at rest by default.
        stretch_damping, bend_damping: Kelvin-Voigt time constants s: the damping moment is EI times the constant times
            the rate of curvature.
        loss_factor: energy lost per radian of vibration over the energy stored, in stretching and bending alike, at
            loss_frequency (Hz); instead of the two time constants: tau = loss_factor / (2 pi loss_frequency). In
            rubbers it varies less with frequency than tau.
        drag_linear, drag_quadratic: air drag per length, N s/m^2 and N s^2/m^3, isotropic.
        clamp_start, clamp_end: (3,), the rope's direction from start to end at a clamped end. The end is pinned, and a
            hidden node half a link away holds the direction.
        grip_start, grip_end: what holds an end and moves it: its place and its direction of travel. A rope has no
            twist: the roll of a grip plays no part. The initial shape is fitted to the length between grips. A point of
            a body (`Body.point`) holds the end there, in its direction `along` if it has one.
        tilts: add two tilts of each grip: small angles by which the rope leaves it askew, about the frame's axes.
        shifts: add the three shifts of each grip: how far beside the given place the rope leaves it, along the frame's
            first and second axis and along the rope.
        start_lead, end_lead: m, the length between a grip and the first marker beside it, where it is not known
            exactly. `_start_lead` and `_end_lead` are that much more rope between them: the grip goes back along the
            rope, and markers keep their places.
        clamp_angles: add `_start_angle` / `_end_angle`, rotations of the clamps about `plane`.
        plane: (3,), unit normal of the plane that the rope stays in; needed by clamp_angles and set_modes.
        set_modes: k of rest-curvature modes cos(k pi s / length) about `plane`; each amplitude starts at zero.
        softness_modes: k of the same modes of the logarithm of the bending compliance over length/EI: a rope that is
            stiffer in places. With 1, 2 and so on, `smooth` of `fit` gives them a prior: "<name>_softness".

    Returns:
        Rope, also kept as `scene.ropes[name]`.

    Raises:
        SceneError: wrong or missing values; the message names the field.
    """
    check_scene(scene)
    way = straight_way(direction, clamp_start, clamp_end)
    shape, length = straight_or_given(name, length, segments, start, way, points)
    grips, clamps, leads = (grip_start, grip_end), (clamp_start, clamp_end), (start_lead, end_lead)
    ends = checked_ends(name, grips, clamps, leads, tilts, shifts)
    speeds = None
    if velocity is not None or any(grips):
        held = [None if grip is None else placed(grip) for grip in grips]
        line = points
        if points is None and grip_start is None:
            line = shape
            if held[1] is not None and clamp_start is None:
                line = shape + (held[1][0] - shape[-1])
            elif held[1] is not None:  # straight from the clamp to the grip
                line, held[0] = None, (shape[0], unit_vector(f"{name}.{way[0]}", way[1]))
        shape, speeds = initial_shape(name, length, segments, line, velocity, held, EA is not None)
    optional = {"EA": EA, "EI": EI, "stretch_damping": stretch_damping, "bend_damping": bend_damping}
    check_positive(name, {"density": density}, optional)
    check_damping(f"{name}.stretch_damping", stretch_damping, "a finite EA", EA)
    check_damping(f"{name}.bend_damping", bend_damping, "EI", EI)
    normal = None if plane is None else unit_vector(f"{name}.plane", plane)
    check_modes(name, EI, normal, set_modes, softness_modes, clamp_angles)

    nodes = scene.add_particles(shape, 0.0, speeds)
    link = length / segments
    scene.add_quantity(f"{name}_length", length, "m")
    scene.add_quantity(f"{name}_density", density, "kg/m")
    taus = time_constants(scene, name, loss_factor, loss_frequency, EA, EI, stretch_damping, bend_damping)
    add_masses(scene, name, nodes, segments)
    add_links(scene, name, nodes, link, EA, taus[0])
    turned_about = normal if clamp_angles else None
    ghosts = [e.hold(scene, int(nodes[k]), link, density, turned_about) for e, k in zip(ends, (0, -1), strict=True)]
    built = Rope(name, nodes, link * np.arange(segments + 1), *ghosts)
    if EI is not None:
        varying = add_joints(scene, built, EI, taus[1], normal, set_modes, softness_modes)
        built = replace(built, field=varying)
    add_drag(scene, name, nodes, segments, drag_linear, drag_quadratic)
    scene.ropes[name] = built
    for e in ends:
        e.loosen(scene, built, taus)
    return built
