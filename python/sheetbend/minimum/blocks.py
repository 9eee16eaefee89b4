"""Least squares over many recordings without a Jacobian of all of them.

A recording depends on the shared numbers and on a few of its own. Its residuals and Jacobian, [own | shared | r], are
reduced by QR to a triangle of as many columns, which is all that is kept of it. A step of all numbers needs no more:
each triangle gives up its own numbers, what is left of all of them is one small problem of the shared ones, and each
recording's own numbers follow from these. Triangles are merged in the order of the recordings, so that the bits do not
depend on who made them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays.timeseries import Array
from ..errors import InputError
from ..experiment.experiment import Experiment
from ..quantities.parameters import Parameters
from ..statistics.covariance import covariance
from ..statistics.gauge import RANK_TOLERANCE, null_space
from .approach import RIDGE, Approach, inside
from .coordinates import Coordinates
from .counts import count
from .parts import expanded_to
from .problem import FitProblem
from .triangle import triangle
from .workers import Common

CHUNK = 16  # recordings in a piece of work
KEPT = 2000  # recordings whose problems a process keeps: some 0.1 MB each, and making one takes 1 ms
PASSES = 8  # of a step, each holding own numbers at the sides that they have met
SMALL = 1e-4  # of the cost of one row: what a step must promise

Item = tuple[range, Array, Array, bool]  # which recordings, their own numbers, the shared ones, whether with a Jacobian


@dataclass(frozen=True)
class Reduced:
    """A triangle without its own numbers d_own = top_shared d + seen, for changes d of the shared ones.

    Attributes:
        own: (q, q) triangle of the own numbers.
        cross: (q, shared) beside it.
        seen: (q,) residuals beside it.
        shared: (rows, shared) what is left of the shared columns.
        left: (rows,) what is left of the residuals.
    """

    own: Array
    cross: Array
    seen: Array
    shared: Array
    left: Array


def reduced(own: Array, shared: Array, r: Array) -> Reduced:
    """From columns (rows, q) and (rows, shared) and residuals (rows,)."""
    q, s = own.shape[1], shared.shape[1]
    T = _padded(np.column_stack([own, shared, r]))
    return Reduced(T[:q, :q], T[:q, q : q + s], T[:q, -1], T[q:, q : q + s], T[q:, -1])


def _padded(rows: Array) -> Array:
    """(n, n) triangle of rows (any, n), zero where there are fewer."""
    n = rows.shape[1]
    T = np.zeros((n, n))
    R = triangle(rows)
    T[: len(R)] = R
    return T


class Arrow:
    """The Jacobian of many recordings, one triangle for each.

    Attributes:
        triangles: [own | shared | residual] of each recording.
        own: columns of its own numbers, of each recording.
        shared: columns of the shared numbers.
        prior: (priors, shared) rows of the shared numbers' priors, and their residuals.
    """

    def __init__(
        self, triangles: Sequence[Array], own: Sequence[Array], shared: Array, prior: tuple[Array, Array]
    ) -> None:
        self.triangles, self.own, self.shared, self.prior = tuple(triangles), own, shared, prior

    @property
    def nbytes(self) -> int:
        """Of the triangles."""
        return sum(T.nbytes for T in self.triangles)

    def parts(self, i: int) -> tuple[Array, Array, Array]:
        """Own and shared columns and residuals of one recording's triangle."""
        T, q = self.triangles[i], len(self.own[i])
        return T[:, :q], T[:, q:-1], T[:, -1]

    def __matmul__(self, s: Array) -> Array:
        """What a step changes, in the order of `residuals`."""
        rows = []
        for i, columns in enumerate(self.own):
            own, shared, _ = self.parts(i)
            rows.append(own @ s[columns] + shared @ s[self.shared])
        return np.concatenate([*rows, self.prior[0] @ s[self.shared]])

    @property
    def residuals(self) -> Array:
        """As many as the triangles have rows; their sum of squares is that of all residuals."""
        return np.concatenate([*(T[:, -1] for T in self.triangles), self.prior[1]])

    def inside(self, ridge: Array, lower: Array, upper: Array) -> Array:
        """The step between lower <= 0 and upper >= 0 with the least sum of squares, see `approach.inside`; own numbers
        that meet a side stay there."""
        s, held = np.zeros(len(ridge)), np.zeros(len(ridge), dtype=bool)
        side = (lower[self.shared], upper[self.shared])
        for _ in range(PASSES):
            small = [self._small(i, s, held, ridge) for i in range(len(self.own))]
            J = np.concatenate([*(part.shared for part in small), self.prior[0]])
            r = np.concatenate([*(part.left for part in small), self.prior[1]])
            s[self.shared] = inside(J, r, ridge[self.shared], *side)
            for part, columns in zip(small, self.own, strict=True):
                free = columns[~held[columns]]
                s[free] = -np.linalg.solve(part.own, part.seen + part.cross @ s[self.shared])
            out = (s < lower) | (s > upper)
            s = np.clip(s, lower, upper)
            if not out.any():
                break
            held |= out
        return s

    def _small(self, i: int, s: Array, held: Array, ridge: Array) -> Reduced:
        own, shared, r = self.parts(i)
        columns, stays = self.own[i], held[self.own[i]]
        moved = own[:, ~stays]
        size = np.maximum(np.linalg.norm(moved, axis=0), np.finfo(float).tiny)
        weak = np.diag(np.maximum(ridge[columns[~stays]], RANK_TOLERANCE * size))
        below = np.zeros((len(weak), shared.shape[1]))
        known = r + own[:, stays] @ s[columns[stays]]
        return reduced(np.vstack([moved, weak]), np.vstack([shared, below]), np.append(known, np.zeros(len(weak))))


