"""Solids: meshes of bricks or tetrahedra, given and fitted by Young's modulus, Poisson's number and damping."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import check_positive, finite, indices, is_number
from ..errors import SceneError
from ..mesh import SolidMesh, TriangleMesh
from ..quantities.quantities import Term
from ..scene.scene import Array, Scene
from .chain import first_value
from .locking import LockingWarning, locking

STRAIN = {8: "brick_strain", 4: "tetrahedron_strain"}
VOLUME = {8: "brick_volume", 4: "tetrahedron_volume"}


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
    """

    name: str
    mesh: SolidMesh
    particles: Array
    material: str
    numbers: Mapping[str, Any]

    @cached_property
    def surface(self) -> SolidSurface:
        mesh, vertices = self.mesh.surface
        return SolidSurface(self.name, mesh, self.particles[vertices])


def solid(
    mesh: SolidMesh,
    *,
    density: float,
    E: float,
    poisson: float,
    name: str = "solid",
    gravity: ArrayLike = (0.0, 0.0, -9.81),
    pinned: ArrayLike = (),
    **options: object,
) -> Scene:
    """A scene with one solid; see `add_solid` for the options. `pinned` holds vertices, such as `mesh.sets["x_min"]`;
    they are its `held` ones where no others are given."""
    scene = Scene(name, gravity)
    still = indices("solid.pinned", pinned, len(mesh.vertices)) if np.size(pinned) else []
    given = {"held": still, **options}
    built = add_solid(scene, mesh, name, density=density, E=E, poisson=poisson, **given)  # type: ignore[arg-type]
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
    E: float,
    poisson: float,
    damping: float | None = None,
    volume_row: bool | None = None,
    held: ArrayLike = (),
    positions: ArrayLike | None = None,
    velocities: ArrayLike | None = None,
) -> Solid:
    """Add a solid of an isotropic material to a scene. docs/solids.md has the law and its limits.

    Quantities: `<material>_density` kg/m^3, `<material>_E` Pa, `<material>_poisson`, and where given
    `<material>_damping` s.

    The energy is mu V tr E^2 at the quadrature points, in Green strain, and lambda V (J - 1)^2/2 with one mean J = V/V0
    of an element. Solids need method "newton", "newton_cg" or "implicit"; "direct" and "gauss_seidel" take them in
    small numbers.

    Args:
        mesh: the shape at rest; of bricks, or of tetrahedra, which are too stiff in bending (a warning says how much).
        material: prefix of the quantities, `name` by default. Solids of one material share them and have the same
            values.
        density: kg/m^3.
        E: Young's modulus, Pa.
        poisson: Poisson's number, above -1 and below 0.5.
        damping: Kelvin-Voigt time constant, s.
        volume_row: one row for the volume of an element, which lets nearly incompressible bricks bend; `poisson` is
            then between 0 and 0.5. Without it the energy has lambda (tr E)^2/2 at the quadrature points instead, and
            `poisson` may be negative. By default where `poisson` is positive.
        held: vertices that will be pinned or driven: elements among them alone are left out.
        positions: (vertices, 3) m, the initial shape; that of the mesh by default.
        velocities: (vertices, 3) m/s at the start; zero by default.

    Warns:
        LockingWarning: tetrahedra, with the factor by which they are too stiff.

    Raises:
        SceneError: wrong or missing values, or others than those of a solid of the same material before.
    """
    check_positive(name, {"density": density, "E": E}, {"damping": damping})
    if not (is_number(poisson) and -1 < poisson < 0.5):
        fix = "give one above -1 and below 0.5; 0.499 hardly changes its volume"
        raise SceneError(f"{name}.poisson", "is no Poisson's number of a stable material", poisson, fix)
    by_row = poisson > 0 if volume_row is None else bool(volume_row)
    if by_row and poisson <= 0:
        fix = "give a positive one, or volume_row = False"
        raise SceneError(f"{name}.poisson", "must be positive with a volume row", poisson, fix)
    material = material or name
    numbers = {"density": density, "E": E, "poisson": poisson, "damping": damping, "volume_row": by_row}
    _check_material(scene, name, material, numbers)
    count = len(mesh.vertices)
    shape = mesh.vertices if positions is None else finite(f"{name}.positions", positions, (count, 3), SceneError)
    moving = None if velocities is None else finite(f"{name}.velocities", velocities, (count, 3), SceneError)
    free = np.ones(count, dtype=bool)
    if np.size(held):
        free[indices(f"{name}.held", held, count)] = False
    if not free.any():
        raise SceneError(f"{name}.held", "are all vertices", count, "leave some free")
    if mesh.elements.shape[1] == 4:
        _warn_locking(name, mesh, poisson, ~free)

    particles = scene.add_particles(shape, 0.0, moving)
    _weigh(scene, mesh, material, particles, density)
    _Rows(scene, mesh, name, material, particles, free).add(E, poisson, damping, by_row)
    built = Solid(name, mesh, particles, material, numbers)
    scene.solids[name] = built
    return built


def _check_material(scene: Scene, name: str, material: str, numbers: Mapping[str, Any]) -> None:
    for other in scene.solids.values():
        if other.name == name:
            raise SceneError(f"{name}.name", "is taken by another solid", name, "give each solid a name of its own")
        if other.material == material and other.numbers != numbers:
            differing = [key for key, value in numbers.items() if other.numbers[key] != value]
            fix = f"give what {other.name} has, or another material"
            raise SceneError(
                f"{name}.{differing[0]}", f"is not that of its material, {material}", numbers[differing[0]], fix
            )


