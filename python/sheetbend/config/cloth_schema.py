"""The sections of a configuration that describe cloth: [[scene.cloth]] and its tables."""

from __future__ import annotations

from typing import Any, Literal, Self

from pydantic import ValidationInfo, field_validator, model_validator

from ..files.units import Length
from .section import MOST_CELLS, Counts, Finite, Name, Pair, Section, Vector, key

MESH_KEYS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "grid": (("width", "height", "nx", "ny"), ("pattern", "warp", "margin")),
    "equilateral": (("width", "height", "nx"), ("warp", "margin")),
    "disk": (("radius", "rings"), ("support", "warp")),
    "file": (("file",), ("unit", "material", "texture_size", "warp", "merge")),
}
"""Of every kind of mesh, what it must have and what it may have."""


class ClothMesh(Section):
    """[scene.cloth.mesh]: a mesh by numbers (`sheetbend.mesh`), flat in its x-y plane with the warp along x, or from a
    file (`sb.read_mesh`)."""

    kind: Literal["grid", "equilateral", "disk", "file"] = key(..., "which of them")
    width: Finite | None = key(None, "of a grid or equilateral triangles, along x", "m", gt=0)
    height: Finite | None = key(None, "of a grid or equilateral triangles, along y", "m", gt=0)
    margin: Finite | list[Finite] | None = key(
        None,
        "how far the cloth goes on beyond `width` and `height`, on all sides, or on the left, right, lower and upper "
        "one; places of markers and `origin` still count from the corner of the inner rectangle",
        "m",
    )
    nx: int | None = key(None, "cells of a grid along x, or sides of equilateral triangles", ge=1, le=MOST_CELLS)
    ny: int | None = key(None, "cells of a grid along y", ge=1, le=MOST_CELLS)
    pattern: Literal["alternating", "crossed", "one_way"] | None = key(
        None, '`grid` only, diagonals; "one_way" when left out: its inner vertices have six neighbors'
    )
    radius: Finite | None = key(None, "of a disk around the origin", "m", gt=0)
    rings: int | None = key(None, "of a disk", ge=1, le=MOST_CELLS)
    support: Finite | None = key(None, "radius of a circle of the disk whose vertices are the set `support`", "m", gt=0)
    file: str | None = key(None, "OBJ, PLY or STL, relative to the configuration")
    unit: Length | None = key(None, "length unit of the file; m when left out")
    material: Literal["texture", "unfold"] | None = key(
        None, "where the file's material coordinates come from; its texture when left out and there is one"
    )
    texture_size: Finite | None = key(None, "of one unit of texture coordinates; 1 when left out", "m", gt=0)
    warp: Vector | None = key(None, "direction of the warp in the mesh; x when left out; of a file with `unfold` only")
    merge: bool | None = key(
        None,
        "mend what exporters leave: one vertex of those at equal positions, no vertices without a triangle, triangles "
        "that face one way; no when left out",
    )

    @model_validator(mode="after")
    def _keys_of_kind(self) -> Self:
        needed, optional = MESH_KEYS[self.kind]
        given = {name for name in type(self).model_fields if name != "kind" and getattr(self, name) is not None}
        missing, foreign = sorted(set(needed) - given), sorted(given - {*needed, *optional})
        if missing:
            raise ValueError(f"of kind '{self.kind}' lacks {', '.join(missing)}|give {', '.join(needed)}")
        if foreign:
            fix = f"leave out what is not of: {', '.join((*needed, *optional))}"
            raise ValueError(f"of kind '{self.kind}' has no {', '.join(foreign)}|{fix}")
        if self.margin is not None and not (len(self.margins) == 4 and min(self.margins) >= 0):
            raise ValueError(
                "has a margin that is not a length for each side|give one number, or four: left, right, lower, upper"
            )
        return self

    @property
    def margins(self) -> list[float]:
        """m, on the left, right, lower and upper side."""
        return self.margin if isinstance(self.margin, list) else [self.margin or 0.0] * 4


