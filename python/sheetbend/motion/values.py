"""What a scene's constraints are worth at given positions: strains and angles, elastic energy and its gradient, forces
on supports."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import ArrayLike

from .. import _core
from ..quantities.kinds import KINDS
from ..scene.group import Group
from ..scene.scene import Array, Scene
from .equilibrium import Equilibrium, whole_start
from .simulate import forces_by_group


def constraint_values(
    scene: Scene, positions: ArrayLike | None = None, values: Mapping[str, float] | None = None
) -> dict[str, Array]:
    """C of every constraint of a group, by group (count, rows), in the units of its kind.

    Args:
        positions: (particles, 3) m, or (nodes, 3) m of all nodes, which it must be where hidden ones can move; the
            scene's initial ones by default.
        values: quantities to change, by name.

    Raises:
        SceneError: wrong shapes or names.
    """
    compiled = scene.compiled
    inputs = compiled.inputs(compiled.values(values))
    x = scene.nodes.ravel() if positions is None else whole_start(scene, positions, inputs, "positions")
    C, _ = _core.evaluate_constraints(
        compiled.core, inputs, x, np.zeros(compiled.core.rows + len(scene.volumes.triangles))
    )
    return forces_by_group(scene, C)


def elastic_energy(
    scene: Scene, positions: ArrayLike | None = None, values: Mapping[str, float] | None = None
) -> dict[str, Array]:
    """C.C/(2 alpha) of every constraint of a group, J, by group (count,); zero where rigid or slack. Arguments: see
    `constraint_values`.

    Not counted is what is in no group: (V - rest)^2/(2 compliance) of a volume that is kept (`Scene.add_volume`), and
    -p V of a pressure (`Scene.add_pressure`). Nor is what two springs hold against each other where one of them has
    slid (kinds with a `share`), share (1 - share) set.set/(2 alpha)."""
    compiled, energies = scene.compiled, {}
    C_of = constraint_values(scene, positions, values)
    for group, alpha in _compliances(scene, compiled.inputs(compiled.values(values))):
        C = C_of[group.name]
        if KINDS[group.kind]["unilateral"]:
            C = np.minimum(C, 0.0)
        energies[group.name] = stored = np.zeros(len(C))
        np.divide((C**2).sum(axis=1), 2.0 * alpha, out=stored, where=alpha > 0)
    return energies


def elastic_energy_gradient(rest: Equilibrium) -> dict[str, float]:
    """Derivative of the elastic energy of all groups at rest, alpha lambda.lambda/2, by every named quantity, J per
    unit; that of a pressure, -p V, is not in it."""
    scene, compiled = rest.scene, rest.scene.compiled
    offset, size = compiled.layout["compliance"]
    own = {group.name: alpha for group, alpha in _compliances(scene, compiled.inputs(rest.theta))}
    bar = rest.input_gradient(None, {name: own[name][:, None] * rest.forces[name] for name in own})
    explicit = [(rest.forces[name] ** 2).sum(axis=1) / 2.0 for name in own]
    bar[offset : offset + size] += np.concatenate(explicit)
    return rest.by_name(bar)


def support_forces(rest: Equilibrium) -> Array:
    """(nodes, 3) N, the force of the supports on held nodes at rest, zero on free ones: of particles, and behind them
    of hidden nodes such as the stub of a clamp, which carries a part of its moment.

    They carry what constraints, kept volumes and given pressures put on held particles; not the weight of those, whose
    masses are not used.
    """
    scene, compiled = rest.scene, rest.scene.compiled
    inputs = compiled.inputs(rest.theta)
    _, forces = _core.evaluate_constraints(compiled.core, inputs, rest.nodes.ravel(), rest.solution.multipliers)
    forces = -(forces.reshape(-1, 3) + _pressure_forces(scene, inputs, rest.nodes))
    forces[scene.free_nodes] = 0.0
    return forces


def _pressure_forces(scene: Scene, inputs: Array, positions: Array) -> Array:
    """(particles, 3) N, pressure times area of each triangle in air, a third to every corner."""
    offset, size = scene.compiled.layout["pressure"]
    triangles = np.reshape(scene.air.triangles, (-1, 3)).astype(int)
    first, second, third = np.moveaxis(positions[triangles], 1, 0)
    each = inputs[offset : offset + size, None] * np.cross(second - first, third - first) / 6.0
    forces = np.zeros_like(positions)
    for corner in triangles.T:
        np.add.at(forces, corner, each)
    return forces


def _compliances(scene: Scene, inputs: Array) -> Iterator[tuple[Group, Array]]:
    """Every group with the compliances of its constraints."""
    offset, size = scene.compiled.layout["compliance"]
    ends = np.cumsum([len(g.particles) for g in scene.groups])
    yield from zip(scene.groups, np.split(inputs[offset : offset + size], ends[:-1]), strict=True)
