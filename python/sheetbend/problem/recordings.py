"""What a process has of many recordings, and what it makes of each: a triangle, a norm, or what a report tells of it.

What is kept of a recording is small: its data, and a compiled problem of it alone. Scenes of equal content are one
object, so that they are compiled once and travel to workers once.
"""

from __future__ import annotations

import copy
import hashlib
import pickle
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from .. import _core
from ..arrays.types import Array
from ..experiment.experiment import Experiment
from ..quantities.parameters import Parameters
from ..scene.scene import Scene
from ..statistics.covariance import covariance
from ..statistics.gauge import RANK_TOLERANCE, null_space
from .problem import FitProblem
from .triangle import padded

KEPT = 10_000  # recordings whose problems a process keeps: some 50 kB each, and making one takes 0.4 to 1.3 ms

Item = tuple[range, Array, Array]  # which recordings, their own numbers, the shared ones


class Small(NamedTuple):
    """The compiled problem of one recording, without what it was made from.

    Attributes:
        name: of the recording.
        core: the problem.
        own, shared: columns of its own numbers and of the shared ones.
        priors: (rows, free) of its own numbers' priors, and (rows,) their residuals where all numbers are zero.
    """

    name: str
    core: _core.Problem
    own: Array
    shared: Array
    priors: tuple[Array, Array]

    @classmethod
    def of(cls, problem: FitProblem, names: Sequence[str]) -> Small:
        """With the names of the shared numbers."""
        free, parameters = problem.parameters.free, problem.parameters
        shared = np.array([free.index(name) for name in names], dtype=int)
        own = np.array([k for k, name in enumerate(free) if name not in names], dtype=int)
        rows = parameters.prior_jacobian()
        mine = rows[:, own].any(axis=1) if len(rows) else np.zeros(0, dtype=bool)
        priors = rows[mine], parameters.prior_residuals(np.zeros(len(free)))[mine]
        return cls(problem.experiments[0].name, problem.core, own, shared, priors)

    def point(self, own: Array, shared: Array) -> Array:
        """(free,) numbers of the problem."""
        u = np.zeros(len(self.own) + len(self.shared))
        u[self.own], u[self.shared] = own, shared
        return u

    def rows(self, u: Array, jacobian: bool) -> tuple[Array, Array] | str:
        """Residuals of the recording and of its own numbers' priors, and their Jacobian; in words why there are
        none."""
        ok, r, J = self.core.evaluate(u, jacobian)
        if not ok or not np.isfinite(r).all() or not np.isfinite(J).all():
            return f"{self.name}: {self.core.failure or 'a residual is not finite'}"
        data, (prior, at_zero) = self.core.data_rows, self.priors
        return np.append(r[:data], at_zero + prior @ u), np.vstack([J[:data], prior]) if jacobian else J


class Recordings:
    """The recordings, as a worker has them. The first `KEPT` problems stay once they are made, and others are made
    again for every evaluation, so that memory is bounded; the bits are the same."""

    def __init__(self, experiments: tuple[Experiment, ...], parameters: Parameters, shared: tuple[str, ...]) -> None:
        self.experiments, self.parameters, self.shared = experiments, parameters, shared
        self._kept: dict[int, Small] = {}
        self._uses = Counter(id(e.scene) for e in experiments)

    def __reduce__(self) -> tuple[Any, ...]:
        return Recordings, (self.experiments, self.parameters, self.shared)

    def digests(self) -> Mapping[str, str]:
        """Of what each problem is made from, where a journal is open."""
        each = (self._made(i).evaluator.digests() for i in range(len(self.experiments)))
        return {label: text for found in each for label, text in found.items()}

    def each(self, item: Item) -> Iterator[tuple[int, Small, Array]]:
        """Of each recording of an item: its number, problem and point."""
        which, own, shared = item
        begun = 0
        for i in which:
            small = self._kept.get(i) or Small.of(self._made(i), self.shared)
            if len(self._kept) < KEPT:
                self._kept[i] = small
            end = begun + len(small.own)
            yield i, small, small.point(own[begun:end], shared)
            begun = end

    def _made(self, i: int) -> FitProblem:
        """On copies, so that what is derived goes with them; scenes of several recordings stay compiled."""
        e = copy.copy(self.experiments[i])
        return FitProblem([e if self._uses[id(e.scene)] > 1 else on_scene(e, e.scene.shallow())], self.parameters)

    def own_covariance(self, i: int, small: Small, r: Array, J: Array) -> Array:
        """(q, q) of a recording's own numbers, the shared ones known; NaN where its data do not determine them."""
        unknown = np.full((len(small.own), len(small.own)), np.nan)
        problem, data = self._made(i), small.core.data_rows
        names, mine = [problem.parameters.free[k] for k in small.own], J[:, small.own]
        seen = null_space(mine, names, [problem.parameters[n].log for n in names], RANK_TOLERANCE).determined
        if not len(names) or len(seen) < len(names) or data <= len(names):
            return unknown
        return covariance(r[:data], mine[:data], problem.rows_layout(), mine[data:]).matrix


def triangles(recordings: Recordings, item: Item) -> Array | str:
    """[own | shared | residual] of each recording, reduced to as many rows as columns."""

    def triangle(_: int, small: Small, r: Array, J: Array) -> Array:
        return padded(np.column_stack([J[:, small.own], J[:, small.shared], r])).ravel()

    return _joined(recordings, item, True, triangle)


def norms(recordings: Recordings, item: Item) -> Array | str:
    """The root of the sum of squares of each recording's residuals."""
    return _joined(recordings, item, False, lambda _, __, r, ___: np.sqrt([r @ r]))


def told(recordings: Recordings, item: Item) -> Array | str:
    """Of each recording the sum of squared residuals without priors, their number, and the covariance of its own
    numbers."""

    def misfit(i: int, small: Small, r: Array, J: Array) -> Array:
        data = small.core.data_rows
        return np.append([r[:data] @ r[:data], data], recordings.own_covariance(i, small, r, J))

    return _joined(recordings, item, True, misfit)


def _joined(
    recordings: Recordings, item: Item, jacobian: bool, made_of: Callable[[int, Small, Array, Array], Array]
) -> Array | str:
    """What is made of the number, the problem and the rows of each recording, end to end; in words why one has no
    rows."""
    found = []
    for i, small, u in recordings.each(item):
        rows = small.rows(u, jacobian)
        if isinstance(rows, str):
            return rows
        found.append(made_of(i, small, *rows))
    return np.concatenate(found)


def sharing_scenes(experiments: Sequence[Experiment]) -> tuple[Experiment, ...]:
    """The experiments, of which those whose scenes have the same content share one."""
    known: dict[int, Scene] = {}
    first: dict[bytes, Scene] = {}
    found = []
    for e in experiments:
        if id(e.scene) not in known:
            content = hashlib.blake2b(pickle.dumps(e.scene, pickle.HIGHEST_PROTOCOL), digest_size=16).digest()
            known[id(e.scene)] = first.setdefault(content, e.scene)
        scene = known[id(e.scene)]
        found.append(e if scene is e.scene else on_scene(e, scene))
    return tuple(found)


def on_scene(e: Experiment, scene: Scene) -> Experiment:
    """A copy of an experiment on a scene of the same content."""
    made = copy.copy(e)
    object.__setattr__(made, "scene", scene)
    return made