class ClothLaw(Section):
    """[scene.cloth.law]: how tension grows with strain, `sb.laws.Exponential`, `Sinh` or `Spline`; linear when left
    out."""

    kind: Literal["exponential", "sinh", "spline"] = key(..., "which of them")
    warp: Finite | list[Finite] | None = key(
        None, "stiffening b of an exponential or sinh, or ratios of a spline at 1 to 4 spacings (1 when left out)"
    )
    weft: Finite | list[Finite] | None = key(None, "the same along the weft")
    shear: Finite | list[Finite] | None = key(None, "the same in shear")
    spacing: Vector | None = key(None, "of a spline, in strain of warp, weft and shear")

    @model_validator(mode="after")
    def _keys_of_kind(self) -> Self:
        given = {name: getattr(self, name) for name in ("warp", "weft", "shear") if getattr(self, name) is not None}
        if self.kind != "spline":
            if len(given) < 3 or not all(isinstance(v, float) for v in given.values()):
                raise ValueError(f"is of kind {self.kind}|give warp, weft and shear, one number each")
            if self.spacing is not None:
                raise ValueError(f"is of kind {self.kind} and has spacing|leave it out, or use a spline")
        elif self.spacing is None or not all(isinstance(v, list) and len(v) == 4 for v in given.values()):
            raise ValueError("is a spline|give spacing, and four ratios for each of warp, weft and shear that is given")
        return self


class VertexSet(Section):
    """Vertices of a cloth by name, beside those that its mesh has (see `sheetbend.mesh`). A list: [[scene.cloth.set]];
    give a box, points or markers."""

    name: Name = key(..., "what `pinned`, grips and references call them")
    lower: Vector | None = key(None, "corner of a box in space, where the cloth is placed; open when left out", "m")
    upper: Vector | None = key(None, "its other corner; open when left out", "m")
    points: list[Vector] | None = key(None, "the vertices nearest to these points in space", "m", min_length=1)
    markers: list[str | int] | None = key(
        None, "the vertices nearest to these markers where they are at the scene's start", min_length=1
    )
    radius: Finite | None = key(
        None, "of the patch of fabric about each of the points or markers whose vertices belong to it too", "m", gt=0
    )

    @model_validator(mode="after")
    def _one_way_to_choose(self) -> Self:
        box = self.lower is not None or self.upper is not None
        if box + (self.points is not None) + (self.markers is not None) != 1:
            raise ValueError("does not say which vertices|give one of: a box (lower, upper), points, markers")
        if box and self.radius is not None:
            raise ValueError("has a box and a radius|leave out one of them")
        return self


class Grip(Section):
    """Vertices of a cloth that are moved with markers or a tool, or fixed to a body. A list: [[scene.cloth.grip]];
    every vertex moves as the line through the markers does where it is nearest to it, or rigidly with the tool or the
    body, from where it is placed."""

    set: Name = key(..., "a set of vertices")
    markers: list[str | int] | None = key(None, "one marker, or several in order along the line", min_length=1)
    tool: Name | None = key(None, "the [[scene.tool]] that holds them, instead of markers")
    body: Name | None = key(None, "the [[scene.body]] that they are fixed to, instead of markers")
    interpolation: Literal["cubic", "linear"] = key("cubic", "of the motion between frames; of a tool always cubic")

    @model_validator(mode="after")
    def _one_mover(self) -> Self:
        if sum(mover is not None for mover in (self.markers, self.tool, self.body)) != 1:
            raise ValueError("must have one of markers, tool and body|give what moves the vertices")
        return self


