"""Whether a pin of a cloth stands elsewhere than told: of its pinned vertices the two that are farthest apart."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from ..arrays.types import Array
from ..objects.cloth import Cloth
from ..problem.problem import FitProblem
from ..quantities.wording import short
from ..scene.scene import Scene
from .tangents import Part
from .told import Told, of_parts


def pinned_ends(problem: FitProblem, u: Array, i: int) -> list[Told]:
    """Directions of the places of single pins in the i-th experiment; none where its motion has no answer at u (free,).
    Takes one set of tangents."""
    e = problem.experiments[i]
    return of_parts(problem, u, i, list(_places(e.scene)), problem.corrections(u).get(e.name))


def _places(scene: Scene) -> Iterator[Part]:
    for name, cloth in scene.cloths.items():
        for vertex in _ends(cloth, np.isin(cloth.particles, sorted(scene.pinned))):
            for axis, way in enumerate("xyz"):
                at = np.array([3 * int(cloth.particles[vertex]) + axis])
                yield f"pin {vertex} of {name} along {way}", ("position", at, np.ones(1)), _says(name, vertex, way)


def _ends(cloth: Cloth, pinned: NDArray[np.bool_]) -> list[int]:
    """Of two pinned vertices and more, the two that are farthest apart on the cloth."""
    vertices = np.flatnonzero(pinned)
    if len(vertices) < 2:
        return []
    x = cloth.mesh.vertices[vertices]
    first = int(np.argmax(np.linalg.norm(x - x.mean(axis=0), axis=1)))
    other = int(np.argmax(np.linalg.norm(x - x[first], axis=1)))
    return [int(vertices[k]) for k in sorted((first, other))]


def _says(name: str, vertex: int, way: str) -> Callable[[float], str]:
    def says(size: float) -> str:
        along = f"{'' if size > 0 else '-'}{way}"
        return f"{name} were held {short(1e3 * abs(size), 2)} mm farther along {along} at vertex {vertex}"

    return says
