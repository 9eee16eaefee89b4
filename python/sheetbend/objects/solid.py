"""Solids: meshes of bricks or tetrahedra, given and fitted by Young's modulus, Poisson's ratio and damping."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import check_kind, check_label, check_positive, finite, is_list, is_number, some_indices
from ..arrays.types import Array
from ..errors import SceneError
from ..mesh import SolidMesh, TriangleMesh
from ..quantities.quantities import Term
from ..scene.given import check_scene
from ..scene.scene import Scene
from .locking import LockingWarning, locking
from .solid_clusters import SHARE, SolidClusters, volumes_of
from .solid_rows import Orthotropic, SolidRows
from .stiffness_field import StiffnessField
from .yielding import check_plastic

SolidLaw = Literal["strain", "neo_hookean"]


@dataclass(frozen=True)
class SolidSurface:
    """The surface of a solid as pictures, pressure and markers take it: triangles, and the particles of its
    vertices."""

    name: str
    mesh: TriangleMesh
    particles: Array

    @property
    def triangles(self) -> Array:
        """(m, 3) particles, counterclockwise as seen from outside, as `Scene.add_pressure` takes them."""
        found: Array = self.particles[self.mesh.triangles]
        return found


@dataclass(frozen=True)
class Solid:
    """A solid in a scene.

    Attributes:
        mesh: as given.
        particles: of its vertices.
        material: prefix of its quantities.
        numbers: of its material as given, those left out too.
        field: the modes in which its stiffness varies; None where there are none.
    """

    name: str
    mesh: SolidMesh
    particles: Array
    material: str
    numbers: Mapping[str, Any]
    field: StiffnessField | None = None

    @cached_property
    def surface(self) -> SolidSurface:
        mesh, vertices = self.mesh.surface
        return SolidSurface(self.name, mesh, self.particles[vertices])


def solid(
    mesh: SolidMesh,
    *,
    density: float,
    name: str = "solid",
    gravity: ArrayLike = (0.0, 0.0, -9.81),
    pinned: ArrayLike = (),
    **options: object,
) -> Scene:
    """Make a scene with one solid.

    Args:
        mesh: the shape at rest, m.
        density: kg/m^3.
        name: of the solid and of the scene; the prefix of its quantities.
        gravity: (3,) m/s^2.
        pinned: vertices that stay in place, such as `mesh.sets["x_min"]`; also `held`, unless that is given.
        options: those of `add_solid`.

    Raises:
        SceneError: wrong or missing values; the message names the field.
    """
    scene = Scene(name, gravity)
    check_kind("solid.mesh", mesh, SolidMesh, "give such as sb.mesh.bricks(size, cells)", SceneError)
    still = some_indices("solid.pinned", pinned, len(mesh.vertices))
    given = {"held": still, **options}
    built = add_solid(scene, mesh, name, density=density, **given)  # type: ignore[arg-type]
    if still:
        scene.pin(built.particles[still])
    return scene


def add_solid(
    scene: Scene,
    mesh: SolidMesh,
    name: str = "solid",
    *,
    material: str = "",
    density: float,
    E: ArrayLike | None = None,
    poisson: float | None = None,
    orthotropic: Orthotropic | None = None,
    clusters: Sequence[ArrayLike] | None = None,
    stiffness_modes: int = 0,
    damping: float | None = None,
    law: SolidLaw = "strain",
    volume_row: bool | None = None,
    yield_stress: float | None = None,
    hardening: float | None = None,
    held: ArrayLike = (),
    positions: ArrayLike | None = None,
    velocities: ArrayLike | None = None,
) -> Solid:
    """Add a solid to a scene. docs/solids.md has the law and its limits.

    Quantities: `<material>_density` kg/m^3, `<material>_E` Pa, `<material>_poisson`, and where given
    `<material>_damping` s, `<material>_yield_stress` Pa and `<material>_hardening` Pa.

    The energy is mu V tr E^2 at the quadrature points, in Green strain, or that of rubber, and lambda V (J - 1)^2/2
    with one mean J = V/V0 of an element. Solids need method "newton", "newton_cg" or "implicit"; "direct" and
    "gauss_seidel" take them in small numbers.

    Args:
        mesh: the shape at rest; of bricks, or of tetrahedra, which are too stiff in bending (a warning says how much).
        material: prefix of the quantities, `name` by default. Solids of one material share them and have the same
            values.
        density: kg/m^3.
        E: Young's modulus, Pa; of clusters one for all, or (clusters,), which are the quantities `<material>_E_0` and
            so on.
        poisson: Poisson's ratio, above -1 and below 0.5.
        orthotropic: a material that differs along three axes, instead of these two; it has no volume row.
        clusters: shape matching instead of elements: (k,) vertices of each cluster, such as `cluster_boxes` gives;
            clusters may share vertices. Springs pull each cluster to its shape at rest, rotated to fit best. `poisson`
            is left out.
        stiffness_modes: of clusters with one E: by how many smooth modes ln E varies from cluster to cluster. The
            quantities are `<material>_stiffness_1` and so on, the smoothest first, each the root mean square of what it
            adds to ln E; 0 at the start. `smooth` of `fit` gives them a prior.
        damping: Kelvin-Voigt time constant, s.
        law: "strain", or "neo_hookean" for rubber that is stretched or compressed by more than some tens of percent.
            Both are linear elasticity for small strains. "neo_hookean" needs a positive `poisson`.
        volume_row: one row for the volume of an element, which lets nearly incompressible bricks bend; `poisson` is
            then between 0 and 0.5. Without it the energy has lambda (tr E)^2/2 at the quadrature points instead, and
            `poisson` may be negative. By default where `poisson` is positive.
        yield_stress: Pa, the stress in tension beyond which the material keeps a deformation (von Mises), of bricks
            with law "strain" and a volume row. Methods "newton", "newton_cg", "direct" and "gauss_seidel" take it.
        hardening: Pa, H, how much the yield stress rises per plastic strain in tension; it then falls as much in
            compression (kinematic hardening). Beyond yield a bar's stress goes on with the slope E H/(E + H). Without
            it the material is perfectly plastic.
        held: vertices that will be pinned or driven: elements among them alone are left out.
        positions: (vertices, 3) m, the initial shape; that of the mesh by default.
        velocities: (vertices, 3) m/s at the start; zero by default.

    Warns:
        LockingWarning: tetrahedra, with the factor by which they are too stiff.

    Raises:
        SceneError: wrong or missing values, or others than those of a solid of the same material before.
    """
    check_label("solid.name", name)
    check_scene(scene)
    check_kind(f"{name}.mesh", mesh, SolidMesh, "give such as sb.mesh.bricks(size, cells)", SceneError)
    numbers = _checked_numbers(name, density, E, poisson, orthotropic, clusters, damping, law, volume_row)
    numbers |= check_plastic(name, yield_stress, hardening, mesh, numbers)
    _check_modes(name, stiffness_modes, clusters, E)
    material = material or name
    _check_material(scene, name, material, numbers)
    count = len(mesh.vertices)
    shape = mesh.vertices if positions is None else finite(f"{name}.positions", positions, (count, 3), SceneError)
    moving = None if velocities is None else finite(f"{name}.velocities", velocities, (count, 3), SceneError)
    free = np.ones(count, dtype=bool)
    free[some_indices(f"{name}.held", held, count)] = False
    if not free.any():
        raise SceneError(f"{name}.held", "are all vertices", count, "leave some free")
    if mesh.elements.shape[1] == 4 and clusters is None:
        _warn_locking(name, mesh, 0.3 if poisson is None else poisson, ~free)

    particles = scene.add_particles(shape, 0.0, moving)
    _weigh(scene, mesh, material, particles, density, 1.0 if clusters is None else 1.0 - SHARE)
    field = None
    if clusters is not None:
        matching = SolidClusters(scene, mesh, name, material, particles, free, clusters)
        field = matching.add(numbers["E"], stiffness_modes, damping, shape, moving)
    elif orthotropic is not None:
        SolidRows(scene, mesh, name, material, particles, free).add_orthotropic(orthotropic, damping)
    else:
        rows = SolidRows(scene, mesh, name, material, particles, free)
        rows.add(numbers["E"], numbers["poisson"], damping, law, numbers["volume_row"], yield_stress, hardening)
    built = Solid(name, mesh, particles, material, numbers, field)
    scene.solids[name] = built
    return built


def _checked_numbers(
    name: str,
    density: float,
    E: ArrayLike | None,
    poisson: float | None,
    orthotropic: Orthotropic | None,
    clusters: Sequence[ArrayLike] | None,
    damping: float | None,
    law: str,
    volume_row: bool | None,
) -> dict[str, Any]:
    """The numbers of a material, with what follows from them."""
    if law not in get_args(SolidLaw):
        raise SceneError(f"{name}.law", "is not a law of solids", law, f"use one of: {', '.join(get_args(SolidLaw))}")
    rubber = law == "neo_hookean"
    check_positive(name, {"density": density}, {"damping": damping})
    others = {"poisson": poisson, "law": law if rubber else None, "volume_row": volume_row or None}
    if clusters is not None and not is_list(clusters):
        raise SceneError(f"{name}.clusters", "must be a list", clusters, "give lists of vertices")
    if orthotropic is not None:
        fix = "give sb.Orthotropic(E, G, poisson, axes)"
        check_kind(f"{name}.orthotropic", orthotropic, Orthotropic, fix, SceneError)
        _refuse_beside(name, "orthotropic", {"E": E, "clusters": None if clusters is None else len(clusters), **others})
        return {"density": density, "orthotropic": orthotropic, "damping": damping}
    if clusters is not None:
        _refuse_beside(name, "clusters", others)
        return {"density": density, "E": _moduli(name, E, len(clusters)), "damping": damping}
    if E is None or poisson is None:
        missing = "E" if E is None else "poisson"
        raise SceneError(f"{name}.{missing}", "is missing", None, "give E and poisson, or orthotropic")
    check_positive(name, {"E": E}, {})  # type: ignore[dict-item]
    if not (is_number(poisson) and -1 < poisson < 0.5):
        fix = "give one above -1 and below 0.5; 0.499 hardly changes its volume"
        raise SceneError(f"{name}.poisson", "is not a Poisson's ratio of a stable material", poisson, fix)
    by_row = poisson > 0 if volume_row is None else bool(volume_row)
    if rubber and not by_row:
        fix = 'give a positive poisson and no volume_row, or law = "strain"'
        raise SceneError(f"{name}.law", "needs the volume row that a positive poisson has", law, fix)
    if by_row and poisson <= 0:
        fix = "give a positive one, or volume_row = False"
        raise SceneError(f"{name}.poisson", "must be positive with a volume row", poisson, fix)
    return {"density": density, "E": E, "poisson": poisson, "damping": damping, "law": law, "volume_row": by_row}


def _check_modes(name: str, modes: int, clusters: Sequence[ArrayLike] | None, E: ArrayLike | None) -> None:
    field = f"{name}.stiffness_modes"
    if isinstance(modes, bool) or not isinstance(modes, int) or modes < 0:
        raise SceneError(field, "must be a whole number", modes, "give how many smooth modes, such as 8, or 0")
    if modes and clusters is None:
        raise SceneError(field, "need clusters", modes, "give clusters, or leave stiffness_modes out")
    if modes and np.ndim(E) > 0:  # type: ignore[arg-type]
        raise SceneError(field, "need one E, from which they vary", E, "give one number, or leave stiffness_modes out")


def _refuse_beside(name: str, beside: str, given: Mapping[str, Any]) -> None:
    for field, value in given.items():
        if value is not None:
            raise SceneError(f"{name}.{field}", f"is given beside {beside}", value, "leave one of them out")


def _moduli(name: str, E: ArrayLike | None, count: int) -> float | tuple[float, ...]:
    """Young's moduli of clusters: one for all, or one for each."""
    if E is None:
        raise SceneError(f"{name}.E", "is missing", None, "give Young's modulus of the clusters")
    if count == 0:
        raise SceneError(
            f"{name}.clusters", "are none", 0, "give lists of vertices, such as sb.cluster_boxes(mesh, size)"
        )
    values = finite(f"{name}.E", E, None, SceneError)
    values = values if values.ndim == 0 else finite(f"{name}.E", values, (count,), SceneError)
    if not (values > 0).all():
        raise SceneError(f"{name}.E", "must be positive", values.tolist(), "give Pa")
    return float(values) if values.ndim == 0 else tuple(values.tolist())


