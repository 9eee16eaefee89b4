"""[[scene.body]] and [[scene.joint]]: rigid bodies, and what joins them."""

from __future__ import annotations

from typing import Literal, Self

from pydantic import model_validator

from ..objects.pivot import SLIP_ANGLE
from .section import Finite, Line, Name, Quaternion, Section, Vector, key

GROUND = "ground"
SPRING = ("stiffness", "rest", "viscosity")
TILT = ("tilt_stiffness", "tilt_damping")
DRY = ("friction", "slip_angle")
LIMITS = ("limits", "limit_stiffness", "limit_damping", "limit_depth")
JOINTS: dict[str, tuple[str, ...]] = {
    "ball": ("compliance",),
    "hinge": ("axis", "rate", *SPRING, "servo", "torque", "rotor", *DRY, *LIMITS, *TILT),
    "universal": ("axes",),
    "slider": ("axis", "rate", *SPRING, *LIMITS),
    "cylinder": ("axis", "rate", "turn_rate"),
    "fixed": (),
}
"""The keys that each kind of joint takes beside those that all have."""
NEEDED = ("axis", "axes")


class BodySection(Section):
    """A rigid body, `Scene.add_body`. A list: [[scene.body]]. docs/bodies.md lists its quantities."""

    name: Name = key(..., "prefix of its quantities, and what joints, grips and markers call it")
    mass: Finite = key(..., "its mass", "kg", gt=0)
    inertia: Vector | list[Vector] | None = key(
        None, "about the center of mass, along the frame's axes: three moments, or a matrix", "kg m^2"
    )
    box: Vector | None = key(None, "sides of a homogeneous box, instead of the inertia; `center` is its middle", "m")
    center: Vector = key([0.0, 0.0, 0.0], "the center of mass in the body's frame", "m")
    capsules: list[Line] = key(
        [],
        "capsules with which it touches what [scene.self_contact] names beside it: both ends of the middle line of "
        "each, in its frame",
        "m",
    )
    at: Vector = key([0.0, 0.0, 0.0], "where the origin of its frame starts", "m")
    quaternion: Quaternion = key([0.0, 0.0, 0.0, 1.0], "(x, y, z, w), how its frame starts: from its axes to the world")
    velocity: Vector = key([0.0, 0.0, 0.0], "of the frame's origin at the start", "m/s")
    spin: Vector = key([0.0, 0.0, 0.0], "angular velocity at the start, in the world's axes", "rad/s")
    starts_on: Name | None = key(
        None, "the [[scene.tool]] whose first recorded poses show the start of a free body, instead of these four keys"
    )
    start_poses: int = key(4, "how many poses, over which its spin is about constant", ge=2)
    start_falls: bool = key(False, "gravity bends its path over them, as in free flight")
    pinned: bool = key(False, "hold it where it starts")
    tool: Name | None = key(None, "the [[scene.tool]] that it rides on; its start plays no part then")
    drag: Finite | None = key(None, "of the air, force over speed: <name>_drag", "N s/m", ge=0)
    turn_drag: Finite | None = key(None, "torque over angular velocity: <name>_turn_drag", "N m s", ge=0)

    @model_validator(mode="after")
    def _one_inertia(self) -> Self:
        if (self.inertia is None) == (self.box is None):
            raise ValueError("must have one of inertia and box|give three moments, or the sides of a box")
        if self.pinned and self.tool is not None:
            raise ValueError("is pinned and rides on a tool|leave one of them out")
        given = sorted({"at", "quaternion", "velocity", "spin", "pinned", "tool"} & self.model_fields_set)
        if self.starts_on is not None and given:
            raise ValueError(f"starts on a tool, and has {', '.join(given)}|leave {', '.join(given)} out")
        if self.starts_on is None and {"start_poses", "start_falls"} & self.model_fields_set:
            raise ValueError("has poses of a start and no tool for it|add starts_on")
        return self


class Knots(Section):
    """A number over time: `times` in the scene's time (0 = its start), linear between, constant outside."""

    times: list[Finite] = key(..., "knots, increasing", "s", min_length=1)
    values: list[Finite] = key(..., "one at each", min_length=1)

    @model_validator(mode="after")
    def _one_at_each(self) -> Self:
        if len(self.times) != len(self.values):
            raise ValueError("has times and values of different numbers|give one value at each time")
        return self


