"""Forward simulation: trajectories of scenes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from .. import _core
from ..arrays.checks import finite
from ..errors import DivergenceError, InputError, UnbalancedError, UnconvergedError
from ..files.memory import expect_room
from ..quantities.kinds import KINDS
from ..scene.scene import Scene
from .contact_counts import ContactCounts, contact_counts, contact_modes
from .depth import deepest
from .solver import Solver

MOST_SUBSTEPS = 2**31 - 1  # that the core counts


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

    Args:
        scene: is frozen by this.
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
    compiled = scene.compiled
    steps = substeps(times, solver.h)
    inputs = compiled.inputs(compiled.values(values))
    if start is not None:
        offset, _ = compiled.layout["position"]
        own = start_of(scene, start, InputError)
        inputs[offset : offset + own.size] = own.ravel()
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


def start_of(scene: Scene, start: ArrayLike, error: type[InputError], field: str = "start") -> np.ndarray:
    """Positions (particles, 3) m, or (nodes, 3) m of all nodes, such as a motion or an equilibrium starts from.

    Raises:
        InputError: of the given kind: another shape, NaN, or particles alone where hidden nodes can move.
    """
    x = finite(field, start, None, error)
    if x.shape == (scene.node_count, 3):
        return x
    if x.shape != (scene.particle_count, 3):
        raise error(field, "has the wrong shape", x.shape, f"give {(scene.particle_count, 3)}")
    if len(scene.free) < len(scene.free_nodes):
        fix = f"give the positions {(scene.node_count, 3)} of all nodes, such as Equilibrium.nodes or Scene.nodes"
        raise error(field, "leaves out hidden nodes that can move, such as the frames of rods", x.shape, fix)
    return x


def substeps(times: ArrayLike, h: float) -> list[int]:
    """Substep numbers of times; raises InputError where a time lies off the grid."""
    t = finite("times", times, None, InputError).ravel()
    if len(t) == 0 or (t < 0).any() or (np.diff(t) < 0).any():
        raise InputError("times", "must be ascending from 0 or later", t[:5].tolist(), "give frame times in s")
    steps = np.rint(t / h)
    off = np.abs(t / h - steps) > 1e-6 * np.maximum(steps, 1.0)
    if off.any():
        raise InputError(
            "times",
            f"do not lie on the grid of substeps of {h:g} s",
            float(t[off][0]),
            "choose h so that it divides the frame interval",
        )
    if steps[-1] > MOST_SUBSTEPS:
        raise InputError("times", f"take more than {MOST_SUBSTEPS} substeps of {h:g} s", float(t[-1]), "end earlier")
    return steps.astype(int).tolist()


def forces_by_group(scene: Scene, multipliers: np.ndarray) -> dict[str, np.ndarray]:
    """Multipliers (..., rows) by group, (..., count, rows)."""
    forces, row = {}, 0
    for g in scene.groups:
        rows = KINDS[g.kind]["rows"]
        part = multipliers[..., row : row + rows * len(g.particles)]
        forces[g.name] = part.reshape(*part.shape[:-1], len(g.particles), rows)
        row += rows * len(g.particles)
    return forces


def pressures_by_volume(scene: Scene, multipliers: np.ndarray) -> dict[str, np.ndarray]:
    """Multipliers (...,) by volume, which follow those of the groups."""
    first = scene.compiled.core.rows
    return {name: multipliers[..., first + v] for v, name in enumerate(scene.volumes.triangles)}


@contextmanager
def divergence(scene: Scene) -> Iterator[None]:
    """Turns what stops the core's rollouts into the package's errors."""
    try:
        yield
    except _core.Diverged as error:
        raise DivergenceError(
            error.substep, error.time, _number(scene, error.particle), scene.name, error.seen
        ) from error
    except _core.Unbalanced as error:
        when = (error.substep, error.time, _number(scene, error.particle))
        raise UnbalancedError(error.problem, error.fix, *when, error.residual, scene.name) from error
    except _core.Unconverged as error:
        raise UnconvergedError(error.iterations, error.residual, scene.name) from error


def whole(field: str, bar: np.ndarray, shape: tuple[int, ...], particles: int, error: type[InputError]) -> np.ndarray:
    """A derivative with respect to positions of all nodes, of this shape (..., nodes, 3), where it may have been given
    with respect to those of the particles alone.

    Raises:
        InputError: of the given kind: another shape, or NaN.
    """
    own = (*shape[:-2], particles, 3)
    if bar.shape == shape:
        return finite(field, bar, shape, error) if not np.isfinite(bar).all() else bar
    padded = np.zeros(shape)
    padded[..., :particles, :] = finite(field, bar, own, error)
    return padded


def _number(scene: Scene, place: int) -> int:
    """The number of the node at a place of the core's arrays."""
    return place if place < scene.particle_count else place - scene.node_count
