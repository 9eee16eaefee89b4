"""Whether a cloth is larger than its mesh says, along warp or weft, or its yarns run in another direction.

A size that is fitted is not asked for. Masses, areas, and what a cloth's membrane and its bending take as the flat
shape all follow from the material coordinates, so that the cloth made again from slightly longer coordinates tells
what a larger size changes. Of a cloth that begins flat there are two such errors. Either its start is longer too, and
what is pinned stands that much farther apart, or the start is as it was told, and the cloth in it is slack.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial

import numpy as np

from ..arrays.types import Array
from ..errors import SceneError, SheetbendError
from ..mesh import TriangleMesh
from ..objects.cloth import Cloth, add_cloth
from ..problem.problem import FitProblem
from ..quantities.wording import short
from ..scene.group import OF_CONSTRAINTS, places_of_groups
from ..scene.scene import Scene
from .tangents import Input, tangents
from .told import Told
from .told_inputs import DEGREE

STEP = 1e-4  # of the size, and rad, to either side
FARTHEST = 0.3  # rad: first order tells no larger angle
FLAT = 1e-6  # of the size: how far a start that is flat may be from it
AXES = ("warp", "weft")
PARTICLES = ("mass", "drag_linear", "drag_quadratic")


def cloth_sizes(problem: FitProblem, u: Array, i: int) -> list[Told]:
    """Directions of the sizes of the cloths of the i-th experiment, relative, and of their grain, rad; none where its
    motion has no answer at u (free,), or where the scene holds its cloths in another way than it was told. Takes one
    set of tangents."""
    e = problem.experiments[i]
    theta, slots, _ = problem.known(u)
    values = dict(zip(e.scene.quantities, theta[slots[i]].tolist(), strict=True))
    added: dict[str, list[Input]] = {}
    free = {problem.parameters.roots[name][0] for name in problem.parameters.free}
    directions: list[tuple[str, Callable[[float], str], list[str]]] = []
    for name, cloth in e.scene.cloths.items():
        made, starts = list[str](), list[str]()
        for axis, along in enumerate(AXES):
            if f"{name}_{along}_size" in free:
                continue
            label = f"size of {name} along the {along}"
            each = {
                label: _changed(e.scene, cloth, values, partial(_longer, axis=axis)),
                f"{label}: start": list(_longer_start(e.scene, cloth, axis)),
            }
            of, start = ({key: inputs} if inputs else {} for key, inputs in each.items())
            added |= of | start
            directions += _directions_of_size(name, label, f" along the {along}", [*of], [*start])
            made, starts = [*made, *of], [*starts, *start]
        directions += _directions_of_size(name, f"size of {name}", "", made, starts)
        if turned := _changed(e.scene, cloth, values, _turned):
            label = f"grain of {name}"
            added[label] = turned
            directions.append((label, _turns(name), [label]))
    if not directions:
        return []
    try:
        corrected = problem.corrections(u).get(e.name)
        columns = dict(zip(added, tangents(problem, u, i, added, corrected=corrected).T, strict=True))
    except SheetbendError:
        return []
    return [
        Told(i, "", label, "", (0.0, ""), np.sum([columns[part] for part in parts], axis=0), missing=says, signed=True)
        for label, says, parts in directions
    ]


def _directions_of_size(
    name: str, label: str, along: str, made: list[str], starts: list[str]
) -> Iterator[tuple[str, Callable[[float], str], list[str]]]:
    """Label, words and inputs of a size, in a start as it was told, and with that."""
    if made:
        yield label, _says(name, along, "in a start as it was told"), made
    if made and starts:
        yield f"{label}, start", _says(name, along, "and its start and the places of its pins with it"), made + starts


def _longer(material: Array, size: float, axis: int) -> Array:
    """Material coordinates that are longer along an axis, relative."""
    return material * np.where(np.arange(2) == axis, 1.0 + size, 1.0)


def _turned(material: Array, angle: float) -> Array:
    """Material coordinates of a cloth whose yarns are turned away from its weft."""
    c, s = np.cos(angle), np.sin(angle)
    return material @ np.array([[c, s], [-s, c]])


def _changed(
    scene: Scene, cloth: Cloth, values: Mapping[str, float], change: Callable[[Array, float], Array]
) -> list[Input]:
    """What a change of its material coordinates adds to input arrays, per unit of the change."""
    held = {*scene.pinned, *scene.boundary.driven}
    for still in ((), tuple(np.flatnonzero([int(p) in held for p in cloth.particles]).tolist())):
        try:
            ends = [_alone(cloth, change(cloth.mesh.material, side * STEP), still) for side in (-1.0, 1.0)]
        except SceneError:
            continue
        known = {g.name: g.particles for g in scene.groups}
        if all(_are_same(known.get(g.name), g.particles, cloth) for g in ends[0].groups):
            return list(_differences(scene, cloth, ends, values))
    return []


def _are_same(known: Array | None, alone: Array, cloth: Cloth) -> bool:
    """Whether stencils in the scene are those of the cloth alone. What yields has a hidden node at the end of its
    stencil, which each scene numbers by itself, below zero."""
    if known is None or known.shape != alone.shape:
        return False
    vertices = alone >= 0
    return np.array_equal(known[vertices], cloth.particles[alone[vertices]])


def _alone(cloth: Cloth, material: Array, still: tuple[int, ...]) -> Scene:
    """A scene of the cloth alone, made again with other material coordinates."""
    mesh, scene = cloth.mesh, Scene("cloth")
    other = TriangleMesh(mesh.vertices, mesh.triangles, material, dict(mesh.sets))
    add_cloth(scene, other, cloth.name, fabric=cloth.fabric, held=still, **cloth.numbers, **cloth.sizes)
    return scene


def _differences(scene: Scene, cloth: Cloth, ends: list[Scene], values: Mapping[str, float]) -> Iterator[Input]:
    at: Array = np.array([values[name] for name in ends[0].quantities])
    low, high = (end.compiled.inputs(at) for end in ends)
    slope = (high - low) / (2.0 * STEP)
    for array in (*OF_CONSTRAINTS, *PARTICLES):
        by = ends[0].compiled.part(slope, array)
        if not by.any():
            continue
        if array in PARTICLES:
            yield array, cloth.particles.astype(int), by[: len(cloth.particles)]
            continue
        entries = np.zeros(len(by), dtype=int)
        for own in places_of_groups(ends[0].groups):
            entries[own.of(array)] = scene.places_of_group(own.group.name).of(array)
        yield array, entries, by


def _longer_start(scene: Scene, cloth: Cloth, axis: int) -> Iterator[Input]:
    """What a larger size adds to a start that is flat, around what is pinned; nothing where it is not, or is driven."""
    mesh = cloth.mesh
    if mesh.material.ndim != 2 or set(scene.boundary.driven) & set(cloth.particles.tolist()):
        return
    x = scene.positions[cloth.particles]
    flat = np.column_stack([mesh.material, np.ones(len(x))])
    map_ = np.linalg.lstsq(flat, x, rcond=None)[0]
    if np.abs(flat @ map_ - x).max() > FLAT * np.ptp(mesh.material):
        return
    pinned = np.isin(cloth.particles, sorted(scene.pinned))
    from_there = mesh.material[:, axis] - (mesh.material[pinned] if pinned.any() else mesh.material)[:, axis].mean()
    entries = (3 * cloth.particles.astype(int)[:, None] + np.arange(3)).ravel()
    yield "position", entries, np.outer(from_there, map_[axis]).ravel()


def _says(name: str, along: str, how: str) -> Callable[[float], str]:
    return lambda size: (
        f"{name} were {short(100 * abs(size), 2)} % {'larger' if size > 0 else 'smaller'}{along} than its mesh, {how}"
    )


def _turns(name: str) -> Callable[[float], str]:
    def says(angle: float) -> str:
        if abs(angle) > FARTHEST:
            return f"the yarns of {name} ran in other directions than its mesh has them"
        way = "away from" if angle > 0 else "toward"
        return f"the warp of {name} ran {short(abs(angle) / DEGREE, 2)} degrees {way} the weft of its mesh"

    return says
