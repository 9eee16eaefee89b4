"""The sheet of `measure.py cloth` for plain_cloth.cpp: the same constraints in the same order, as text."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np
from sheetbend.motion.solver import Solver
from sheetbend.scene.scene import Scene
from sheetbend_bench import cloth

KINDS = ("strain", "dihedral")


def write_swatch(path: Path) -> int:
    """The smallest sheet of the benchmark, still: how many projections its motion takes."""
    scene, substeps = cloth.sheet(cloth.CELLS[0]), cloth.substeps_of(cloth.CELLS[0])
    write(path, scene, cloth.SOLVER, substeps, np.zeros(scene.compiled.core.inputs))
    return sum(len(g.particles) for g in scene.groups) * cloth.SOLVER.sweeps * substeps


def write(path: Path, scene: Scene, solver: Solver, substeps: int, direction: np.ndarray) -> None:
    """Every number is followed by its share of the direction (inputs,)."""
    compiled = scene.compiled
    if tuple(g.kind for g in scene.groups) != KINDS:
        raise ValueError(f"a sheet of {' and '.join(KINDS)}, in this order")
    pairs = np.stack([compiled.inputs(), direction], axis=1)
    arrays = {name: pairs[first : first + count] for name, (first, count) in compiled.layout.items()}
    membrane, hinges = (g.particles for g in scene.groups)
    rest = arrays["rest"][: 7 * len(membrane)].reshape(len(membrane), 7, 2), arrays["rest"][7 * len(membrane) :]
    soft = arrays["compliance"][: len(membrane)], arrays["compliance"][len(membrane) :]
    lines = [[scene.particle_count, substeps, solver.sweeps, repr(solver.h), len(membrane), len(hinges)]]
    lines += [_numbers(arrays[name]) for name in ("position", "mass", "gravity")]
    lines.append([int(n in scene.pinned) for n in range(scene.particle_count)])
    for stencils, values, compliance in zip((membrane, hinges), rest, soft, strict=True):
        lines += [
            [*stencils[i], *_numbers(values[i]), *_numbers(compliance[i])] for i in _swept(stencils, scene.pinned)
        ]
    path.write_text("".join(" ".join(map(str, line)) + "\n" for line in lines))


def _numbers(pairs: np.ndarray) -> list[str]:
    return [repr(float(v)) for v in np.ravel(pairs)]


def _swept(stencils: np.ndarray, pinned: Iterable[int]) -> list[int]:
    """Constraints in the order of a sweep, by colors: each has the first that none of its free particles has yet."""
    held = set(pinned)
    colors: list[set[int]] = []  # what of each is taken
    color_of = []
    for stencil in stencils.tolist():
        free = set(stencil) - held
        color = next((c for c, taken in enumerate(colors) if not free & taken), len(colors))
        if color == len(colors):
            colors.append(set())
        colors[color] |= free
        color_of.append(color)
    return np.argsort(color_of, kind="stable").tolist()
