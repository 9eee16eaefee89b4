"""A frozen scene in one file: topology, inputs and the map from quantities. docs/scene_file.md describes the bytes.

The file holds no code and nothing is executed on loading: a header in JSON and plain arrays, every one checked.
"""

from __future__ import annotations

import json
import zlib
from pathlib import Path
from typing import Any

import numpy as np

from ..arrays.types import Array
from ..errors import SceneError
from ..files.whole import written
from .compiled import specification
from .contact_file import written_contacts
from .given import check_scene
from .scene import Scene
from .scene_reader import (
    LONGEST_HEADER,
    LONGEST_NAME,
    MAGIC,
    NUMBERS,
    PREFIX,
    VERSION,
    SceneReader,
    file_layout,
    is_name,
)


def save_scene(scene: Scene, path: str | Path) -> None:
    """Write a scene to one file, from which `load_scene` makes a scene with the same bits of motion and gradient.

    Ropes, cloths, bodies and meshes that built the scene (`Scene.ropes`, `Scene.cloths`, `Scene.bodies`) are not in it:
    places of markers on them must be given as `Place`s. Fields and unknown inputs over time become plain quantities,
    one for each mode, which a fit of the loaded scene gives no prior.

    Args:
        scene: frozen by this call.
        path: is replaced only once the file is whole.

    Raises:
        SceneError: a name that no file can hold.
        UnwrittenError: the path cannot be written.
    """
    header, arrays = _header(scene), _arrays(scene)
    offset = 0
    header["arrays"] = {}
    for name, values in arrays.items():
        kind = "f8" if values.dtype.kind == "f" else "i4"
        arrays[name] = values = np.ascontiguousarray(values, dtype=NUMBERS[kind])
        header["arrays"][name] = {"type": kind, "shape": list(values.shape), "offset": offset}
        offset += values.nbytes + -values.nbytes % 8
    text = json.dumps(header, allow_nan=False, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 8)
    if len(text) > LONGEST_HEADER:
        raise SceneError(scene.name, "has too many names for one file", len(text), "use fewer groups and quantities")
    body = b"".join([text, *(values.tobytes() + bytes(-values.nbytes % 8) for values in arrays.values())])
    with written(path) as beside:
        beside.write_bytes(PREFIX.pack(MAGIC, VERSION, zlib.crc32(body), len(text)) + body)


def load_scene(path: str | Path) -> Scene:
    """Read a scene that `save_scene` wrote; it is frozen.

    Raises:
        SceneError: the file cannot be read, is no scene file, is damaged or of another version, or holds an
            inconsistent scene; names the file and the part at fault.
    """
    return SceneReader(Path(path)).scene()


def _header(scene: Scene) -> dict[str, Any]:
    check_scene(scene)
    scene.freeze()
    named: dict[str, Any] = {
        "name": scene.name,
        "groups": [
            {"name": g.name, "kind": g.kind, "damped": g.damped, "count": len(g.particles)} for g in scene.groups
        ],
        "volumes": [{"name": name, "triangles": len(t)} for name, t in scene.volumes.triangles.items()],
        "quantities": [
            {
                "name": q.name,
                "value": float(q.value),
                "unit": q.unit,
                "positive": bool(q.positive),
                "scale": None if q.scale is None else float(q.scale),
                "limits": None if q.limits is None else [_finite_or_none(limit) for limit in q.limits],
                "beyond": q.beyond,
                "unsure": float(q.unsure),
            }
            for q in scene.quantities.values()
        ],
        "following": [{"markers": list(f.markers), "from_placed": f.from_placed} for f in scene.boundary.following],
    }
    named |= written_contacts(scene)[0]
    parts = ("groups", "volumes", "quantities", "colliders", "contacts")
    every = [scene.name, *(n["name"] for part in parts for n in named.get(part, ()))]
    every += [named["collisions"]["name"]] if "collisions" in named else []
    for text in (*every, *(q.unit for q in scene.quantities.values()), *_markers(scene)):
        if not is_name(text):
            raise SceneError("name", "cannot be written to a file", text, f"use up to {LONGEST_NAME} printable letters")
    return {
        "format": "sheetbend scene",
        "version": VERSION,
        **named,
        "particles": scene.particle_count,
        "interpolation": scene.boundary.interpolation,
        "has_drag": bool(scene.has_drag),
        "layout": file_layout(scene),
    }


def _arrays(scene: Scene) -> dict[str, Array]:
    map_, own = scene.compiled.map(), specification(scene)
    whole = np.int64
    return {
        "directors": np.array(own["directors"], whole).reshape(-1, 4),
        "pinned": np.array(own["pinned"], whole),
        "driven": np.array(own["driven"], whole),
        "boundary_times": scene.boundary.times if scene.boundary.driven else np.zeros(0),
        "loaded": np.array(own["loaded"], whole),
        "force_times": scene.forces.times,
        "air": scene.air.triangles.reshape(-1, 3),
        "wind_times": scene.air.times,
        **({"bodies": np.array(own["bodies"], whole)} if own["bodies"] else {}),
        **{f"stencil_{i}": scene.places_of(g.particles) for i, g in enumerate(scene.groups)},
        **{f"volume_{i}": t for i, t in enumerate(scene.volumes.triangles.values())},
        **written_contacts(scene)[1],
        **{f"following_{i}": f.slots for i, f in enumerate(scene.boundary.following)},
        **{f"weights_{i}": f.weights for i, f in enumerate(scene.boundary.following)},
        **{name: np.asarray(values) for name, values in map_.items()},
    }


def _markers(scene: Scene) -> list[str]:
    return [marker for part in scene.boundary.following for marker in part.markers]


def _finite_or_none(limit: float) -> float | None:
    return float(limit) if np.isfinite(limit) else None