class Bar(Section):
    """A straight bar that holds a side of a cloth, for `shape = "recording"`. A list: [[scene.cloth.bar]]; the side
    starts on the line through the marker, also where no other marker shows how it lies. A grip moves it."""

    set: Name = key(..., "a set of the mesh's own vertices, such as left or right of a grid")
    marker: str | int = key(..., "on the bar, anywhere along it")
    direction: Vector = key(..., "of the bar")

    @field_validator("direction")
    @classmethod
    def _has_length(cls, direction: list[float]) -> list[float]:
        if not any(direction):
            raise ValueError("has no length|give where the bar points")
        return direction


class MarkerGrid(Section):
    """[scene.cloth.grid], [recording.grids.NAME]: markers on an even grid of a cloth, rows along the warp one after
    another."""

    first: Pair = key(..., "material coordinates (along warp and weft) of the first marker", "m")
    last: Pair = key(..., "and of the last one, at the opposite corner", "m")
    counts: Counts = key(..., "how many markers along the warp, and how many along the weft")
    markers: list[str | int] | None = key(
        None,
        "names or numbers, those of the first row first; all markers of the recording that move no grip, in its order, "
        "when left out",
        min_length=1,
    )

    @model_validator(mode="after")
    def _one_each(self) -> Self:
        nx, ny = self.counts
        if self.markers is not None and len(self.markers) != nx * ny:
            raise ValueError(f"has {len(self.markers)} markers for {nx} x {ny} places|give one for each place")
        return self

    def places(self) -> list[list[float]]:
        """Material coordinates of every place, m."""
        (u0, v0), (u1, v1), (nx, ny) = self.first, self.last, self.counts

        def at(k: int, count: int, start: float, stop: float) -> float:
            return start if count == 1 else start + (stop - start) * k / (count - 1)

        return [[at(i, nx, u0, u1), at(j, ny, v0, v1)] for j in range(ny) for i in range(nx)]


class ClothVolume(Section):
    """[scene.cloth.volume]: a closed mesh keeps its volume, `Scene.add_volume`, at rest and in motions with any method
    but "implicit". The table may be empty. Its numbers are the quantities `<name>_volume` and, unless zero,
    `<name>_volume_compliance`."""

    rest: Finite | None = key(None, "what it keeps; the volume of the mesh as placed when left out", "m^3", gt=0)
    compliance: Finite = key(
        0.0, "0 = incompressible; a gas at p Pa that keeps its temperature has V/p", "m^3/Pa", ge=0
    )


