"""A stiffness that varies smoothly from cluster to cluster, as the logarithm of a mean one and smooth modes.

ln E of cluster c is ln E + sum_k shapes[c, k] q_k, with one quantity q_k for each mode. The modes are eigenvectors of
the graph Laplacian of the clusters: the first bends least from neighbor to neighbor, the next more. Their eigenvalues
are squared wave numbers (1/m^2), so a prior of a given length is one of independent modes, whose deviations fall as
1/(1 + length^2 eigenvalue): a field of Matern's class (Whittle 1954, Biometrika 41; Lindgren, Rue & Lindstrom 2011,
J. R. Stat. Soc. B 73).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
FLAT = 1e-6  # of the longest extent: along shorter ones neighbors do not differ


@dataclass(frozen=True, eq=False)
class StiffnessField:
    """The modes of a field.

    Attributes:
        stiffness: name of the mean stiffness.
        modes: names of the quantities of the modes, smoothest first.
        eigenvalues: (clusters,) 1/m^2, ascending, of all modes; the first is that of the constant.
        shapes: (clusters, modes), of mean square 1: a quantity is the root mean square of what it adds to ln E.
        centers: (clusters, 3) m, at rest.
    """

    stiffness: str
    modes: tuple[str, ...]
    eigenvalues: Array
    shapes: Array
    centers: Array

    @property
    def name(self) -> str:
        """`<material>_stiffness`."""
        return self.modes[0].removesuffix("_1")

    @property
    def extent(self) -> float:
        """Of the centers, m."""
        return float(np.linalg.norm(np.ptp(self.centers, axis=0)))

    def deviations(self, size: float, length: float) -> Array:
        """(modes,) standard deviations of the prior of a field with a root mean square `size` of ln E about its mean
        and a length of correlation, m."""
        falls = 1.0 / (1.0 + length**2 * self.eigenvalues[1:])
        return np.asarray(size * (falls / np.sqrt(np.sum(falls**2)))[: len(self.modes)])


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
    strongest = vectors[np.argmax(np.abs(vectors), axis=0), np.arange(n)]
    return np.maximum(values, 0.0), vectors * np.sign(strongest) * np.sqrt(n)
