"""Damping in elements that a model gives a stiffness and no damping.

Kelvin-Voigt damping of a time constant, of a third of a frame interval, of a whole one and of three: what a motion that
was recorded at these intervals may show. Or a time constant that is fitted along.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..arrays.types import Array
from ..experiment.experiment import Experiment
from ..problem.problem import FitProblem
from ..quantities.parameters import Parameter
from ..quantities.quantities import Quantity, Term
from ..scene.group import places_of_groups
from ..scene.scene import Scene
from .more_parameters import with_parameter

DAMPING = Parameter(name="[damping]", initial=1.0, log=True)  # in intervals between frames
FRAMES = (1 / 3, 1.0, 3.0)  # intervals between frames: the time constants that are tried


def undamped(scene: Scene) -> list[int]:
    """Places of the groups that have a stiffness and no damping."""
    compliance = scene.compiled.part(scene.compiled.inputs(), "compliance")
    return [
        k
        for k, places in enumerate(places_of_groups(scene.groups))
        if not places.group.damped and (compliance[places.constraints] > 0.0).any()
    ]


def with_damping(problem: FitProblem, u: Array, frames: float, only: str = "") -> FitProblem:
    """The problem with a damping of so many frame intervals in all undamped groups of its motions, or in one of them by
    name."""
    theta, slots, _ = problem.known(u)
    return problem.of(
        [
            e if e.static else _damped(e, theta[own], float(np.median(np.diff(recording.times))), frames, only)
            for e, own, recording in zip(problem.experiments, slots, problem.recordings, strict=True)
        ]
    )


def with_free_damping(problem: FitProblem, u: Array, only: str) -> FitProblem:
    """The same problem with one more parameter at the end, the damping as a number of frame intervals."""
    return with_parameter(with_damping(problem, u, 1.0, only), DAMPING)


def _damped(e: Experiment, theta: Array, interval: float, frames: float, only: str) -> Experiment:
    """The experiment with Kelvin-Voigt damping in its undamped groups. The time constant is `frames` intervals [s]
    between frames; the force per rate is this time over the compliance."""
    every = list(places_of_groups(e.scene.groups))
    compliance = e.scene.compiled.part(e.scene.compiled.inputs(theta), "compliance")
    scene, name = e.scene.shallow(), DAMPING.name
    scene.groups, scene.terms = list(scene.groups), list(scene.terms)
    scene.quantities = {**scene.quantities, name: Quantity(name, frames, "")}
    for k in undamped(e.scene):
        g, own = every[k].group, every[k].constraints
        if only in ("", g.name):
            own = own[compliance[own] > 0.0]
            scene.groups[k] = replace(g, damped=True, damping=np.zeros(len(g.particles)))
            scene.terms.append(Term("damping", own, interval / compliance[own], ((name, "identity"),)))
    return replace(e, scene=scene)
