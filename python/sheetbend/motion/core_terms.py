"""Times, starts, derivatives, multipliers and errors of a motion, between the terms of users and those of the core."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
from numpy.typing import ArrayLike

from .. import _core
from ..arrays.checks import MOST_WHOLE, finite
from ..errors import DivergenceError, InputError, UnbalancedError, UnconvergedError
from ..quantities.kinds import KINDS
from ..scene.compiled import CompiledScene
from ..scene.given import check_scene
from ..scene.group import places_of_groups
from ..scene.scene import Scene

MOST_SUBSTEPS = MOST_WHOLE
"""The largest number of substeps that the core counts."""


def compiled_of(scene: Scene) -> CompiledScene:
    """The compiled scene that a caller gave, which is frozen by this.

    Raises:
        InputError: it is no scene.
    """
    check_scene(scene)
    return scene.compiled


def start_of(scene: Scene, start: ArrayLike, error: type[InputError], field: str = "start") -> np.ndarray:
    """Check the positions from which a motion or an equilibrium starts: (particles, 3) m, or (nodes, 3) m of all nodes.

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
    forces = {}
    for places in places_of_groups(scene.groups):
        count, rows = len(places.group.particles), KINDS[places.group.kind]["rows"]
        part = multipliers[..., places.first_row : places.first_row + count * rows]
        forces[places.group.name] = part.reshape(*part.shape[:-1], count, rows)
    return forces


def pressures_by_volume(scene: Scene, multipliers: np.ndarray) -> dict[str, np.ndarray]:
    """Multipliers (...,) by volume, which follow those of the groups."""
    first = scene.compiled.core.rows
    return {name: multipliers[..., first + v] for v, name in enumerate(scene.volumes.triangles)}


@contextmanager
def divergence(scene: Scene) -> Iterator[None]:
    """Raise what stops a rollout of the core as an error of the package, with the particle's number in the scene."""
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


def over_all_nodes(bar: np.ndarray, shape: tuple[int, ...], particles: int, error: type[InputError]) -> np.ndarray:
    """The derivative `positions_bar` with respect to the positions of all nodes; zero for hidden nodes where it was
    given for the particles alone.

    Args:
        bar: (..., nodes, 3) or (..., particles, 3).
        shape: (..., nodes, 3).
        particles: their number.
        error: kind of error to raise.

    Raises:
        InputError: of the given kind: another shape, or NaN.
    """
    own = (*shape[:-2], particles, 3)
    if bar.shape == shape:
        return finite("positions_bar", bar, shape, error) if not np.isfinite(bar).all() else bar
    padded = np.zeros(shape)
    padded[..., :particles, :] = finite("positions_bar", bar, own, error)
    return padded


def _number(scene: Scene, place: int) -> int:
    """The number of the node at a place of the core's arrays."""
    return place if place < scene.particle_count else place - scene.node_count
