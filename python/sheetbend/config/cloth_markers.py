"""Places of a recording's markers on cloths."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..cloth import Cloth
from ..errors import ConfigError
from ..markers import Place, on_cloth, on_mesh
from ..recording import Recording
from ..scene import Scene
from . import cloth_schema as schema
from .errors import located


def places_on_cloths(sections: Sequence[schema.Cloth], scene: Scene, recording: Recording) -> dict[str, Place]:
    """By marker, what the keys `markers` and `nearest_at` of the scene's cloths say.

    With `nearest_at` of several cloths a marker sits on the nearest one; those that move a grip sit on none.

    Raises:
        ConfigError: an unknown marker, a place outside of the fabric, or no frame at `nearest_at`.
    """
    given: dict[str, Place] = {}
    nearest: dict[str, tuple[float, Place]] = {}
    moving = {m if isinstance(m, str) else recording.markers[m] for s in sections for g in s.grip for m in g.markers}
    for i, section in enumerate(sections):
        if section.name not in scene.cloths:  # left out of this recording
            continue
        path, cloth = f"scene.cloth[{i}]", scene.cloths[section.name]
        for name, at in section.markers.items():
            if name not in recording.markers:
                fix = f"name some of: {', '.join(recording.markers)}"
                raise ConfigError(f"{path}.markers.{name}", "is no marker of the recording", recording.name, fix)
            with located(f"{path}.markers.{name}"):
                (given[name],) = on_cloth(cloth, [at])
        if section.nearest_at is not None:
            for name, found in _nearest(f"{path}.nearest_at", section.nearest_at, cloth, recording).items():
                nearest[name] = min(nearest.get(name, found), found, key=lambda pair: pair[0])
    return {name: place for name, (_, place) in nearest.items() if name not in moving} | given


def _nearest(path: str, time: float, cloth: Cloth, recording: Recording) -> dict[str, tuple[float, Place]]:
    """Distance [m] and place of every marker that is seen in the frame nearest to a time."""
    first, last = recording.times[[0, -1]]
    if not first <= time <= last:
        problem = f"lies outside of the recording '{recording.name}'"
        raise ConfigError(path, problem, time, f"give a time from {first:g} to {last:g} s")
    x = recording.positions[np.abs(recording.times - time).argmin()]
    seen = np.flatnonzero(np.isfinite(x).all(axis=1))
    places = cloth.mesh.project(x[seen])
    distances = np.linalg.norm(places.positions(cloth.mesh.vertices) - x[seen], axis=1)
    found = zip(seen, distances.tolist(), on_mesh(cloth, places), strict=True)
    return {recording.markers[k]: (distance, place) for k, distance, place in found}
