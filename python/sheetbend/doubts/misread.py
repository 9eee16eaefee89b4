"""What a large misfit looks like: markers in another order, turned or mirrored axes, another unit or frame rate.

Intervals take what a fit leaves for noise. Where that is a noticeable part of the motion, the cause is often how the
recording was read, or which way gravity points. These tests take no fit: simulated markers are put in another order,
turned, mirrored, scaled or taken at other times, and whichever of these leaves much less of the measured motion is
named. They are tried at the fitted values and at those that the fit began with, since a fit to misread markers may end
anywhere.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ..arrays.timeseries import linear, mean_position
from ..arrays.types import Array
from ..errors import SheetbendError
from ..experiment.experiment import Experiment
from ..optional import require
from ..problem.problem import FitProblem
from ..quantities.wording import short

Mask = NDArray[np.bool_]

NOTICEABLE = 0.02  # of the motion
SEEN = 3.0  # sigmas: what is left is no noise
EXPLAINS = 0.5  # of what is left, at most, where the markers are read otherwise
TURNED = 5.0  # degrees
SCALED = 0.2  # of the size
RATES = (1 / 4, 1 / 2, 4 / 5, 5 / 6, 6 / 5, 5 / 4, 2.0, 4.0)  # of frames, as told ones to those of the camera
CAUSES = "gravity, lengths, densities, clamps, clocks, a loss that the model lacks, the markers' order and places"


def misread(problem: FitProblem, u: Array) -> tuple[str, ...]:
    """A warning for every motion of which a fit that ended in u (free,) misses a noticeable part."""
    ok, r, _ = problem.evaluate(u)
    if not ok:
        return ()
    layout, warnings = problem.rows_layout(), []
    data = r[: len(layout.recording)]
    for i, (e, recording) in enumerate(zip(problem.experiments, problem.recordings, strict=True)):
        mine = data[(layout.recording == i) & (layout.clocks == 0)]  # of markers, without force sensors
        if e.is_cloud:
            warnings += far_off(e, mine)
            continue
        axes = ["xyz".index(a) for a in e.axes]
        seen, measured = recording.mask, recording.positions[..., axes]
        left = e.sigma * float(np.sqrt(np.sum(mine**2) / max(int(seen.sum()), 1)))
        motion = _rms(np.broadcast_to(mean_position(measured), measured.shape), measured, seen)
        if e.static or not left > max(NOTICEABLE * motion, SEEN * e.sigma * np.sqrt(len(axes))):
            continue
        simulated = [x[..., axes] for at in (u, problem.parameters.initial()) for x in _simulated(problem, i, at)]
        readings = [one for x in simulated for one in _better(x, measured, seen)]
        if not e.scene.boundary.driven and e.time_offset is None:
            times = recording.times - e.t0
            readings += [one for x in simulated for one in _clocked(x, measured, seen, times)]
        better = min(readings, key=lambda one: one[0], default=(np.inf, ""))
        missed = f"the fit misses {_percent(left, motion)} of the motion of {e.name}"
        if better[0] < EXPLAINS * left:
            found = f"it would miss {_percent(better[0], motion)} if the simulated markers were {better[1]}"
            warnings.append(f"{missed}; {found}. Check that they mean the same as the measured ones")
        else:
            warnings.append(f"{missed}, and the intervals take that for noise. Check {CAUSES}")
    return tuple(warnings)


def _percent(part: float, whole: float) -> str:
    return f"{short(100 * part / whole, 2)} %" if whole > 0 else "all"


def far_off(e: Experiment, residuals: Array) -> list[str]:
    """A warning for a cloud whose points (residuals in sigmas) lie where no noise puts them. Its points have no names,
    so no other order of them is tried."""
    left = float(np.sqrt(np.mean(residuals**2)))
    if not left > SEEN:
        return []
    return [
        f"{e.name}: the points of the cloud lie {short(1e3 * left * e.sigma, 2)} mm rms off the fitted motion, "
        f"{short(left, 2)} times their sigma, and the intervals take that for noise. Check sigma, gravity, lengths, "
        "densities, clamps and clocks, and whether points of other things were cut off"
    ]


def _simulated(problem: FitProblem, experiment: int, u: Array) -> list[Array]:
    """Markers (frames, markers, 3) of one experiment, none where the physics has no answer."""
    try:
        return [problem.simulate_one(experiment, u)]
    except SheetbendError:
        return []


def _rms(x: Array, y: Array, seen: Mask) -> float:
    return float(np.sqrt(((x - y) ** 2).sum(axis=-1)[seen].mean())) if seen.any() else 0.0


def _better(x: Array, y: Array, seen: Mask) -> list[tuple[float, str]]:
    """The readings that leave much less than x as it is."""
    plain = _rms(x, y, seen)
    return [one for one in _readings(x, y, seen) if one[0] < EXPLAINS * plain]


def _readings(x: Array, y: Array, seen: Mask) -> Iterator[tuple[float, str]]:
    """What is left of y (frames, markers, axes) when x is read otherwise, and how."""
    order = _order(x, y, seen)
    if list(order) != sorted(order):
        yield _rms(x[:, order], y, seen), f"in the order {', '.join(str(k + 1) for k in order)}"
    here, there = x[seen].mean(axis=0), y[seen].mean(axis=0)
    a, b = x - here, y - there
    inner = float((a[seen] ** 2).sum())
    size = float((a[seen] * b[seen]).sum()) / inner if inner > 0 else 1.0
    if size > 0 and abs(size - 1.0) > SCALED:
        yield _rms(size * a, b, seen), f"{short(size, 2)} times as far apart"
    if x.shape[-1] == 3:
        yield from _turned(a, b, seen)


def _clocked(x: Array, y: Array, seen: Mask, times: Array) -> Iterator[tuple[float, str]]:
    """What would be left if frames had been taken at other rates, and which, as far as the simulated motion goes. The
    frames that it reaches stand for all."""
    plain = _rms(x, y, seen)
    for rate in RATES:
        at = rate * times
        there = at <= times[-1]
        moved = linear(times, x, at[there])
        before = _rms(x[there], y[there], seen[there])
        if before > 0.0:
            left = plain * _rms(moved, y[there], seen[there]) / before
            if left < EXPLAINS * plain:
                yield left, f"taken at {short(rate, 3)} times the told times, as of another frame rate"


def _order(x: Array, y: Array, seen: Mask) -> Array:
    """(markers,) which simulated marker is nearest each measured one, all told (an assignment)."""
    d = ((x[:, :, None] - y[:, None]) ** 2).sum(axis=-1)
    cost = np.where(seen[:, None], d, 0.0).sum(axis=0) / np.maximum(seen.sum(axis=0), 1)
    rows, columns = require("scipy.optimize", "fit").linear_sum_assignment(cost)
    return np.asarray(rows[np.argsort(columns)])


def _turned(a: Array, b: Array, seen: Mask) -> Iterator[tuple[float, str]]:
    """Around their centers, by the best rotation, and by the best one with a mirror (Kabsch 1976, Acta Cryst. A32,
    922)."""
    left, _, right = np.linalg.svd(b[seen].T @ a[seen])
    sign = np.sign(np.linalg.det(left @ right))
    for mirrored in (1.0, -1.0):
        turn = left @ np.diag([1.0, 1.0, sign * mirrored]) @ right
        rotation = turn * mirrored
        angle = float(np.rad2deg(np.arccos(np.clip((np.trace(rotation) - 1.0) / 2.0, -1.0, 1.0))))
        if mirrored < 0:
            yield _rms(a @ turn.T, b, seen), "mirrored"
        elif angle > TURNED:
            axis = np.linalg.eigh(rotation + rotation.T)[1][:, -1]
            twist = rotation - rotation.T
            if axis @ [twist[2, 1], twist[0, 2], twist[1, 0]] < 0.0:
                axis = -axis
            along = ", ".join(short(round(float(c), 2) + 0.0) for c in axis)
            yield _rms(a @ turn.T, b, seen), f"turned by {short(angle, 2)} degrees about ({along})"
