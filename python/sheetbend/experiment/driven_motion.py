"""The motion of the markers that drive a scene, as a fit with `driven_sigma` estimated it: made from the correction
that the fit found, and given to a scene instead of the recorded motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..arrays.smoothing import FEWEST, steadiest
from ..arrays.timeseries import interpolate, mean_position
from ..arrays.types import Array
from ..errors import RecordingError
from ..recording.recording import Recording
from .correction import Correction
from .experiment import Experiment

SAME_TIME = 1e-6  # s
WIDTHS = tuple(2.0 ** (k / 4) for k in range(4, 30))  # times that of the fewest frames
FAR, PART = 10.0, 0.1
"""Times `driven_sigma`, and of the recorded sway: a motion that is farther off was estimated from another recording."""


def recorded_motion(e: Experiment) -> Recording | None:
    """The markers that the scene of an experiment follows at every knot of their motion, gaps closed; of an equilibrium
    one mean frame. None where it follows none, or where the knots are no frames of the recording."""
    correction = _every_knot(e)
    if correction is None or not set(correction.markers) <= set(e.recording.markers):
        return None
    recording = e.recording.select(correction.markers)
    if e.static:
        part = recording if e.fit is None else recording.piece(*e.fit)
        return _plain(e, correction, part.times[:1], mean_position(part.positions)[None])
    knots = e.scene.boundary.times[: correction.knots] + e.t0
    frames = np.abs(recording.times - knots[:, None]).argmin(axis=1)
    times = recording.times[frames]
    if np.abs(times - knots).max() > SAME_TIME:
        return None
    closed = interpolate(recording.times, recording.positions, times, "cubic", np.inf)
    return None if np.isnan(closed).any() else _plain(e, correction, times, closed)


def estimated_motion(e: Experiment, correction: Array) -> Recording | None:
    """The motion of the followed markers as a fit estimated it; None as for `recorded_motion`.

    Behind the fitted part no compared marker tells of their noise. There the motion is smoothed, by the polynomials
    that generalized cross-validation chooses; as recorded where these would move it by more than its noise explains.

    Args:
        correction: (knots, markers, 3) m, of the fit (`Fit.corrections`), which ends behind the fitted part.
    """
    recorded = recorded_motion(e)
    return None if recorded is None else replace(recorded, positions=_estimated(e, recorded, correction))


def continued(e: Experiment, correction: Array) -> Array:
    """(knots, markers, 3) m, what `estimated_motion` adds to the recorded motion at every knot; the correction itself
    where that is None."""
    recorded = recorded_motion(e)
    return correction if recorded is None else _estimated(e, recorded, correction) - recorded.positions


def _estimated(e: Experiment, recorded: Recording, correction: Array) -> Array:
    """(knots, markers, 3) m, the recorded motion corrected, and smoothed behind the fitted part."""
    times, positions = recorded.times, recorded.positions.copy()
    known = len(times) if e.static else int(np.searchsorted(times, e.fitted().times[-1] + SAME_TIME))
    positions[:known] += correction[:known]
    if known < len(times):
        positions[known:] = _behind(times, recorded.positions, positions, known, e.driven_noise or 0.0)
    return positions


def _behind(times: Array, recorded: Array, positions: Array, known: int, noise: float) -> Array:
    """Positions (knots, markers, 3) from the knot `known` on, smoothed as suits the recorded ones there, whose noise is
    given. Of a smoother that gives a frame the weight w in its own value, the residuals of noise have the variance
    (1 - w) noise^2. A bias adds its square to that, and may not exceed what smoothing gains, which is as much again."""
    then, there = times[known:], recorded[known:]
    smoother = steadiest(then, there, (FEWEST - 1) * float(np.median(np.diff(times))), WIDTHS)
    if smoother is None:
        return positions[known:]
    value, own = smoother.of(then, there)
    if np.mean((value - there) ** 2) > 2.0 * (1.0 - own) * noise**2:
        return positions[known:]
    return smoother.of(times, positions)[0][known:]


def following(e: Experiment, motion: Recording) -> Experiment:
    """The experiment with a scene that follows `motion` instead of what its recording holds of these markers.

    Raises:
        RecordingError: it is not a motion of the followed markers at every frame from the scene's start on, or too far
            from the recorded one.
    """
    recorded, correction = recorded_motion(e), _every_knot(e)
    again = "fit again, or leave it out to follow the recorded motion"
    if recorded is None or correction is None:
        raise RecordingError("driven_motion", "needs a scene that follows markers of its recording", motion.name, again)
    if set(motion.markers) != set(recorded.markers):
        problem = f"must be of the markers that drive the scene, {', '.join(recorded.markers)}"
        raise RecordingError("driven_motion", problem, motion.markers, again)
    frames = np.abs(motion.times - recorded.times[:, None]).argmin(axis=1)
    missing = recorded.times[np.abs(motion.times[frames] - recorded.times) > SAME_TIME]
    if len(missing):
        raise RecordingError("driven_motion", f"lacks the frame at {missing[0]:.6g} s", motion.name, again)
    numbers = motion.select(recorded.markers).positions[frames] - recorded.positions
    if np.isnan(numbers).any():
        at = recorded.times[np.isnan(numbers).any(axis=(1, 2))][0]
        raise RecordingError("driven_motion", f"has a gap at {at:.6g} s", motion.name, again)
    far, sway = float(np.sqrt(np.mean(numbers**2))), recorded.positions - recorded.positions.mean(axis=0)
    if far > max(FAR * (e.driven_noise or 0.0), PART * float(np.sqrt(np.mean(sway**2)))):
        problem = f"is {1e3 * far:.3g} mm from the recorded motion (of one coordinate), as from another recording"
        raise RecordingError("driven_motion", problem, motion.name, again)
    return _with_corrections(e, correction, numbers)


def corrected(e: Experiment, correction: Array) -> Experiment:
    """The experiment with a scene that follows what `continued` makes of a fit's correction."""
    every, numbers = _every_knot(e), continued(e, correction)
    if every is None:
        return e
    full = np.zeros(every.shape)
    full[: len(numbers)] = numbers[: len(full)]
    return _with_corrections(e, every, full)


def _with_corrections(e: Experiment, correction: Correction, numbers: Array) -> Experiment:
    scene = e.scene.shallow()
    scene.boundary = e.scene.boundary.moved(correction.added(e.scene.boundary.values, numbers))
    return replace(e, scene=scene)


def _every_knot(e: Experiment) -> Correction | None:
    return Correction.of(e.scene, None if e.static else np.inf)


def _plain(e: Experiment, correction: Correction, times: Array, positions: Array) -> Recording:
    return Recording(positions, times, markers=correction.markers, name=f"driven_{e.name}")