class Cloth(Section):
    """A cloth, `sb.add_cloth`. A list: [[scene.cloth]]."""

    name: Name = key("cloth", "prefix of its quantities: <name>_warp and so on")
    fabric: Name | None = key(
        None,
        "name of an earlier cloth that is cut from the same fabric: both share the keys from `density` to "
        "`drag_quadratic` and `law`, and their quantities",
    )
    fabric_file: str | None = key(
        None, "file that `sheetbend fabric` has written: `density`, `warp` to `bending_twist` and `law` are those in it"
    )
    mesh: ClothMesh = key(..., "[scene.cloth.mesh]")
    density: Finite = key(..., "mass per area", "kg/m^2", gt=0)
    warp: Finite = key(..., "tension stiffness along the warp, of a strip with free sides", "N/m", gt=0)
    weft: Finite | None = key(None, "along the weft; that of the warp when left out", "N/m", gt=0)
    shear: Finite = key(..., "shear stiffness", "N/m", gt=0)
    poisson: Finite = key(0.0, "sqrt(nu_uv nu_vu), between -1 and 1", gt=-1, lt=1)
    law: ClothLaw | None = key(None, "[scene.cloth.law]")
    bending: Finite | None = key(None, "rigidity along the warp; no bending when left out", "N m", gt=0)
    bending_weft: Finite | None = key(None, "rigidity along the weft; `bending` when left out", "N m", gt=0)
    bending_twist: Finite | None = key(None, "rigidity against twist; `bending` when left out", "N m", gt=0)
    bending_model: Literal["curvature", "dihedral", "isometric_bending"] = key("curvature", "see `sb.add_cloth`")
    curved: bool = key(False, "the mesh's own shape is that of bending at rest; flat otherwise")
    membrane_damping: Finite | None = key(None, "Kelvin-Voigt time constant of the membrane", "s", gt=0)
    bend_damping: Finite | None = key(None, "Kelvin-Voigt time constant of bending", "s", gt=0)
    yield_curvature: Finite | None = key(
        None,
        "elastic curvature along the warp beyond which friction between fibers slides, of the curvature model; elastic "
        "when left out",
        "1/m",
        gt=0,
    )
    yield_share: Finite | None = key(None, "the part of `bending` that slides", gt=0, lt=1)
    yield_shear: Finite | None = key(
        None,
        "elastic shear strain (tangent of the angle in simple shear) beyond which yarns slide where they cross, of the "
        "linear law; elastic when left out",
        gt=0,
    )
    yield_shear_share: Finite | None = key(None, "the part of `shear` that slides", gt=0, lt=1)
    drag_linear: Finite | None = key(None, "linear air drag per area", "N s/m^3", gt=0)
    drag_quadratic: Finite | None = key(None, "quadratic air drag per area", "N s^2/m^4", gt=0)
    warp_size: Finite | None = key(
        None,
        "size of the flat cloth along the warp over that of the mesh; 1.0 makes <name>_warp_size a quantity to fit",
        ge=0.8,
        le=1.25,
    )
    weft_size: Finite | None = key(None, "the same along the weft", ge=0.8, le=1.25)
    stiffness_modes: int = key(
        0,
        "by how many smooth modes the logarithm of the membrane's stiffness varies from triangle to triangle; "
        "quantities NAME_stiffness_1, ..., the smoothest first. [smooth.NAME_stiffness] fits them",
        ge=0,
    )
    air_normal: Finite | None = key(
        None, "force of air along the normal of the triangles, air density * drag coefficient / 2", "kg/m^3", gt=0
    )
    air_tangential: Finite | None = key(None, "the same across the normal", "kg/m^3", gt=0)
    volume: ClothVolume | None = key(None, "[scene.cloth.volume], not kept when left out")
    pressure: Finite | None = key(
        None,
        "pushes the triangles along their normals, out of a closed mesh, and where x_axis x y_axis points from a flat "
        "one; the quantity <name>_pressure",
        "Pa",
    )
    origin: Vector = key([0.0, 0.0, 0.0], "where the mesh's origin is placed", "m")
    x_axis: Vector = key([1.0, 0.0, 0.0], "where the mesh's x axis points")
    y_axis: Vector = key([0.0, 1.0, 0.0], "where its y axis points, perpendicular to `x_axis`")
    on_tool: Name | None = key(
        None,
        "a [[scene.tool]] in whose axes, as they are at the scene's start, the cloth is placed: the correction of the "
        "tool's frame then moves all of it",
    )
    set: list[VertexSet] = key([], "further sets of vertices")
    pinned: list[Name] = key([], "sets that are held where they are placed")
    grip: list[Grip] = key([], "sets that are moved with markers or a tool")
    bar: list[Bar] = key([], "sides that lie on straight bars at the start")
    markers: dict[str, Pair] | Literal["vertices"] = key(
        {},
        'material coordinates (along warp and weft) of markers, by name; or "vertices" of a mesh from a file: markers '
        "v0, v1, ... of a sequence of meshes sit on its vertices",
        "m",
    )
    grid: MarkerGrid | None = key(None, "[scene.cloth.grid], markers on a grid; a recording may have its own")
    nearest_at: Finite | None = key(
        None,
        "time of a recording at which the cloth lies as placed: a marker without another place, which moves no grip, "
        "is attached where it is nearest to the cloth at that time",
        "s",
    )

    layout: list[Pair] | None = key(
        None,
        "material coordinates of markers, in any order: at `nearest_at` each goes to the marker nearest to it; "
        "markers that get none are not attached",
        "m",
        min_length=1,
    )
    shape: Literal["placed", "recording"] = key(
        "placed",
        "shape that a recording's scene starts from: as placed, or smoothly through the markers on it, as first "
        "measured (their mean when static)",
    )
    velocity: Literal["recording"] | None = key(
        None, 'initial velocity: "recording" takes that of the markers on it; at rest when left out'
    )
    smoothing: Finite = key(0.05, "over which markers are smoothed for `velocity`", "s", gt=0)

    @field_validator("markers")
    @classmethod
    def _vertices_of_a_file(
        cls, markers: dict[str, list[float]] | str, info: ValidationInfo
    ) -> dict[str, list[float]] | str:
        mesh = info.data.get("mesh")
        if markers == "vertices" and isinstance(mesh, ClothMesh) and mesh.kind != "file":
            raise ValueError("are vertices of a mesh that is from no file|give material coordinates by name")
        return markers

    @field_validator("layout")
    @classmethod
    def _beside_nearest_at(cls, layout: list[Pair] | None, info: ValidationInfo) -> list[Pair] | None:
        if layout is not None and info.data.get("nearest_at") is None:
            raise ValueError("says not when the cloth lies as placed|give nearest_at too")
        return layout

    @field_validator("pressure")
    @classmethod
    def _beside_no_volume(cls, pressure: float | None, info: ValidationInfo) -> float | None:
        if pressure is not None and info.data.get("volume") is not None:
            fix = "leave it out, or leave out scene.cloth.volume, which finds the pressure that it takes"
            raise ValueError(f"stands beside a volume that is kept, and one takes up the other|{fix}")
        return pressure

    @model_validator(mode="after")
    def _bars_beside_a_recorded_shape(self) -> Self:
        if self.bar and self.shape == "placed":
            raise ValueError('has sides on bars and starts as placed|give shape = "recording", or leave out bar')
        return self

    @property
    def in_air(self) -> bool:
        """Whether air acts on its triangles."""
        return self.air_normal is not None or self.air_tangential is not None


