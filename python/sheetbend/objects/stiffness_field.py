"""A stiffness that varies smoothly from place to place, as the logarithm of a mean one and smooth modes.

Places are the clusters of a solid, the triangles of a cloth or the joints of a rope (`along_rope`). ln E of place c is
ln E + sum_k shapes[c, k] q_k, with one quantity q_k for each mode. The modes are eigenvectors of the Laplace operator,
that of the graph of clusters or in finite elements on the mesh of a cloth: the first bends least from place to place,
the next more. Their eigenvalues are squared wave numbers (1/m^2), so a prior of a given length is one of independent
modes, whose deviations fall as 1/(1 + length^2 eigenvalue): a field of Matern's class (Whittle 1954, Biometrika 41;
Lindgren, Rue & Lindstrom 2011, J. R. Stat. Soc. B 73).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays.types import Array
from ..errors import SceneError
from ..mesh import TriangleMesh
from ..scene.scene import Scene

FLAT = 1e-6  # of the longest extent: along shorter ones neighbors do not differ
SCALE = 0.3  # of a mode of ln E: what it may well be
MOST = 4000  # triangles, whose modes take a matrix of their number squared


@dataclass(frozen=True, eq=False)
class StiffnessField:
    """The modes of a field.

    Attributes:
        stiffness: name of the mean stiffness.
        modes: names of the quantities of the modes, smoothest first.
        eigenvalues: (places,) 1/m^2, ascending, of all modes; the first is that of the constant.
        shapes: (places, modes), of mean square 1: a quantity is the root mean square of what it adds to ln E.
        centers: (places, 3) m, at rest; along a rope its arc length, 0 and 0.
        finer: (places, others) likewise, of the modes that have no quantity.
        unit: of the stiffness.
        place: what one place is called.
        rms: root mean square of the shapes where it is not 1.
    """

    stiffness: str
    modes: tuple[str, ...]
    eigenvalues: Array
    shapes: Array
    centers: Array
    finer: Array
    unit: str = "Pa"
    place: str = "cluster"
    rms: float = 1.0

    @property
    def name(self) -> str:
        """`<material>_stiffness`."""
        return self.modes[0].removesuffix("_1")

    @property
    def scale(self) -> float:
        """An order of magnitude of its deviations, in ln E."""
        return 1.0

    @property
    def extent(self) -> float:
        """Of the centers, m."""
        return float(np.linalg.norm(np.ptp(self.centers, axis=0)))

    def deviations(self, size: float, length: float) -> Array:
        """(modes,) standard deviations of the prior of a field with a root mean square `size` of ln E about its mean
        and a length of correlation, m."""
        return self._of_all(size, length)[: len(self.modes)]

    def left_out(self, size: float, length: float) -> Array:
        """(places,) variance of ln E that the prior expects of the modes that have no quantity."""
        return np.asarray(np.sum((self.finer * self._of_all(size, length)[len(self.modes) :]) ** 2, axis=1))

    def _of_all(self, size: float, length: float) -> Array:
        return np.asarray(size / self.rms * shares(self.eigenvalues[1:], length))


def shares(eigenvalues: Array, length: float) -> Array:
    """(modes,) deviations of a prior with a length of correlation, m, and a root mean square of 1 in all."""
    falls = 1.0 / (1.0 + length**2 * eigenvalues)
    return np.asarray(falls / np.sqrt(np.sum(falls**2)))


def field_of_modes(
    scene: Scene,
    name: str,
    stiffness: str,
    modes: int,
    values: Array,
    shapes: Array,
    centers: Array,
    unit: str = "Pa",
    place: str = "cluster",
) -> StiffnessField:
    """The field of the first modes behind the constant, with the quantities `<name>_stiffness_1` and so on.

    Args:
        values, shapes: of `modes_of`.
    """
    names = tuple(
        scene.add_quantity(f"{name}_stiffness_{k}", 0.0, "", positive=False, scale=SCALE) for k in range(1, modes + 1)
    )
    own, finer = shapes[:, 1 : modes + 1], shapes[:, modes + 1 :]
    return StiffnessField(stiffness, names, values, own, centers, finer, unit, place)


def field_of_triangles(
    scene: Scene, mesh: TriangleMesh, name: str, stiffness: str, modes: int, kept: NDArray[np.intp]
) -> StiffnessField:
    """Over the triangles of a cloth that can move.

    Raises:
        SceneError: too many modes or triangles.
    """
    where = f"{name}.stiffness_modes"
    if isinstance(modes, bool) or not isinstance(modes, int) or modes < 1:
        raise SceneError(where, "must be a whole number", modes, "give how many smooth modes, such as 20")
    if len(kept) > MOST:
        raise SceneError(where, f"are for cloths of up to {MOST} triangles", len(kept), "give a coarser mesh")
    values, shapes = modes_of_triangles(mesh.corners[kept], mesh.triangles[kept])
    if modes >= len(values):
        most = f"give at most {len(values) - 1}, one fewer than vertices of triangles that can move"
        raise SceneError(where, "are more than the mesh has", modes, most)
    centers = mesh.vertices[mesh.triangles[kept]].mean(axis=1)
    return field_of_modes(scene, name, stiffness, modes, values, shapes, centers, "N/m", "triangle")


def modes_of_triangles(corners: Array, triangles: NDArray[np.intp]) -> tuple[Array, Array]:
    """Eigenvalues (n,) 1/m^2 of the Laplace operator with free edges in linear finite elements, and its eigenvectors
    (triangles, n) as means over the triangles. Before that their mean square over the area is 1.

    Args:
        corners: (triangles, 3, 2) m, flat.
        triangles: (triangles, 3) vertices.
    """
    _, places, laplacian, area = laplacian_of_triangles(corners, triangles)
    values, shapes = modes_of_laplacian(laplacian, area, float(area.sum()))
    return values, signed(shapes)[places].mean(axis=1)


def modes_of_laplacian(laplacian: Array, sizes: Array, whole: float) -> tuple[Array, Array]:
    """Eigenvalues (n,) 1/m^2 and eigenvectors (n, n) of a Laplace operator on vertices of these sizes (n,), whose mean
    square over the whole is 1."""
    values, vectors = np.linalg.eigh(laplacian / np.sqrt(np.outer(sizes, sizes)))
    return np.maximum(values, 0.0), np.asarray(vectors / np.sqrt(sizes / whole)[:, None])


def laplacian_of_triangles(
    corners: Array, triangles: NDArray[np.intp]
) -> tuple[NDArray[np.intp], NDArray[np.intp], Array, Array]:
    """The Laplace operator in linear finite elements on some vertices: their numbers (n,), where the corners of each
    triangle are among them (triangles, 3), the matrix (n, n), and the area (n,) m^2 of each.

    Args:
        corners: (triangles, 3, 2) m, flat.
        triangles: (triangles, 3) vertices.
    """
    known, places = np.unique(triangles, return_inverse=True)
    n, places = len(known), places.reshape(triangles.shape)
    opposite = np.roll(corners, -2, axis=1) - np.roll(corners, -1, axis=1)
    twice = np.abs(opposite[:, 0, 0] * opposite[:, 1, 1] - opposite[:, 0, 1] * opposite[:, 1, 0])
    weights = np.einsum("tia,tja->tij", opposite, opposite) / (2.0 * twice)[:, None, None]
    laplacian = np.zeros((n, n))
    np.add.at(laplacian, (places[:, :, None], places[:, None, :]), weights)
    area = np.asarray(np.bincount(places.ravel(), np.repeat(twice / 6.0, 3), n), dtype=float)
    return known, np.asarray(places), np.asarray(laplacian), area


def modes_of(centers: Array, neighbors: NDArray[np.intp]) -> tuple[Array, Array]:
    """Eigenvalues (n,) 1/m^2 and eigenvectors (n, n) of mean square 1, smoothest first, of a graph.

    A link weighs the inverse square of its length, times one factor for all that makes eigenvalues of smooth modes
    those of the Laplace operator where links go evenly in all directions.

    Args:
        centers: (n, 3) m.
        neighbors: (links, 2), each once.
    """
    n = len(centers)
    squared = np.sum((centers[neighbors[:, 0]] - centers[neighbors[:, 1]]) ** 2, axis=1)
    extents = np.linalg.svd(centers - centers.mean(axis=0), compute_uv=False)
    directions = int(np.sum(extents > FLAT * max(float(extents.max(initial=0.0)), 1e-300)))
    weight = directions * n / max(len(neighbors), 1) / squared
    laplacian = np.zeros((n, n))
    np.add.at(laplacian, (neighbors[:, 0], neighbors[:, 1]), -weight)
    laplacian += laplacian.T
    laplacian -= np.diag(laplacian.sum(axis=1))
    values, vectors = np.linalg.eigh(laplacian)
    return np.maximum(values, 0.0), signed(vectors) * np.sqrt(n)


def signed(vectors: Array) -> Array:
    """With the largest entry of each column positive."""
    strongest = vectors[np.argmax(np.abs(vectors), axis=0), np.arange(vectors.shape[1])]
    return np.asarray(vectors * np.sign(strongest))
