"""Pieces of recordings as experiments, and the least-squares problem of several of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..experiment import Experiment, Window
from ..parameters import Parameter, Parameters
from ..problem import FitProblem
from .model import RopeModel
from .motion import GrippedMotion


def windows_of(motions: Sequence[GrippedMotion], window: Window) -> list[tuple[GrippedMotion, Window]]:
    """(motion, (start, stop) in s) of windows of one length, spread over all motions, of about the total time.

    Args:
        window: (length, total) in s; an infinite total takes all there are.
    """
    length, total = window
    whole = [float(m.recording.times[-1] - m.recording.times[0]) for m in motions]
    places = [
        (m, (start, start + length))
        for m, duration in zip(motions, whole, strict=True)
        for start in (m.recording.times[0] + length * np.arange(max(1, int(duration / length + 1e-9)))).tolist()
        if m.shown(int(np.searchsorted(m.recording.times, start - 1e-9)))
    ]
    count = len(places) if np.isinf(total) else max(1, min(len(places), round(total / length)))
    return [places[i] for i in np.unique(np.linspace(0, len(places) - 1, count).astype(int))]


def experiments_of(model: RopeModel, motions: Sequence[GrippedMotion], window: Window) -> list[Experiment]:
    """The model on `windows_of` the motions, each predicted open loop from its first frame."""
    return [model.experiment(m, span) for m, span in windows_of(motions, window)]


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
