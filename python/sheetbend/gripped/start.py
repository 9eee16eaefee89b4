"""Where the recipe starts: stiff and damped, the safe side; and the model with all that its rungs may add."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..experiment.experiment import Experiment
from ..quantities.parameters import Parameter, Parameters
from .ladder import Rung
from .model import NAME, RopeModel
from .motion import GrippedMotion


def started(model: RopeModel, motions: Sequence[GrippedMotion], bending_length: float) -> RopeModel:
    """The model with the values of a start, its stiffness that of a bending length (EI/(density g))^(1/3), m."""
    EI = model.density * 9.81 * bending_length**3
    start = {"EI": EI, "GJ": 0.7 * EI, "bend_damping": 0.03, "twist_damping": 0.03, "drag_linear": 0.02}
    return model.with_values(**start, length=float(np.mean([m.length for m in motions])))


def about(parameters: Sequence[Parameter], model: RopeModel) -> tuple[Parameter, ...]:
    """The parameters, with the prior of the length about that of a started model."""
    measured = model.values["length"]
    assert measured is not None
    return tuple(
        replace(p, initial=measured, prior=(measured, p.prior[1])) if p.name == f"{NAME}_length" and p.prior else p
        for p in parameters
    )


def whole(
    model: RopeModel, ladder: Sequence[Rung], motion: GrippedMotion, seconds: float
) -> tuple[Experiment, Parameters]:
    """A piece of a recording with everything that the rungs add to a started model, and all of their parameters."""
    wanted: list[Parameter] = []
    for rung in ladder:
        model = rung.added_to(model)
        wanted += rung.wanted(motion)
    times = motion.recording.times
    first = next((k for k in range(len(times)) if motion.shown(k)), 0)
    e = model.experiment(motion, (float(times[first]), min(float(times[first]) + seconds, float(times[-1]))))
    known = e.scene.quantities
    return e, Parameters(
        p if p.tied_to is not None else replace(p, initial=float(np.clip(known[p.name].value, p.lower, p.upper)))
        for p in wanted
    )
