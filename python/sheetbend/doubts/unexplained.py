"""Whether a fit explains the motion that it was made from.

Intervals take what a fit leaves for noise. Where it leaves most of the motion, the minimum says little of the motion's
parameters: a model that rings where the recording has come to rest is pulled toward whatever rings least. So the
variance over time that is left is compared with that of the measured motion, marker by marker. Constant offsets count
in neither, since a shape that is missed is no motion that is missed.

Where markers drive a scene, most of the motion is carried along by them, and a model of any stiffness has that. What is
to be explained is then the motion beside that of markers which move rigidly with the grips (`experiment.carried`).
There a shape that is missed counts too, where it spoils the prediction: a model whose error is more than a third of
that without physics, both in the fitted and in the held-out part, does not move as what was recorded.

Forces and torques of a sensor are asked in the same way, the two apart. What is within their sigma is noise.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..arrays.timeseries import mean_position
from ..arrays.types import Array
from ..experiment.carried import Values, carried_baselines
from ..problem.problem import FitProblem
from ..quantities.wording import short
from ..statistics.white_noise import white_variance
from .force_comparison import UNITS
from .prediction import Comparison

Mask = NDArray[np.bool_]

MOST = 0.5
"""Of the motion's variance beyond noise: a fit that leaves more of it does not explain the motion. The fits of the
shipped experiments leave at most about 20 %, by their logged reports; those that were built to mislead, without a loss
that the motion has, leave 106 to 2,400 %."""
NOISY = 4.0  # of the noise's variance: what is left is none
WORSE = 0.02  # of the motion's variance: by so much a prediction that nothing moves must be better
CHANCE = 4.0  # standard deviations
SEEN = 3.0  # sigmas: an error that can be told from noise
REST = "that nothing moves"
THIRD = 1 / 3
"""Of the error without physics, both in the fitted and in the held-out part of a driven scene. In the shipped
experiments the held-out error is 4 % of it (twin cloth) and 6 % (held cloth)."""
NOISELESS = 1e-6  # of sigma squared: residuals that are as good as none


@dataclass(frozen=True)
class Shares:
    """Variances over time of one recording's fitted part, per sample and summed over the axes, m^2.

    Attributes:
        left: of measured minus simulated markers.
        moved: of measured markers, or of these minus where the grips would carry them, if that is less.
        carried: whether it is.
        noise: of their noise: as told, or as second differences show it where that is more.
        samples: number of them, times the axes.
    """

    left: float
    moved: float
    noise: float
    samples: int
    carried: bool = False


def unexplained(
    problem: FitProblem, comparisons: Sequence[Comparison], alike: float, u: Array | None = None
) -> dict[str, str]:
    """By free parameter, the fitted motion that depends on it and that the fit does not explain.

    Args:
        comparisons: of all experiments, at the values of the fit.
        alike: frames of residual that count as one.
        u: (free,) the values of the fit, for where the grips are; as the scenes have them by default.
    """
    known = {} if u is None else {e.name: problem.values_of(e, u) for e in problem.experiments}
    found: dict[str, str] = {}
    for c in comparisons:
        if c.experiment.static or c.experiment.predict is not None:
            continue
        words = _words(c, alike, known) or _hardly_better(c, known) or next(_of_forces(c), "")
        if words:
            found |= {name: words for name in problem.acting_on(c.experiment) if name not in found}
    return found


def shares(c: Comparison, values: Values | None = None) -> Shares | None:
    """Shares of the fitted part of a comparison; None where it holds no motion.

    Args:
        values: see `carried_baselines`.
    """
    axes = ["xyz".index(a) for a in c.experiment.axes]
    fitted = ~c.held_out
    measured, seen = c.recording.positions[fitted][..., axes], c.recording.mask[fitted]
    if int(seen.sum()) <= seen.shape[1]:
        return None
    told = c.experiment.sigma**2 * len(axes)
    residual = np.where(seen[..., None], c.simulated[fitted][..., axes] - measured, np.nan)
    left, moved = (_variance(x, seen, c.experiment.loss) for x in (residual, measured))
    part = c.recording.frames(fitted)
    carried = carried_baselines(c.experiment, [(c.experiment, part)], part, values)
    beside = [_variance(measured - x[..., axes], seen, c.experiment.loss) for x in carried.values()]
    least = min(beside, default=np.inf)
    three = seen[:-2] & seen[1:-1] & seen[2:]
    noise = max(told, white_variance(measured, three))
    return Shares(left, min(moved, least), noise, int(seen.sum()) * len(axes), least < moved)


def _variance(x: Array, seen: Mask, loss: str) -> float:
    """Mean squared distance of what is seen (frames, markers, axes) from each marker's mean; the median where the fit
    puts up with outliers."""
    squares = ((x - mean_position(x)) ** 2).sum(axis=-1)[seen]
    return float(squares.mean() if loss == "squares" else np.median(squares))


def _words(c: Comparison, alike: float, values: Values) -> str:
    """Why the motion counts as unexplained; empty where it does not."""
    s = shares(c, values)
    if s is None or s.left <= NOISELESS * c.experiment.sigma**2:
        return ""
    name, axes = c.experiment.name, len(c.experiment.axes)
    by_chance = CHANCE**2 * alike * (s.left / axes) / (s.samples / axes)
    if s.left - s.moved > max(WORSE * s.moved, by_chance):
        more = short(100 * (s.left / s.moved - 1), 2) if s.moved > 0 else ""
        how = f" {more} % more variance over time than" if more else " more than"
        beside, better = (" beside that of its grips", "a motion with the grips alone") if s.carried else ("", REST)
        return (
            f"the fit leaves{how} the measured motion of {name} has{beside}: {better} would explain it better. The "
            "model moves where the recording does not, as without a loss that the recording shows"
        )
    beyond = s.moved - s.noise
    if s.left > NOISY * s.noise and s.left - s.noise > MOST * beyond > 0:
        missed = short(100 * (s.left - s.noise) / beyond, 2)
        beside = " beside that of its grips" if s.carried else ""
        return (
            f"the fit leaves {missed} % of the variance over time of the motion of {name}{beside}, so it does not "
            "explain that motion; the model lacks something, such as a loss, or this is not the lowest minimum"
        )
    return ""


def _hardly_better(c: Comparison, values: Values) -> str:
    """Why both parts of a driven motion count as not predicted; empty where one is, or nothing is held out."""
    fitted, e = ~c.held_out, c.experiment
    told = SEEN * e.sigma * float(np.sqrt(len(e.axes)))
    part = c.recording.frames(fitted)
    if c.baseline is None or not c.recording.mask[fitted].any() or not c.recording.mask[c.held_out].any():
        return ""
    carried = carried_baselines(e, [(e, part)], part, values)
    beside = replace(c, recording=part, held_out=np.zeros(len(part.times), dtype=bool))
    every = np.ones(len(part.times), dtype=bool)
    here = min((beside.rms(every, x) or 0.0 for x in carried.values()), default=0.0)
    there = c.rms(c.held_out, c.baseline) or 0.0
    errors = [c.rms(fitted) or 0.0, c.rms(c.held_out) or 0.0]
    if not all(
        error > max(THIRD * base, told) and base > 0.0 for error, base in zip(errors, (here, there), strict=True)
    ):
        return ""
    said = " and ".join(f"{short(100 * error / base, 2)} %" for error, base in zip(errors, (here, there), strict=True))
    return (
        f"the error in the fitted and in the held-out motion of {e.name} is {said} of that without physics "
        f"(markers carried by the grips; {c.baseline_words}), so the model hardly predicts it: the ends may be held "
        "otherwise, as in clamps where it lets them turn"
    )


def _of_forces(c: Comparison) -> Iterator[str]:
    """Why the forces or torques of a sensor count as unexplained."""
    for sensor, one in zip(c.experiment.forces, c.forces, strict=True):
        told = (sensor.sigma, sensor.torque_sigma or 0.0)
        for kind, (_, columns), sigma in zip(("forces", "torques"), UNITS, told, strict=True):
            y, x = one.measured[one.fitted][:, columns], one.simulated[one.fitted][:, columns]
            counts = np.isfinite(y).any(axis=0)
            y, x = y[:, counts], x[:, counts]
            y, x = (each[np.isfinite(y).all(axis=1)] for each in (y, x))
            if len(y) < 3 or not y.size:
                continue
            left, moved = (float(np.var(each, axis=0).sum()) for each in (y - x, y))
            noise = max(sigma**2 * y.shape[1], white_variance(y))
            if left > NOISY * noise and left - noise > MOST * (moved - noise) > 0.0:
                missed = short(100 * (left - noise) / (moved - noise), 2)
                yield (
                    f"the fit leaves {missed} % of the variance over time of the {kind} of {one.sensor}, so it does "
                    "not explain them; they may have another sign, axes or unit, or the model lacks something"
                )
