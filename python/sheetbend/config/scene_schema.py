"""The scene sections of a configuration: what stands in [scene] and its tables."""

from __future__ import annotations

from typing import Any, Literal, Self

from pydantic import model_validator

from .body_schema import BodySection, JointSection
from .cloth_schema import Cloth, with_fabrics
from .contact_schema import ColliderSection, CollisionsSection, ContactSection, SelfContactSection
from .rope_schema import Rod, Rope
from .section import Finite, Name, Quaternion, Reference, Section, Vector, key
from .solid_schema import SolidSection


class Particles(Section):
    """Single particles. A list: [[scene.particles]]."""

    name: Name = key(..., "what other tables call them: NAME:0, NAME:1, ...")
    positions: list[Vector] = key(..., "initial positions", "m", min_length=1)
    velocity: list[Vector] | None = key(None, "initial velocities; at rest when left out", "m/s")
    mass: Finite | list[Finite] = key(0.0, "one for all or one each; 0 where [[scene.point_mass]] gives it", "kg")
    pinned: bool = key(False, "hold them where they start")
    body: Name | None = key(None, "the [[scene.body]] that they are fixed to where they start")
    drag: Finite | None = key(
        None, "quadratic air drag of each, force over speed squared: <name>_drag", "N s^2/m^2", ge=0
    )


class Pendulum(Section):
    """A point mass on a massless rigid arm, swinging in the x-z plane, `sb.add_pendulum`. A list:
    [[scene.pendulum]]."""

    name: Name = key(
        "pendulum",
        "prefix of its quantities: <name>_length, _mass, _angle, _rate, _hinge_viscosity, "
        "_friction, _slip_angle, _drag",
    )
    length: Finite = key(..., "from pivot to mass", "m", gt=0)
    mass: Finite = key(1.0, "of the point", "kg", gt=0)
    pivot: Vector | Name = key([0.0, 0.0, 0.0], "a fixed point, or the name of the arm whose end carries this one", "m")
    angle: Finite = key(0.0, "initial angle from straight down towards +x", "rad")
    rate: Finite = key(0.0, "initial rate of the angle", "rad/s")
    viscosity: Finite | None = key(None, "of the pivot: torque over rate", "N m s/rad", gt=0)
    friction: Finite | None = key(None, "dry friction of the pivot: <name>_friction, Coulomb's torque", "N m", gt=0)
    slip_angle: Finite = key(1e-3, "how far the pivot gives before it slides; small beside the swing", "rad", gt=0)
    drag: Finite | None = key(None, "quadratic air drag: <name>_drag, torque over rate squared", "N m s^2/rad^2", ge=0)


class Arm(Section):
    """A rigid arm with mass, first moment and inertia, swinging in the x-z plane, `sb.add_arm`. A list:
    [[scene.arm]]."""

    name: Name = key(
        "arm",
        "prefix of its quantities: <name>_mass, _first_moment, _inertia, _length, _angle, _rate, _hinge_viscosity, "
        "_friction, _slip_angle, _drag",
    )
    mass: Finite = key(..., "its mass", "kg", gt=0)
    first_moment: Finite = key(..., "mass times distance from pivot to center of mass", "kg m", gt=0)
    inertia: Finite = key(..., "about the pivot", "kg m^2", gt=0)
    length: Finite = key(..., "from pivot to end, which carries the next arm", "m", gt=0)
    pivot: Vector | Name = key([0.0, 0.0, 0.0], "a fixed point, or the name of the arm whose end carries this one", "m")
    angle: Finite = key(0.0, "initial angle from straight down towards +x", "rad")
    rate: Finite = key(0.0, "initial rate of the angle", "rad/s")
    viscosity: Finite | None = key(
        None, "of the pivot: torque over the rate of the angle between the two arms", "N m s/rad", gt=0
    )
    friction: Finite | None = key(
        None, "dry friction of the pivot between the two arms: <name>_friction, Coulomb's torque", "N m", gt=0
    )
    slip_angle: Finite = key(1e-3, "how far the pivot gives before it slides; small beside the swing", "rad", gt=0)
    drag: Finite | None = key(
        None,
        "quadratic air drag on the arm's end: <name>_drag, torque over the rate squared when its pivot rests",
        "N m s^2/rad^2",
        ge=0,
    )


