"""[[scene.solid]]: solids of bricks or tetrahedra."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import Field, model_validator

from ..files.units import Length
from ..objects.solid import SolidLaw
from .section import Finite, Name, Section, Vector, key

MOST_BRICKS = 1_000
Cells = Annotated[list[Annotated[int, Field(ge=1, le=MOST_BRICKS)]], Field(min_length=3, max_length=3)]


class SolidSet(Section):
    """Vertices of a solid in a box of space. A list: [[scene.solid.set]]. A box of bricks has its faces as sets
    already: x_min, x_max, y_min, y_max, z_min and z_max."""

    name: Name = key(..., "what `pinned`, grips and means call it")
    lower: Vector = key(..., "the box's lowest corner", "m")
    upper: Vector = key(..., "its highest corner", "m")


class SolidGrip(Section):
    """Vertices of a solid that are fixed to a body where they are placed. A list: [[scene.solid.grip]]."""

    set: Name = key(..., "a set of vertices, such as x_min")
    body: Name = key(..., "the [[scene.body]] that they are fixed to; a `tool` or `pinned` of it holds or moves them")


class SolidMean(Section):
    """A particle at the mean of a set of vertices, weighted by their share of the surface, `add_mean`. A list:
    [[scene.solid.mean]]. What is hung on it, pulls or holds it acts on all of them and lets them narrow."""

    name: Name = key(..., "what [[scene.point_mass]], [[scene.force]], markers and `pin` call the particle")
    set: Name = key(..., "a set with whole faces of elements, such as x_max")


class SolidSection(Section):
    """A solid, `add_solid`: a box of bricks, or a mesh from a file. A list: [[scene.solid]]. docs/solids.md has its
    law."""

    name: Name = key("solid", "prefix of its quantities, and what markers call it")
    size: Vector | None = key(None, "of a box, along x, y and z", "m")
    cells: Cells | None = key(None, "of a box: the number of bricks along x, y and z")
    origin: Vector = key([0.0, 0.0, 0.0], "of a box: its lowest corner", "m")
    file: str | None = key(None, "a mesh of hexahedra or tetrahedra instead, relative to the configuration")
    unit: Length = key("m", "of the file")
    material: Name | None = key(None, "prefix of the quantities instead; solids of one material share them")
    density: Finite = key(..., "mass per volume", "kg/m^3", gt=0)
    E: Finite = key(..., "Young's modulus", "Pa", gt=0)
    poisson: Finite | None = key(
        None, "Poisson's ratio: 0.499 hardly changes its volume; left out with clusters", gt=-1, lt=0.5
    )
    clusters: Finite | None = key(
        None,
        "shape matching: the size of boxes, which overlap by half and in which vertices keep their shape",
        "m",
        gt=0,
    )
    stiffness_modes: int = key(
        0,
        "with clusters: by how many smooth modes ln E varies from cluster to cluster; quantities NAME_stiffness_1, "
        "..., the smoothest first. [smooth.NAME_stiffness] fits them",
        ge=0,
    )
    damping: Finite | None = key(None, "Kelvin-Voigt time constant", "s", gt=0)
    law: SolidLaw = key("strain", "neo_hookean: rubber at large strains")
    volume_row: bool | None = key(
        None, "one row for the volume of each element, which lets bricks bend; by default where poisson is positive"
    )
    yield_stress: Finite | None = key(
        None, "stress in tension beyond which bricks keep a deformation (von Mises)", "Pa", gt=0
    )
    hardening: Finite | None = key(
        None, "rise of the yield stress per plastic strain, kinematic; left out: perfectly plastic", "Pa", gt=0
    )
    pinned: list[str] = key([], "sets of vertices that are held where they start")
    grip: list[SolidGrip] = key([], "sets of vertices that are fixed to bodies")
    mean: list[SolidMean] = key([], "particles at the mean of sets of vertices")
    set: list[SolidSet] = key([], "further sets")

    @model_validator(mode="after")
    def _one_mesh(self) -> Self:
        box = [name for name in ("size", "cells") if getattr(self, name) is not None]
        if self.file is None and len(box) < 2:
            raise ValueError("has no mesh|give size and cells, or a file")
        if self.file is not None and (box or "origin" in self.model_fields_set):
            raise ValueError("has a file and the box of another mesh|leave size, cells and origin out")
        return self
