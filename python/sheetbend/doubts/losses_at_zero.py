"""Losses that a model does not have: drag, and damping of elements that have a stiffness and no damping.

They stand at zero among the inputs of a simulation, where one tangent each tells what a little of them would change.
Damping is asked for only where something touches: elsewhere another integrator shows it (`missing_loss`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from ..arrays.types import Array
from ..experiment.experiment import Experiment
from ..quantities.wording import short
from ..scene.group import places_of_groups
from .absent_damping import undamped
from .tangents import Part

DRAGS = {"drag_linear": "N s/m", "drag_quadratic": "N s^2/m^2"}
DAMPING = "damping of "  # and the name of a group


def touches(e: Experiment) -> bool:
    """Whether anything can touch in an experiment's motion."""
    return not e.static and bool(e.scene.compiled.contacts or e.scene.compiled.touches_itself)


def with_losses(e: Experiment) -> Experiment:
    """The same experiment, on a scene that has inputs for these losses, at zero."""
    scene = e.scene.shallow()
    scene.has_drag = True
    if touches(e):
        scene.groups = list(scene.groups)
        for k in undamped(e.scene):
            group = scene.groups[k]
            scene.groups[k] = replace(group, damped=True, damping=np.zeros(len(group.particles)))
    return replace(e, scene=scene)


def losses_at_zero(e: Experiment, inputs: Mapping[str, Array], free: np.ndarray) -> Iterator[Part]:
    """The losses that an experiment's model lacks.

    Args:
        inputs: of its scene, by array.
        free: nodes that move.
    """
    mass = inputs["mass"]
    for array, unit in DRAGS.items():
        if not inputs[array].any():

            def says(size: float, array: str = array, unit: str = unit) -> str:
                return f"it had a {array} of {short(size, 2)} {unit} per kg, which the model lacks"

            yield array, (array, free, mass[free]), says
    every = list(places_of_groups(e.scene.groups))
    for k in undamped(e.scene) if touches(e) else ():
        name, own = every[k].group.name, every[k].constraints
        own = own[inputs["compliance"][own] > 0.0]

        def damped(size: float, name: str = name) -> str:
            return f"{name} had a damping of {short(1e3 * size, 2)} ms, which the model lacks"

        yield DAMPING + name, ("damping", own, 1.0 / inputs["compliance"][own]), damped


def is_loss(label: str) -> bool:
    """Whether a part that is missing, by its label, is a loss."""
    return label in DRAGS or label.startswith(DAMPING)
