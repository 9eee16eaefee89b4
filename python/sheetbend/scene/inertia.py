"""Mass, center of mass and inertia of rigid bodies: simple shapes, closed meshes, and bodies welded together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import check_kind, finite, is_number
from ..arrays.rotations import rotation_matrix
from ..arrays.types import Array
from ..errors import SceneError
from ..mesh.topology import half_edges
from ..mesh.triangle_mesh import TriangleMesh

SLACK = 1e-9  # relative, by which a body may be flatter than flat from rounding


@dataclass(frozen=True, eq=False)
class Inertia:
    """Mass, center of mass and moments of inertia of a rigid body.

    Attributes:
        mass: kg.
        center: (3,) m, the center of mass in the body's frame.
        matrix: (3, 3) kg m^2, the inertia about the center of mass, along the frame's axes. Three numbers are taken for
            a diagonal. Its products of inertia are -integral rho x y dV off the diagonal.

    Raises:
        SceneError: shapes, NaN, a mass that is not positive, a matrix that is not symmetric, or an inertia that no body
            of positive thickness has: each principal moment must be smaller than the sum of the other two.
    """

    mass: float
    center: Array
    matrix: Array

    def __init__(self, mass: float, matrix: ArrayLike, center: ArrayLike = (0.0, 0.0, 0.0)) -> None:
        _check_mass(mass)
        m = finite("inertia", matrix, None, SceneError)
        m = np.diag(m) if m.shape == (3,) else m
        if m.shape != (3, 3) or abs(m - m.T).max() > SLACK * abs(m).max():
            fix = "give three principal moments, or a symmetric matrix (3, 3)"
            raise SceneError("inertia", "is not a symmetric matrix", m.tolist(), fix)
        moments = np.linalg.eigvalsh(m)
        if not moments.sum() - 2.0 * moments[2] > SLACK * moments[2]:
            problem = f"is that of no body: {moments[2]:g} is not less than {moments[0]:g} + {moments[1]:g}"
            fix = "give moments about the center of mass, and a flat or thin body some thickness"
            raise SceneError("inertia", problem, moments.tolist(), fix)
        object.__setattr__(self, "mass", float(mass))
        object.__setattr__(self, "center", finite("inertia.center", center, (3,), SceneError))
        object.__setattr__(self, "matrix", (m + m.T) / 2.0)

    @classmethod
    def box(cls, mass: float, sides: ArrayLike) -> Inertia:
        """A homogeneous box of sides (3,) m about its middle."""
        _check_mass(mass)
        a = _lengths("inertia.sides", sides, 3)
        return cls(mass, mass / 12.0 * ((a**2).sum() - a**2))

    @classmethod
    def ball(cls, mass: float, radius: float) -> Inertia:
        """A homogeneous ball about its middle."""
        _check_mass(mass)
        (r,) = _lengths("inertia.radius", [radius], 1)
        return cls(mass, np.full(3, 0.4 * mass * r**2))

    @classmethod
    def cylinder(cls, mass: float, radius: float, length: float) -> Inertia:
        """A homogeneous cylinder along x about its middle."""
        _check_mass(mass)
        r, h = _lengths("inertia.radius, length", [radius, length], 2)
        across = mass * (3.0 * r**2 + h**2) / 12.0
        return cls(mass, [0.5 * mass * r**2, across, across])

    @classmethod
    def of_mesh(cls, mesh: TriangleMesh, density: float) -> Inertia:
        """A homogeneous body inside a closed mesh; density in kg/m^3.

        The integrals are sums over tetrahedra between each triangle and one point, exact for polyhedra.

        Raises:
            SceneError: the mesh is open or inside out, or the density is not positive.
        """
        check_kind("inertia.mesh", mesh, TriangleMesh, "give a closed mesh, such as sb.read_mesh(path)", SceneError)
        if not (is_number(density) and density > 0):
            raise SceneError("inertia.density", "must be positive", density, "give kg/m^3")
        check_closed("inertia.mesh", mesh.triangles)
        origin = mesh.vertices.mean(axis=0)  # keeps the digits of what is far from zero
        x = (mesh.vertices - origin)[mesh.triangles]
        six = np.linalg.det(x)  # times the volume of each tetrahedron
        volume = float(six.sum() / 6.0)
        if not volume > 0:
            fix = "list corners counterclockwise as seen from outside"
            raise SceneError("inertia.mesh", "is inside out, it encloses a negative volume", volume, fix)
        total = x.sum(axis=1)
        first = six @ total / 24.0
        second = (np.einsum("t,tka,tkb->ab", six, x, x) + np.einsum("t,ta,tb->ab", six, total, total)) / 120.0
        center = first / volume
        spread = density * (second - volume * np.outer(center, center))
        return cls(density * volume, np.trace(spread) * np.eye(3) - spread, origin + center)

    @classmethod
    def welded(cls, parts: Sequence[Inertia]) -> Inertia:
        """Bodies whose frames coincide (`moved` puts them there), as one.

        Raises:
            SceneError: no part, or what is no Inertia.
        """
        if not isinstance(parts, Sequence) or not parts or not all(isinstance(p, Inertia) for p in parts):
            raise SceneError("inertia.parts", "are not bodies", parts, "give a list of one or more sb.Inertia")
        mass = sum(p.mass for p in parts)
        center = np.sum([p.mass * p.center for p in parts], axis=0) / mass
        return cls(mass, np.sum([p.about(center) for p in parts], axis=0), center)

    def about(self, point: ArrayLike) -> Array:
        """(3, 3) kg m^2, the inertia about a point (3,) m of the frame (Steiner)."""
        d = finite("inertia.point", point, (3,), SceneError) - self.center
        return np.asarray(self.matrix + self.mass * ((d @ d) * np.eye(3) - np.outer(d, d)))

    def moved(self, at: ArrayLike = (0.0, 0.0, 0.0), rotation: ArrayLike | None = None) -> Inertia:
        """The same body, its frame placed at (3,) m of another frame and turned in it: a matrix (3, 3), a quaternion
        (x, y, z, w) or a rotation vector (3,) rad."""
        turn = rotation_matrix("inertia.rotation", rotation)
        place = finite("inertia.at", at, (3,), SceneError)
        return Inertia(self.mass, turn @ self.matrix @ turn.T, place + turn @ self.center)

    def principal(self) -> tuple[Array, Array]:
        """Principal moments (3,) kg m^2 and the right-handed axes (3, 3), as columns. A diagonal matrix keeps its
        order."""
        if not (self.matrix - np.diag(np.diag(self.matrix))).any():
            return np.diag(self.matrix).copy(), np.eye(3)
        moments, axes = np.linalg.eigh(self.matrix)
        return moments, axes * np.array([1.0, 1.0, np.sign(np.linalg.det(axes))])


def _check_mass(mass: object) -> None:
    if not (is_number(mass) and mass > 0):  # type: ignore[operator]
        raise SceneError("inertia.mass", "must be positive", mass, "give kg")


def _lengths(field: str, values: ArrayLike, count: int) -> Array:
    a = finite(field, values, (count,), SceneError)
    if not (a > 0).all():
        raise SceneError(field, "must be positive", a.tolist(), "give m")
    return a


def check_closed(field: str, triangles: Array) -> None:
    """Every edge lies between two triangles, which go along it in opposite directions."""
    edges = half_edges(triangles)
    size = triangles.max() + 1
    there, back = edges @ [size, 1], edges @ [1, size]
    known, at, times = np.unique(there, return_inverse=True, return_counts=True)
    bad = (times[at] > 1) | ~np.isin(back, known)
    if bad.any():
        fix = "let every edge be between two triangles that are both counterclockwise as seen from outside"
        raise SceneError(field, "are not a closed surface at the edge", edges[int(np.argmax(bad))].tolist(), fix)
