"""Ropes and rods of a configuration, and what holds their ends."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import AfterValidator, model_validator

from .section import MOST_SEGMENTS, Finite, Name, Section, Vector, key


class RopeGrip(Section):
    """What holds an end of a rope or rod and moves it. A list: [[scene.rope.grip]], [[scene.rod.grip]].

    One marker gives the place alone: the end is pinned to it and turns freely. Two markers, in the order in which the
    rope passes them, also give the direction, but no roll about it. Three or more markers on a rigid piece, and a tool,
    give the whole pose. On a rigid body the end turns freely, unless it has a direction."""

    at: Literal["start", "end"] = key(..., "which end")
    markers: list[str | int] | None = key(
        None,
        "markers on the hand, gripper or gripped piece: one; two in the order in which the rope passes them, which is "
        "free beyond the inner one; or three and more of a rigid piece, not on one line",
        min_length=1,
    )
    tool: Name | None = key(
        None, "the [[scene.tool]] that holds it, instead of markers: poses of a robot or rigid body"
    )
    body: Name | None = key(None, "the [[scene.body]] that it is fixed to, instead of markers")
    position: Vector | None = key(
        None,
        "where the rope enters the grip: of a tool or body in its axes, of three or more markers in the recording's "
        "axes at the scene's start; where the end is placed when left out",
        "m",
    )
    direction: Vector | None = key(
        None,
        "the rope's direction of travel there, in the same axes; that of its first or last link as placed when left "
        "out. With one marker: the direction that the end keeps, as in a clamp that moves without turning",
    )
    lead: Finite | None = key(
        None,
        "length between the grip and the first marker beside it, where it is not known exactly: adds "
        "<name>_start_lead or <name>_end_lead (m), that much more rope between them. For ropes, not for rods, and for "
        "grips that give a direction",
        "m",
        gt=0,
    )
    offset: Vector = key([0.0, 0.0, 0.0], "from one marker to the end, in the recording's axes", "m")
    smoothing: Finite = key(
        0.0,
        "over which the recorded motion is smoothed. 0 takes it as recorded; one marker then goes with `driven_sigma`",
        "s",
        ge=0,
    )

    @model_validator(mode="after")
    def _one_mover(self) -> Self:
        if sum(given is not None for given in (self.markers, self.tool, self.body)) != 1:
            raise ValueError("must have one of markers, tool and body|give what moves the end, or use clamp or pinned")
        count = 0 if self.markers is None else len(self.markers)
        if count == 2 and (self.position is not None or self.direction is not None):
            raise ValueError("takes its place and direction from its two markers|leave out position and direction")
        if count == 1 and self.position is not None:
            raise ValueError("has a position beside one marker|give the offset from the marker")
        if count == 1 and self.lead is not None:
            raise ValueError("has a lead beside one marker|give the offset from the marker, and a longer rope")
        if count != 1 and any(self.offset):
            raise ValueError("has an offset from one marker|give the position")
        return self


def _one_at_each_end(grips: list[RopeGrip]) -> list[RopeGrip]:
    for at in ("start", "end"):
        count = sum(grip.at == at for grip in grips)
        if count > 1:
            raise ValueError(f"has {count} grips at its {at}|give one, with all of its markers")
    return grips


RopeGrips = Annotated[list[RopeGrip], AfterValidator(_one_at_each_end)]


class RopeHere(Section):
    """[recording.here.NAME]: the markers on a rope or rod and what moves its ends in this recording, instead of its
    own: for takes of one rope whose markers were put on anew, or have other names."""

    markers: dict[str, Finite] | None = key(
        None, "markers on it and their arc lengths from the start; its own when left out", "m", min_length=1
    )
    grip: RopeGrips | None = key(None, "what holds its ends and moves them; its own grips when left out")


class Strand(Section):
    """What ropes and rods share."""

    length: Finite | None = key(None, "rest length; that of `points` when left out", "m", gt=0)
    segments: int = key(40, "number of equal links", ge=1, le=MOST_SEGMENTS)
    density: Finite = key(..., "mass per length", "kg/m", gt=0)
    EA: Finite | None = key(None, "axial stiffness; inextensible when left out", "N", gt=0)
    start: Vector = key([0.0, 0.0, 0.0], "where a straight one starts; at the marker of a grip there", "m")
    direction: Vector | None = key(
        None,
        "where a straight one points; left out: as clamp_start, or else clamp_end, or else the grip of a rope that has "
        "one, or along x",
    )
    points: list[Vector] | Literal["recording"] | None = key(
        None,
        'initial shape as a polyline, or "recording": through the markers on it, as first measured '
        "(their mean when static); a fit that changes the length bends this shape to it, unless it is almost straight "
        "between two held ends",
        "m",
    )
    velocity: Literal["recording"] | None = key(
        None, 'initial velocity: "recording" takes that of the markers on it, with `points`; at rest when left out'
    )
    smoothing: Finite = key(0.05, "over which markers are smoothed for `velocity`, and `points` then", "s", ge=0)
    markers: dict[str, Finite] | None = key(
        None,
        "markers on it and their arc lengths from the start, such as { m0 = 0.0, m1 = 0.1 }; further ones and offsets "
        "in [[marker]]",
        "m",
    )
    stretch_damping: Finite | None = key(None, "Kelvin-Voigt time constant of stretching", "s", gt=0)
    bend_damping: Finite | None = key(None, "Kelvin-Voigt time constant of bending", "s", gt=0)
    drag_linear: Finite | None = key(None, "linear air drag per length", "N s/m^2", ge=0)
    drag_quadratic: Finite | None = key(None, "quadratic air drag per length", "N s^2/m^3", ge=0)
    clamp_start: Vector | None = key(
        None,
        "direction of travel at the start, held by a clamp there. A [[scene.drive]] of the start moves the clamp, "
        "which keeps its direction",
    )
    clamp_end: Vector | None = key(None, "direction of travel at the end, held by a clamp there")
    pinned: list[int] = key([], "nodes that are held where they start; -1 is the last")
    grip: RopeGrips = key([], "what holds its ends and moves them")
    tilts: bool = key(False, "adds <name>_start_tilt_1, ... (rad): it leaves its grips askew by these angles")
    shifts: bool = key(
        False, "adds <name>_start_shift_1, ... (m): it leaves its grips so far beside and before their places"
    )

    @model_validator(mode="after")
    def _held_once(self) -> Self:
        for at, clamp in (("start", self.clamp_start), ("end", self.clamp_end)):
            if clamp is not None and self.grip_at(at) is not None:
                fix = "leave out one of them; `direction` of a grip with one marker keeps a direction"
                raise ValueError(f"has a grip and clamp_{at} at its {at}|{fix}")
        if self.velocity is not None and self.points != "recording":
            raise ValueError('has velocity = "recording" and other points|give points = "recording"')
        return self

    def grip_at(self, end: str) -> RopeGrip | None:
        """What holds the "start" or the "end"."""
        return next((grip for grip in self.grip if grip.at == end), None)


class Rope(Strand):
    """A rope, `sb.add_rope`: it bends and stretches, and knows no twist. A list of ropes: [[scene.rope]]."""

    name: Name = key("rope", "prefix of its quantities: <name>_EI and so on")
    EI: Finite | None = key(None, "bending stiffness; no bending when left out", "N m^2", gt=0)
    loss_factor: Finite | None = key(
        None,
        "of stretching and bending, instead of the time constants: tau = loss_factor / (2 pi loss_frequency)",
        gt=0,
    )
    loss_frequency: Finite | None = key(None, "frequency of the motion at which `loss_factor` holds", "Hz", gt=0)
    clamp_angles: bool = key(
        False, "adds <name>_start_angle and <name>_end_angle (rad), the clamps' rotations about `plane`"
    )
    plane: Vector | None = key(None, "unit normal of the plane that the rope stays in")
    set_modes: list[int] = key([], "k of rest-curvature modes cos(k pi s / length), each adds <name>_set_<k> (1/m)")
    softness_modes: list[int] = key(
        [],
        "the same of the logarithm of the bending compliance: <name>_softness_<k>. With 1, 2 and so on, "
        "[smooth.<name>_softness] fits them with a prior",
    )


class Rod(Strand):
    """A rod, `sb.add_rod`: a rope that stores twist, with a rest shape in space. A list of rods: [[scene.rod]]."""

    name: Name = key("rod", "prefix of its quantities: <name>_EI, <name>_GJ and so on")
    length: Finite = key(..., "rest length, between its grips", "m", gt=0)
    segments: int = key(40, "number of equal links", ge=2, le=MOST_SEGMENTS)
    EI: Finite = key(..., "bending stiffness", "N m^2", gt=0)
    GJ: Finite = key(..., "torsional stiffness", "N m^2", gt=0)
    EI2: Finite | None = key(
        None, "bending stiffness about the frame's first axis, of a section with two; EI when left out", "N m^2", gt=0
    )
    GA: Finite | None = key(None, "shear stiffness; sections stay across the rod when left out", "N", gt=0)
    director: Vector | None = key(None, "the frame's first axis at a start that no grip holds; any when left out")
    hold_roll: list[Literal["start", "end"]] = key(
        [],
        "ends at which it does not spin about its own axis but turns in every direction, as in a hand that one marker "
        "shows; an end without a grip, or with one marker, spins freely when left out",
    )
    turns: int = key(0, "whole turns by which the end's frame is ahead at the start")
    roll: bool = key(False, "adds <name>_roll (rad): the twist built in when the rod was gripped at its end")
    twist_damping: Finite | None = key(None, "Kelvin-Voigt time constant of twisting", "s", gt=0)
    shear_damping: Finite | None = key(None, "Kelvin-Voigt time constant of shear; needs GA", "s", gt=0)
    yield_curvature: Finite | None = key(
        None, "elastic curvature beyond which internal friction slides; elastic when left out", "1/m", gt=0
    )
    yield_share: Finite | None = key(None, "the part of EI that slides", gt=0, lt=1)
    curvature_modes: list[int] = key(
        [], "k of rest-curvature modes cos(k pi s / length) about both axes: <name>_curvature_1_<k>, _2_<k> (1/m)"
    )
    twist_modes: list[int] = key([], "the same of the rest twist: <name>_twist_<k> (1/m)")
    softness_modes: list[int] = key(
        [],
        "the same of the logarithm of the bending compliance: <name>_softness_<k>. With 1, 2 and so on, "
        "[smooth.<name>_softness] fits them with a prior",
    )
    density_modes: list[int] = key([], "the same of the density, relative to it: <name>_density_<k>")
    slid_modes: list[int] = key(
        [],
        "the same of the curvature by which internal friction has slid before the start, about both axes: "
        "<name>_slid_1_<k>, _2_<k> (1/m); needs yield_curvature",
    )

    @model_validator(mode="after")
    def _known_leads(self) -> Self:
        if any(grip.lead is not None for grip in self.grip):
            raise ValueError("has a grip with a lead|use [[scene.rope]], or `shifts` and the exact length")
        return self
