"""What windows of a rope's motion can show at most: bounds of its parameters, and words for an end that lies at one.

A damping far slower than a window holds the rope like a stiffness, and EI times damping is all that is seen: without a
bound a fit slides along that product to any EI. A turn more in the end grip is another way in which the rope was
gripped, which no continuous change leads to.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..quantities.parameters import Parameter
from ..quantities.wording import short
from .model import GRAVITY, NAME, RopeModel
from .motion import GrippedMotion

SLOWEST = 2.0  # damping time over the longest window
QUICKEST = 0.1  # damping time over the frame interval: losses of slow motion add up over many frames
BENDING_LENGTHS = (0.01, 10.0)  # over the rope's length: softer hangs as a chain, stiffer does not bend
REACHED = 1e-3  # of a bound, relative on a log scale


def bounded(
    parameters: Sequence[Parameter], model: RopeModel, motions: Sequence[GrippedMotion], window: float
) -> list[Parameter]:
    """The parameters with the bounds of a fit to windows of that length, s; narrower ones of their own stay."""
    limits = _limits(model, motions, window)
    return [_within(p, *limits[p.name]) if p.name in limits and p.tied_to is None else p for p in parameters]


def at_bounds(
    parameters: Sequence[Parameter],
    values: Mapping[str, float],
    model: RopeModel,
    motions: Sequence[GrippedMotion],
    window: float,
) -> tuple[str, ...]:
    """A sentence on every value that lies at such a bound."""
    found = []
    for p in bounded(parameters, model, motions, window):
        name, value = p.name.removeprefix(f"{NAME}_"), values.get(p.name)
        if value is None or p.tied_to is not None:
            continue
        for bound, above in ((p.lower, False), (p.upper, True)):
            near = REACHED * (bound if p.log else 1.0)
            if math.isfinite(bound) and abs(value - bound) <= near and name in WORDS:
                found.append(f"{name} ends at its bound, {short(bound)} {p.unit}: {WORDS[name][above]}")
    return tuple(found)


def _within(p: Parameter, lower: float, upper: float) -> Parameter:
    """With these bounds too, and a start between them."""
    lower, upper = max(p.lower, lower), min(p.upper, upper)
    return replace(p, lower=lower, upper=upper, initial=float(np.clip(p.initial or lower, lower, upper)))


def _limits(model: RopeModel, motions: Sequence[GrippedMotion], window: float) -> dict[str, tuple[float, float]]:
    frame = float(np.median([np.median(np.diff(m.recording.times)) for m in motions]))
    length = float(np.mean([m.length for m in motions]))
    g = float(np.linalg.norm(GRAVITY))
    stiff = [model.density * g * (ratio * length) ** 3 for ratio in BENDING_LENGTHS]
    return {
        f"{NAME}_EI": (stiff[0], stiff[1]),
        f"{NAME}_GJ": (1e-3 * stiff[0], 1e3 * stiff[1]),
        f"{NAME}_bend_damping": (QUICKEST * frame, SLOWEST * window),
        f"{NAME}_drag_linear": (1e-3 * model.density / window, model.density / frame),
    }


SLIDES = "the windows show EI times damping at best, and neither EI nor the damping is to be trusted"
TURNS = "a fit beyond a turn explains something else by built-in twist; GJ and the roll are not to be trusted"
WORDS: Mapping[str, tuple[str, str]] = {
    "EI": (
        "the rope hangs as a chain would, and EI is not to be trusted",
        "the rope hardly bends, and EI is unknown",
    ),
    "GJ": ("no torsional stiffness is seen", "the rope hardly twists, and GJ is unknown"),
    "bend_damping": ("no internal damping is seen, or the substep damps as much", SLIDES),
    "drag_linear": ("no drag is seen", "the rope hardly moves against the air, and drag is not to be trusted"),
    "roll": (TURNS, TURNS),
    "yield_share": ("hardly anything slides", "nearly all of the bending stiffness slides, and EI is unknown"),
}
"""What an end at the lower and at the upper bound says."""
