"""Where a motion that is shot in windows is cut, and what its windows hold (`shooting`)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..arrays.types import Array
from ..errors import InputError
from ..recording.recording import Recording
from ..scene.scene import Scene
from .experiment import Experiment
from .shooting import Shooting

LEAST_FRAMES, LEAST_STEPS = 6, 40  # of a window
STARTED = 8  # substeps: by then the second-order scheme has forgotten how it was started
START = ("position", "velocity", "intermediate")  # what quantities of a start set


def shot(e: Experiment) -> Shooting | None:
    """How an experiment is shot in windows, once it is cut; None before, and where it is not."""
    own = e.shooting
    return own if isinstance(own, Shooting) and own.behind is not None else None


def in_steps(e: Experiment, steps: int) -> Experiment:
    """The experiment, whose states take at most `steps` steps in an evaluation where it is shot in windows."""
    own = shot(e)
    return e if own is None else replace(e, shooting=replace(own, steps=steps))


def start_quantities(scene: Scene) -> tuple[str, ...]:
    """Names of the quantities that set places and velocities at the start and nothing else, in the scene's order."""
    start: set[str] = set()
    others: set[str] = set()
    for term in scene.every_term:
        (start if term.array in START else others).update(term.quantities)
    return tuple(name for name in scene.quantities if name in start - others)


def cut(e: Experiment) -> Experiment:
    """The experiment with every part of its `shooting` known but the loss and the states.

    Raises:
        InputError: its scene has no quantities of its start, or a window would hold too little.
    """
    own, field = e.shooting, f"{e.name}.shooting"
    assert isinstance(own, Shooting)
    if not start_quantities(e.scene):
        fix = "give it some, as add_arm does, or leave shooting out"
        raise InputError(field, "needs quantities that set how the scene starts", list(e.scene.quantities), fix)
    times = e.fitted().times
    assert isinstance(own.window, float | int)
    interval = float(np.median(np.diff(times)))
    behind = interval * math.ceil(STARTED * e.solver.h / interval - 1e-9)
    length = float(own.window)
    least = max(LEAST_FRAMES * interval, LEAST_STEPS * e.solver.h, 4 * behind)
    if length < least:
        raise InputError(field, "is short for these frames and substeps", length, f"give at least {least:.3g} s")
    told = own.is_given or (own.loss is not None and own.behind is None)
    return replace(e, shooting=replace(own, behind=own.behind or behind, pace=own.pace or pace(e), is_given=told))


def pace(e: Experiment) -> float:
    """Time in which the markers move as far as they sway, s: their rms distance from their mean place over their rms
    speed."""
    recording = e.fitted()
    x, times = recording.positions, recording.times
    far = np.nanmean((x - np.nanmean(x, axis=0)) ** 2)
    speed = np.nanmean((np.diff(x, axis=0) / np.diff(times)[:, None, None]) ** 2)
    return math.sqrt(float(far / speed)) if speed > 0 else 1.0


def borders(e: Experiment) -> Array:
    """(windows + 1,) recording times at which windows begin, and the end of the fitted part; at frames, as evenly as
    these allow.

    Raises:
        InputError: the windows' length is not known yet.
    """
    own = e.shooting
    assert isinstance(own, Shooting) and isinstance(own.window, float | int)
    times = e.fitted().times
    count = max(1, math.ceil((times[-1] - e.t0) / own.window - 1e-6))
    wanted = np.linspace(e.t0, times[-1], count + 1)
    at = times[np.clip(np.searchsorted(times, wanted[1:-1] - 1e-9), 0, len(times) - 1)]
    return np.unique(np.concatenate([[e.t0], at, [times[-1]]]))


def piece(recording: Recording, edges: Array, number: int, behind: float) -> Recording:
    """The frames of a recording that one window explains: from `behind` s after its border, where it no longer feels
    how the integrator was started, to as much after the next one. What comes before the first or behind the last
    belongs to these."""
    first = None if number == 0 else float(edges[number]) + behind
    last = None if number == len(edges) - 2 else float(edges[number + 1]) + behind
    return recording.piece(first, last)


def free_particles(scene: Scene) -> Sequence[int]:
    """Places of those nodes whose positions and velocities make a gap: of particles, stubs and axes of bodies."""
    return [int(p) for p in np.setdiff1d(scene.free_nodes, scene.places_of(list(scene.directors)))]
