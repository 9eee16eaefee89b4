"""What had slid inside a rope before a window begins.

Internal friction remembers how a rope was bent earlier, which no marker shows. But what has slid pulls: in the first
frames it moves the rope beside what its shape, its weight and its grips do. So it is looked for in the frames over
which the start is smoothed anyway, as smooth fields of curvature along the rope. How large they may be is found from
the same frames (type II maximum likelihood: MacKay 1992), so that noise is not taken for a history. Where the rope
rests in these frames, its balance tells more (`rest`).
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import replace
from weakref import WeakKeyDictionary

import numpy as np

from ..arrays.smoothing import FEWEST
from ..arrays.types import Array
from ..experiment.experiment import Experiment
from ..problem.problem import FitProblem
from ..quantities.parameters import Parameter, Parameters
from ..recording.windows import Window
from .model import NAME, RopeModel
from .motion import GrippedMotion
from .rest import creep, rests

MODES = tuple(range(6))
DRAG = f"{NAME}_drag_linear"
LARGEST = 4.0  # standard deviation of mode 0, in yield curvatures: a joint that has slid too far slides back at once
FIRST = 0.5  # the same, before the frames were seen
STEPS, MORE, ROUNDS = 4, 4, 30  # to what had slid, and to its size in each
PARTS = (1.0, 0.4, 0.16, 0.064)  # of a step, the first of which that lowers the cost is taken
LEAST_NOISE = 1e-4  # m, of a marker
# The speed at a start comes from the same frames. Its error moves a marker by up to twice the noise there, in all of
# the some nine frames alike.
OFF = 6.0  # error of a frame over the noise of a marker, as if frames were independent


def window_of(
    model: RopeModel, motion: GrippedMotion, window: Window | None, values: Mapping[str, float]
) -> Experiment:
    """A window of a recording (all of it by default), which starts with what had slid before it at these values of the
    rope's quantities. A rope that does not yield remembers nothing."""
    if model.values.get("yield_curvature") is None:
        return model.experiment(motion, window)
    remembering = replace(model, slid_modes=MODES)
    first = float(motion.recording.times[0]) if window is None else window[0]
    e = remembering.experiment(motion, window)
    known, key = _known.setdefault(motion, {}), (first, _moves(remembering, e, values))
    if key not in known:
        known[key] = slid(remembering, motion, first, values)
    for name, value in known[key].items():
        e.scene.quantities[name] = replace(e.scene.quantities[name], value=value)
    return e


# Found once for each start and rope: a rung's first step and its fit begin where the last prediction was made.
_known: WeakKeyDictionary[GrippedMotion, dict[Hashable, dict[str, float]]] = WeakKeyDictionary()


def _moves(model: RopeModel, e: Experiment, values: Mapping[str, float]) -> Hashable:
    """All that the motion of a model follows from. What a rung adds at zero changes nothing."""
    quantities = ((name, values.get(name, q.value)) for name, q in e.scene.quantities.items())
    made = (model.segments, model.substeps, model.iterations, model.smoothing, model.marker_mass, *model.gravity)
    nominal = tuple(float(x) for direction in model.nominal for x in direction)
    return made, nominal, frozenset((name, value) for name, value in quantities if value != 0.0)


def slid(model: RopeModel, motion: GrippedMotion, first: float, values: Mapping[str, float]) -> dict[str, float]:
    """The most likely curvatures by which a rope had slid, 1/m, by quantity; zero where the first frames do not tell.

    Args:
        model: with slid modes.
        first: s, where the motion starts; the frames are those of the `smoothing` s from there on.
        values: of the rope's quantities.
    """
    yields = values.get(f"{NAME}_yield_curvature", model.values["yield_curvature"])
    assert yields is not None
    nothing = {f"{NAME}_slid_{axis}_{k}": 0.0 for k in model.slid_modes for axis in (1, 2)}
    times, size = motion.recording.times, noise(motion.recording.positions)
    frames = np.flatnonzero((times >= first - 1e-9) & (times <= first + model.smoothing + 1e-9))
    if len(frames) < FEWEST:
        return nothing
    model = model.at(values)
    moving = replace(_seen(model.experiment(motion, (first, first + model.smoothing))), sigma=OFF * size)
    if not moving.compared:
        return nothing
    largest = np.array([yields / (1.0 + 0.5 * k) for k in model.slid_modes for _ in (1, 2)])
    at = _searched(_problem([moving], nothing, values), largest, np.zeros(len(largest)), STEPS)
    if rests(motion, frames, size):
        both = [moving, creep(model, motion, frames, size)]
        at = _searched(_problem(both, nothing, values), largest, at, MORE)
    return dict(zip(nothing, (largest * at).tolist(), strict=True))


def _seen(e: Experiment) -> Experiment:
    """The experiment without markers that none of its few frames shows."""
    shown = e.recording.mask if e.fit is None else e.recording.piece(*e.fit).mask
    lost = {k for k in range(shown.shape[1]) if not shown[:, k].any()}
    markers = [None if k in lost else place for k, place in enumerate(e.places)]
    names = {e.recording.markers[k] for k in lost}
    return replace(e, markers=markers, offsets={name: by for name, by in e.offsets.items() if name not in names})


def _problem(experiments: Sequence[Experiment], names: Iterable[str], values: Mapping[str, float]) -> FitProblem:
    """Of what had slid; the rope's other quantities are held at their values. Each experiment keeps its drag."""
    known = experiments[0].scene.quantities
    free = [Parameter(name=name, initial=0.0, scale=1.0, unit="1/m") for name in names]
    held = [Parameter(name=k, initial=values[k], fixed=True) for k in known if k in values and k != DRAG]
    return FitProblem(experiments, Parameters([*free, *held]))


def _searched(problem: FitProblem, size: Array, at: Array, steps: int) -> Array:
    """The most likely numbers from `at` on, in units of `size`: Gauss-Newton steps, and their spread anew at each.

    Joints slide or hold, so the residuals have kinks: a step counts only if it lowers what it is to lower.
    """
    spread = FIRST
    for _ in range(steps):
        ok, r, J = problem.evaluate(size * at)
        if not ok:
            break
        likely, spread = _likely(J * size, r - J @ (size * at), spread)
        before = r @ r + at @ at / spread**2
        for part in PARTS:
            tried = at + part * (likely - at)
            ok, r, _ = problem.evaluate(size * tried, jacobian=False)
            if ok and r @ r + tried @ tried / spread**2 < before:
                break
        else:
            break
        at = tried
    return at


def _likely(J: Array, r: Array, spread: float) -> tuple[Array, float]:
    """The most likely numbers (k,) of which r + J numbers is noise of size 1, and their standard deviation."""
    curvature, axes = np.linalg.eigh(J.T @ J)
    slope = axes.T @ (J.T @ r)
    for _ in range(ROUNDS):
        variance = 1.0 / (curvature + 1.0 / spread**2)
        spread = float(np.clip(np.sqrt(np.mean((variance * slope) ** 2 + variance)), 1e-3, LARGEST))
    return -axes @ (variance * slope), spread


def noise(positions: Array) -> float:
    """Standard deviation of a coordinate, m, from third differences in time (median), which smooth motion leaves small.

    Args:
        positions: (frames, markers, 3) m, NaN = not seen.
    """
    third = np.diff(positions, 3, axis=0)
    third = third[np.isfinite(third)]
    return max(LEAST_NOISE, 1.4826 * float(np.median(np.abs(third))) / math.sqrt(20.0)) if len(third) else LEAST_NOISE
