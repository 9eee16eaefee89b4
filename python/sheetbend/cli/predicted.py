"""Predicted markers as recordings: what `simulate` and `fit` leave for other programs."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np

from .. import _core
from ..experiment.experiment import Experiment
from ..motion.core_terms import divergence
from ..problem.problem import NOTHING
from ..recording.recording import Recording

PREDICTED = "predicted_"


def predicted_files(names: Iterable[str]) -> list[str]:
    """The files that `save_predicted` writes of experiments."""
    return [f"{PREDICTED}{name}{suffix}" for name in names for suffix in (".npz", ".json")]


def save_predicted(measured: Recording, simulated: np.ndarray, name: str, folder: Path) -> list[str]:
    """Write the simulated markers (frames, markers, 3) m of a (part of a) recording as an NPZ with its JSON, which
    `Recording.load` reads; the files' names."""
    told = {"about": f"simulated markers at the times of the recording {measured.name}"}
    recording = replace(measured, positions=simulated, name=f"{PREDICTED}{name}", metadata=told)
    recording.save(folder / f"{PREDICTED}{name}.npz")
    return predicted_files([name])


def at_starting_values(e: Experiment, duration: float | None) -> tuple[Recording, np.ndarray]:
    """The compared markers of a recording from the scene's start on, as recorded and as simulated at the scene's
    values, (frames, markers, 3) m."""
    if e.static:
        part = e.fitted()
    else:
        stop = None if duration is None else e.t0 + duration
        start = "settled" if e.start == "estimated" else e.start
        whole = replace(
            e, start=start, fit=None, held_out=None, start_time=e.t0, recording=e.recording.piece(e.t0, stop)
        )
        part = whole.fitted()
    theta = e.scene.compiled.theta
    problem = _core.Problem(
        experiments=[e.core(part, NOTHING)], theta=theta, slots=[list(range(len(theta)))], free=[], threads=1
    )
    with divergence(e.scene):
        return part, problem.simulate(0, np.zeros(0)).reshape(part.positions.shape)
