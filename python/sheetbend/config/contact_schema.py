"""[[scene.collider]] and [[scene.contact]]: the shapes that ropes and cloths touch, and who touches them."""

from __future__ import annotations

from dataclasses import MISSING, fields
from typing import Literal, Self

from pydantic import model_validator

from ..files.units import Length
from ..scene.colliders import Box, Capsule, Collider, Cylinder, Plane, Sphere
from ..scene.distance_field import DistanceField
from .section import Finite, Name, Section, Vector, key

SHAPES: dict[str, type[Collider]] = {
    "plane": Plane,
    "sphere": Sphere,
    "capsule": Capsule,
    "cylinder": Cylinder,
    "box": Box,
    "mesh": DistanceField,
}
_COMMON = {"name", "motion"}
_FILE = {"file": True, "unit": False}  # that a configuration has in the place of a mesh and its grid


def arguments(shape: str) -> dict[str, bool]:
    """The keys of a shape, and whether each must be given."""
    own = {f.name: f.default is MISSING for f in fields(SHAPES[shape]) if f.name not in _COMMON}
    if shape != "mesh":
        return own
    return _FILE | {name: needed for name, needed in own.items() if name not in ("mesh", "grid")}


class ColliderSection(Section):
    """A shape that ropes and cloths touch, `sb.Plane`, `sb.Sphere`, `sb.Capsule`, `sb.Cylinder`, `sb.Box` or a mesh
    (`sb.DistanceField`), standing, moving at knots or with a tool. A list: [[scene.collider]]. Its quantities are
    <name>_x, <name>_y and <name>_z (m), how far it is from where it was given, and its lengths, such as <name>_radius
    (m)."""

    name: Name = key(..., "prefix of its quantities, and what contacts call it")
    shape: Literal["plane", "sphere", "capsule", "cylinder", "box", "mesh"] = key(
        ..., "a plane is solid below, a long capsule a cylinder, a mesh any closed surface from a file"
    )
    point: Vector | None = key(None, "of a plane: a point on it; the origin when left out", "m")
    normal: Vector | None = key(None, "of a plane: to its free side, of any length; up (z) when left out")
    center: Vector | None = key(None, "of a sphere or box", "m")
    start: Vector | None = key(
        None, "of a capsule: where its segment starts; of a cylinder: the middle of one flat end", "m"
    )
    end: Vector | None = key(
        None, "of a capsule: where its segment ends; of a cylinder: the middle of the other end", "m"
    )
    radius: Finite | None = key(None, "of a sphere, capsule or cylinder", "m", gt=0)
    size: Vector | None = key(None, "of a box: its whole edges, before it is turned", "m")
    edge_radius: Finite | None = key(
        None, "of a box or cylinder: of its rounded edges, below half of the shortest edge or thickness", "m", gt=0
    )
    rotation: Vector | None = key(
        None, "of a box or mesh: a vector along the axis that it is turned about, as long as the angle", "rad"
    )
    file: str | None = key(None, "of a mesh: OBJ, PLY or STL, closed, relative to the configuration")
    unit: Length | None = key(None, "of a mesh: length unit of the file; m when left out")
    position: Vector | None = key(None, "of a mesh: where the origin of its coordinates is", "m")
    spacing: Finite | None = key(
        None, "of a mesh: of the grid of its distances; a 32nd of its longest side when left out", "m", gt=0
    )
    margin: Finite | None = key(
        None, "of a mesh: how far around it the grid goes, more than contact radii; 4 spacings when left out", "m", gt=0
    )
    times: list[Finite] | None = key(
        None, "knots of its motion in the scene's time (0 = its start); it stands before and after", "s", min_length=1
    )
    displacements: list[Vector] | None = key(
        None, "at the knots: of a plane's point, or the center, from where it was given", "m"
    )
    rotations: list[Vector] | None = key(
        None, "at the knots, about that point: vectors along the axis, as long as the angle", "rad"
    )
    interpolation: Literal["cubic", "linear"] = key("cubic", "of the motion between knots")
    tool: Name | None = key(None, "the [[scene.tool]] that it moves with, from where it is given at the scene's start")

    @model_validator(mode="after")
    def _of_its_shape(self) -> Self:
        own = arguments(self.shape)
        missing = [name for name, needed in own.items() if needed and getattr(self, name) is None]
        if missing:
            raise ValueError(f"is a {self.shape} without {' and '.join(missing)}|add {', '.join(missing)}")
        every = {name for shape in SHAPES for name in arguments(shape)}
        alien = sorted(name for name in every - set(own) if getattr(self, name) is not None)
        if alien:
            raise ValueError(f"is a {self.shape} and has {' and '.join(alien)}|a {self.shape} has {', '.join(own)}")
        return self

    @model_validator(mode="after")
    def _one_motion(self) -> Self:
        if (self.times is None) != (self.displacements is None):
            raise ValueError("has only one of times and displacements|give both, or neither of one that stands")
        if self.times is None and (self.rotations is not None or self.interpolation != "cubic"):
            raise ValueError("turns and has no times|give times and displacements (zeros where it turns in place)")
        if self.tool is not None and self.times is not None:
            raise ValueError("moves with a tool and at knots|give one of tool and times")
        return self


