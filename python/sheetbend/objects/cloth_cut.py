"""A cut of a fabric in a scene, as the parts of a cloth (masses, membrane, bending) are added to it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from ..mesh import TriangleMesh
from ..scene.scene import Array, Scene
from .flat_size import FlatSize
from .laws import Law


@dataclass(frozen=True)
class Cut:
    """One cut of a fabric in a scene: where the terms of a cloth's parts go.

    Attributes:
        name: prefix of its groups and of what is the cut's alone.
        fabric: prefix of the quantities that all cuts of the fabric share.
        particles: (vertices,) of the mesh's vertices.
        size: of the flat cloth relative to the mesh.
    """

    scene: Scene
    mesh: TriangleMesh
    name: str
    fabric: str
    particles: Array
    size: FlatSize


class Stretching(NamedTuple):
    """How a cloth stretches and shears in its plane, as `add_cloth` was given it.

    Attributes:
        warp, weft, shear: stiffness, N/m; weft = warp where it is None.
        poisson: sqrt(nu_uv nu_vu).
        law: how tension grows with strain.
        damping: Kelvin-Voigt time constant, s; None = undamped.
        slides: the shear strain at which it yields, and the share of the shear stiffness that slides; None = elastic.
    """

    warp: float
    weft: float | None
    shear: float
    poisson: float
    law: Law
    damping: float | None
    slides: tuple[float, float] | None


class Bending(NamedTuple):
    """How a cloth bends, as `add_cloth` was given it.

    Attributes:
        rigidity: N m, along the warp and, where nothing else is given, in all directions.
        model: "curvature", "dihedral" or "isometric_bending".
        weft, twist: N m, of the curvature model; None = `rigidity`.
        curved: whether the mesh's vertices are the shape at rest; otherwise that is flat.
        damping: Kelvin-Voigt time constant, s; None = undamped.
        yields: the yield curvature, 1/m, and the share of the stiffness that slides; None = elastic.
    """

    rigidity: float
    model: str
    weft: float | None
    twist: float | None
    curved: bool
    damping: float | None
    yields: tuple[float, float] | None

    @property
    def of_curvature(self) -> bool:
        """Whether the curvature of triangles bends, and not their hinges."""
        return self.model == "curvature"
