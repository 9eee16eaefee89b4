"""Rigid arms that swing in the x-z plane, with mass, first moment and inertia exactly right: pendulums and linkages.

An arm is four particles: its pivot, its end and a pair beside the line between them, all in the plane of motion, held
by five rigid distances (two triangles on the side from pivot to end). Five is the full count in a plane: 8 coordinates
less 3 rigid motions. Six distances would need a true tetrahedron, and there is none: when pivot and end lie on the
arm's line, the center of mass of the other two must lie on it too, so the line through those two crosses it and all
four are coplanar. Coplanar points make the sixth distance redundant (rank 5), and the direct solver cannot be rigid
twice. Nothing pushes the arm out of its plane, so that the two triangles never fold.

The masses follow linearly from what motion can show, mass m, first moment S = m a (a: pivot to center of mass) and
inertia J about the pivot,
    pair  Q = (S L - J) / (q L - rho^2),    end  E = (J q - S rho^2) / (L (q L - rho^2)),    pivot  m - Q - E,
with the arm's length L and the pair at q along the arm and +-e across it, rho^2 = q^2 + e^2; q/L and e/L are fixed
when the arm is added.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import check_label, finite, is_number
from ..errors import SceneError
from ..quantities.quantities import Term
from ..scene.given import check_scene
from ..scene.scene import Scene
from .arm_data import Arm
from .pivot import SLIP_ANGLE, add_resistance

Factors = tuple[tuple[str, str], ...]


def add_arm(
    scene: Scene,
    name: str = "arm",
    *,
    mass: float,
    first_moment: float,
    inertia: float,
    length: float,
    pivot: ArrayLike | Arm = (0.0, 0.0, 0.0),
    angle: float = 0.0,
    rate: float = 0.0,
    viscosity: float | None = None,
    friction: float | None = None,
    slip_angle: float = SLIP_ANGLE,
    drag: float | None = None,
) -> Arm:
    """Add a rigid arm.

    Quantities: `<name>_mass` kg, `<name>_first_moment` kg m, `<name>_inertia` kg m^2, `<name>_length` m,
    `<name>_angle` rad, `<name>_rate` rad/s, with viscosity `<name>_hinge_viscosity` N m s/rad, with friction
    `<name>_friction` N m, and with drag `<name>_drag` N m s^2/rad^2. Angle and rate are the initial state.

    Args:
        mass: kg. It plays no part in the motion where the pivot is fixed.
        first_moment: mass times the distance from the pivot to the center of mass, which lies on the line from pivot
            to end, kg m.
        inertia: about the pivot and the plane's normal, kg m^2.
        length: pivot to end, m. It must exceed inertia/first_moment; where the end carries nothing it is free to
            choose beyond that.
        pivot: a fixed point (3,) m, or the arm whose end carries this one.
        angle: from straight down (-z) towards +x, rad; not relative to another arm.
        rate: of the angle, rad/s.
        viscosity: of the pivot, torque = viscosity * rate of the angle between the two arms (or between the arm and
            the ground), N m s/rad.
        friction: dry friction of the pivot, the torque of Coulomb's law, N m: it opposes any motion and holds the joint
            against a smaller torque. It starts unstrained.
        slip_angle: how far the joint gives elastically before it slides, rad.
        drag: of the air, as a torque over the square of the arm's rate when its pivot rests, N m s^2/rad^2; it acts on
            the arm's end against the end's velocity.

    Raises:
        SceneError: values that no body has, or a length that would make a particle's mass negative; the message gives
            the range.
    """
    for field, value in (("mass", mass), ("first_moment", first_moment), ("inertia", inertia), ("length", length)):
        _positive(f"{name}.{field}", value)
    along, across = _pair(name, mass, first_moment / mass, inertia / first_moment, length)
    arm = _hang(scene, name, pivot, length, angle, rate, [(1.0, 0.0), (along, across), (along, -across)])
    for quantity, value, unit in (
        ("mass", mass, "kg"),
        ("first_moment", first_moment, "kg m"),
        ("inertia", inertia, "kg m^2"),
    ):
        scene.add_quantity(f"{name}_{quantity}", value, unit)
    _share_mass(scene, arm, along, along**2 + across**2)
    near, far = math.hypot(along, across), math.hypot(1.0 - along, across)
    end, left, right = arm.particles[-3:]
    pairs = [(arm.pivot, end), (arm.pivot, left), (arm.pivot, right), (end, left), (end, right)]
    _links(scene, name, pairs, [1.0, near, near, far, far], length)
    carrier = pivot if isinstance(pivot, Arm) else None
    add_resistance(scene, arm, carrier, viscosity=viscosity, friction=friction, slip_angle=slip_angle, drag=drag)
    return arm


def add_pendulum(
    scene: Scene,
    name: str = "pendulum",
    *,
    length: float,
    mass: float = 1.0,
    pivot: ArrayLike | Arm = (0.0, 0.0, 0.0),
    angle: float = 0.0,
    rate: float = 0.0,
    viscosity: float | None = None,
    friction: float | None = None,
    slip_angle: float = SLIP_ANGLE,
    drag: float | None = None,
) -> Arm:
    """Add a simple pendulum: a point mass on a massless rigid arm.

    It moves like any rigid body on a fixed pivot whose inertia/first_moment is `length`, at a tenth of the cost of
    `add_arm`. Quantities: `<name>_mass` kg, `<name>_length` m, and `<name>_angle`, `<name>_rate`,
    `<name>_hinge_viscosity`, `<name>_friction`, `<name>_drag`; arguments as there.

    Raises:
        SceneError: values that are not positive or not finite.
    """
    _positive(f"{name}.length", length)
    _positive(f"{name}.mass", mass)
    arm = _hang(scene, name, pivot, length, angle, rate, [(1.0, 0.0)])
    scene.add_quantity(f"{name}_mass", mass, "kg")
    scene.add_terms([Term("mass", arm.end, 1.0, ((f"{name}_mass", "identity"),))])
    _links(scene, name, [(arm.pivot, arm.end)], [1.0], length)
    carrier = pivot if isinstance(pivot, Arm) else None
    add_resistance(scene, arm, carrier, viscosity=viscosity, friction=friction, slip_angle=slip_angle, drag=drag)
    return arm


def _positive(field: str, value: float) -> None:
    if not is_number(value) or not value > 0.0:
        raise SceneError(field, "must be positive", value, "give a positive number")


def _pair(name: str, mass: float, center: float, reduced: float, length: float) -> tuple[float, float]:
    """Places of the pair of masses as shares of the length, in the middle of the range in which all four masses are
    positive.

    With center a = S/m and reduced length r = J/S the end's mass asks for rho^2 < r q and the pivot's for
    rho^2 (L - a) < q (L^2 - a r) - a L (L - r); on the arm's line both leave q between a (L - r)/(L - a) and r.
    """
    if not reduced > center:
        least = mass * center / reduced
        raise SceneError(
            f"{name}.mass",
            "is too small for this first moment and inertia",
            mass,
            f"give more than first_moment^2/inertia = {least:g} kg",
        )
    if not length > reduced:
        raise SceneError(
            f"{name}.length",
            "leaves the pair a negative mass",
            length,
            f"give more than inertia/first_moment = {reduced:g} m",
        )
    q = 0.5 * (center * (length - reduced) / (length - center) + reduced)
    by_pivot = (q * (length**2 - center * reduced) - center * length * (length - reduced)) / (length - center)
    across = math.sqrt(0.5 * (min(reduced * q, by_pivot) - q**2))
    return q / length, across / length


def _hang(
    scene: Scene,
    name: str,
    pivot: ArrayLike | Arm,
    length: float,
    angle: float,
    rate: float,
    points: list[tuple[float, float]],
) -> Arm:
    """Particles at points (along, across) of the arm, in parts of its length, the end first; their initial state by
    angle and rate."""
    check_label("arm.name", name)
    check_scene(scene)
    carrier = pivot if isinstance(pivot, Arm) else None
    root = pivot.root if isinstance(pivot, Arm) else finite(f"{name}.pivot", pivot, (3,), SceneError)
    scene.add_quantity(f"{name}_length", length, "m")
    scene.add_quantity(f"{name}_angle", angle, "rad", positive=False, scale=0.1)
    scene.add_quantity(f"{name}_rate", rate, "rad/s", positive=False, scale=1.0)
    fixed = [] if carrier else scene.add_particles([root], 0.0).tolist()
    scene.pin(fixed) if fixed else None
    own = scene.add_particles(np.tile(root, (len(points), 1)), 0.0).tolist()
    carried = carrier.motion if carrier else ()
    motions = [
        tuple(_for_particle(p, t) for t in carried) + _swing(name, p, *where)
        for p, where in zip(own, points, strict=True)
    ]
    scene.add_terms([t for motion in motions for t in motion])
    return Arm(name, carrier.end if carrier else fixed[0], own[0], (*fixed, *own), root, motions[0])


def _for_particle(particle: int, t: Term) -> Term:
    return replace(t, index=3 * particle + t.index % 3)


def _swing(name: str, particle: int, along: float, across: float) -> tuple[Term, ...]:
    """Position L (along u + across w) and velocity L rate (along w - across u) with u = (sin, 0, -cos) and w =
    du/dangle = (cos, 0, sin)."""
    arm: Factors = ((f"{name}_length", "identity"),)
    turn: Factors = (*arm, (f"{name}_rate", "identity"))
    sin, cos = ((f"{name}_angle", "sin"),), ((f"{name}_angle", "cos"),)
    x, z = 3 * particle, 3 * particle + 2
    parts = [
        ("position", x, along, arm + sin),
        ("position", x, across, arm + cos),
        ("position", z, -along, arm + cos),
        ("position", z, across, arm + sin),
        ("velocity", x, along, turn + cos),
        ("velocity", x, -across, turn + sin),
        ("velocity", z, along, turn + sin),
        ("velocity", z, across, turn + cos),
    ]
    return tuple(Term(*part) for part in parts if part[2] != 0.0)


def _share_mass(scene: Scene, arm: Arm, q: float, rho2: float) -> None:
    """Masses of pair, end and pivot; q and rho2 are parts of the length and of its square."""
    mass, moment, inertia = (
        ((f"{arm.name}_{quantity}", "identity"),) for quantity in ("mass", "first_moment", "inertia")
    )
    per_length: Factors = ((f"{arm.name}_length", "inverse"),)
    end, left, right = arm.particles[-3:]
    share = 1.0 / (q - rho2)
    first, second = moment + per_length, inertia + per_length + per_length
    scene.add_terms(
        [
            Term("mass", p, 0.5 * sign * share, factors)
            for p in (left, right)
            for sign, factors in ((1.0, first), (-1.0, second))
        ]
    )
    scene.add_terms([Term("mass", end, -rho2 * share, first), Term("mass", end, q * share, second)])
    scene.add_terms([Term("mass", arm.pivot, 1.0, mass)])
    scene.add_terms(
        [Term("mass", arm.pivot, -(1.0 - rho2) * share, first), Term("mass", arm.pivot, (1.0 - q) * share, second)]
    )


def _links(scene: Scene, name: str, pairs: list[tuple[int, int]], parts: list[float], length: float) -> None:
    """Rigid distances that are parts of the arm's length."""
    scene.add_constraints("distance", pairs, name=f"{name}_links", rest=np.multiply(parts, length))
    scene.groups[-1].rest[:] = 0.0
    places = scene.places_of_group(f"{name}_links").rest.ravel().tolist()
    by = ((f"{name}_length", "identity"),)
    scene.add_terms([Term("rest", at, part, by) for at, part in zip(places, parts, strict=True)])
