"""Solids of a scene, built from their description."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .. import mesh as meshes
from ..errors import ConfigError
from ..mesh import SolidMesh
from ..objects.mean import add_mean
from ..objects.solid import Solid, add_solid
from ..objects.solid_clusters import cluster_boxes
from ..scene.scene import Scene
from .bodies import fix_to_body
from .errors import located
from .solid_schema import SolidSection

_ELSEWHERE = {"name", "size", "cells", "origin", "file", "unit", "pinned", "grip", "mean", "set", "clusters"}


def build_solid(
    scene: Scene, path: str, section: SolidSection, folder: Path, finer: int
) -> tuple[Solid, SolidMesh, dict[str, int]]:
    """Add a solid to a scene, with its vertices that are pinned or fixed to bodies, and its means.

    Args:
        folder: files are relative to it.
        finer: multiplies the cells of a box; a mesh from a file stays as it is.

    Returns:
        The solid, its mesh as configured, and the particles at means by name.

    Raises:
        ConfigError: anything inconsistent, with the path of the key.
    """
    mesh, configured = (_mesh(path, section, folder, times) for times in (finer, 1))
    pinned = [_members(f"{path}.pinned", mesh, name) for name in section.pinned]
    gripped = [_members(f"{path}.grip[{i}].set", mesh, grip.set) for i, grip in enumerate(section.grip)]
    fields = section.model_dump(exclude=_ELSEWHERE, exclude_none=True)
    with located(path, section.name):
        clusters = None if section.clusters is None else cluster_boxes(mesh, section.clusters)
        held = np.unique(np.concatenate([np.zeros(0, dtype=int), *pinned, *gripped]))
        solid = add_solid(scene, mesh, section.name, clusters=clusters, held=held, **fields)
        for vertices in pinned:
            scene.pin(solid.particles[vertices])
    for i, (grip, vertices) in enumerate(zip(section.grip, gripped, strict=True)):
        fix_to_body(scene, f"{path}.grip[{i}]", grip.body, solid.particles[vertices], f"{section.name}_{grip.set}")
    means: dict[str, int] = {}
    for i, mean in enumerate(section.mean):
        vertices = _members(f"{path}.mean[{i}].set", mesh, mean.set)
        with located(f"{path}.mean[{i}]", mean.name):
            means[mean.name] = add_mean(scene, solid.particles[vertices], mesh.areas(vertices), name=mean.name)
    return solid, configured, means


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
        raise ConfigError(path, "is not a set of the solid", name, f"use one of: {', '.join(mesh.sets) or 'none'}")
    return mesh.sets[name]
