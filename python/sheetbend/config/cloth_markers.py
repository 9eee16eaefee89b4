"""Places of a recording's markers on cloths."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..errors import ConfigError, RecordingError
from ..mesh import Places, TriangleMesh
from ..objects.markers import Place, on_mesh
from ..recording.recording import Recording
from ..recording.recording_checks import marker_indices
from ..scene.scene import Scene
from . import cloth_schema as schema
from .errors import located

Seat = tuple[str, Places]
"""A cloth's name, and a place of its mesh."""


def places_on_cloths(sections: Sequence[schema.Cloth], scene: Scene, recording: Recording) -> dict[str, Place]:
    """By marker, what the keys `markers`, `grid`, `nearest_at` and `layout` of the scene's cloths say.

    Raises:
        ConfigError: as `seats`.
    """
    meshes = {name: cloth.mesh for name, cloth in scene.cloths.items()}
    seated = seats(sections, meshes, recording)
    return {marker: on_mesh(scene.cloths[cloth], place)[0] for marker, (cloth, place) in seated.items()}


def seats(
    sections: Sequence[schema.Cloth], meshes: Mapping[str, TriangleMesh], recording: Recording
) -> dict[str, Seat]:
    """By marker, the cloth that it sits on and where.

    With `nearest_at` of several cloths a marker sits on the nearest one; those that move a grip sit on none.

    Args:
        meshes: by name of the cloth, as placed; cloths without one are left out of this recording.

    Raises:
        ConfigError: an unknown marker, a place outside of the fabric, no frame at `nearest_at`, or a place of a layout
            that no marker takes.
    """
    given: dict[str, Seat] = {}
    nearest: dict[str, tuple[float, Seat]] = {}
    by_number = dict(enumerate(recording.markers))  # numbers that are none are refused where the grip is made
    moving = {
        m if isinstance(m, str) else by_number.get(m, "") for s in sections for g in s.grip for m in g.markers or ()
    }
    for i, section in enumerate(sections):
        if section.name not in meshes:
            continue
        path, mesh = f"scene.cloth[{i}]", meshes[section.name]
        named: Mapping[str, list[float]] = {}
        if isinstance(section.markers, str):
            own = _on_vertices(mesh, recording)
            given |= {name: (section.name, place) for name, place in own.items()}
        else:
            named = section.markers
        for name, at in named.items():
            if name not in recording.markers:
                fix = f"name some of: {', '.join(recording.markers)}"
                raise ConfigError(f"{path}.markers.{name}", "is not a marker of the recording", recording.name, fix)
            with located(f"{path}.markers.{name}"):
                given[name] = section.name, mesh.at([at])
        if section.grid is not None:
            on_grid = _on_grid(f"{path}.grid", section.grid, mesh, recording, moving | set(given))
            given |= {name: (section.name, place) for name, place in on_grid.items()}
        if section.nearest_at is None:
            continue
        names, x = _seen(f"{path}.nearest_at", section.nearest_at, recording, moving | set(given))
        if section.layout is not None:
            for name, place in _laid_out(f"{path}.layout", section.layout, mesh, names, x):
                given[name] = section.name, place
            continue
        places = mesh.project(x)
        distances = np.linalg.norm(places.positions(mesh.vertices) - x, axis=1)
        for k, name in enumerate(names):
            found = (float(distances[k]), (section.name, _one(places, k)))
            nearest[name] = min(nearest.get(name, found), found, key=lambda pair: pair[0])
    return {name: seat for name, (_, seat) in nearest.items() if name not in moving} | given


def _on_grid(
    path: str, grid: schema.MarkerGrid, mesh: TriangleMesh, recording: Recording, others: set[str]
) -> dict[str, Places]:
    """Each place of a grid with its marker; by default those of the recording that have no place yet."""
    left = [name for name in recording.markers if name not in others]
    if grid.markers is not None:
        try:
            left = [recording.markers[k] for k in marker_indices("markers", grid.markers, recording.markers)]
        except RecordingError as error:
            raise ConfigError(f"{path}.markers", error.problem, error.got, error.fix) from error
    at = grid.places()
    if len(left) != len(at):
        problem = f"has {len(at)} places, and the recording '{recording.name}' other free markers"
        raise ConfigError(f"{path}.counts", problem, len(left), "name the markers of the grid, in its order")
    with located(path):
        places = mesh.at(at)
    return {name: _one(places, k) for k, name in enumerate(left)}


def _on_vertices(mesh: TriangleMesh, recording: Recording) -> dict[str, Places]:
    """Markers v0, v1, ... on the vertices of these numbers."""
    _, first = np.unique(mesh.triangles, return_index=True)
    places = Places(first // 3, mesh.triangles[first // 3], np.eye(3)[first % 3])
    known = set(recording.markers)
    return {m: _one(places, k) for k in range(len(first)) if (m := f"v{k}") in known}


def _seen(path: str, time: float, recording: Recording, but: set[str]) -> tuple[list[str], np.ndarray]:
    """Names and positions (k, 3) m of the markers that are seen in the frame nearest to a time, some left out."""
    first, last = recording.times[[0, -1]]
    if not first <= time <= last:
        problem = f"lies outside of the recording '{recording.name}'"
        raise ConfigError(path, problem, time, f"give a time from {first:g} to {last:g} s")
    x = recording.positions[np.abs(recording.times - time).argmin()]
    kept = [k for k, name in enumerate(recording.markers) if np.isfinite(x[k]).all() and name not in but]
    if not kept:
        raise ConfigError(path, "is a time at which no marker is seen", time, "choose another")
    return [recording.markers[k] for k in kept], x[kept]


def _laid_out(
    path: str, layout: list[list[float]], mesh: TriangleMesh, names: list[str], x: np.ndarray
) -> list[tuple[str, Places]]:
    """Each place of a layout with its marker: the nearest one, which has no other place nearer."""
    with located(path):
        places = mesh.at(layout)
    apart = np.linalg.norm(places.positions(mesh.vertices)[:, None] - x, axis=2)
    takes, taken_by = apart.argmin(axis=1), apart.argmin(axis=0)
    empty = [layout[k] for k in range(len(layout)) if taken_by[takes[k]] != k]
    if empty:
        problem = f"has {len(empty)} places that no marker is nearest to"
        fix = "place the cloth as it lies at nearest_at, choose a time at which all are seen, or leave these out"
        raise ConfigError(path, problem, empty[:4], fix)
    return [(names[marker], _one(places, k)) for k, marker in enumerate(takes)]


def _one(places: Places, k: int) -> Places:
    return Places(places.triangles[k : k + 1], places.vertices[k : k + 1], places.weights[k : k + 1])