class ManyProblem:
    """Many recordings with shared and own parameters.

    Attributes:
        experiments: in order.
        parameters: own ones expanded to one for each recording that has them.
        coordinates: those of the parameters.
        own: columns of the own parameters, of each recording.
        shared: columns of the shared ones.
        failure: why the last evaluation was not ok.
        cheap_jacobian: never made along.
    """

    cheap_jacobian = False

    def __init__(self, experiments: Sequence[Experiment], parameters: Parameters) -> None:
        """
        Raises:
            InputError: recordings share a name, correct the markers that their scenes follow, estimate their starts,
                or are shot in windows.
        """
        self.experiments, self.failure = tuple(experiments), ""
        names = [e.name for e in experiments]
        if len(set(names)) < len(names):
            twice = next(name for name in names if names.count(name) > 1)
            raise InputError("experiments", "share a name", twice, "give each a name of its own")
        corrected = [e.name for e in experiments if e.driven_noise is not None]
        if corrected:
            raise InputError("driven_sigma", "does not go with many recordings", corrected[:5], "use sheetbend.fit")
        if unknown := [e.name for e in experiments if e.start == "estimated"]:
            raise InputError("start", "is not estimated of many recordings", unknown[:5], "use sheetbend.fit")
        if in_windows := [e.name for e in experiments if e.shooting is not None]:
            raise InputError("shooting", "does not go with many recordings", in_windows[:5], "use sheetbend.fit")
        if over_time := [e.name for e in experiments if e.scene.over_time]:
            raise InputError("scene", "has unknown inputs over time", over_time[:5], "use sheetbend.fit")
        self.parameters = expanded_to(parameters, self.experiments)
        self.coordinates = Coordinates(self.parameters)
        place = {name: column for column, name in enumerate(self.parameters.free)}
        every = [name for name in parameters.free if not parameters[name].private]
        self.shared = np.array([place[name] for name in every], dtype=int)
        kinds = [name for name in parameters.free if parameters[name].private]
        self.own = [
            np.array([place[n] for k in kinds if (n := f"{k}[{e.name}]") in place], dtype=int) for e in experiments
        ]
        self._common = Common(_Recordings(self.experiments, parameters, tuple(every)))

    def _map(self, work: Callable[[_Recordings, Item], Any], u: Array, jacobian: bool) -> list[Any]:
        total = len(self.experiments)
        chunks = [range(k, min(k + CHUNK, total)) for k in range(0, total, CHUNK)]
        items = [(c, np.concatenate([u[self.own[i]] for i in c]), u[self.shared], jacobian) for c in chunks]
        return self._common.map(work, items)

    def evaluate(self, u: Array, jacobian: bool = True) -> tuple[bool, Array, Any]:
        """(ok, residuals, `Arrow` or None) at u (free,). The residuals are as `Arrow.residuals` has them; without a
        Jacobian they are one for each recording, of the same sum of squares."""
        found = [part for chunk in self._map(_evaluated, u, jacobian) for part in chunk]
        count(1, int(jacobian))
        lost = [part for part in found if isinstance(part, str)]
        if lost:
            self.failure = lost[0]
            return False, np.zeros(0), None
        prior = self._prior(u)
        if not jacobian:
            return True, np.append(np.array(found, dtype=float), prior[1]), None
        arrow = Arrow(found, self.own, self.shared, prior)
        return True, arrow.residuals, arrow

    def own_covariances(self, u: Array) -> list[Array]:
        """(q, q) of each recording's own numbers, the shared ones known; NaN where its data do not determine them."""
        return [part for chunk in self._map(_own_covariances, u, True) for part in chunk]

    def misfits(self, u: Array) -> tuple[Array, Array]:
        """(recordings,) sums of squared residuals, priors left out, and their numbers."""
        found = [part for chunk in self._map(_misfits, u, False) for part in chunk]
        return np.array([part[0] for part in found]), np.array([part[1] for part in found])

    def _prior(self, u: Array) -> tuple[Array, Array]:
        names = [self.parameters.free[column] for column in self.shared]
        given = [(k, self.parameters[n]) for k, n in enumerate(names) if self.parameters[n].prior is not None]
        rows, r = np.zeros((len(given), len(names))), np.zeros(len(given))
        for row, (k, p) in enumerate(given):
            mean, sd = p.prior or (0.0, 1.0)
            rows[row, k], r[row] = 1.0 / sd, (u[self.shared[k]] - p.to_internal(mean)) / sd
        return rows, r


