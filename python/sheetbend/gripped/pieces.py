"""Pieces of recordings as experiments, and the least-squares problem of several of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..experiment.experiment import Experiment
from ..problem.problem import FitProblem
from ..quantities.parameters import Parameter, Parameters
from .model import RopeModel
from .motion import GrippedMotion
from .slid import window_of
from .windows import Span, places


def experiments_of(
    model: RopeModel, motions: Sequence[GrippedMotion], span: Span, values: Mapping[str, float]
) -> list[Experiment]:
    """The model on the windows of a span, each predicted open loop from its first frame, with what had slid before it
    at these values."""
    return [window_of(model, m, (start, start + span[0]), values) for m, start in places(motions, span)]


def numbered(experiments: Sequence[Experiment]) -> list[Experiment]:
    """The same with names that differ."""
    return [replace(e, name=f"{i}: {e.name}") for i, e in enumerate(experiments)]


def problem_of(
    experiments: Sequence[Experiment],
    parameters: Sequence[Parameter],
    values: Mapping[str, float],
    threads: int = 1,
) -> FitProblem:
    """Free parameters start at `values`; other quantities keep them."""
    free = {p.name for p in parameters}
    known = experiments[0].scene.quantities
    start = {name: q.value for name, q in known.items()} | dict(values)
    held = [
        Parameter(name=name, initial=start[name], fixed=True) for name in known if name in values and name not in free
    ]
    return FitProblem(experiments, Parameters([*starting(parameters, start), *held]), threads=threads)


def starting(parameters: Sequence[Parameter], values: Mapping[str, float]) -> list[Parameter]:
    """The parameters with these initial values, inside their bounds."""
    return [
        replace(p, initial=float(np.clip(values[p.name], p.lower, p.upper)))
        if p.tied_to is None and p.name in values
        else p
        for p in parameters
    ]