def _warn_locking(name: str, mesh: SolidMesh, poisson: float, held: Array) -> None:
    factor = locking(mesh, poisson, held)
    stiff = "too stiff in bending" if factor is None else f"{factor:.2g} times too stiff in its slowest motion"
    said = f"'{name}' is made of linear tetrahedra, and {stiff}: a fit finds E as much too small. Use bricks"
    warnings.warn(f"{said} (sb.mesh.bricks, or a mesh of hexahedra).", LockingWarning, stacklevel=3)


def _weigh(scene: Scene, mesh: SolidMesh, material: str, particles: Array, density: float) -> None:
    """Masses: each node has its share of the elements around it."""
    share = np.bincount(mesh.elements.ravel(), mesh.points[2].ravel(), len(mesh.vertices))
    scene.add_quantity(f"{material}_density", density, "kg/m^3", shared=True)
    scene.add_terms([Term("mass", particles, share, ((f"{material}_density", "identity"),))])


class _Rows:
    """Adds the constraints of a solid: strains at the quadrature points, and volumes of the elements."""

    def __init__(self, scene: Scene, mesh: SolidMesh, name: str, material: str, particles: Array, free: Array) -> None:
        self.scene, self.name = scene, name
        self.kept = np.flatnonzero(free[mesh.elements].any(axis=1))
        self.nodes = particles[mesh.elements[self.kept]]
        self.mesh = mesh
        self.E, self.nu, self.tau = (f"{material}_{label}" for label in ("E", "poisson", "damping"))

    def add(self, E: float, poisson: float, damping: float | None, by_row: bool) -> None:
        limits = (0.0, 0.5) if by_row else (-1.0, 0.5)
        self.scene.add_quantity(self.E, E, "Pa", shared=True)
        self.scene.add_quantity(self.nu, poisson, "", positive=False, scale=0.1, limits=limits, shared=True)
        if damping is not None:
            self.scene.add_quantity(self.tau, damping, "s", shared=True)
        if by_row:
            self._beside_volume(damping is not None)
        else:
            self._alone(damping is not None)

    def _strains(self, damped: bool) -> tuple[Array, Array, Array]:
        """Adds the strains with zero compliance; returns their constraints, volumes and first own parameters."""
        gradients, volumes, _ = (part[self.kept] for part in self.mesh.points)
        count, points, nodes, _ = gradients.shape
        usual = np.array([0.0, 0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 2.0])
        rest = gradients[:, :, 1:].reshape(count * points, 3 * (nodes - 1))
        at = self._group(
            STRAIN[nodes],
            f"{self.name}_strain",
            np.repeat(self.nodes, points, axis=0),
            damped,
            np.hstack([rest, np.broadcast_to(usual, (len(rest), len(usual)))]),
        )
        width = 3 * (nodes - 1) + len(usual)
        return at, volumes.ravel(), first_value(self.scene, f"{self.name}_strain") + width * np.arange(len(rest))

    def _group(self, kind: str, name: str, stencils: Array, damped: bool, rest: Array) -> Array:
        none = np.zeros(len(stencils))
        self.scene.add_constraints(
            kind, stencils, name=name, compliance=none, damping=none if damped else None, rest=rest
        )
        first: int = self.scene.group(name)[1]
        return first + np.arange(len(stencils))

    def _beside_volume(self, damped: bool) -> None:
        """mu V tr E^2 + lambda V (J - 1)^2/2, 2 mu = E/(1 + nu) and lambda = E nu/((1 + nu) (1 - 2 nu))."""
        at, volume, _ = self._strains(damped)
        E, nu, tau = (self.E, "inverse"), (self.nu, "identity"), (self.tau, "identity")
        terms = [Term("compliance", at, 1.0 / volume, (E,)), Term("compliance", at, 1.0 / volume, (E, nu))]
        stiff = ((self.tau, "identity"), (self.E, "identity"))
        if damped:
            terms.append(Term("damping", at, volume, (*stiff, (self.nu, "over_one_plus"))))
        whole = self.mesh.volumes[self.kept]
        kind, name = VOLUME[self.mesh.elements.shape[1]], f"{self.name}_volume"
        at = self._group(kind, name, self.nodes, damped, whole)
        terms += [
            Term("compliance", at, whole, (E, (self.nu, "inverse"))),
            Term("compliance", at, -whole, (E,)),
            Term("compliance", at, -2.0 * whole, (E, nu)),
        ]
        if damped:
            third = 1.0 / (3.0 * whole)
            terms.append(Term("damping", at, third, (tau, (self.E, "identity"), (self.nu, "over_one_minus_twice"))))
            terms.append(Term("damping", at, -third, (*stiff, (self.nu, "over_one_plus"))))
        self.scene.add_terms(terms)

    def _alone(self, damped: bool) -> None:
        """mu V tr E^2 + lambda V (tr E)^2/2 in the strains' own couplings."""
        at, volume, values = self._strains(damped)
        terms = [Term("compliance", at, 1.0 / volume, ((self.E, "inverse"),))]
        if damped:
            terms.append(Term("damping", at, volume, ((self.tau, "identity"), (self.E, "identity"))))
        first = 3 * (self.mesh.elements.shape[1] - 1)
        nu = (self.nu, "identity")
        terms += [Term("rest", values + first + k, 1.0, (nu,)) for k in range(3)]
        terms += [Term("rest", values + first + k, 2.0, (nu,)) for k in range(5, 8)]
        self.scene.add_terms(terms)
