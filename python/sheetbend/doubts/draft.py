"""What a draft changes of a motion whose air is taken to stand still.

Drag is -(c1 + c2 |v|) v of each particle, with v its velocity in the air. Where the air moves at w, that is to first
order a further force c1 w + c2 (|v| w + (v . w) v / |v|), with v from the motion in still air.
"""

from __future__ import annotations

import copy
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..arrays.timeseries import Array
from ..experiment.experiment import Experiment
from ..experiment.found_start import start_nodes
from ..minimum.problem import FitProblem
from ..motion.simulate import simulate
from ..recording.recording import Recording
from ..scene.air import WIND
from .tangents import Input

KNOTS = 50  # over a motion, between which the force of drag that grows with the speed is linear


def drafts(problem: FitProblem, u: Array, i: int, inputs: Array) -> tuple[FitProblem, list[Input]]:
    """The problem at u (free,), with forces for a draft in the i-th experiment, and what 1 m/s along each axis adds to
    them. None are added where nothing has drag, and where the scene has a wind already.

    Args:
        inputs: of the experiment's scene there.

    Raises:
        SheetbendError: the motion has no answer there.
    """
    e, recording = problem.experiment_at(i, u), problem.recordings[i]
    if e.static or not e.scene.has_drag or any(name.startswith(WIND) for name in e.scene.quantities):
        return problem, []
    values = problem.values_of(e, u)
    drag = _drag(e, inputs)
    particles = np.flatnonzero(drag.any(axis=0))
    if not len(particles):
        return problem, []
    forces = copy.deepcopy(e.scene.forces)
    if drag[1].any() and forces.particles and len(forces.times) == 1:
        return problem, []  # forces that do not change leave no room for those of a draft that do
    times = forces.times if forces.particles else _knots(e, recording, values, drag[1])
    new = particles[~np.isin(particles, forces.particles)]
    forces.add(new, np.zeros((len(times), len(new), 3)), times)
    scene = e.scene.shallow()
    scene.forces = forces
    made = problem.of([replace(e, scene=scene) if k == i else other for k, other in enumerate(problem.experiments)])
    slot = {p: k for k, p in enumerate(forces.particles)}
    slots = np.array([slot[p] for p in particles.tolist()])
    where = np.arange(len(times))[:, None] * len(slot) + slots
    per_speed = _per_speed(e, values, times, drag[:, particles], particles)
    entries = (3 * where[..., None] + np.arange(3)).ravel()
    return made, [("force", entries, per_speed[..., axis].ravel()) for axis in range(3)]


def _drag(e: Experiment, inputs: Array) -> Array:
    """(2, particles) c1 and c2 of those that are free to move."""
    firsts = [e.scene.compiled.layout[array][0] for array in ("drag_linear", "drag_quadratic")]
    drag = np.array([inputs[first : first + e.scene.particle_count] for first in firsts])
    drag[:, [p for p in e.scene.held if p >= 0]] = 0.0
    return drag


def _knots(e: Experiment, recording: Recording, values: dict[str, float], quadratic: Array) -> Array:
    """Times of the forces, s: one is enough for what does not change."""
    if not quadratic.any():
        return np.zeros(1)
    until = float(e.scene_times(recording.times[-1:], values)[0])
    return np.unique(np.rint(np.linspace(0.0, until, KNOTS) / e.solver.h)) * e.solver.h


def _per_speed(
    e: Experiment, values: dict[str, float], times: Array, drag: Array, particles: NDArray[np.integer]
) -> Array:
    """(knots, particles, 3, 3) N s/m, the force per velocity of the air."""
    linear, quadratic = drag[..., None, None]
    found = np.broadcast_to(linear * np.eye(3), (len(times), len(particles), 3, 3))
    if not quadratic.any():
        return found
    at = np.clip(np.rint(times / e.solver.h), 0, None) * e.solver.h
    v = simulate(e.scene, at, e.solver, values, start_nodes(e, values)).velocities[:, particles]
    speed = np.linalg.norm(v, axis=-1)[..., None, None]
    along = v[..., :, None] * v[..., None, :] / np.maximum(speed, np.finfo(float).tiny)
    return np.asarray(found + quadratic * (speed * np.eye(3) + along))