class Constraints(Section):
    """A group of constraints, `Scene.add_constraints`. A list: [[scene.constraints]]."""

    name: Name | None = key(None, "prefix of its quantities; the kind when left out")
    kind: str = key(..., "distance, bend, planar_bend, hinge or attachment")
    particles: list[list[Reference]] = key(..., "the particles of each constraint", min_length=1)
    compliance: Finite | list[Finite] | None = key(
        None, "0 = rigid; m/N, bends 1/(N m), hinge rad/(N m). One number is the quantity <name>_compliance"
    )
    damping: Finite | list[Finite] | None = key(None, "N s/m, angles N m s. One number is the quantity <name>_damping")
    viscosity: Finite | list[Finite] | None = key(None, "a damper without stiffness, instead of both; <name>_viscosity")
    rest: Finite | list[Finite] | None = key(None, "rest length m (initial when left out), planar rest, or angle rad")
    normal: Vector | None = key(None, "plane normal of planar kinds")


class PointMass(Section):
    """A mass hung on a particle. A list: [[scene.point_mass]]."""

    name: Name = key(..., "its quantity is <name>_mass (kg)")
    particle: Reference = key(..., "where it hangs")
    mass: Finite = key(..., "its mass", "kg", gt=0)


class Force(Section):
    """A force over time on particles, or on a point of a body. A list: [[scene.force]]."""

    name: Name | None = key(None, "adds the quantities <name>_x, <name>_y, <name>_z (N); a plain force when left out")
    particles: list[Reference] = key([], "each of them bears the whole force")
    body: Name | None = key(None, "the [[scene.body]] that it acts on, instead of particles")
    point: Vector = key([0.0, 0.0, 0.0], "where it acts, in the body's frame", "m")
    force: Vector = key(..., "the force", "N")
    times: list[Finite] = key(
        [0.0], "knots in the scene's time (0 = its start); linear between, constant outside", "s", min_length=1
    )
    factors: list[Finite] | None = key(None, "share of the force at each knot; 1 when left out")

    @model_validator(mode="after")
    def _acts_on_something(self) -> Self:
        if bool(self.particles) == (self.body is not None):
            raise ValueError("acts on particles and a body, or on nothing|give particles, or a body and a point of it")
        if self.body is None and "point" in self.model_fields_set:
            raise ValueError("has a point without its body|add body")
        return self


class UnknownForce(Section):
    """A force over time that nobody measured, such as that of a hand or a draft, on particles, along a rope or on a
    point of a body, `sb.add_unknown_force`. A list: [[scene.unknown_force]]. A fit finds it with its interval, of each
    recording of a motion its own, under a prior of zero mean; [smooth.NAME] may give the size and the length of the
    prior."""

    name: Name = key("push", "prefix of its quantities")
    particles: list[Reference] = key([], "each of them bears the whole force")
    rope: Name | None = key(None, "the [[scene.rope]] or [[scene.rod]] along which it is spread evenly, instead")
    body: Name | None = key(None, "the [[scene.body]] that it acts on, instead")
    point: Vector = key([0.0, 0.0, 0.0], "where it acts, in the body's frame", "m")
    scale: Finite = key(..., "an order of magnitude of the force", "N", gt=0)
    spacing: Finite = key(..., "between knots; the force is linear between them", "s", gt=0)
    duration: Finite | None = key(
        None, "from the scene's start to the last knot; to the end of the recording when left out", "s", gt=0
    )

    @model_validator(mode="after")
    def _acts_on_one(self) -> Self:
        if bool(self.particles) + (self.rope is not None) + (self.body is not None) != 1:
            raise ValueError("must act on one of particles, rope and body|give one of them")
        if self.body is None and "point" in self.model_fields_set:
            raise ValueError("has a point without its body|add body")
        return self


