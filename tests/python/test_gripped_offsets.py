"""Markers beside the rope: what they move is counted, and what is no offset is not taken for one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from sheetbend.gripped import GrippedMotion
from sheetbend.gripped.judging import predict
from sheetbend.gripped.offsets import offset_reach
from sheetbend.minimum.optimizers import minimize
from sheetbend.problem.problem import FitProblem
from sheetbend.quantities.parameters import Parameter, Parameters
from test_gripped_motion import carried_about, model_of

NOISE, OFFSET = 2e-4, 1e-3  # m
NAMES = ("rope_EI", "rope_start_tilt_1", "rope_start_tilt_2", "rope_end_tilt_1", "rope_end_tilt_2")
WANTED = [Parameter(name=NAMES[0], initial=0.02, log=True), *(Parameter(name=name, initial=0.0) for name in NAMES[1:])]
MOTION = GrippedMotion.of(carried_about(), 0.0)
MODEL = model_of(MOTION, tilts=True, smoothing=0.0)
(CLEAN,) = predict(MODEL, [MOTION], {})


def across() -> np.ndarray:
    """(frames, markers, 2, 3): out of the plane of the rope, and in it."""
    along = np.gradient(CLEAN, axis=1)
    out = np.cross(along, (0.0, 1.0, 0.0))
    out /= np.linalg.norm(out, axis=2, keepdims=True)
    return np.stack([np.broadcast_to((0.0, 1.0, 0.0), out.shape), out], axis=2)


def fitted(noise: float, offset: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """What offsets and noise of the free markers move, internal, and how far it may move by `offset_reach`."""
    random = np.random.default_rng(seed)
    free = list(MOTION.free)
    x = CLEAN.copy()
    x[:, free] += np.einsum("mk,fmkx->fmx", offset * random.standard_normal((len(free), 2)), across()[:, free])
    x[:, free] += noise * random.standard_normal(x[:, free].shape)
    seen = replace(MODEL.experiment(MOTION), recording=replace(MOTION.recording, positions=x))
    problem = FitProblem([seen], Parameters(WANTED))
    end = minimize(problem, problem.parameters.initial())[0].u
    reach = offset_reach(problem, end)
    physical = problem.parameters.to_physical(end)
    return end - problem.parameters.initial(), np.array(
        [reach[n] / (physical[n] if n == NAMES[0] else 1) for n in NAMES]
    )


def test_it_covers_what_offsets_move() -> None:
    """Of 40 draws 95 % are expected inside, and a root mean square of 0.46 to 0.51; five sixths must be."""
    ratios = np.array([moved / reach for moved, reach in (fitted(0.0, OFFSET, seed) for seed in range(40))])
    assert ((np.abs(ratios) < 1).mean(axis=0) > 5 / 6).all()
    size = np.sqrt(np.square(ratios).mean(axis=0))
    assert (size > 0.35).all() and (size < 0.65).all()


def test_frames_need_not_lie_on_substeps() -> None:
    jitter = 0.002 * np.sin(np.arange(len(MOTION.recording.times)))
    jitter[[0, -1]] = 0.0
    seen = MODEL.experiment(GrippedMotion.of(replace(MOTION.recording, times=MOTION.recording.times + jitter), 0.0))
    problem = FitProblem([seen], Parameters(WANTED))
    assert min(offset_reach(problem, problem.parameters.initial()).values()) >= 0.0


def test_noise_is_not_taken_for_offsets() -> None:
    _, with_offsets = fitted(NOISE, OFFSET, 0)
    _, without = fitted(NOISE, 0.0, 0)
    assert (without < 0.05 * with_offsets).all()