class JointSection(Section):
    """A joint between two bodies, `sb.ball`, `sb.hinge` and the like. A list: [[scene.joint]]. Its quantities begin
    with its name: docs/bodies.md lists them."""

    kind: Literal["ball", "hinge", "universal", "slider", "cylinder", "fixed"] = key(..., "what it leaves free")
    name: Name = key(..., "prefix of its quantities")
    upper: Name = key(GROUND, 'the body that carries the other one; "ground" is the world')
    lower: Name = key(..., "the body that hangs on it")
    at: Vector = key(..., "a point of the joint in the world, as the bodies start", "m")
    axis: Vector | None = key(None, "of a hinge, slider or cylinder: its direction in the world")
    axes: list[Vector] | None = key(None, "of a universal joint: the two bodies' axes", min_length=2, max_length=2)
    rate: Finite = key(0.0, "at the start: of a hinge's angle, rad/s; of a slider or cylinder along the axis, m/s")
    turn_rate: Finite = key(0.0, "of a cylinder's angle at the start", "rad/s")
    stiffness: Finite | None = key(None, "of the spring of a hinge or slider: <name>_stiffness", "N m/rad or N/m", gt=0)
    rest: Finite = key(
        0.0, "the angle or shift at which that spring rests, counted from the start: <name>_rest", "rad or m"
    )
    viscosity: Finite | None = key(
        None, "of a hinge or slider, torque or force over rate: <name>_viscosity", "N m s/rad or N s/m", gt=0
    )
    friction: Finite | None = key(None, "of a hinge, dry: <name>_friction, Coulomb's torque", "N m", gt=0)
    slip_angle: Finite = key(SLIP_ANGLE, "how far a hinge with dry friction gives before it slides", "rad", gt=0)
    servo: Knots | None = key(
        None, "the angles that a hinge has, or its spring rests at: { times = [...], values = [...] }", "s, rad"
    )
    torque: Knots | None = key(
        None, "of a motor on a hinge, linear between the times; up to 50 are <name>_torque_0, ...", "s, N m"
    )
    rotor: Finite | None = key(None, "inertia of that motor, as the hinge feels it: <name>_rotor", "kg m^2", gt=0)
    limits: list[Finite] | None = key(
        None,
        "of a hinge or slider: [low, high], counted from the start: <name>_limit_low, <name>_limit_high",
        "rad or m",
        min_length=2,
        max_length=2,
    )
    limit_stiffness: Finite | None = key(
        None,
        "of the stops at these limits: <name>_limit_stiffness; left out, it turns the lower body back in 20 ms",
        "N m/rad or N/m",
        gt=0,
    )
    limit_damping: Finite | None = key(
        None, "of the stops, torque or force over rate: <name>_limit_damping", "N m s/rad or N s/m", ge=0
    )
    limit_depth: Finite | None = key(
        None, "beyond a limit, over which stiffness and damping grow from zero; 0.02 rad or 0.005 m", "rad or m", gt=0
    )
    tilt_stiffness: Finite | None = key(
        None,
        "of a hinge whose axis gives way, torque over the angle that it leans: <name>_tilt_stiffness",
        "N m/rad",
        gt=0,
    )
    tilt_damping: Finite | None = key(
        None, "of such a hinge, torque over the rate of that angle: <name>_tilt_damping", "N m s/rad", ge=0
    )
    compliance: Finite | None = key(None, "of a ball joint that gives way: <name>_compliance", "m/N", gt=0)

    @model_validator(mode="after")
    def _of_its_kind(self) -> Self:
        own, every = JOINTS[self.kind], {name for names in JOINTS.values() for name in names}
        missing = [name for name in NEEDED if name in own and getattr(self, name) is None]
        if missing:
            raise ValueError(f"is a {self.kind} without {missing[0]}|add {missing[0]}")
        alien = sorted((every - set(own)) & self.model_fields_set)
        if alien:
            raise ValueError(f"is a {self.kind} with {' and '.join(alien)}|leave {', '.join(alien)} out")
        return self