class UnknownWind(Section):
    """[scene.unknown_wind]: a wind over time that nobody measured, added to the constant one, `sb.add_unknown_wind`. It
    blows on what the constant one does. A fit finds it like an unknown force."""

    name: Name = key("gust", "prefix of its quantities")
    scale: Finite = key(..., "an order of magnitude of the wind", "m/s", gt=0)
    spacing: Finite = key(..., "between knots; the wind is linear between them", "s", gt=0)
    duration: Finite | None = key(
        None, "from the scene's start to the last knot; to the end of the recording when left out", "s", gt=0
    )


class Tool(Section):
    """A tool whose poses were recorded, such as a robot's hand, `sb.Tool`. A list: [[scene.tool]]. Its poses are in a
    frame of their own; the transform to the recording's frame is corrected by the quantities <name>_x, <name>_y,
    <name>_z (m), <name>_turn_x, <name>_turn_y and <name>_turn_z (rad)."""

    name: Name = key(..., "prefix of its six quantities, and what grips and drives call it")
    file: str | None = key(
        None,
        "poses, a CSV (`time,x,y,z,qx,qy,qz,qw`, or of Motive with rigid bodies) or NPZ (`times`, `positions`, "
        "`quaternions`), relative to the configuration; a recording may have its own, see `tools`",
    )
    body: str | None = key(
        None, "name of the rigid body, where the file is a CSV of Motive; not needed where it has one alone"
    )
    position: Vector = key([0.0, 0.0, 0.0], "origin of the poses' frame in the recording's frame, as calibrated", "m")
    quaternion: Quaternion = key([0.0, 0.0, 0.0, 1.0], "(x, y, z, w), from its axes to the recording's, as calibrated")
    about: Vector = key(
        [0.0, 0.0, 0.0],
        "a point of the recording's frame about which the correction turns. A point near the tool's places separates "
        "shift and turn best",
        "m",
    )
    flex: Finite | None = key(
        None,
        "deflection of the rod that carries the grip per acceleration, 1/(2 pi f)^2 of its lowest frequency f; the "
        "quantity <name>_flex; a stiff rod when left out",
        "s^2",
        ge=0,
    )
    rod: Vector | None = key(None, "direction of that rod in the tool's axes, along which it does not give")
    shift_sd: Finite | None = key(
        None, "how far off the calibration may be, a standard deviation: the three shifts are fitted", "m", gt=0
    )
    turn_sd: Finite | None = key(None, "the same of its turn: the three angles are fitted", "rad", gt=0)


class Drive(Section):
    """Particles that follow markers of the recording, or ride on a tool. A list: [[scene.drive]]."""

    particles: list[Reference] = key(..., "the particles that are moved", min_length=1)
    markers: list[str | int] | None = key(None, "the markers they follow, one each: names or numbers", min_length=1)
    tool: Name | None = key(None, "the [[scene.tool]] that they ride on, instead of markers")
    points: list[Vector] | None = key(
        None, "of a tool: where they sit in its axes, one each; from where they are placed when left out", "m"
    )
    offset: Vector = key([0.0, 0.0, 0.0], "from marker to particle", "m")
    interpolation: Literal["cubic", "linear"] = key("cubic", "of the motion between frames")

    @model_validator(mode="after")
    def _one_mover(self) -> Self:
        if (self.markers is None) == (self.tool is None):
            raise ValueError("must have one of markers and tool|give what moves the particles")
        if self.points is not None and self.tool is None:
            raise ValueError("has points and no tool|give the tool, or the offset from the markers")
        if self.tool is not None and (any(self.offset) or self.interpolation == "linear"):
            raise ValueError("has an offset from markers, or their interpolation, beside a tool|leave it out")
        return self


