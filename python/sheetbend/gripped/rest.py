"""A rope that rests when a window begins, which tells more of what had slid than a rope that moves.

At rest what has slid pulls against the weight, the grips and the elastic shape, and all are in balance. In thick air a
rope with another history creeps away from where it was seen, until its own balance holds it. So the motion that shows
the history is one between grips that stand still, compared with the recorded shape at its end.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..arrays.types import Array
from ..experiment.experiment import Experiment
from .model import RopeModel
from .motion import GrippedMotion

RESTS = 2.0  # mean square of slopes and bends of the first frames over that of noise, below which a rope rests
SECONDS, THICK = 0.6, 12.0  # s, of the creep, and 1/s, its drag over the density: about that of no overshoot
SEEN = 3  # frames at its end that are compared
SHAPE = 6e-4  # m, error of a shape: of the model, and of markers that sit beside the rope


def rests(motion: GrippedMotion, frames: Array, noise: float) -> bool:
    """Whether all markers are seen in some frames, three or more, and stand still.

    Args:
        frames: numbers.
        noise: m, standard deviation of a coordinate.
    """
    times, x = motion.recording.times[frames], motion.recording.positions[frames].reshape(len(frames), -1)
    seen = np.isfinite(x)
    whole = seen.all(axis=0)
    if not (seen.any(axis=0).all() and whole.any()):
        return False
    basis = np.linalg.qr(np.vander(times - times.mean(), 3, increasing=True))[0]
    return bool(np.mean((basis[:, 1:].T @ x[:, whole]) ** 2) < RESTS * noise**2)


def creep(model: RopeModel, motion: GrippedMotion, frames: Array, noise: float) -> Experiment:
    """The rope in thick air, from its mean shape in some frames on, between grips that stand still.

    Args:
        frames: numbers, in which it rests (`rests`).
        noise: m, standard deviation of a coordinate.
    """
    recording = motion.recording
    step = float(np.median(np.diff(recording.times)))
    times = recording.times[frames[0]] + step * np.arange(round(SECONDS / step) + 1)
    still = np.repeat(np.nanmean(recording.positions[frames], axis=0)[None], len(times), axis=0)
    held = replace(
        motion,
        recording=replace(recording, times=times, positions=still),
        positions=still,
        velocities=np.zeros_like(still),
        steadied=None,
    )
    e = replace(model, substeps=1).with_values(drag_linear=THICK * model.density).experiment(held)
    sigma = np.sqrt(SEEN * (SHAPE**2 + noise**2 / len(frames)))  # of frames that show the same
    return replace(
        e, name=f"{e.name}, in thick air", fit=(float(times[-SEEN - 1]), float(times[-1])), sigma=float(sigma)
    )
