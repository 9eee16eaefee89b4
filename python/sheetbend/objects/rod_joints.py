"""The joints of a rod: bending with or without yield, twist, and what they are at rest."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..arrays.types import Array
from ..errors import SceneError
from ..quantities.quantities import Term
from ..scene.scene import Scene
from .along_rope import mode_quantities
from .chain import voronoi_shares

Factors = tuple[tuple[str, str], ...]
Exponents = tuple[tuple[str, Array], ...]
_INVERSE = {"identity": "inverse", "inverse": "identity"}


class Joints:
    """Adds a rod's joints to a scene, group by group; alpha = Voronoi length / stiffness.

    Args:
        stencils: (joints, 5) three points and two directors; or (joints, 4) two normals and two directors of sections
            that shear.
        place: (joints,) node numbers along the rod; a gripped end is a joint that counts the rod's own half link.
    """

    def __init__(self, scene: Scene, name: str, stencils: Array, place: Array, segments: int) -> None:
        self._scene, self._name, self._stencils = scene, name, stencils
        self._sections = stencils.shape[1] == 4
        self._share, self._s = voronoi_shares(segments)[place], place / segments
        self._length = f"{name}_length"
        self._ratio: Factors = ()
        self._sets: Array | None = None

    def bend(
        self,
        EI: float,
        EI2: float | None,
        damping: float | None,
        yield_curvature: float | None,
        yield_share: float | None,
        softness_modes: Sequence[int],
    ) -> None:
        """Material curvatures; with a set per joint where they yield. Compliance length/EI exp(sum of modes): each mode
        starts at zero, and no value of one makes a stiffness negative."""
        scene, name = self._scene, self._name
        scene.add_quantity(f"{name}_EI", EI, "N m^2")
        softness = mode_quantities(scene, name, "softness", softness_modes, self._s)
        stencils, kind = self._stencils, "section_curvature" if self._sections else "material_curvature"
        if yield_curvature is not None:
            self._sets = scene.add_hidden(np.zeros((len(stencils), 3)), 1.0, pinned=True)
            kind = "section_yielding_curvature" if self._sections else "yielding_curvature"
            stencils = np.column_stack([stencils, self._sets])
        own = None
        if yield_curvature is not None and yield_share is not None:
            own = np.tile([yield_share, yield_curvature, 0.0, 0.0], (len(stencils), 1))
        self._group("bend", kind, f"{name}_EI", stencils, damping, tuple(softness), own)
        bend = scene.places_of_group(f"{name}_bend")
        places, rest = bend.rest, bend.group.rest
        if EI2 is not None:
            scene.add_quantity(f"{name}_EI2", EI2, "N m^2")
            self._ratio = ((f"{name}_EI2", "sqrt"), (f"{name}_EI", "inverse_sqrt"))
            rest[:, 0] = 0.0
            scene.add_terms([Term("rest", places[:, 0], 1.0, self._ratio)])
        if yield_curvature is not None and yield_share is not None:
            scene.add_quantity(f"{name}_yield_share", yield_share, "")
            scene.add_quantity(f"{name}_yield_curvature", yield_curvature, "1/m")
            rest[:, 1:3] = 0.0
            scene.add_terms(
                [
                    Term("rest", places[:, 1], 1.0, ((f"{name}_yield_share", "identity"),)),
                    Term(
                        "rest",
                        places[:, 2],
                        self._share,
                        ((f"{name}_yield_curvature", "identity"), (self._length, "identity")),
                    ),
                ]
            )

    def twist(self, damping: float | None) -> None:
        """Twist between neighboring edges; the quantity GJ is there already."""
        kind = "section_twist" if self._sections else "twist"
        self._group("twist", kind, f"{self._name}_GJ", self._stencils, damping, ())

    def rest(self, curvature_modes: Sequence[int], twist_modes: Sequence[int]) -> None:
        """Rest curvature and twist in modes cos(k pi s/length)."""
        bend, twist = (self._scene.places_of_group(f"{self._name}_{label}").rest for label in ("bend", "twist"))
        targets: list[tuple[str, Sequence[int], Array, Factors]] = [
            ("curvature_1", curvature_modes, bend[:, -2], ()),
            ("curvature_2", curvature_modes, bend[:, -1], self._ratio),
            ("twist", twist_modes, twist[:, 0], ()),
        ]
        for label, modes, index, factors in targets:
            for mode, weights in mode_quantities(self._scene, self._name, label, modes, self._s, "1/m"):
                own: Factors = ((mode, "identity"), (self._length, "identity"), *factors)
                self._scene.add_terms([Term("rest", index, self._share * weights, own)])

    def slid(self, modes: Sequence[int]) -> None:
        """The curvature by which joints have slid at the start, in modes cos(k pi s/length)."""
        if self._sets is None:
            if len(modes):
                fix = "give yield_curvature and yield_share, or leave them out"
                raise SceneError(f"{self._name}.slid_modes", "need a rod that yields", modes, fix)
            return
        for axis in (0, 1):
            label, factors = f"slid_{axis + 1}", self._ratio if axis else ()
            for mode, weights in mode_quantities(self._scene, self._name, label, modes, self._s, "1/m"):
                own: Factors = ((mode, "identity"), (self._length, "identity"), *factors)
                self._scene.add_terms([Term("position", 3 * self._sets + axis, self._share * weights, own)])

    def _group(
        self,
        label: str,
        kind: str,
        stiffness: str,
        stencils: Array,
        damping: float | None,
        softness: Exponents,
        rest: Array | None = None,
    ) -> None:
        group, compliance = f"{self._name}_{label}", (self._share, (self._length, "identity"))
        _add_elastic(self._scene, group, kind, stencils, compliance, stiffness, damping, softness, rest)


def shear(scene: Scene, name: str, stencils: Array, GA: float, damping: float | None) -> None:
    """Let the sections of a rod's links lean against them; alpha = 1 / (GA link).

    Args:
        stencils: (links, 4) the two ends, the section's normal and its director.
    """
    scene.add_quantity(f"{name}_GA", GA, "N")
    compliance = float(len(stencils)), (f"{name}_length", "inverse")
    _add_elastic(scene, f"{name}_shear", "shear", stencils, compliance, f"{name}_GA", damping)


def _add_elastic(
    scene: Scene,
    group: str,
    kind: str,
    stencils: Array,
    compliance: tuple[Array | float, tuple[str, str]],
    stiffness: str,
    damping: float | None,
    softness: Exponents = (),
    rest: Array | None = None,
) -> None:
    """Add constraints of compliance coefficient length^(+-1) / stiffness exp(softness), damped by a Kelvin-Voigt time
    constant.

    Args:
        compliance: the coefficient, and the quantity of the length with its function.
        stiffness: its quantity.
        damping: s, of the new quantity `<group>_damping`; None = undamped.
        softness: quantities and their weights in each constraint.
        rest: as in `Scene.add_constraints`.
    """
    coefficient, (length, power) = compliance
    zero = np.zeros(len(stencils))
    damped = None if damping is None else zero
    scene.add_constraints(kind, stencils, name=group, compliance=zero, damping=damped, rest=rest)
    first = scene.places_of_group(group).constraints
    scene.add_terms([Term("compliance", first, coefficient, ((length, power), (stiffness, "inverse")), softness)])
    if damping is not None:
        tau = scene.add_quantity(f"{group}_damping", damping, "s")
        factors: Factors = ((tau, "identity"), (stiffness, "identity"), (length, _INVERSE[power]))
        scene.add_terms([Term("damping", first, 1.0 / coefficient, factors)])


def weigh(scene: Scene, name: str, nodes: Array, segments: int, modes: Sequence[int]) -> None:
    """Density (1 + sum of modes), each mode starting at zero; the whole weight stays."""
    share, s = voronoi_shares(segments), np.arange(segments + 1) / segments
    for mode, weights in mode_quantities(scene, name, "density", modes, s):
        factors: Factors = ((mode, "identity"), (f"{name}_density", "identity"), (f"{name}_length", "identity"))
        for part in (slice(None, -1), slice(-1, None)):  # a ring's last node is its first
            scene.add_terms([Term("mass", nodes[part], (share * weights)[part], factors)])
