"""The values of a scene's constraints at given positions: strains and angles, elastic energy and its gradient, forces
of supports."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import ArrayLike

from .. import _core
from ..arrays.checks import check_kind
from ..arrays.types import Array
from ..quantities.kinds import KINDS
from ..scene.group import Group, places_of_groups
from ..scene.scene import Scene
from .core_terms import compiled_of, forces_by_group
from .equilibrium import Equilibrium, whole_start


def constraint_values(
    scene: Scene, positions: ArrayLike | None = None, values: Mapping[str, float] | None = None
) -> dict[str, Array]:
    """Evaluate the strain or angle C of every constraint.

    Args:
        scene: frozen by this call.
        positions: (particles, 3) m, or (nodes, 3) m of all nodes, which is needed where hidden nodes can move; the
            scene's initial positions by default.
        values: quantities to change, by name.

    Returns:
        C by name of the group, (count, rows), in the unit of its kind.

    Raises:
        SceneError: wrong shapes or names.
    """
    compiled = compiled_of(scene)
    inputs = compiled.inputs(compiled.values(values))
    x = scene.nodes.ravel() if positions is None else whole_start(scene, positions, inputs, "positions")
    C, _ = _core.evaluate_constraints(
        compiled.core, inputs, x, np.zeros(compiled.core.rows + len(scene.volumes.triangles))
    )
    return forces_by_group(scene, C)


def elastic_energy(
    scene: Scene, positions: ArrayLike | None = None, values: Mapping[str, float] | None = None
) -> dict[str, Array]:
    """Compute the elastic energy C.C/(2 alpha) of every constraint, alpha being its compliance.

    Energies that belong to no group are left out: (V - rest)^2/(2 compliance) of a volume that is kept
    (`Scene.add_volume`), and -p V of a pressure (`Scene.add_pressure`). So is the energy share (1 - share)
    set.set/(2 alpha) that two springs hold against each other after one of them has slid (kinds with a `share`).

    Args:
        scene, positions, values: as for `constraint_values`.

    Returns:
        J by name of the group, (count,); zero for constraints that are rigid or slack.

    Raises:
        SceneError: wrong shapes or names.
    """
    compiled, energies = compiled_of(scene), {}
    C_of = constraint_values(scene, positions, values)
    for group, alpha in _compliances(scene, compiled.inputs(compiled.values(values))):
        C = C_of[group.name]
        if KINDS[group.kind]["unilateral"]:
            C = np.minimum(C, 0.0)
        energies[group.name] = stored = np.zeros(len(C))
        np.divide((C**2).sum(axis=1), 2.0 * alpha, out=stored, where=alpha > 0)
    return energies


def elastic_energy_gradient(rest: Equilibrium) -> dict[str, float]:
    """Differentiate the elastic energy of all groups at rest, alpha lambda.lambda/2, with respect to every named
    quantity, in J per unit of the quantity. The energy -p V of a pressure is left out."""
    scene, compiled = rest.scene, rest.scene.compiled
    own = {group.name: alpha for group, alpha in _compliances(scene, compiled.inputs(rest.theta))}
    bar = rest.input_gradient(None, {name: own[name][:, None] * rest.forces[name] for name in own})
    explicit = [(rest.forces[name] ** 2).sum(axis=1) / 2.0 for name in own]
    compiled.part(bar, "compliance")[:] += np.concatenate(explicit)
    return rest.by_name(bar)


def support_forces(rest: Equilibrium) -> Array:
    """Compute the forces that supports exert on held nodes at rest.

    They balance the forces of constraints, kept volumes and given pressures on held nodes. The weight of held particles
    is left out, because their masses are not used.

    Args:
        rest: as `equilibrium` returned it.

    Returns:
        (nodes, 3) N, zero for free nodes: particles first, then hidden nodes such as the stub of a clamp, which carries
        a part of the clamp's moment.
    """
    check_kind("rest", rest, Equilibrium, "give what sb.equilibrium returns")
    scene, compiled = rest.scene, rest.scene.compiled
    inputs = compiled.inputs(rest.theta)
    _, forces = _core.evaluate_constraints(compiled.core, inputs, rest.nodes.ravel(), rest.solution.multipliers)
    forces = -(forces.reshape(-1, 3) + _pressure_forces(scene, inputs, rest.nodes))
    forces[scene.free_nodes] = 0.0
    return forces


def _pressure_forces(scene: Scene, inputs: Array, positions: Array) -> Array:
    """(nodes, 3) N, pressure times area of each triangle in air, a third to every corner."""
    triangles = np.reshape(scene.air.triangles, (-1, 3)).astype(int)
    first, second, third = np.moveaxis(positions[triangles], 1, 0)
    each = scene.compiled.part(inputs, "pressure")[:, None] * np.cross(second - first, third - first) / 6.0
    forces = np.zeros_like(positions)
    for corner in triangles.T:
        np.add.at(forces, corner, each)
    return forces


def _compliances(scene: Scene, inputs: Array) -> Iterator[tuple[Group, Array]]:
    """Every group with the compliances of its constraints."""
    compliance = scene.compiled.part(inputs, "compliance")
    yield from ((places.group, compliance[places.constraints]) for places in places_of_groups(scene.groups))
