"""What markers weigh where the model has them without a mass."""

from __future__ import annotations

import numpy as np

from ..arrays.types import Array
from ..experiment.experiment import Experiment

MOST_EACH = 1e-4  # kg each: a small ball or a piece of tape
SHARE = 0.005  # of what carries them, all together


def marker_load(e: Experiment) -> Array:
    """(nodes,) kg that free nodes carry for each kg that every marker weighs. Markers on rigid bodies are left out: the
    mass of a body contains them."""
    weights = np.zeros(e.scene.node_count)
    for place in e.compared_places:
        if place.body is None:
            np.add.at(weights, list(place.particles), place.weights)
    weights[e.scene.held] = 0.0
    return weights


def unseen_mass(e: Experiment, mass: Array) -> float:
    """kg that each marker may well weigh although the model gives it no mass; 0 where none sits on anything free.

    Args:
        mass: (nodes,) of the model.
    """
    if e.is_cloud or not marker_load(e).any():
        return 0.0
    free = np.ones(len(mass), dtype=bool)
    free[e.scene.held] = free[e.scene.particle_count :] = False
    return min(MOST_EACH, SHARE * float(mass[free].sum()) / len(e.compared_places))
