"""Cloths of a scene, built from their description: mesh, placement, sets of vertices, and what holds or moves them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from .. import mesh as meshes
from ..arrays.smoothing import state_at
from ..errors import ConfigError
from ..mesh import Places, TriangleMesh
from ..mesh.places import nearest
from ..mesh.subdivide import subdivided
from ..mesh.through import through
from ..objects.cloth import Cloth, add_cloth
from ..objects.laws import COMPONENTS, Exponential, Law, Sinh, Spline
from ..objects.tool import Tool
from ..scene.scene import Scene
from . import cloth_schema as schema
from .bodies import fix_to_body
from .errors import located
from .moment import Moment
from .tools import tool_named

_ELSEWHERE = {
    *("name", "mesh", "law", "origin", "x_axis", "y_axis", "on_tool", "set", "pinned", "grip"),
    *("bar", "markers", "grid", "nearest_at", "layout", "shape", "velocity", "smoothing"),
    *("air_normal", "air_tangential", "pressure", "volume"),
}
"""Keys of a cloth that are not arguments of `add_cloth`, or not as they stand."""
_AT_PIN = 1e-6  # of the cloth's size: a marker so near to a pinned vertex sits on it
_SQUARE = 1e-6  # of the product of their lengths: how far two axes may be from perpendicular


def build_cloth(
    scene: Scene,
    path: str,
    section: schema.Cloth,
    mesh: TriangleMesh,
    seated: Mapping[str, Places],
    moment: Moment | None,
    tools: Mapping[str, Tool],
) -> Cloth:
    """Add a cloth with its pinned and driven vertices to a scene.

    Args:
        mesh: of `placed_mesh`.
        seated: by marker of the recording, its place on the mesh.
        tools: of the scene, by name.

    Raises:
        ConfigError: anything inconsistent, with the path of the key.
    """
    shape = mesh.vertices if section.shape == "placed" else _recorded(path, section, mesh, seated, moment)
    for i, chosen in enumerate(section.set):
        mesh = _with_set(f"{path}.set[{i}]", mesh, shape, chosen, moment)
    pinned = [_members(f"{path}.pinned", mesh, name) for name in section.pinned]
    gripped = [_members(f"{path}.grip[{i}].set", mesh, grip.set) for i, grip in enumerate(section.grip)]
    fields = section.model_dump(exclude=_ELSEWHERE, exclude_none=True)
    if section.velocity is not None:
        fields["velocity"] = _speeds(path, section, mesh, seated, moment, pinned)
    with located(path, section.name):
        held = np.unique(np.concatenate([np.zeros(0, dtype=int), *pinned, *gripped]))
        cloth = add_cloth(scene, mesh, section.name, law=_law(section.law), held=held, positions=shape, **fields)
        for vertices in pinned:
            scene.pin(cloth.particles[vertices])
        _press(scene, section, cloth)
    base = None if section.on_tool is None else tools[section.on_tool]
    for i, (grip, vertices) in enumerate(zip(section.grip, gripped, strict=True)):
        where, held_there = f"{path}.grip[{i}]", cloth.particles[vertices]
        if grip.body is not None:
            fix_to_body(scene, where, grip.body, held_there, f"{section.name}_{grip.set}")
        elif grip.tool is None:
            _drive(scene, where, grip, moment, held_there, shape[vertices])
        else:
            tool = tool_named(f"{where}.tool", grip.tool, tools)
            points = tool.held((shape if base is None else mesh.vertices)[vertices])
            with located(where):
                tool.drive(scene, held_there, points)
    if base is not None and section.shape == "placed":
        attached = [p for body in scene.bodies.values() for p in body.attached]
        base.frame.place(scene, np.setdiff1d(cloth.particles, attached))
    return cloth


def placed_mesh(path: str, section: schema.Cloth, folder: Path, finer: int, tools: Mapping[str, Tool]) -> TriangleMesh:
    """The mesh where the cloth is placed.

    Args:
        folder: files are relative to it.
        tools: of the scene, by name.
        finer: multiplies its cells, rings or sides; a mesh from a file is split.

    Raises:
        ConfigError: anything inconsistent, with the path of the key.
    """
    with located(f"{path}.mesh"):
        mesh = _mesh(f"{path}.mesh", section.mesh, folder, finer)
    placed = np.array(section.origin) + mesh.vertices @ _axes(path, section)
    if section.on_tool is not None:
        placed = tool_named(f"{path}.on_tool", section.on_tool, tools).placed(placed)
    return replace(mesh, vertices=placed)


def _recorded(
    path: str, section: schema.Cloth, mesh: TriangleMesh, seated: Mapping[str, Places], moment: Moment | None
) -> np.ndarray:
    """(vertices, 3) m, smoothly through the markers on a mesh at the start, and through bars that hold its sides."""
    places, order, moment = _seats(f"{path}.shape", seated, moment)
    shape = moment.shape[order]
    if np.array_equal(places.positions(mesh.vertices), mesh.vertices) and not np.isnan(shape).any():
        return shape  # a marker on every vertex
    at, to = [places.positions(mesh.vertices)], [shape]
    for i, bar in enumerate(section.bar):
        held = mesh.vertices[_members(f"{path}.bar[{i}].set", mesh, bar.set)]
        at, to = [*at, held], [*to, _on_bar(f"{path}.bar[{i}]", bar, held, moment)]
    with located(f"{path}.shape"):
        return through(mesh.vertices, np.concatenate(at), np.concatenate(to))


def _speeds(
    path: str,
    section: schema.Cloth,
    mesh: TriangleMesh,
    seated: Mapping[str, Places],
    moment: Moment | None,
    pinned: Sequence[np.ndarray],
) -> np.ndarray:
    """(vertices, 3) m/s, smoothly through the velocities of the markers at the start, and zero where it is pinned."""
    places, order, moment = _seats(f"{path}.velocity", seated, moment)
    if moment.static:
        raise ConfigError(
            f"{path}.velocity", "belongs to a motion, and the recording is static", section.velocity, "leave it out"
        )
    at = places.positions(mesh.vertices)
    _, speeds = state_at(moment.whole.times, moment.whole.positions[:, order], moment.t0, section.smoothing)
    still = np.unique(np.concatenate([np.zeros(0, dtype=int), *pinned]))
    apart = np.linalg.norm(mesh.vertices[still][:, None] - at[None], axis=2).min(axis=1)
    beside = mesh.vertices[still[apart > _AT_PIN * np.ptp(mesh.vertices, axis=0).max()]]
    with located(f"{path}.velocity"):
        found = through(mesh.vertices, np.concatenate([at, beside]), np.concatenate([speeds, np.zeros_like(beside)]))
    found[still] = 0.0
    return found


def _seats(path: str, seated: Mapping[str, Places], moment: Moment | None) -> tuple[Places, list[int], Moment]:
    """Places of the markers on a cloth, their numbers in the recording, and this."""
    if moment is None:
        raise ConfigError(path, "needs a recording", "recording", "add a [[recording]], or leave the key out")
    if not seated:
        fix = "give markers, or nearest_at"
        raise ConfigError(path, "needs markers on the cloth", "none", fix)
    number = {marker: k for k, marker in enumerate(moment.recording.markers)}
    fields = [np.concatenate([getattr(p, f) for p in seated.values()]) for f in ("triangles", "vertices", "weights")]
    return Places(*fields), [number[marker] for marker in seated], moment


def _on_bar(path: str, bar: schema.Bar, placed: np.ndarray, moment: Moment) -> np.ndarray:
    """(vertices, 3) m, the points of a bar nearest to where its vertices are placed."""
    (marker,) = _seen(f"{path}.marker", [bar.marker], moment)
    along = np.array(bar.direction) / np.linalg.norm(bar.direction)
    return np.asarray(marker + np.outer((placed - marker) @ along, along))


def _press(scene: Scene, section: schema.Cloth, cloth: Cloth) -> None:
    """Put a cloth under the pressure that is given, or under the one that keeps its volume."""
    triangles = cloth.particles[cloth.mesh.triangles]
    if section.pressure is not None:
        scene.add_pressure(triangles, section.pressure, name=section.name)
    if section.volume is not None:
        scene.add_volume(triangles, **section.volume.model_dump(), name=section.name)


def _mesh(path: str, section: schema.ClothMesh, folder: Path, finer: int) -> TriangleMesh:
    given: dict[str, Any] = section.model_dump(exclude={"kind", "margin"}, exclude_none=True)
    if section.kind == "file":
        file = folder / given.pop("file")
        if not file.is_file():
            fix = "give a file relative to the configuration's folder"
            raise ConfigError(f"{path}.file", "does not exist", str(file), fix)
        mesh = meshes.read_mesh(file, **given)
        for _ in range(finer.bit_length() - 1):
            mesh = subdivided(mesh)
        return mesh
    for count in ("nx", "ny", "rings"):
        if count in given:
            given[count] *= finer
    warp = given.pop("warp", [1.0, 0.0, 0.0])
    left, right, low, high = section.margins
    if section.margin is not None:
        given |= {"width": left + given["width"] + right, "height": low + given["height"] + high}
    if section.kind == "equilateral":
        mesh = meshes.equilateral(given["width"], given["height"], given["nx"])
    else:
        mesh = meshes.disk(**given) if section.kind == "disk" else meshes.grid(**{"pattern": "one_way", **given})
    vertices, material = mesh.vertices - [left, low, 0.0], mesh.material - [left, low]
    return replace(mesh, vertices=vertices, material=material @ _along_warp(f"{path}.warp", warp))


def _along_warp(path: str, warp: list[float]) -> np.ndarray:
    """(2, 2) that turns x and y of a flat mesh to coordinates along warp and weft."""
    x, y = warp[:2]
    size = np.hypot(x, y)
    if warp[2] != 0.0 or not size > 0:
        raise ConfigError(path, "is not a direction in the mesh's plane", warp, "give such as [1, 1, 0]")
    return np.array([[x, -y], [y, x]]) / size


def _axes(path: str, section: schema.Cloth) -> np.ndarray:
    """(3, 3) unit rows: where x, y and z of the mesh point."""
    x, y = np.array(section.x_axis), np.array(section.y_axis)
    sizes = np.linalg.norm(x), np.linalg.norm(y)
    for key, size in zip(("x_axis", "y_axis"), sizes, strict=True):
        if not size > 0:
            raise ConfigError(f"{path}.{key}", "has no length", getattr(section, key), "give a direction")
    if abs(x @ y) > _SQUARE * sizes[0] * sizes[1]:
        raise ConfigError(f"{path}.y_axis", "is not perpendicular to x_axis", section.y_axis, "turn one of them")
    x, y = x / sizes[0], y / sizes[1]
    return np.stack([x, y, np.cross(x, y)])


def _with_set(
    path: str, mesh: TriangleMesh, shape: np.ndarray, chosen: schema.VertexSet, moment: Moment | None
) -> TriangleMesh:
    if chosen.name in mesh.sets:
        fix = f"choose a name beside: {', '.join(mesh.sets)}"
        raise ConfigError(f"{path}.name", "is a set of the mesh already", chosen.name, fix)
    if chosen.markers is not None:
        vertices = nearest(shape, _seen(f"{path}.markers", chosen.markers, moment))
    elif chosen.points is not None:
        vertices = mesh.nearest(chosen.points)
    else:
        lower = [-np.inf] * 3 if chosen.lower is None else chosen.lower
        vertices = mesh.within(lower, [np.inf] * 3 if chosen.upper is None else chosen.upper)
    if not len(vertices):
        box = [mesh.vertices.min(axis=0).tolist(), mesh.vertices.max(axis=0).tolist()]
        raise ConfigError(path, "holds no vertex", chosen.name, f"choose within the cloth's own box, {box}")
    if len(np.unique(vertices)) < len(vertices):
        fix = "leave out all but one of them, or use a finer mesh"
        raise ConfigError(path, "has one vertex nearest to several", chosen.name, fix)
    if chosen.radius is not None:
        far = np.linalg.norm(mesh.vertices[:, None] - mesh.vertices[vertices], axis=2).min(axis=1)
        vertices = np.flatnonzero(far <= chosen.radius * (1 + 1e-9))
    with located(path):
        return mesh.with_set(chosen.name, vertices)


def _seen(path: str, markers: list[str | int], moment: Moment | None) -> np.ndarray:
    """(k, 3) m, where markers are at the start."""
    if moment is None:
        raise ConfigError(path, "need a recording", markers, "add a [[recording]], or give points")
    with located(path):
        shape = replace(moment, recording=moment.recording.select(markers)).shape
    lost = [m for m, x in zip(markers, shape, strict=True) if np.isnan(x).any()]
    if lost:
        raise ConfigError(path, "are not seen at the scene's start", lost, "start where they are, or give points")
    return shape


def _members(path: str, mesh: TriangleMesh, name: str) -> np.ndarray:
    if name not in mesh.sets:
        fix = f"use one of: {', '.join(mesh.sets) or 'none'}, or add a [[scene.cloth.set]]"
        raise ConfigError(path, "names no set of vertices", name, fix)
    return mesh.sets[name]


def _law(section: schema.ClothLaw | None) -> Law | None:
    if section is None:
        return None
    given: dict[str, Any] = {c: getattr(section, c) for c in COMPONENTS if getattr(section, c) is not None}
    if section.kind != "spline":
        return (Exponential if section.kind == "exponential" else Sinh)(**given)
    assert section.spacing is not None  # the schema's check
    u, v, shear = section.spacing
    return Spline((u, v, shear), **{c: tuple(ratios) for c, ratios in given.items()})


def _drive(
    scene: Scene, path: str, grip: schema.Grip, moment: Moment | None, particles: np.ndarray, placed: np.ndarray
) -> None:
    """Let particles, placed at (k, 3) m, follow the line through a grip's markers."""
    assert grip.markers is not None  # the schema's check
    line = _seen(f"{path}.markers", grip.markers, moment)
    assert moment is not None  # `_seen` needed it
    if moment.static:
        fix = "use [[scene.drive]], which puts particles on their markers"
        raise ConfigError(path, "has no motion to follow in a recording at rest", grip.set, fix)
    weights = np.array([_along(line, point) for point in placed])
    with located(path):
        times, motion, names = moment.followed(grip.markers)
        scene.follow(particles, times, motion, names, weights, placed, grip.interpolation)


def _along(line: np.ndarray, point: np.ndarray) -> np.ndarray:
    """(markers,) weights of the place of a line through markers (markers, 3) that is nearest to a point; the line goes
    on beyond its ends."""
    weights = np.zeros(len(line))
    if len(line) == 1:
        weights[0] = 1.0
        return weights
    step = np.diff(line, axis=0)
    share = np.einsum("kx,kx->k", point - line[:-1], step) / np.maximum((step**2).sum(axis=1), np.finfo(float).tiny)
    low, high = np.zeros(len(step)), np.ones(len(step))
    low[0], high[-1] = -np.inf, np.inf
    share = np.clip(share, low, high)
    k = int(((line[:-1] + share[:, None] * step - point) ** 2).sum(axis=1).argmin())
    weights[k : k + 2] = 1.0 - share[k], share[k]
    return weights
