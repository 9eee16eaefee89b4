"""What the noise of the motion that drives a scene does to the residuals of a fit.

A scene that recorded markers or poses drive is shaken by their noise n. To first order the compared markers are off by
A n, in all parts of the data at once and alike over time. So the estimates are off by more than the scatter of the
residuals tells, and parts of the data seem to contradict each other. The covariance of A n is known: A from the
rollout's tangents, that of n from the recording. Random draws of A n stand for it.

Where the scene follows markers, the noise is theirs, as neighboring frames show it; along a shape at rest, which has no
neighbors, it is the sigma of the compared markers. Where the scene does not know which markers drive it (a grip's pose,
a smoothed marker), the noise is that of the motion itself: each knot is compared with the cubic through its four
neighbors, as in `timeseries.noise`. Smoothing hides noise from that comparison and leaves what is slow. So where a
recorded marker keeps its distance from a driven particle, the noise is taken as no less than that marker's own, which
is an upper bound: what has been smoothed has less of it. Where a scene tells by what it was smoothed
(`Boundary.smoothed`), so are the draws. Poses of a robot's tool are no markers, and are taken as they show. In any case
A n is a part of what the fit leaves: it is no larger, and what is left resembles the draws as these resemble each
other. Where it does not, as in motions that grow or behind a path that is exact, the noise is less or the tangents say
too much, and the draws are made smaller.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import zip_longest
from weakref import WeakKeyDictionary

import numpy as np

from ..arrays.timeseries import interpolate, noise, off_neighbors
from ..arrays.types import Array
from ..experiment.experiment import Experiment
from ..problem.problem import FitProblem
from ..scene.boundary import Following
from ..statistics.least_squares import spanned

DRAWS = 64  # of the noise where parts of the data are compared; eight of them share a rollout
FEW = 24  # of the noise, for intervals
MOST_NUMBERS = 192  # of a driven motion, all of which are asked for: eight times as many rollouts as for an interval
PACK = 8  # draws that share a rollout
UNFELT = 0.2  # standard errors: what moves estimates by less adds no more than 2 % to an interval
CHANCE = 0.05  # share of the draws that resemble the others less than residuals of such noise are taken to do
SOUND = 0.5  # to which draws may have been made smaller where a bias is told: beyond, the tangents say too much
DIRECTIONS = 8  # of noise, over all experiments that the same parameters act on, from which their slope is told
STEP = 0.1  # of the noise, along which a Jacobian changes
FEWEST = 12  # knots, that tell the noise of a motion
STEADY = 3.0  # times its noise: by so much the distance of a marker from a driven particle varies at most


@dataclass(frozen=True, eq=False)
class DrivenErrors:
    """Random draws of the noise of what drives a problem's scenes, where no correction allows for it.

    Attributes:
        problem: the same problem with every driven particle free to move by itself.
        draws: by place of the experiment, (draws, numbers) m.
        size: by place of the experiment, m of one coordinate.
        moved: by place of the experiment, (draws, its data rows) what the noise does to the weighted residuals.
        believed: by place of the experiment, by how much the draws of `moved` had to be made smaller; 1 = not at all.
    """

    problem: FitProblem
    draws: Mapping[int, Array]
    size: Mapping[int, float]
    moved: Mapping[int, Array]
    believed: Mapping[int, float]

    def slope(self, u: Array, J: Array) -> Array:
        """(free,) by u (free,): how the mean over the draws of the sum of squares grows that noise adds to twice the
        cost, in motions whose tangents are to be believed. That of |A n|^2 is twice A n times how J changes along n.
        Of many experiments that the same parameters act on, some stand for all.

        Args:
            J: (rows, free) at u.
        """
        rows, free, told = self.problem.core.first_rows, self.problem.parameters.free, dict[int, list[Array]]()
        several = self._alike()
        for k, every in enumerate(zip_longest(*map(_dealt, several), fillvalue=())):
            asked = [i for part in every for i in part if k < len(self.draws[i])]
            if not asked:
                break
            along = {self.problem.experiments[i].name: STEP * self.draws[i][k] for i in asked}
            there = self.problem.piece(asked).moved(along)
            mine = [free.index(name) for name in there.parameters.free]
            ok, _, changed = there.evaluate(u[mine])
            for n, i in enumerate(asked if ok else ()):
                own, other = slice(rows[i], rows[i + 1]), slice(*there.core.first_rows[n : n + 2])
                slope = np.zeros(len(u))
                slope[mine] = 2.0 / STEP * (self.moved[i][k] / self.believed[i]) @ (changed[other] - J[own][:, mine])
                told.setdefault(i, []).append(slope)
        total = np.zeros(len(u))
        for places in several:
            means = [np.mean(told[i], axis=0) for i in places if i in told]
            if means:
                total += len(places) * np.mean(means, axis=0)
        return total

    def _alike(self) -> list[list[int]]:
        """Places of the experiments whose tangents are to be believed; those together on which the same parameters act,
        and which stand for each other."""
        found: dict[tuple[str, ...], list[int]] = {}
        for i in self.draws:
            acting = self.problem.acting_on(self.problem.experiments[i])
            if self.believed[i] >= SOUND and acting:
                found.setdefault(acting, []).append(i)
        return list(found.values())


def _dealt(places: Sequence[int]) -> list[Sequence[int]]:
    """Those asked for their first draw, for their second, ...: `DIRECTIONS` in all, spread evenly over many."""
    few = [places[n] for n in np.unique(np.linspace(0, len(places) - 1, DIRECTIONS).astype(int))]
    dealt = (few * DIRECTIONS)[:DIRECTIONS]
    return [dealt[k : k + len(few)] for k in range(0, DIRECTIONS, len(few))]


def drawn_noise(problem: FitProblem, u: Array, draws: int) -> DrivenErrors | None:
    """Draws of the noise of every driven motion at the minimum u (free,), the same for every call; None where none has
    any."""
    every = {i: _noise_of_motion(e, problem.values_of(e, u), draws) for i, e in _shaken(problem).items()}
    known = {i: n for i, n in every.items() if n is not None}
    if not known:
        return None
    driven = problem.of([_following_all(e) if i in known else e for i, e in enumerate(problem.experiments)]).follow(
        problem
    )
    basis = spanned(problem.evaluate(u)[2])
    flat: dict[int, Array] = {}
    size: dict[int, float] = {}
    moved: dict[int, Array] = {}
    for i, n in known.items():
        correction = driven.experiments[i].correction(problem.recordings[i])
        assert correction is not None  # it follows all that is driven
        made = np.ascontiguousarray(n[:, : correction.knots]).reshape(draws, -1)
        responses = _responses(problem, driven, i, u, made, basis)
        if responses is None:
            continue
        flat[i], moved[i], e = made, responses, problem.experiments[i]
        places = [k for k, p in enumerate(e.scene.boundary.driven) if p not in e.scene.directors]
        size[i] = _noise_of_markers(e) or float(np.sqrt(np.mean(n[:, :, places] ** 2)))
    if not moved:
        return None
    believed = _believed(problem, u, moved, basis)
    return DrivenErrors(driven, flat, size, {i: believed[i] * m for i, m in moved.items()}, believed)


_KNOWN: WeakKeyDictionary[FitProblem, dict[tuple[int, bytes], Array]] = WeakKeyDictionary()
"""Responses to the first draws, which are the same however many are asked for."""


def _responses(problem: FitProblem, driven: FitProblem, i: int, u: Array, draws: Array, basis: Array) -> Array | None:
    """(draws, data rows of the i-th experiment) what draws of the noise do to the residuals at u; None where no
    interval would feel it. The part of A n that parameters can take up, over the residuals' size, is what it moves
    them in standard errors, and |A n| is the most that it can move anything.

    Args:
        basis: of what the columns of the Jacobian at u span (`spanned`), which is dear to make.
    """
    known = _KNOWN.setdefault(problem, {})
    key, rows = (i, u.tobytes()), problem.core.first_rows
    found = known.get(key)
    if found is None:
        found = driven.respond(i, u, draws[:PACK])
        _, r, _ = problem.evaluate(u)
        own = slice(rows[i], rows[i + 1])
        left = np.sqrt(_square(r[own]))
        taken = np.linalg.norm(found @ basis[own], axis=1)
        if np.sqrt(_square(taken)) < UNFELT * left and np.linalg.norm(found, axis=1).max() < left:
            found = np.zeros((0, rows[i + 1] - rows[i]))
        known[key] = found
    if not len(found):
        return None
    if len(found) < len(draws):
        known[key] = found = np.vstack([found, driven.respond(i, u, draws[len(found) :])])
    return found[: len(draws)]


def _believed(problem: FitProblem, u: Array, moved: Mapping[int, Array], basis: Array) -> dict[int, float]:
    """By place of the experiment, the part of the responses that fits into what the fit leaves, 1 at most. Parameters
    take some of either up."""
    _, r, _ = problem.evaluate(u)
    rows, found = problem.core.first_rows, {}
    for i, errors in moved.items():
        own = slice(rows[i], rows[i + 1])
        beside = errors - (errors @ basis[own]) @ basis[own].T
        found[i] = min(1.0, _share(_square(r[own]), _square(beside)), _share(*_alike(r[own], beside)))
    return found


def _share(left: float, made: float) -> float:
    return float(np.sqrt(left / made)) if made > 0.0 else 1.0


def _square(series: Array) -> float:
    return float(np.mean(series**2))


def _alike(left: Array, draws: Array) -> tuple[float, float]:
    """How much residuals (rows,) resemble draws (draws, rows), and how much one draw resembles the others at least: the
    mean square of the projection onto another's direction, of the draws its lower 5 %."""
    products = draws @ draws.T
    squares = np.diag(products).copy()
    if len(draws) < 2 or not squares.all():
        return 0.0, 0.0
    np.fill_diagonal(products, 0.0)
    others = (products**2 / squares).sum(axis=1) / (len(draws) - 1)
    return float(np.mean((draws @ left) ** 2 / squares)), float(np.quantile(others, CHANCE))