class ContactSection(Section):
    """What may touch a collider, and with which friction, `Scene.add_contact` (docs/contact.md). A list:
    [[scene.contact]]. It needs method = "implicit" or "gauss_seidel" in [solver]. Its quantities are <name>_friction,
    unless zero <name>_contact_radius (m), and where given <name>_contact_stiffness (N/m), <name>_contact_dissipation
    (s/m) and <name>_restitution."""

    name: Name | None = key(None, "prefix of its quantities; the collider's name when left out")
    of: Name | list[Name] = key(
        ..., "a rope, a rod, a cloth or a set of particles, or several: all of their particles; or a body"
    )
    points: list[Vector] | None = key(
        None, "of a body: those that may touch, in its frame; the corners of its box when left out", "m", min_length=1
    )
    collider: Name = key(..., "the [[scene.collider]] that they may touch")
    friction: Finite = key(..., "Coulomb's coefficient; 0 is smooth", ge=0)
    radius: Finite = key(
        0.0, "of a rope, or half the thickness of a cloth: particles touch at this distance", "m", ge=0
    )
    stiffness: Finite | None = key(None, "per particle; rigid when left out", "N/m", gt=0)
    restitution: Finite | None = key(None, "speed after an impact over that before; 0 when left out", ge=0, le=1)
    dissipation: Finite | None = key(
        None, "of a contact with a stiffness: how much more it pushes per speed at which it goes in", "s/m", ge=0
    )
    settle: bool = key(
        False,
        "move particles that start inside, as measured ones may by noise, to the surface before the motion starts; "
        "a body as a whole",
    )

    @property
    def touching(self) -> list[str]:
        """Names of what may touch."""
        return [self.of] if isinstance(self.of, str) else self.of


class CollisionsSection(Section):
    """[scene.collisions]: particles that hit each other like smooth balls, `Scene.add_collisions` (docs/contact.md).
    Its quantities are balls_restitution and balls_contact_radius (m), or balls_contact_radius_0 and so on where there
    are several radii."""

    of: Name | list[Name] = key(
        ..., "a set of particles, or several: all of their particles, none of which is pinned, driven or on a tether"
    )
    radius: Finite | list[Finite] = key(
        ..., "of the balls: one for all, or one for each set that is named in `of`", "m"
    )
    restitution: Finite = key(..., "speed after an impact over that before, along the centers", ge=0, le=1)

    @model_validator(mode="after")
    def _radii_are_positive(self) -> Self:
        radii = self.radius if isinstance(self.radius, list) else [self.radius]
        if not all(r > 0 for r in radii):
            raise ValueError(f"has a radius of {min(radii)}|give positive radii")
        if isinstance(self.radius, list) and len(radii) != len(self.sets):
            raise ValueError(
                f"has {len(radii)} radii for {len(self.sets)} names|give one for all, or one for each name"
            )
        return self

    @property
    def sets(self) -> list[str]:
        """Names of the sets."""
        return [self.of] if isinstance(self.of, str) else self.of


class SelfContactSection(Section):
    """[scene.self_contact]: ropes, cloths and bodies that touch themselves and each other, `Scene.add_self_contact`
    (docs/self_contact.md). It needs method = "implicit" in [solver]. The radius is the quantity self_contact_radius
    (m), or self_contact_radius_0 and so on where there are several, and the friction is self_friction."""

    of: Name | list[Name] | None = key(
        None, "a rope, a cloth or a body with `capsules`, or several; all of the scene when left out"
    )
    radius: Finite | list[Finite] = key(
        ...,
        "of ropes and capsules, or half the thickness of cloths: one for all, or one for each that is named in `of`",
        "m",
    )
    friction: Finite = key(0.0, "Coulomb's coefficient between any two; 0 is smooth", ge=0)
    pairs: int | None = key(
        None,
        "with friction, how many pairs of edges and of particles and triangles may touch at a time; twice as many as "
        "there are edges and particles of cloths when left out",
        gt=0,
    )

    @model_validator(mode="after")
    def _radii_are_positive(self) -> Self:
        radii = self.radius if isinstance(self.radius, list) else [self.radius]
        if not all(r > 0 for r in radii):
            raise ValueError(f"has a radius of {min(radii)}|give positive radii")
        if isinstance(self.radius, list) and len(radii) != len(self.pieces):
            raise ValueError(f"has {len(radii)} radii for {len(self.pieces)} names|name each piece in `of`")
        return self

    @property
    def pieces(self) -> list[str]:
        """Names of what may touch; none where it is everything."""
        return [] if self.of is None else [self.of] if isinstance(self.of, str) else self.of
