"""An experiment whose start a fit has estimated, starting there."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ..arrays.types import Array
from ..motion.core_terms import divergence
from ..motion.equilibrium import equilibrium
from .experiment import Experiment


def started(e: Experiment, numbers: Array) -> Experiment:
    """The experiment with a scene that starts with what a fit found.

    Args:
        numbers: (numbers,) of its start (`FitProblem.starts`).
    """
    assert e.estimated_start is not None
    return replace(e, scene=e.scene.starting(*e.estimated_start.added(numbers, e.scene.node_count)), start="settled")


def start_moved(e: Experiment, numbers: Array) -> tuple[float, float]:
    """m and m/s, root mean square of one coordinate of the places and the velocities that are estimated."""
    assert e.estimated_start is not None
    x, v = e.estimated_start.added(numbers, e.scene.node_count)
    moving = e.scene.free_nodes
    return float(np.sqrt(np.mean(x[moving] ** 2))), float(np.sqrt(np.mean(v[moving] ** 2)))


def start_nodes(e: Experiment, values: Mapping[str, float]) -> Array | None:
    """(nodes, 3) m, where a motion starts at values of its scene's quantities, if that is not where the scene does."""
    if e.start == "settled":
        return settled(e, values)
    return equilibrium(e.scene, values=values).nodes if e.start == "equilibrium" else None


def settled(e: Experiment, values: Mapping[str, float]) -> Array:
    """(nodes, 3) m, where the scene starts once rigid links hold, at values of its quantities."""
    compiled, solver = e.scene.compiled, replace(e.solver, extrapolate=1)
    with divergence(e.scene):
        return solver.core(compiled).settled(compiled.inputs(compiled.values(values)), 0.0).reshape(-1, 3)