class _Recordings:
    """What a worker has of the recordings: problems of one recording each, once they are made. The first `KEPT` stay,
    and others are made again for every evaluation, so that memory is bounded; the bits are the same."""

    def __init__(self, experiments: tuple[Experiment, ...], parameters: Parameters, shared: tuple[str, ...]) -> None:
        self.experiments, self.parameters, self.shared = experiments, parameters, shared
        self._made: dict[int, FitProblem] = {}

    def __reduce__(self) -> tuple[Any, ...]:
        return _Recordings, (self.experiments, self.parameters, self.shared)

    def each(self, item: Item) -> list[tuple[FitProblem, Array, Array, Array]]:
        """Of each recording of an item: problem, point, own columns, shared columns."""
        which, own, shared, _ = item
        known, found, begun = dict(zip(self.shared, shared, strict=True)), [], 0
        for i in which:
            problem = self._made.get(i) or FitProblem([self.experiments[i]], self.parameters)
            if len(self._made) < KEPT:
                self._made[i] = problem
            free = problem.parameters.free
            mine = np.array([k for k, name in enumerate(free) if name not in known], dtype=int)
            u = np.array([known.get(name, math.nan) for name in free])
            u[mine] = own[begun : begun + len(mine)]
            begun += len(mine)
            found.append((problem, u, mine, np.array([free.index(name) for name in self.shared], dtype=int)))
        return found


def _rows(problem: FitProblem, u: Array, own: Array, jacobian: bool) -> tuple[Array, Array] | str:
    """Residuals of one recording and of its own numbers' priors, and their Jacobian; in words why there are none."""
    ok, r, J = problem.core.evaluate(u, jacobian)
    if not ok or not np.isfinite(r).all() or not np.isfinite(J).all():
        return f"{problem.experiments[0].name}: {problem.failure}"
    data, prior = problem.core.data_rows, problem.parameters.prior_jacobian()
    mine = prior[:, own].any(axis=1) if len(prior) else np.zeros(0, dtype=bool)
    r = np.append(r[:data], problem.parameters.prior_residuals(u)[mine])
    return r, np.vstack([J[:data], prior[mine]]) if jacobian else J


def _evaluated(recordings: _Recordings, item: Item) -> list[Array | float | str]:
    found: list[Array | float | str] = []
    for problem, u, own, shared in recordings.each(item):
        made = _rows(problem, u, own, item[3])
        if isinstance(made, str):
            return [made]
        r, J = made
        found.append(_padded(np.column_stack([J[:, own], J[:, shared], r])) if item[3] else float(np.sqrt(r @ r)))
    return found


def _own_covariances(recordings: _Recordings, item: Item) -> list[Array]:
    found = []
    for problem, u, own, _ in recordings.each(item):
        made, unknown = _rows(problem, u, own, True), np.full((len(own), len(own)), np.nan)
        if isinstance(made, str) or not len(own):
            found.append(unknown)
            continue
        (r, J), data = made, problem.core.data_rows
        names = [problem.parameters.free[k] for k in own]
        seen = null_space(J[:, own], names, [problem.parameters[n].log for n in names], RANK_TOLERANCE).determined
        whole = len(seen) == len(own) and data > len(own)
        layout = problem.rows_layout()
        found.append(covariance(r[:data], J[:data, own], layout, J[data:, own]).matrix if whole else unknown)
    return found


def _misfits(recordings: _Recordings, item: Item) -> list[tuple[float, int]]:
    found = []
    for problem, u, own, _ in recordings.each(item):
        made, data = _rows(problem, u, own, False), problem.core.data_rows
        found.append((math.nan, data) if isinstance(made, str) else (float(made[0][:data] @ made[0][:data]), data))
    return found


class ManyApproach(Approach):
    """The same walk with steps from triangles: a recording's own numbers keep their places as long as moving them
    promises next to nothing of its own cost."""

    _J: Arrow | None

    def __init__(self, problem: ManyProblem, u: Array) -> None:
        self._own = problem.own
        super().__init__(problem, u)

    @property
    def least(self) -> float:
        """See `Approach.least`: many rows would hide a step of a standard deviation."""
        return SMALL / max(self.cost, 1.0)

    def _inside(self, J: Arrow, lower: Array, upper: Array) -> Array:
        ridge = math.sqrt(2.0 * RIDGE * self.cost) / self._longest
        for i, columns in enumerate(self._own):
            part = float(np.linalg.norm(J.triangles[i][:, -1]))
            ridge[columns] = math.sqrt(RIDGE) * part / self._longest[columns]
        return J.inside(ridge, lower, upper)

    def _finite(self) -> bool:
        return self._J is not None
