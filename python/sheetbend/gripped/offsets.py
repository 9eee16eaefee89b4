"""What markers beside the rope may do to its parameters.

A marker is glued to the rope's surface, one or two millimeters off its axis, the same way in every recording. What
the shape of the rope cannot take up of that stays in the residuals: a part that is constant in the rope's frame. Its
size gives that of the offsets, and the fit's Jacobian tells what unknown offsets of that size move. (Offsets along the
rope do not count: the places of the markers are measured, with their slack.)
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..arrays.types import Array
from ..experiment.experiment import Experiment
from ..motion.simulate import simulate
from ..objects.markers import Place
from ..objects.rod import Rod
from ..problem.problem import FitProblem
from ..recording.recording import Recording
from ..statistics.intervals import critical_t
from .model import NAME


def offset_reach(problem: FitProblem, u: Array, beside: Sequence[tuple[float, float]] = ()) -> dict[str, float]:
    """Half of the 95 % interval of each free parameter, in its unit, for independent offsets of one size about both
    directors.

    Args:
        problem: of experiments of a `RopeModel`.
        u: (free,) its minimum.
        beside: (free markers, 2) m, by which the recordings were moved onto the rope's axis already. Their size counts
            as if they had not been: what the shape of the rope can take up of them is as unknown.
    """
    _, r, J = problem.evaluate(u)
    layout = problem.rows_layout()
    rows = len(layout.frame)
    r, J, prior = r[:rows], J[:rows], problem.parameters.prior_jacobian()
    values = problem.parameters.to_physical(u)
    axes = [frames_at_markers(e, part, values) for e, part in zip(problem.experiments, problem.recordings, strict=True)]
    marker, axis = np.divmod(layout.channel, 3)
    count = 1 + int(marker.max())
    by_offset = np.zeros((rows, count, 2))  # residuals per meter
    for i, (e, own) in enumerate(zip(problem.experiments, axes, strict=True)):
        mine = np.flatnonzero(layout.recording == i)
        by_offset[mine, marker[mine]] = own[layout.frame[mine], marker[mine], :, axis[mine]] / e.sigma
    G = by_offset.reshape(rows, -1)
    if len(beside):
        r = r - G @ np.ravel(beside)
    # how the minimum moves, and what is left in the residuals, per meter
    zeros = np.zeros((len(prior), G.shape[1]))
    moved = -np.linalg.lstsq(np.vstack([J, prior]), np.vstack([G, zeros]), rcond=None)[0]
    seen = np.maximum(np.square(G).sum(axis=0), np.finfo(float).tiny)
    constant = G.T @ r / seen
    left = G.T @ (G + J @ moved) / seen[:, None]
    size = float(np.linalg.norm(constant) / np.linalg.norm(left))
    # a size from few offsets is itself uncertain (Satterthwaite)
    degrees = np.square(left).sum() ** 2 / np.square(left.T @ left).sum()
    reach = critical_t(degrees) * size * np.linalg.norm(moved, axis=1)
    end = problem.parameters.to_physical(u + reach)
    return {name: end[name] - values[name] for name in problem.parameters.free}


def frames_at_markers(e: Experiment, part: Recording, values: Mapping[str, float]) -> Array:
    """(frames, free markers, 2, 3): the rope's two directors at its markers, at the substeps nearest to the frames."""
    rod: Rod = e.scene.ropes[NAME]
    times = e.solver.h * np.rint((part.times - (e.start_time or 0.0)) / e.solver.h)
    x = simulate(e.scene, times, e.solver, values).nodes
    return np.stack([_directors(rod, place, x) for place in e.places if place is not None], axis=1)


def _directors(rod: Rod, place: Place, x: Array) -> Array:
    """(frames, 2, 3) unit vectors across the rope, of the link that a place is on."""
    nodes = list(place.particles)
    along = np.tensordot(np.asarray(place.tangent), x[:, nodes], axes=(0, 1))
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    where = {int(node): s for node, s in zip(rod.particles, rod.arc_length, strict=True)}
    s = sum(weight * where[node] for weight, node in zip(place.weights, nodes, strict=True))
    link = int(np.searchsorted(rod.arc_length, s, side="right")) - 1
    first = x[:, rod.directors[1 + link]]  # the first one is the grip's
    first = first - (first * along).sum(axis=1, keepdims=True) * along
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(along, first)], axis=1)