def _check_material(scene: Scene, name: str, material: str, numbers: Mapping[str, Any]) -> None:
    for other in scene.solids.values():
        if other.name == name:
            raise SceneError(f"{name}.name", "is taken by another solid", name, "give each solid a name of its own")
        if other.material == material and other.numbers != numbers:
            differing = [key for key, value in numbers.items() if other.numbers.get(key) != value]
            fix = f"give what {other.name} has, or another material"
            raise SceneError(
                f"{name}.{differing[0]}", f"is not that of its material, {material}", numbers[differing[0]], fix
            )


def _warn_locking(name: str, mesh: SolidMesh, poisson: float, held: Array) -> None:
    factor = locking(mesh, poisson, held)
    stiff = "too stiff in bending" if factor is None else f"{factor:.2g} times too stiff in its slowest motion"
    said = f"'{name}' is made of linear tetrahedra, and {stiff}: a fit finds E as much too small. Use bricks"
    warnings.warn(f"{said} (sb.mesh.bricks, or a mesh of hexahedra).", LockingWarning, stacklevel=3)


def _weigh(scene: Scene, mesh: SolidMesh, material: str, particles: Array, density: float, part: float) -> None:
    """Masses of the vertices: this part of what the elements weigh."""
    share = part * volumes_of(mesh)
    scene.add_quantity(f"{material}_density", density, "kg/m^3", shared=True)
    scene.add_terms([Term("mass", particles, share, ((f"{material}_density", "identity"),))])