FABRIC = (
    *("density", "warp", "weft", "shear", "poisson", "law", "bending", "bending_weft", "bending_twist"),
    *("bending_model", "membrane_damping", "bend_damping", "yield_curvature", "yield_share"),
    *("yield_shear", "yield_shear_share"),
    *("drag_linear", "drag_quadratic"),
)
"""Keys of a cloth that tell its fabric."""


def with_fabrics(scene: dict[str, Any]) -> dict[str, Any]:
    """What [scene] has of cloths as read, each with the keys of the fabric that it is cut from.

    Raises:
        ValueError: a fabric is that of no earlier cloth, or a cut has a number of its own.
    """
    cloths = scene.get("cloth")
    if not isinstance(cloths, list) or not all(isinstance(cloth, dict) for cloth in cloths):
        return {}  # refused where it stands
    known: dict[str, dict[str, Any]] = {}
    complete = []
    for cloth in cloths:
        name, fabric = str(cloth.get("name", "cloth")), cloth.get("fabric")
        if isinstance(fabric, str):
            if fabric not in known:
                fix = f"name an earlier [[scene.cloth]]{': ' + ', '.join(known) if known else ''}"
                raise ValueError(f"has a cloth, {name}, whose fabric is that of no earlier one, {fabric}|{fix}")
            whole = known[fabric]
            own = [key for key in FABRIC if key in cloth and cloth[key] != whole.get(key)]
            if own:
                fix = f"leave them out, or leave out its fabric: the numbers of {fabric} hold"
                raise ValueError(f"has a cloth, {name}, with numbers beside its fabric: {', '.join(own)}|{fix}")
            cloth = {k: whole[k] for k in FABRIC if k in whole} | cloth | {"fabric": whole.get("fabric", fabric)}
        known[name] = cloth
        complete.append(cloth)
    return {"cloth": complete}
