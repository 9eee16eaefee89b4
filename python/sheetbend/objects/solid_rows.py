"""The constraints of solids: strains at the quadrature points, and volumes of the elements."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import finite
from ..arrays.types import Array
from ..errors import SceneError
from ..mesh import SolidMesh
from ..quantities.quantities import Term
from ..scene.scene import Scene

STRAIN = {8: "brick_strain", 4: "tetrahedron_strain"}
YIELDING = "yielding_brick_strain"
RUBBER = {8: "brick_neo_hookean", 4: "tetrahedron_neo_hookean"}
VOLUME = {8: "brick_volume", 4: "tetrahedron_volume"}
PAIRS = ("23", "13", "12")
WORLD = np.eye(3)
USUAL = np.array([0.0, 0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 2.0])
"""Couplings and ratios of stiffness of what stands beside a volume row."""


@dataclass(frozen=True, eq=False)
class Orthotropic:
    """A material that differs along three axes: wood, a printed lattice, a fiber's direction in silicone.

    Quantities: `<material>_E_1`, `_E_2`, `_E_3` and `_G_23`, `_G_13`, `_G_12` Pa, and the couplings
    `<material>_poisson_12`, `_13`, `_23`.

    Attributes:
        E: (3,) Pa, Young's moduli along the axes.
        G: (3,) Pa, shear moduli between axes 2 and 3, 1 and 3, 1 and 2.
        poisson: (3,) the couplings sqrt(nu_ij nu_ji) of axes 1 and 2, 1 and 3, 2 and 3: pulled along axis i the
            material narrows along axis j by nu_ij = coupling sqrt(E_i/E_j) times its strain.
        axes: (3, 3) whose columns are the material's axes in the shape at rest, perpendicular and of length 1; the
            world's by default. Or (elements, 3, 3).

    Raises:
        SceneError: numbers of no stable material, axes that are not perpendicular.
    """

    E: tuple[float, float, float]
    G: tuple[float, float, float]
    poisson: tuple[float, float, float] = (0.0, 0.0, 0.0)
    axes: ArrayLike = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))

    def __post_init__(self) -> None:
        for field in ("E", "G", "poisson"):
            values = finite(f"orthotropic.{field}", getattr(self, field), (3,), SceneError)
            if field != "poisson" and not (values > 0).all():
                raise SceneError(f"orthotropic.{field}", "must be positive", values.tolist(), "give moduli in Pa")
            object.__setattr__(self, field, tuple(values.tolist()))
        n12, n13, n23 = self.poisson
        coupled = np.array([[1.0, -n12, -n13], [-n12, 1.0, -n23], [-n13, -n23, 1.0]])
        if not np.linalg.eigvalsh(coupled)[0] > 0:
            fix = "give smaller couplings; an isotropic material has three times its Poisson's ratio, below 0.5"
            raise SceneError("orthotropic.poisson", "are of no stable material", list(self.poisson), fix)
        axes = finite("orthotropic.axes", self.axes, None, SceneError)
        if axes.shape[-2:] != (3, 3) or axes.ndim > 3:
            raise SceneError("orthotropic.axes", "have the wrong shape", axes.shape, "give (3, 3) or (elements, 3, 3)")
        if not np.allclose(np.swapaxes(axes, -1, -2) @ axes, np.eye(3), atol=1e-9):
            fix = "give columns of length 1 that are perpendicular"
            raise SceneError("orthotropic.axes", "are not perpendicular unit vectors", axes.tolist(), fix)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Orthotropic) and all(
            np.array_equal(np.asarray(getattr(self, f)), np.asarray(getattr(other, f)))
            for f in ("E", "G", "poisson", "axes")
        )


class SolidRows:
    """Adds the constraints of a solid to a scene; `free` says which vertices (n,) can move."""

    def __init__(self, scene: Scene, mesh: SolidMesh, name: str, material: str, particles: Array, free: Array) -> None:
        self.scene, self.name, self.material = scene, name, material
        self.kept = np.flatnonzero(free[mesh.elements].any(axis=1))
        self.nodes = particles[mesh.elements[self.kept]]
        self.mesh = mesh
        self.E, self.nu, self.tau = (f"{material}_{label}" for label in ("E", "poisson", "damping"))

    def add(
        self,
        E: float,
        poisson: float,
        damping: float | None,
        law: str,
        by_row: bool,
        yield_stress: float | None = None,
        hardening: float | None = None,
    ) -> None:
        """An isotropic material, its volume in a row of its own or in the strains; with a row it may yield."""
        limits = (0.0, 0.5) if by_row else (-1.0, 0.5)
        self.scene.add_quantity(self.E, E, "Pa", shared=True)
        self.scene.add_quantity(self.nu, poisson, "", positive=False, scale=0.1, limits=limits, shared=True)
        if damping is not None:
            self.scene.add_quantity(self.tau, damping, "s", shared=True)
        if by_row:
            self._beside_volume(damping is not None, law, yield_stress, hardening)
        else:
            self._alone(damping is not None)

    def add_orthotropic(self, law: Orthotropic, damping: float | None) -> None:
        """A material that differs along three axes."""
        moduli = {f"{self.E}_{k + 1}": E for k, E in enumerate(law.E)}
        shears = {f"{self.material}_G_{pair}": G for pair, G in zip(PAIRS, law.G, strict=True)}
        for name, value in (moduli | shears).items():
            self.scene.add_quantity(name, value, "Pa", shared=True)
        if damping is not None:
            self.scene.add_quantity(self.tau, damping, "s", shared=True)
        axes = np.asarray(law.axes, dtype=float)
        if axes.ndim == 3:
            if len(axes) != len(self.mesh.elements):
                fix = f"give ({len(self.mesh.elements)}, 3, 3)"
                raise SceneError("orthotropic.axes", "are not those of the elements", axes.shape, fix)
            axes = axes[self.kept][:, None]
        at, volume, values = self._strains(damping is not None, axes)
        self.scene.groups[-1].rest[:, -len(USUAL) :] = 0.0  # the terms make all of them
        first, *others = moduli
        terms = [Term("compliance", at, 1.0 / volume, ((first, "inverse"),))]
        if damping is not None:
            terms.append(Term("damping", at, volume, ((self.tau, "identity"), (first, "identity"))))
        own = values[:, -len(USUAL) :]
        for k, (pair, n) in enumerate(zip(("12", "13", "23"), law.poisson, strict=True)):
            name = self.scene.add_quantity(
                f"{self.nu}_{pair}", n, "", positive=False, scale=0.1, limits=(-1.0, 1.0), shared=True
            )
            terms.append(Term("rest", own[:, k], 1.0, ((name, "identity"),)))
        for k, name in enumerate([*others, *shears], start=3):
            terms.append(Term("rest", own[:, k], 1.0, ((first, "identity"), (name, "inverse"))))
        self.scene.add_terms(terms)

    def _strains(self, damped: bool, axes: Array = WORLD) -> tuple[Array, Array, Array]:
        """Adds the strains along axes, columns (3, 3) or (m, 1, 3, 3), with zero compliance; returns their constraints,
        volumes and parameters."""
        at, volume = self._points(STRAIN, damped, axes, USUAL)
        return at, volume, self.scene.places_of_group(f"{self.name}_strain").rest

    def _yielding(self, damped: bool, stress: float, hardening: float | None) -> tuple[Array, Array]:
        """Adds the strains of what yields, with its quantities and zero compliance; returns them and their volumes.
        Their last parameters are H/(3 mu) and s sqrt(2/3)/(2 mu), with 2 mu = E/(1 + nu) (yielding_solid_strain.h)."""
        at, volume = self._points({8: YIELDING}, damped, WORLD, np.array([0.0, 1.0]), sets=2)
        strains = self.scene.places_of_group(f"{self.name}_strain")
        values = strains.rest
        strains.group.rest[:, -2:] = 0.0  # the terms make them
        made = [(values[:, -1], "yield_stress", stress, np.sqrt(2.0 / 3.0))]
        if hardening is not None:
            made.append((values[:, -2], "hardening", hardening, 2.0 / 3.0))
        E, nu = (self.E, "inverse"), (self.nu, "identity")
        for places, label, value, factor in made:
            own = (self.scene.add_quantity(f"{self.material}_{label}", value, "Pa", shared=True), "identity")
            self.scene.add_terms([Term("rest", places, factor, (own, E)), Term("rest", places, factor, (own, E, nu))])
        return at, volume

    def _points(
        self, kinds: Mapping[int, str], damped: bool, axes: Array, more: Array, sets: int = 0
    ) -> tuple[Array, Array]:
        """Adds a constraint at every quadrature point, with the gradients along axes, more parameters and so many
        nodes for its set; returns them and their volumes."""
        gradients, volumes, _ = (part[self.kept] for part in self.mesh.points)
        gradients = gradients @ axes
        count, points, nodes, _ = gradients.shape
        rest = gradients[:, :, 1:].reshape(count * points, 3 * (nodes - 1))
        stencils = np.repeat(self.nodes, points, axis=0)
        if sets:
            hidden = self.scene.add_hidden(np.zeros((sets * len(rest), 3)), 1.0, pinned=True)
            stencils = np.hstack([stencils, hidden.reshape(-1, sets)])
        at = self._group(
            kinds[nodes],
            f"{self.name}_strain",
            stencils,
            damped,
            np.hstack([rest, np.broadcast_to(more, (len(rest), len(more)))]),
        )
        return at, volumes.ravel()

    def _group(self, kind: str, name: str, stencils: Array, damped: bool, rest: Array) -> Array:
        none = np.zeros(len(stencils))
        self.scene.add_constraints(
            kind, stencils, name=name, compliance=none, damping=none if damped else None, rest=rest
        )
        return self.scene.places_of_group(name).constraints

    def _beside_volume(self, damped: bool, law: str, stress: float | None, hardening: float | None) -> None:
        """mu V tr E^2 + lambda V (J - 1)^2/2, 2 mu = E/(1 + nu) and lambda = E nu/((1 + nu) (1 - 2 nu)); of rubber
        mu V (|F|^2 - 4 J + J^2)/2 beside the same volume row."""
        if law == "neo_hookean":
            at, volume = self._points(RUBBER, damped, WORLD, USUAL[:0])
            volume = volume / 2.0
        elif stress is not None:
            at, volume = self._yielding(damped, stress, hardening)
        else:
            at, volume, _ = self._strains(damped)
        E, nu, tau = (self.E, "inverse"), (self.nu, "identity"), (self.tau, "identity")
        terms = [Term("compliance", at, 1.0 / volume, (E,)), Term("compliance", at, 1.0 / volume, (E, nu))]
        stiff = ((self.tau, "identity"), (self.E, "identity"))
        if damped:
            terms.append(Term("damping", at, volume, (*stiff, (self.nu, "over_one_plus"))))
        fill = np.asarray(self.mesh.fill)[self.kept]
        rest = self.mesh.volumes[self.kept] / fill
        kind, name = VOLUME[self.mesh.elements.shape[1]], f"{self.name}_volume"
        at = self._group(kind, name, self.nodes, damped, rest)
        whole = rest / fill
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
        own, nu = values[:, -len(USUAL) :], (self.nu, "identity")
        terms += [Term("rest", own[:, k], 1.0, (nu,)) for k in range(3)]
        terms += [Term("rest", own[:, k], 2.0, (nu,)) for k in range(5, 8)]
        self.scene.add_terms(terms)
