"""Motions as glTF 2.0 in one binary file, which browsers, Blender and game engines open."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np

from ..arrays.types import Array
from ..errors import InputError
from ..files.whole import written
from ..motion.simulate import Trajectory
from ..scene.scene import Scene
from ..version import __version__
from .moving_shapes import MovingShape, chosen_frames, moving_shapes, tube, turn_between, up_of

MOST_FRAMES = 240
"""Each frame is a morph target, of which some programs take no more than a few hundred."""

_SIDES = 8
_COLORS = ([0.05, 0.35, 0.45, 1.0], [0.72, 0.33, 0.22, 1.0])  # of cloths, of ropes
_FLOAT, _UINT = 5126, 5125
_ARRAY, _ELEMENT = 34962, 34963


def write_gltf(path: str | Path, scene: Scene, motion: Trajectory, *, radius: float | None = None) -> int:
    """Write the cloths and ropes of a motion as a .glb file.

    Each frame is a morph target, and an animation goes from one to the next at the motion's own times. Texture
    coordinates are the material's, in m. glTF has y up: the root node turns the scene's axis that points up there.

    Args:
        path: of the file, with the suffix .glb.
        scene: that was simulated.
        motion: of `simulate`.
        radius: of ropes, which are drawn as tubes, m; 0.4 % of each rope's length when left out.

    Returns:
        The number of frames that are written: of more than `MOST_FRAMES` so many, evenly.

    Raises:
        InputError: a scene without cloth and rope, or another suffix.
    """
    path = Path(path)
    if path.suffix.lower() != ".glb":
        raise InputError("path", "is not a binary glTF file", str(path), "give a name that ends in .glb")
    frames = chosen_frames(motion.times, MOST_FRAMES)
    file = _File(turn_between(up_of(scene.gravity), np.array([0.0, 1.0, 0.0])))
    times = file.accessor(motion.times[frames].astype("<f4"), "SCALAR", bounds=True) if len(frames) > 1 else None
    for shape in moving_shapes(scene, motion, frames):
        file.add(shape, times, radius)
    with written(path) as beside:
        beside.write_bytes(file.packed(scene.name))
    return len(frames)


class _File:
    """The parts of a glTF file as they are put together; `turn` is the rotation (x, y, z, w) of the root node."""

    def __init__(self, turn: list[float]) -> None:
        self._binary = bytearray()
        self._views: list[dict[str, Any]] = []
        self._accessors: list[dict[str, Any]] = []
        self._meshes: list[dict[str, Any]] = []
        self._nodes: list[dict[str, Any]] = [{"name": "y up", "rotation": turn}]
        self._channels: list[dict[str, Any]] = []
        self._samplers: list[dict[str, Any]] = []

    def add(self, shape: MovingShape, times: int | None, radius: float | None) -> None:
        """A mesh, its node, and its part of the animation."""
        x, triangles = shape.positions, shape.triangles
        if triangles is None:
            x, triangles = tube(x, shape.radius(radius), _SIDES)
        attributes = {"POSITION": self.accessor(x[0].astype("<f4"), "VEC3", bounds=True, target=_ARRAY)}
        if shape.material is not None:
            attributes["TEXCOORD_0"] = self.accessor(shape.material.astype("<f4"), "VEC2", target=_ARRAY)
        primitive: dict[str, Any] = {
            "attributes": attributes,
            "indices": self.accessor(triangles.astype("<u4").ravel(), "SCALAR", target=_ELEMENT),
            "material": int(shape.triangles is None),
        }
        mesh: dict[str, Any] = {"name": shape.name, "primitives": [primitive]}
        node = {"name": shape.name, "mesh": len(self._meshes)}
        if times is not None:
            moved = (x[1:] - x[0]).astype("<f4")
            primitive["targets"] = [{"POSITION": self.accessor(m, "VEC3", bounds=True)} for m in moved]
            mesh["weights"] = [0.0] * len(moved)
            weights = np.vstack([np.zeros(len(moved)), np.eye(len(moved))]).astype("<f4")
            output = self.accessor(weights.ravel(), "SCALAR")
            self._channels.append(
                {"sampler": len(self._samplers), "target": {"node": len(self._nodes), "path": "weights"}}
            )
            self._samplers.append({"input": times, "output": output, "interpolation": "LINEAR"})
        self._meshes.append(mesh)
        self._nodes.append(node)

    def accessor(self, array: Array, kind: str, *, bounds: bool = False, target: int | None = None) -> int:
        """The number of an accessor of an array of 32-bit numbers, which goes into the binary part."""
        data = np.ascontiguousarray(array)
        view: dict[str, Any] = {"buffer": 0, "byteOffset": len(self._binary), "byteLength": data.nbytes}
        if target is not None:
            view["target"] = target
        self._binary += data.tobytes()
        self._views.append(view)
        found: dict[str, Any] = {
            "bufferView": len(self._views) - 1,
            "componentType": _UINT if data.dtype.kind == "u" else _FLOAT,
            "count": len(data),
            "type": kind,
        }
        if bounds:
            rows = data.reshape(len(data), -1).astype(float)
            found |= {"min": rows.min(axis=0).tolist(), "max": rows.max(axis=0).tolist()}
        self._accessors.append(found)
        return len(self._accessors) - 1

    def packed(self, name: str) -> bytes:
        """The whole file: header, JSON and binary chunk, each a multiple of four bytes long."""
        self._nodes[0]["children"] = list(range(1, len(self._nodes)))
        content: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": f"sheetbend {__version__}"},
            "scene": 0,
            "scenes": [{"name": name, "nodes": [0]}],
            "nodes": self._nodes,
            "meshes": self._meshes,
            "materials": [
                {"name": n, "doubleSided": True, "pbrMetallicRoughness": {"baseColorFactor": c, "metallicFactor": 0.0}}
                for n, c in zip(("cloth", "rope"), _COLORS, strict=True)
            ],
            "accessors": self._accessors,
            "bufferViews": self._views,
            "buffers": [{"byteLength": len(self._binary)}],
        }
        if self._channels:
            content["animations"] = [{"name": "motion", "channels": self._channels, "samplers": self._samplers}]
        text = json.dumps(content, separators=(",", ":"), allow_nan=False).encode()
        text += b" " * (-len(text) % 4)
        binary = bytes(self._binary) + b"\0" * (-len(self._binary) % 4)
        total = 12 + 8 + len(text) + 8 + len(binary)
        head = struct.pack("<4sII", b"glTF", 2, total) + struct.pack("<I4s", len(text), b"JSON")
        return head + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
