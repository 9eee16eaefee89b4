"""What a draft changes of a motion whose air is taken to stand still: drag of each particle is against the air."""

from __future__ import annotations

import copy
from dataclasses import replace

import numpy as np

from ..arrays.types import Array
from ..problem.problem import FitProblem
from .tangents import Input


def drafts(problem: FitProblem, u: Array, i: int) -> tuple[FitProblem, list[Input]]:
    """The problem at u (free,), with a wind of zero in the i-th experiment, and what 1 m/s along each axis adds to it.
    None is added where nothing has drag, and where the scene has a wind already.

    Raises:
        SheetbendError: the motion has no answer there.
    """
    e = problem.experiment_at(i, u)
    if e.static or not e.scene.has_drag or any(t.array == "wind" for t in e.scene.terms):
        return problem, []
    scene = e.scene.shallow()
    scene.air = copy.copy(scene.air)
    scene.air.times, scene.air.wind = np.zeros(1), np.zeros((1, 3))
    made = problem.of([replace(e, scene=scene) if k == i else other for k, other in enumerate(problem.experiments)])
    return made, [("wind", np.array([axis]), np.ones(1)) for axis in range(3)]