def driven_errors(problem: FitProblem, u: Array, draws: int = DRAWS) -> Array:
    """(data rows, draws) what noise of driven particles may do to the weighted residuals at u (free,), where no
    correction allows for it; no draws where nothing is driven."""
    found = drawn_noise(problem, u, draws)
    errors = np.zeros((problem.core.data_rows, 0 if found is None else draws))
    for i, moved in ({} if found is None else found.moved).items():
        errors[problem.core.first_rows[i] : problem.core.first_rows[i + 1]] = moved.T
    return errors


def driven_span(problem: FitProblem, u: Array) -> Array:
    """(data rows, n) what every change of a driven motion does to the weighted residuals at u (free,), of any size and
    to first order. Motions are left out that have more numbers than half of their rows or than `MOST_NUMBERS`, or whose
    noise no interval feels."""
    first, few = problem.core.first_rows, drawn_noise(problem, u, FEW)
    counts = {i: drawn.shape[1] for i, drawn in ({} if few is None else few.draws).items()}
    counts = {i: n for i, n in counts.items() if n <= min((first[i + 1] - first[i]) // 2, MOST_NUMBERS)}
    errors = driven_errors(problem, u, max(counts.values())) if counts else np.zeros((problem.core.data_rows, 0))
    span = [np.zeros((len(errors), n)) for n in counts.values()]
    for made, (i, n) in zip(span, counts.items(), strict=True):
        made[first[i] : first[i + 1]] = errors[first[i] : first[i + 1], :n]
    return np.column_stack(span) if span else errors


def _shaken(problem: FitProblem) -> dict[int, Experiment]:
    return {i: e for i, e in enumerate(problem.experiments) if e.scene.boundary.driven and e.driven_noise is None}


def _following_all(e: Experiment) -> Experiment:
    """The experiment with a scene of which every driven particle follows a marker of its own, so that each may be
    moved by itself. The compiled scene stays the same."""
    scene, boundary = copy.copy(e.scene), copy.copy(e.scene.boundary)
    count = len(boundary.driven)
    boundary.following = [Following(np.arange(count), tuple(map(str, range(count))), np.eye(count), False)]
    scene.boundary = boundary
    return replace(e, scene=scene)


def _noise_of_markers(e: Experiment) -> float | None:
    """m of one coordinate, of the markers that the scene follows; None where it follows none, or nothing tells."""
    if not e.scene.boundary.following:
        return None
    return e.sigma if e.static else e.recorded_noise()


def _noise_of_motion(e: Experiment, values: Mapping[str, float], draws: int) -> Array | None:
    """(draws, knots, driven, 3) random noise like that of the driven motion; None where it has none to tell."""
    boundary = e.scene.boundary
    x, t, generator = boundary.values, boundary.times, np.random.default_rng(0)
    told = _noise_of_markers(e)
    if told:
        made = np.zeros((draws, *x.shape))
        every = list(dict.fromkeys(m for part in boundary.following for m in part.markers))
        n = told * generator.standard_normal((draws, len(t), len(every), 3))
        for part in boundary.following:
            mine = n[:, :, [every.index(m) for m in part.markers]]
            moved = np.einsum("pm,dkma->dkpa", part.weights, mine)
            made[:, :, part.slots] = moved - moved[:, :1] if part.from_placed else moved
        return made
    if e.static or len(t) < FEWEST:
        return None
    bends = off_neighbors(t, x).reshape(len(t) - 4, -1)
    bends *= _hidden(e, values, bends.reshape(-1, *x.shape[1:]))
    if not bends.any():
        return None
    mixed = generator.standard_normal((draws * len(t), len(bends))) @ bends / np.sqrt(len(bends))
    white = mixed.reshape(draws, *x.shape)
    if boundary.smoothed is None or boundary.smoothed.frames(t) > len(t):
        return np.asarray(white)
    smooth, _ = boundary.smoothed.of(t, np.swapaxes(white, 0, 1))
    return np.ascontiguousarray(np.swapaxes(smooth, 0, 1))


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
        if p in scene.directors or p in boundary.posed or shown == 0.0:
            continue
        path = interpolate(boundary.times, boundary.values[:, [slot]], at, "cubic", np.inf)[:, 0]
        for m in beside:
            apart = np.linalg.norm(recording.positions[:, m] - path, axis=1)
            if np.nanstd(apart) < STEADY * found[m]:
                most = max(most, float(found[m]) / shown)
    return most
