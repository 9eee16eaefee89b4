"""The cloths and ropes of a simulated scene as files for other programs."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path

import numpy as np

from ..mesh import write_obj_sequence, write_ply, write_ply_sequence
from ..mesh.export import frame_files
from ..motion.simulate import Trajectory
from ..optional import require
from ..pictures.gltf import write_gltf
from ..pictures.strain import strain_fields
from ..pictures.usd import write_usd
from ..scene.scene import Scene


class MeshFormat(StrEnum):
    """What `sheetbend simulate --mesh` writes."""

    OBJ = "obj"
    PLY = "ply"
    PLY_SEQUENCE = "ply-sequence"
    GLTF = "gltf"
    USD = "usd"


WHOLE = {MeshFormat.GLTF: ".glb", MeshFormat.USD: ".usdc"}
"""Formats that hold all cloths and ropes of a motion in one file, by its suffix."""


def check_format(form: MeshFormat) -> None:
    """Raise MissingExtraError, before any work, where a format needs a package that is not installed."""
    if form is MeshFormat.USD:
        require("pxr", "usd")


def mesh_files(name: str, scene: Scene, frames: int, folder: Path, form: MeshFormat) -> list[Path]:
    """Every file that `write_meshes` will write."""
    if form in WHOLE:
        return [folder / f"{name}{WHOLE[form]}"]
    files: list[Path] = []
    for cloth in scene.cloths:
        path = folder / f"{name}_{cloth}"
        if form is MeshFormat.PLY:
            files.append(path.with_name(f"{path.name}.ply"))
        else:
            files += frame_files(path, frames, ".obj" if form is MeshFormat.OBJ else ".ply")
    return files


def write_meshes(name: str, scene: Scene, motion: Trajectory, folder: Path, form: MeshFormat) -> list[str]:
    """Every cloth of a scene, all frames as OBJ or PLY, or the last as PLY; or everything in one file. Gives the
    paths."""
    if form in WHOLE:
        path = folder / f"{name}{WHOLE[form]}"
        (write_gltf if form is MeshFormat.GLTF else write_usd)(path, scene, motion)
        return [str(path)]
    written = []
    for cloth in scene.cloths.values():
        path = folder / f"{name}_{cloth.name}"
        if form is MeshFormat.OBJ:
            write_obj_sequence(path, cloth.mesh, motion.positions[:, cloth.particles])
        elif form is MeshFormat.PLY_SEQUENCE:
            strains = [strain_fields(scene, cloth, x) for x in motion.positions]
            fields = {name: np.array([frame[name] for frame in strains]) for name in strains[0]}
            write_ply_sequence(path, cloth.mesh, motion.positions[:, cloth.particles], face_fields=fields)
        else:
            path = path.with_name(f"{path.name}.ply")
            fields = strain_fields(scene, cloth, motion.positions[-1])
            write_ply(path, cloth.mesh, motion.positions[-1, cloth.particles], face_fields=fields)
        written.append(str(path))
    return written
