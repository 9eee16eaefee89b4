"""Forward simulation: trajectories of scenes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError
from ..files.memory import expect_room
from ..scene.scene import Scene
from .contact_counts import ContactCounts, contact_counts, contact_modes
from .core_terms import compiled_of, divergence, forces_by_group, pressures_by_volume, start_of, substeps
from .depth import deepest
from .solver import Solver


@dataclass(frozen=True)
class Trajectory:
    """The result of a simulation.

    Attributes:
        times: (frames,) s.
        positions: (frames, particles, 3) m.
        velocities: (frames, particles, 3) m/s.
        forces: per group the constraints' multipliers (frames, count, rows) in units of force (distance: minus the
            tension in N; bend and hinge: minus the moment in N m), zero at the initial frame.
        pressures: per volume (frames,) its multiplier, Pa, inside above outside; zero at the initial frame.
        contacts: per contact of the scene, by name, how many particles touched, slid, stuck, began and ended, and
            how deep they were.
        contact_modes: per contact, by name, (frames, particles) what each of its particles did in the last substep
            before a frame, numbers of `ContactMode`; apart in the initial frame, and where it is held or driven.
        scene: that was simulated; None of a motion that was put together otherwise.
        nodes: (frames, nodes, 3) m, the positions of all nodes: particles first, then the hidden ones, which their own,
            negative numbers index, such as `motion.nodes[:, rod.directors]`. The positions alone by default.
        node_velocities: (frames, nodes, 3) m/s, likewise; zero for directors, which are directions.
    """

    times: np.ndarray
    positions: np.ndarray
    velocities: np.ndarray
    forces: Mapping[str, np.ndarray]
    pressures: Mapping[str, np.ndarray] = field(default_factory=dict)
    contacts: Mapping[str, ContactCounts] = field(default_factory=dict)
    contact_modes: Mapping[str, np.ndarray] = field(default_factory=dict)
    scene: Scene | None = field(default=None, repr=False, compare=False)
    nodes: np.ndarray = field(default_factory=lambda: np.zeros(0), repr=False, compare=False)
    node_velocities: np.ndarray = field(default_factory=lambda: np.zeros(0), repr=False, compare=False)

    def __post_init__(self) -> None:
        if not self.nodes.size:
            object.__setattr__(self, "nodes", self.positions)
            object.__setattr__(self, "node_velocities", self.velocities)


def simulate(
    scene: Scene,
    times: ArrayLike,
    solver: Solver | None = None,
    values: Mapping[str, float] | None = None,
    start: ArrayLike | None = None,
) -> Trajectory:
    """Simulate a scene from its initial state.

    Examples:
        >>> rope = sb.rope(0.6, 20, density=0.05, EI=1e-3, clamp_start=(1, 0, 0))
        >>> motion = sb.simulate(rope, [0.0, 0.25, 0.5], sb.Solver(h=1 / 480))
        >>> motion.positions.shape  # frames, particles, 3
        (3, 21, 3)

    Args:
        scene: frozen by this call.
        times: (frames,) s, not decreasing, starting at or after 0; each must lie on the substep grid.
        solver: `Solver()` by default.
        values: quantities to change for this run, by name.
        start: (particles, 3) m, positions to start from instead of the scene's; (nodes, 3) m, such as
            `Equilibrium.nodes`, where hidden nodes can move.

    Raises:
        InputError: times off the grid, unknown quantities, more frames than fit in the free memory, a start without
            hidden nodes that can move.
        DivergenceError: a state became infinite, or nothing put into the scene explains it; says when and where.
        UnconvergedError: method "newton_cg" ran out of iterations.
        UnbalancedError: method "implicit" did not bring a substep's forces into balance; says when and where.
    """
    solver = Solver.given(solver)
    compiled = compiled_of(scene)
    steps = substeps(times, solver.h)
    inputs = compiled.inputs(compiled.values(values))
    if start is not None:
        own = start_of(scene, start, InputError)
        compiled.part(inputs, "position")[: own.size] = own.ravel()
    frames = len(steps)
    numbers = 2 * compiled.core.dofs + compiled.core.rows + len(scene.volumes.triangles)
    expect_room("times", 8 * frames * numbers, f"ask for fewer than {frames} frames at a time")
    with divergence(scene):
        out = solver.core(compiled).simulate(inputs, steps, 0.0)
    nodes, velocities = (out[name].reshape(frames, -1, 3) for name in ("positions", "velocities"))
    velocities[:, list(scene.directors)] = 0.0
    particles = slice(scene.particle_count)
    at = np.array(steps) * solver.h
    modes = contact_modes({c.name: len(c.particles) for c in scene.contacts.contacts}, out["contact_modes"])
    depths = deepest(compiled, inputs, at, out.get("uncombined", out["positions"]), modes)
    return Trajectory(
        at,
        nodes[:, particles],
        velocities[:, particles],
        forces_by_group(scene, out["multipliers"]),
        pressures_by_volume(scene, out["multipliers"]),
        contact_counts(list(scene.contacts.counted()), out["contacts"], out["first_order"] / max(steps[-1], 1), depths),
        modes,
        scene,
        nodes,
        velocities,
    )
