"""What the noise of the motion that drives a scene does to the residuals and the estimates of a fit.

A scene that recorded markers or poses drive is shaken by their noise n. To first order the compared markers are off by
A n, in all parts of the data at once and alike over time, so parts of the data seem to contradict each other more than
their residuals tell. The covariance of A n is known: A from the rollout's tangents, that of n from the recording.
Random draws of A n stand for it.

Where the scene does not know which markers drive it (a grip's pose, a smoothed marker), the noise is that of the motion
itself: each knot is compared with the cubic through its four neighbors, as in `timeseries.noise`. Smoothing hides noise
from that comparison and leaves what is slow. So where a recorded marker keeps its distance from a driven particle, the
noise is taken as no less than that marker's own, which is an upper bound: what has been smoothed has less of it.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..arrays.timeseries import Array, interpolate, noise, off_neighbors
from ..experiment.experiment import Experiment
from ..minimum.problem import FitProblem
from ..quantities.wording import short
from ..result.result import Estimate
from ..scene.boundary import Following
from ..statistics.blocks import moved_by
from ..statistics.identifiability import Identifiability
from ..statistics.intervals import reach_of

DRAWS = 64  # of the noise; several of them share a rollout
FEWEST = 12  # knots, that tell the noise of a motion
NORMAL = 1.96  # standard deviations: 95 %
STEADY = 3.0  # times its noise: by so much the distance of a marker from a driven particle varies at most


def driven_errors(problem: FitProblem, u: Array, draws: int = DRAWS) -> tuple[Array, str]:
    """What noise of driven particles may do to the residuals at u (free,), where no correction allows for it.

    Returns:
        (data rows, draws) of weighted residuals, no draws where nothing is driven; and what the noise is, in words.
    """
    motions = {i: e for i, e in enumerate(problem.experiments) if _shaken(e)}
    size: dict[int, float] = {}
    errors = np.zeros((problem.core.data_rows, draws))
    rows = problem.core.first_rows
    known = {i: _noise_of_motion(e, problem.values_of(e, u), draws) for i, e in motions.items()}
    if not any(n is not None for n in known.values()):
        return errors[:, :0], ""
    open_ = [_following_all(e) if known.get(i) is not None else e for i, e in enumerate(problem.experiments)]
    driven = problem.of(open_)
    for i, n in known.items():
        if n is None:
            continue
        correction = driven.experiments[i].correction(problem.recordings[i])
        assert correction is not None  # it follows all that is driven
        flat = np.ascontiguousarray(n[:, : correction.knots]).reshape(draws, -1)
        errors[rows[i] : rows[i + 1]] = driven.core.respond(i, u, flat).T
        scene = motions[i].scene
        places = [k for k, p in enumerate(scene.boundary.driven) if p not in scene.directors]
        size[i] = float(np.sqrt(np.mean(n[:, :, places] ** 2)))
    worst = max(size, key=lambda i: size[i])
    words = (
        f"noise of what drives {problem.experiments[worst].name} ({short(1e3 * size[worst], 2)} mm of one coordinate)"
    )
    return errors, words


def within_driven_errors(
    problem: FitProblem, u: Array, judged: Identifiability, names: Sequence[str], errors: Array, noise_words: str
) -> dict[str, str]:
    """By parameter, that noise of driven particles moves it by more than its interval allows for.

    Args:
        names: of the parameters that are asked about.
        errors, noise_words: `driven_errors`.
    """
    estimates: Mapping[str, Estimate] = {e.name: e for e in judged.estimates}
    free = problem.parameters.free
    columns = [c for c, name in enumerate(free) if estimates[name].half_width is not None]
    if not columns or not errors.size:
        return {}
    _, _, J = problem.evaluate(u)
    reaches = dict(zip(columns, NORMAL * np.sqrt(np.mean(moved_by(J[:, columns], errors) ** 2, axis=1)), strict=True))
    words = {}
    for column, reach in reaches.items():
        p, e = problem.parameters[free[column]], estimates[free[column]]
        if e.name not in names or reach <= reach_of(p, e):
            continue
        by = f"{short(100 * float(np.expm1(reach)), 2)} %" if p.log else f"{short(reach, 2)} {p.unit}".rstrip()
        words[e.name] = (
            f"{noise_words} moves it by up to {by} (95 %, to first order), which its interval does not count; set "
            "driven_sigma where the scene follows markers, or hold the grip's pose by more markers farther apart"
        )
    return words


def _shaken(e: Experiment) -> bool:
    return bool(e.scene.boundary.driven) and not e.static and e.driven_noise is None


def _following_all(e: Experiment) -> Experiment:
    """The experiment with a scene of which every driven particle follows a marker of its own, so that each may be
    moved by itself. The compiled scene stays the same."""
    scene, boundary = copy.copy(e.scene), copy.copy(e.scene.boundary)
    count = len(boundary.driven)
    boundary.following = [Following(np.arange(count), tuple(map(str, range(count))), np.eye(count), False)]
    scene.boundary = boundary
    return replace(e, scene=scene)


def _noise_of_motion(e: Experiment, values: Mapping[str, float], draws: int) -> Array | None:
    """(draws, knots, driven, 3) random noise like that of the driven motion; None where it has none to tell."""
    boundary = e.scene.boundary
    x, t, generator = boundary.values, boundary.times, np.random.default_rng(0)
    if len(t) < FEWEST:
        return None
    told = e.recorded_noise() if boundary.following else None
    if told:
        made = np.zeros((draws, *x.shape))
        every = list(dict.fromkeys(m for part in boundary.following for m in part.markers))
        n = told * generator.standard_normal((draws, len(t), len(every), 3))
        for part in boundary.following:
            mine = n[:, :, [every.index(m) for m in part.markers]]
            moved = np.einsum("pm,dkma->dkpa", part.weights, mine)
            made[:, :, part.slots] = moved - moved[:, :1] if part.from_placed else moved
        return made
    bends = off_neighbors(t, x).reshape(len(t) - 4, -1)
    bends *= _hidden(e, values, bends.reshape(-1, *x.shape[1:]))
    if not bends.any():
        return None
    mixed = generator.standard_normal((draws * len(t), len(bends))) @ bends / np.sqrt(len(bends))
    return np.asarray(mixed.reshape(draws, *x.shape))


def _hidden(e: Experiment, values: Mapping[str, float], bends: Array) -> float:
    """By how much the noise of the recorded markers that drive the scene exceeds what the motion shows of it; 1 where
    no marker is known to drive it."""
    scene, recording = e.scene, e.recording.piece(e.t0, None)
    boundary, found = scene.boundary, noise(recording.times, recording.positions)
    beside = [m for m in range(len(found)) if m not in e.compared and found[m] > 0.0]
    at = np.clip(e.scene_times(recording.times, values), boundary.times[0], boundary.times[-1])
    most = 1.0
    for slot, p in enumerate(boundary.driven):
        shown = float(np.sqrt(np.mean(bends[:, slot] ** 2)))
        if p in scene.directors or shown == 0.0:
            continue
        path = interpolate(boundary.times, boundary.values[:, [slot]], at, "cubic", np.inf)[:, 0]
        for m in beside:
            apart = np.linalg.norm(recording.positions[:, m] - path, axis=1)
            if np.nanstd(apart) < STEADY * found[m]:
                most = max(most, float(found[m]) / shown)
    return most
