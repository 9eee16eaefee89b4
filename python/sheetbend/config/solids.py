"""Solids of a scene, built from their description."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .. import mesh as meshes
from ..errors import ConfigError
from ..mesh import SolidMesh
from ..objects.solid import Solid, add_solid
from ..objects.solid_clusters import cluster_boxes
from ..scene.scene import Scene
from .errors import located
from .solid_schema import SolidSection

_ELSEWHERE = {"name", "size", "cells", "origin", "file", "unit", "pinned", "set", "clusters"}


def build_solid(scene: Scene, path: str, section: SolidSection, folder: Path, finer: int) -> tuple[Solid, SolidMesh]:
    """Add a solid with its pinned vertices to a scene.

    Args:
        folder: files are relative to it.
        finer: multiplies the cells of a box; a mesh from a file stays as it is.

    Returns:
        The solid, and its mesh as configured.

    Raises:
        ConfigError: anything inconsistent, with the path of the key.
    """
    mesh, configured = (_mesh(path, section, folder, times) for times in (finer, 1))
    chosen = [_members(f"{path}.pinned", mesh, name) for name in section.pinned]
    pinned = np.unique(np.concatenate([np.zeros(0, dtype=int), *chosen]))
    fields = section.model_dump(exclude=_ELSEWHERE, exclude_none=True)
    with located(path, section.name):
        clusters = None if section.clusters is None else cluster_boxes(mesh, section.clusters)
        solid = add_solid(scene, mesh, section.name, clusters=clusters, held=pinned, **fields)
        if len(pinned):
            scene.pin(solid.particles[pinned])
    return solid, configured


def _mesh(path: str, section: SolidSection, folder: Path, finer: int) -> SolidMesh:
    with located(path):
        if section.file is not None:
            mesh = meshes.read_solid(folder / section.file, unit=section.unit)
        else:
            mesh = meshes.bricks(section.size or (), [finer * n for n in section.cells or ()], at=section.origin)
        sets = dict(mesh.sets)
        for i, chosen in enumerate(section.set):
            inside = mesh.within(chosen.lower, chosen.upper)
            if not len(inside):
                fix = "give a box of space that vertices lie in"
                raise ConfigError(f"{path}.set[{i}]", "has no vertex", chosen.name, fix)
            sets[chosen.name] = inside
        return SolidMesh(mesh.vertices, mesh.elements, sets)


def _members(path: str, mesh: SolidMesh, name: str) -> np.ndarray:
    if name not in mesh.sets:
        raise ConfigError(path, "is no set of the solid", name, f"use one of: {', '.join(mesh.sets) or 'none'}")
    return mesh.sets[name]
