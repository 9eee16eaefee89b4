"""The tests of a fabric in a TOML file: what `sheetbend fabric` reads."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, field_validator, model_validator

from ..files.units import Length
from ..textile.drape import Plates
from .section import Finite, Name, Section, key

Positive = Annotated[Finite, Field(gt=0)]
Values = Annotated[list[Positive], Field(min_length=1)]
Files = Annotated[list[str], Field(min_length=1)]
Along = Literal["warp", "weft"]


LIGHTEST, LIMPEST = 2.0, 4.0
"""g/m^2 and mm, of any fabric: less is in another unit."""


class FabricSection(Section):
    """[fabric]: the name of the fabric and the law of its tension."""

    name: Name = key(..., "names the results")
    about: str = key("", "a sentence on it")
    law: Literal["chosen", "linear", "exponential", "sinh"] = key(
        "chosen", "how tension grows with strain; chosen = what the pulls support most"
    )


class Weight(Section):
    """[weight]: the weight of pieces of the fabric."""

    specimens: Values = key(..., "weight per area of each", "g/m^2")

    @field_validator("specimens")
    @classmethod
    def _of_fabrics(cls, given: list[float]) -> list[float]:
        if min(given) < LIGHTEST:
            kilograms = f"such as {[float(f'{1e3 * g:.6g}') for g in given]} for kg/m^2"
            raise ValueError(f"are lighter than any fabric, {LIGHTEST:g} g/m^2|give g/m^2, {kilograms}")
        return given


class Machine(Section):
    """What the files of a testing machine leave open, as for `sheetbend textile`."""

    files: Files | None = key(None, "text exports, a specimen or several in each")
    length: str | None = key(None, 'between the jaws: "20cm", or the words before it in the preamble')
    width: str | None = key(None, 'of the specimen: "5cm", or the words before it')
    columns: dict[str, str | int] = key({}, "by role (deformation, load, time, repeat), the column's name or number")
    units: dict[str, str] = key({}, 'by role, where the header has none: { load = "cN" }')
    decimal: Literal[".", ","] | None = key(None, "decimal mark, where the file leaves it open")
    cycle: int = key(0, "which cycle counts, from 0; -1 is the last")


class Pull(Machine):
    """Strips that were pulled. A list: [[pull]]."""

    files: Files = key(..., "text exports, a specimen or several in each")
    along: Literal["warp", "weft", "bias"] = key(..., "direction; bias = 45 degrees")
    pretension: str | None = key(None, 'from where strains count: "2N", or "1cN/cm"')
    way: Literal["loading", "unloading", "skeleton"] = key("loading", "which way of the loop the fabric follows")


class ShearTest(Machine):
    """A KES shear test. A list: [[shear]]; give files or specimens."""

    along: Along = key("warp", "the yarns between the jaws")
    specimens: Values | None = key(None, "G as read", "gf/(cm deg)")

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        if (self.files is None) == (self.specimens is None):
            raise ValueError("needs its readings|give files or specimens, one of them")
        return self


class BendingTest(Machine):
    """Bending of strips. A list: [[bending]]; give files of KES loops, or bending lengths."""

    along: Along = key("warp", "direction of the strips")
    bending_length: Values | None = key(None, "of each specimen, by the cantilever test (ASTM D1388, FAST-2)", "mm")

    @field_validator("bending_length")
    @classmethod
    def _of_fabrics(cls, given: list[float] | None) -> list[float] | None:
        if given is not None and min(given) < LIMPEST:
            centimeters = f"such as {[float(f'{10 * g:.6g}') for g in given]} for cm"
            raise ValueError(f"are shorter than those of any fabric, {LIMPEST:g} mm|give mm, {centimeters}")
        return given

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        if (self.files is None) == (self.bending_length is None):
            raise ValueError("needs its readings|give files or bending_length, one of them")
        return self


class DrapeTest(Section):
    """[drape]: outlines of the shadows in a drape test."""

    outlines: Files = key(..., "a file for each specimen: points around the shadow, or a picture of it")
    units: Length | None = key(None, "of points")
    picture_width: Positive | None = key(None, "how much a picture shows from side to side", "m")
    diameter: Positive = key(0.3, "of the cloth", "m")
    plate: Positive = key(0.18, "of the plates", "m")
    friction: Positive | None = key(
        None, "of the plates, which the cloth then touches; held flat between them when left out"
    )
    cover: bool = key(True, "whether a second plate lies on the cloth; without it give the friction")
    error: Positive = key(3.0, "points of the coefficient by which stable states of one fabric differ")

    @model_validator(mode="after")
    def _rubs_without_a_cover(self) -> Self:
        if not self.cover and self.friction is None:
            raise ValueError("has no cover and no friction|give the friction of the plate too, or leave out cover")
        return self

    def plates(self) -> Plates:
        return {"diameter": self.diameter, "plate": self.plate, "friction": self.friction, "cover": self.cover}


class Given(Section):
    """[given]: parameters that are given instead of fitted."""

    density: Positive | None = key(None, "mass per area", "kg/m^2")
    warp: Positive | None = key(None, "tension stiffness along the warp", "N/m")
    weft: Positive | None = key(None, "along the weft", "N/m")
    shear: Positive | None = key(None, "shear stiffness", "N/m")
    poisson: Finite | None = key(None, "sqrt(nu_uv nu_vu)", gt=-1, lt=1)
    bending: Positive | None = key(None, "rigidity along the warp", "N m")
    bending_weft: Positive | None = key(None, "along the weft", "N m")
    bending_twist: Positive | None = key(None, "against twist", "N m")


class FabricConfig(Section):
    """A file of `sheetbend fabric`."""

    fabric: FabricSection = key(..., "[fabric]")
    weight: Weight | None = key(None, "[weight]")
    pull: list[Pull] = key([], "[[pull]]")
    shear: list[ShearTest] = key([], "[[shear]]")
    bending: list[BendingTest] = key([], "[[bending]]")
    drape: DrapeTest | None = key(None, "[drape]")
    given: Given = Field(default_factory=Given, description="[given]")

    @model_validator(mode="after")
    def _one_of_each(self) -> Self:
        for name, tests in (("pull", self.pull), ("bending", self.bending)):
            directions = [test.along for test in tests]
            twice = sorted({d for d in directions if directions.count(d) > 1})
            if twice:
                raise ValueError(f"has {name} along the {twice[0]} twice|put all of its files into one [[{name}]]")
        return self