class Wind(Section):
    """[scene.wind]: the wind around the cloths that have `air_normal` or `air_tangential`, and around what has drag,
    such as a rope with `drag_linear`. A constant one is the quantities wind_x, wind_y and wind_z; a changing one is
    multiplied by wind_strength, and with at most 50 knots it is wind_x_0, wind_y_0, wind_z_0, wind_x_1 and so on."""

    velocity: Vector | list[Vector] = key(..., "one, or one at each of the times", "m/s")
    times: list[Finite] | None = key(
        None,
        "knots of a changing wind in the scene's time (0 = its start); linear between, constant outside",
        "s",
        min_length=1,
    )

    @model_validator(mode="after")
    def _one_each(self) -> Self:
        several = isinstance(self.velocity[0], list)
        if self.times is None and several:
            raise ValueError("has several velocities and no times|give the time of each, or one velocity")
        if self.times is not None and not (several and len(self.velocity) == len(self.times)):
            raise ValueError(f"has not one velocity at each of its {len(self.times)} times|give [[x, y, z], ...]")
        return self


class ExtraQuantity(Section):
    """A further named number, for marker offsets and clock shifts. One table each: [scene.quantities.NAME]."""

    value: Finite = key(0.0, "in its unit")
    unit: str = key("m", "for reports")
    positive: bool = key(False, "whether only positive values make sense (it is then fitted on a log scale)")
    scale: Finite | None = key(None, "a natural size, for what may well be zero: precision is judged against it", gt=0)


class SceneSection(Section):
    """[scene]: the objects and forces, shared by all recordings."""

    gravity: Vector | None = key(None, "the recording's own when left out, else [0, 0, -9.81]", "m/s^2")
    pin: list[Reference] = key([], "particles that are held where they start")
    wind: Wind | None = key(None, "[scene.wind]; still air when left out")
    rope: list[Rope] = key([], "ropes")
    rod: list[Rod] = key([], "rods, which store twist")
    cloth: list[Cloth] = key([], "cloths")
    solid: list[SolidSection] = key([], "solids")
    particles: list[Particles] = key([], "single particles")
    pendulum: list[Pendulum] = key([], "simple pendulums")
    arm: list[Arm] = key([], "rigid arms")
    body: list[BodySection] = key([], "rigid bodies")
    joint: list[JointSection] = key([], "joints between them")
    constraints: list[Constraints] = key([], "constraint groups")
    point_mass: list[PointMass] = key([], "hung masses")
    force: list[Force] = key([], "forces over time")
    unknown_force: list[UnknownForce] = key([], "forces over time that a fit finds")
    unknown_wind: UnknownWind | None = key(None, "[scene.unknown_wind], which a fit finds; none when left out")
    tool: list[Tool] = key([], "tools whose poses were recorded")
    drive: list[Drive] = key([], "motion taken from markers, or from a tool")
    collider: list[ColliderSection] = key([], "shapes that ropes and cloths touch")
    contact: list[ContactSection] = key([], "who may touch them")
    self_contact: SelfContactSection | None = key(None, "[scene.self_contact]; nothing touches itself when left out")
    collisions: CollisionsSection | None = key(
        None, "[scene.collisions]; particles pass through each other when left out"
    )
    quantities: dict[Name, ExtraQuantity] = key({}, "further named numbers")

    @property
    def strands(self) -> list[tuple[str, Rope | Rod]]:
        """Ropes and rods with their paths."""
        ropes = [(f"scene.rope[{i}]", rope) for i, rope in enumerate(self.rope)]
        return [*ropes, *((f"scene.rod[{i}]", rod) for i, rod in enumerate(self.rod))]

    @model_validator(mode="before")
    @classmethod
    def _cuts_have_their_fabric(cls, given: Any) -> Any:
        return given if not isinstance(given, dict) else given | with_fabrics(given)

    @model_validator(mode="after")
    def _colliders_are_corrected_by_nothing(self) -> Self:
        corrected = {tool.name for tool in self.tool if tool.shift_sd is not None or tool.turn_sd is not None}
        for collider in self.collider:
            if collider.tool in corrected:
                fix = "leave these out, and fit the collider's own place, such as"
                raise ValueError(
                    f"has a collider on tool {collider.tool}, whose shift_sd and turn_sd would not move it|"
                    f"{fix} [parameters.{collider.name}_x]"
                )
        return self
