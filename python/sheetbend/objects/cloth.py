"""Cloth: triangle meshes with membrane and bending stiffness, given and fitted by numbers of the fabric that do not
depend on the mesh."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import check_count, check_kind, check_label, check_positive, finite, is_number, some_indices
from ..arrays.types import Array
from ..errors import SceneError
from ..mesh import TriangleMesh
from ..quantities.quantities import Term
from ..scene.given import check_scene
from ..scene.scene import Scene
from .cloth_cut import Cut
from .flat_size import FlatSize
from .hinges import Hinges
from .laws import Law, Linear
from .sheet_bending import SheetCurvature
from .sheet_stretching import add_membrane
from .stiffness_field import StiffnessField, field_of_triangles
from .yielding import check_yield

MESH = "give a TriangleMesh, such as sb.mesh.equilateral(...) or sb.read_mesh(path)"
NEEDED = ("density", "warp", "shear")  # numbers of a fabric that have to be given
NOT_POSITIVE = ("poisson", "law", "bending_model", "yield_share", "yield_shear_share")
MODELS = ("curvature", "dihedral", "isometric_bending")


@dataclass(frozen=True)
class Cloth:
    """A cloth in a scene.

    Attributes:
        mesh: as given.
        particles: of its vertices.
        fabric: prefix of its fabric's quantities.
        numbers: of its fabric as given, those left out too.
        sizes: `warp_size` and `weft_size` as given.
        field: how its stiffness varies from triangle to triangle; None = it does not.
    """

    name: str
    mesh: TriangleMesh
    particles: Array
    fabric: str
    numbers: Mapping[str, Any]
    sizes: Mapping[str, Any]
    field: StiffnessField | None = None


def cloth(
    mesh: TriangleMesh,
    *,
    density: float,
    warp: float,
    shear: float,
    name: str = "cloth",
    gravity: ArrayLike = (0.0, 0.0, -9.81),
    pinned: ArrayLike = (),
    **options: object,
) -> Scene:
    """Make a scene with one cloth.

    Examples:
        >>> mesh = sb.mesh.grid(0.3, 0.4, 6, 8, "one_way")  # width and height in m, cells
        >>> scene = sb.cloth(mesh, density=0.2, warp=60.0, shear=20.0, bending=1e-5, pinned=mesh.sets["corners"])
        >>> len(scene.cloths["cloth"].particles)
        63

    Args:
        mesh: with material coordinates along warp and weft, m.
        density: mass per area, kg/m^2.
        warp: tension stiffness along the warp, N/m.
        shear: shear stiffness, N/m.
        name: of the cloth and of the scene; the prefix of its quantities.
        gravity: (3,) m/s^2.
        pinned: vertices that stay in place, such as `mesh.sets["corners"]`; also `held`, unless that is given.
        options: those of `add_cloth`.

    Raises:
        SceneError: wrong or missing values; the message names the field.
    """
    scene = Scene(name, gravity)
    check_kind("cloth.mesh", mesh, TriangleMesh, MESH, SceneError)
    still = some_indices("cloth.pinned", pinned, len(mesh.vertices))
    given = {"held": still, **options}
    built = add_cloth(scene, mesh, name, density=density, warp=warp, shear=shear, **given)  # type: ignore[arg-type]
    if len(still):
        scene.pin(built.particles[still])
    return scene


def add_cloth(
    scene: Scene,
    mesh: TriangleMesh,
    name: str = "cloth",
    *,
    fabric: str = "",
    density: float,
    warp: float,
    weft: float | None = None,
    shear: float,
    poisson: float = 0.0,
    law: Law | None = None,
    bending: float | None = None,
    bending_weft: float | None = None,
    bending_twist: float | None = None,
    bending_model: str = "curvature",
    curved: bool = False,
    held: ArrayLike = (),
    positions: ArrayLike | None = None,
    velocity: ArrayLike | None = None,
    membrane_damping: float | None = None,
    bend_damping: float | None = None,
    yield_curvature: float | None = None,
    yield_share: float | None = None,
    yield_shear: float | None = None,
    yield_shear_share: float | None = None,
    drag_linear: float | None = None,
    drag_quadratic: float | None = None,
    warp_size: float | None = None,
    weft_size: float | None = None,
    stiffness_modes: int = 0,
) -> Cloth:
    """Add a cloth to a scene.

    Quantities: `<fabric>_density` kg/m^2, `_warp`, `_weft`, `_shear` N/m, `_poisson`, the law's coefficients (see
    `sheetbend.laws`) such as `_warp_stiffening`, and where given `_bending`, `_bending_weft`,
    `_bending_twist` N m, `_membrane_damping` s,
    `_bend_damping` s, `_yield_curvature` 1/m, `_yield_share`, `_yield_shear`, `_yield_shear_share`,
    `_drag_linear` N s/m^3, `_drag_quadratic` N s^2/m^4;
    and of this cut alone, where given, `<name>_warp_size`, `<name>_weft_size` and `<name>_stiffness_1` and so on.

    The membrane's energy per area is Y_warp f(E_uu)^2 + 2 n sqrt(Y_warp Y_weft) f(E_uu) f(E_vv) + Y_weft f(E_vv)^2,
    over 2 (1 - n^2), plus G f(2 E_uv)^2/2, in Green strain (core/constraints/membrane.h).

    Args:
        mesh: with material coordinates along warp and weft.
        fabric: prefix of the quantities, `name` by default. Cuts of one fabric share them and have the same values.
        density: mass per area, kg/m^2.
        warp, weft: tension stiffness at rest, N/m, of a strip with free sides; weft = warp by default.
        shear: G, N/m; an isotropic fabric has warp/(2 (1 + poisson)).
        poisson: n = sqrt(nu_uv nu_vu), between -1 and 1. A strip pulled along the warp narrows by
            nu_uv = n sqrt(warp/weft) times its strain.
        law: how tension grows with strain; Linear() by default.
        bending: rigidity B, N m, along the warp and, where nothing else is given, in all directions; None = no bending.
        bending_weft, bending_twist: rigidities along the weft and against twist, N m, of the curvature model.
        bending_model: "curvature" (of triangles: right on meshes whose inner vertices have six neighbors), "dihedral"
            (angles between triangles: what a mesh makes of B depends on its pattern) or "isometric_bending" (the
            quadratic form of that, flat at rest).
        curved: the mesh's vertices are the shape at rest of the bending; flat by default.
        held: vertices that will be pinned or driven: triangles and hinges among them alone are left out. To clamp a
            sheet with the curvature model hold two rows or more: the clamp then acts in the middle between the last row
            and the one before it. A single row is a hinge line.
        positions: (vertices, 3) m, the initial shape; the mesh's vertices by default.
        velocity: (vertices, 3) m/s; at rest by default.
        membrane_damping, bend_damping: Kelvin-Voigt time constants, s.
        yield_curvature: 1/m, the elastic curvature beyond which friction between fibers slides, of the curvature model:
            along the warp; the curvature along the weft counts by sqrt(bending_weft/bending). What has slid, the set,
            starts at zero. None = elastic.
        yield_share: the part of the bending stiffness that slides, between 0 and 1: beyond yield (1 - share) of it is
            left. Small motion shows all of it. A strip bent back and forth has a loop of 2 share bending
            yield_curvature in its moment per width (2HB of a KES test).
        yield_shear: the elastic shear strain 2 E_uv, in simple shear the tangent of the angle, beyond which yarns slide
            on each other where they cross. What has slid starts at zero. None = elastic. Of the linear law.
        yield_shear_share: the part of the shear stiffness that slides, between 0 and 1. A strip sheared back and forth
            has a loop of 2 yield_shear_share shear yield_shear in its force per width (2HG of a KES test).
        drag_linear, drag_quadratic: air drag per area, N s/m^3 and N s^2/m^4, isotropic.
        warp_size, weft_size: size of the flat cloth along warp and weft over that of the mesh, between 0.8 and 1.25:
            what it would be without tension, its area and its mass follow, and the numbers of the fabric stay. The
            initial shape, places of markers on the mesh and angles at rest of `curved` are kept. Give 1.0 to fit what a
            measurement leaves open. None = that of the mesh, and no quantity. Of the curvature model.
        stiffness_modes: by how many smooth modes the logarithm of the membrane's stiffness (warp, weft and shear alike)
            varies from triangle to triangle. The quantities are `<name>_stiffness_1` and so on, the smoothest first,
            each the root mean square of what it adds; 0 at the start. `smooth` of `fit` gives them a prior.

    Raises:
        SceneError: wrong or missing values, or others than those of a cut before; a mesh whose diagonals bias bending.
    """
    check_label("cloth.name", name)
    check_scene(scene)
    check_kind(f"{name}.mesh", mesh, TriangleMesh, MESH, SceneError)
    fabric = fabric or name
    numbers = {
        "density": density,
        "warp": warp,
        "shear": shear,
        "weft": weft,
        "bending": bending,
        "bending_weft": bending_weft,
        "bending_twist": bending_twist,
        "membrane_damping": membrane_damping,
        "bend_damping": bend_damping,
        "yield_curvature": yield_curvature,
        "yield_shear": yield_shear,
        "drag_linear": drag_linear,
        "drag_quadratic": drag_quadratic,
        "poisson": poisson,
        "law": Linear() if law is None else law,
        "bending_model": bending_model,
        "yield_share": yield_share,
        "yield_shear_share": yield_shear_share,
    }
    _check_each(name, numbers)
    _check_cut(scene, name, fabric, numbers)
    _check_together(name, numbers)
    check = partial(finite, shape=mesh.vertices.shape, error=SceneError)
    shape = mesh.vertices if positions is None else check(f"{name}.positions", positions)
    free = np.ones(len(shape), dtype=bool)
    free[some_indices(f"{name}.held", held, len(shape))] = False
    speeds = None if velocity is None else check(f"{name}.velocity", velocity)

    particles = scene.add_particles(shape, 0.0, speeds)
    size = FlatSize.add(scene, mesh, name, warp_size, weft_size, None if bending is None else bending_model)
    cut = Cut(scene, mesh, name, fabric, particles, size, numbers)
    _weigh(cut)
    kept = np.flatnonzero(free[mesh.triangles].any(axis=1))
    check_count(f"{name}.stiffness_modes", stiffness_modes, 0, len(mesh.triangles))
    varying = None
    if stiffness_modes:
        varying = field_of_triangles(scene, mesh, name, f"{fabric}_warp", stiffness_modes, kept)
    add_membrane(cut, kept, varying)
    if bending is not None:
        sheet = SheetCurvature(mesh, free) if bending_model == "curvature" else Hinges(mesh, free)
        sheet.add(cut, curved)
    built = Cloth(name, mesh, particles, fabric, numbers, {"warp_size": warp_size, "weft_size": weft_size}, varying)
    scene.cloths[name] = built
    return built


def _check_each(name: str, numbers: Mapping[str, Any]) -> None:
    """Refuse numbers of a fabric that are none of what they should be."""
    if not isinstance(numbers["law"], Law):
        raise SceneError(f"{name}.law", "is not a law", numbers["law"], "give such as sb.laws.Sinh(warp, weft, shear)")
    positive = {key: value for key, value in numbers.items() if key not in NOT_POSITIVE}
    check_positive(name, {key: positive.pop(key) for key in NEEDED}, positive)
    check_yield(name, numbers["yield_curvature"], numbers["yield_share"], "the bending stiffness")
    at, share = fields = "yield_shear", "yield_shear_share"
    check_yield(name, numbers[at], numbers[share], "the shear stiffness", fields)


def _check_cut(scene: Scene, name: str, fabric: str, numbers: Mapping[str, Any]) -> None:
    """Cuts of one fabric have the same numbers."""
    for other in scene.cloths.values():
        if other.fabric == fabric and other.numbers != numbers:
            differing = [key for key, value in numbers.items() if other.numbers[key] != value]
            fix = f"give what {other.name} has, or another fabric"
            raise SceneError(
                f"{name}.{differing[0]}", f"is not that of its fabric, {fabric}", numbers[differing[0]], fix
            )


def _check_together(name: str, numbers: Mapping[str, Any]) -> None:
    """Refuse numbers of a fabric that are out of range or do not go with others."""
    poisson, model, bending = numbers["poisson"], numbers["bending_model"], numbers["bending"]
    if not (is_number(poisson) and -1 < poisson < 1):
        raise SceneError(f"{name}.poisson", "must lie between -1 and 1", poisson, "give sqrt(nu_uv nu_vu)")
    if model not in MODELS:
        raise SceneError(f"{name}.bending_model", "is unknown", model, f"use one of: {', '.join(MODELS)}")
    damping = numbers["bend_damping"]
    if damping is not None and bending is None:
        raise SceneError(f"{name}.bend_damping", "needs bending", damping, "give bending, or leave it out")
    for field in ("bending_weft", "bending_twist", "yield_curvature"):
        if numbers[field] is not None and (bending is None or model != "curvature"):
            fix = "give bending and keep bending_model = 'curvature', or leave it out"
            raise SceneError(f"{name}.{field}", "belongs to the curvature model", numbers[field], fix)
    if numbers["yield_shear"] is not None and not isinstance(numbers["law"], Linear):
        fix = "give the linear law, or leave it out"
        raise SceneError(f"{name}.yield_shear", "belongs to the linear law", numbers["yield_shear"], fix)


def _weigh(cut: Cut) -> None:
    """Masses and drag: every vertex has a third of its triangles."""
    scene, mesh = cut.scene, cut.mesh
    share = np.bincount(mesh.triangles.ravel(), np.repeat(mesh.areas / 3.0, 3), len(mesh.vertices))
    for array, label, unit in (
        ("mass", "density", "kg/m^2"),
        ("drag_linear", "drag_linear", "N s/m^3"),
        ("drag_quadratic", "drag_quadratic", "N s^2/m^4"),
    ):
        if (value := cut.numbers[label]) is not None:
            scene.has_drag |= array != "mass"
            quantity = scene.add_quantity(f"{cut.fabric}_{label}", value, unit, shared=True)
            scene.add_terms([Term(array, cut.particles, share, ((quantity, "identity"), *cut.size.power(1, 1)))])
