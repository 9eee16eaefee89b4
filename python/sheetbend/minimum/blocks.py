"""Least squares over many recordings without a Jacobian of all of them.

A recording depends on the shared numbers and on a few of its own. Its residuals and Jacobian, [own | shared | r], are
reduced by QR to a triangle of as many columns, which is all that is kept of it. A step of all numbers needs no more:
each triangle gives up its own numbers, what is left of all of them is one small problem of the shared ones, and each
recording's own numbers follow from these. Triangles are merged in the order of the recordings, so that the bits do not
depend on who made them.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..arrays.types import Array
from ..errors import InputError, SheetbendError
from ..experiment.experiment import Experiment
from ..quantities.parameters import Parameters
from ..statistics.gauge import RANK_TOLERANCE
from .approach import RIDGE, Approach, inside
from .coordinates import Coordinates
from .counts import count
from .journal import Evaluation, current
from .parts import expanded_to
from .recordings import Item, Recordings, norms, sharing_scenes, told, triangles
from .triangle import padded
from .workers import Common

CHUNK = 16  # recordings in a piece of work
PASSES = 8  # of a step, each holding own numbers at the sides that they have met
SMALL = 1e-4  # of the cost of one row: what a step must promise

Work = Callable[[Recordings, Item], Array | str]


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
    T = padded(np.column_stack([own, shared, r]))
    return Reduced(T[:q, :q], T[:q, q : q + s], T[:q, -1], T[q:, q : q + s], T[q:, -1])


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


class Told(NamedTuple):
    """What is told of each recording.

    Attributes:
        squares: (recordings,) sums of squared residuals, priors left out.
        rows: (recordings,) their numbers.
        covariances: (q, q) of each recording's own numbers, the shared ones known; NaN where its data do not determine
            them.
    """

    squares: Array
    rows: Array
    covariances: Sequence[Array]


class ManyProblem:
    """Many recordings with shared and own parameters.

    Attributes:
        experiments: in order; those whose scenes have the same content share one.
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
        names, self.failure = [e.name for e in experiments], ""
        if len(set(names)) < len(names):
            twice = next(name for name, count in Counter(names).items() if count > 1)
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
        self.experiments = sharing_scenes(experiments)
        self.parameters = expanded_to(parameters, self.experiments)
        self.coordinates = Coordinates(self.parameters)
        place = {name: column for column, name in enumerate(self.parameters.free)}
        every = [name for name in parameters.free if not parameters[name].private]
        self.shared = np.array([place[name] for name in every], dtype=int)
        kinds = [name for name in parameters.free if parameters[name].private]
        self.own = [
            np.array([place[n] for k in kinds if (n := f"{k}[{e.name}]") in place], dtype=int) for e in experiments
        ]
        self._common = Common(Recordings(self.experiments, parameters, tuple(every)))
        self._journal, self._key = current(), b""

    def _flat(self, work: Work, u: Array) -> tuple[bool, Array]:
        """What a piece of work makes of all recordings at u, one after the other, through the journal where one is
        open; not ok, with `failure`, where the physics of one has no answer."""

        def made() -> Evaluation:
            total, nothing = len(self.experiments), np.zeros((0, 0))
            chunks = [range(k, min(k + CHUNK, total)) for k in range(0, total, CHUNK)]
            items = [(c, np.concatenate([u[self.own[i]] for i in c]), u[self.shared]) for c in chunks]
            parts = self._common.map(work, items)
            lost = [part for part in parts if isinstance(part, str)]
            self.failure = lost[0] if lost else ""
            return not lost, np.concatenate([part for part in parts if not isinstance(part, str)] or [u[:0]]), nothing

        if self._journal is None:
            return made()[:2]
        if not self._key:
            self._key = self._journal.problem(self._common.value.digests())
        key = self._key + work.__name__.encode()
        return self._journal.evaluate(key, u, False, made)[0][:2]

    def evaluate(self, u: Array, jacobian: bool = True) -> tuple[bool, Array, Any]:
        """(ok, residuals, `Arrow` or None) at u (free,). The residuals are as `Arrow.residuals` has them; without a
        Jacobian they are one for each recording, of the same sum of squares."""
        ok, found = self._flat(triangles if jacobian else norms, u)
        count(1, int(jacobian))
        if not ok:
            return False, np.zeros(0), None
        prior = self._prior(u)
        if not jacobian:
            return True, np.append(found, prior[1]), None
        sizes = np.array([len(own) + len(self.shared) + 1 for own in self.own])
        parts = np.split(found, np.cumsum(sizes**2)[:-1])
        arrow = Arrow([T.reshape(n, n) for T, n in zip(parts, sizes, strict=True)], self.own, self.shared, prior)
        return True, arrow.residuals, arrow

    def told(self, u: Array) -> Told:
        """What is told of each recording at u (free,).

        Raises:
            SheetbendError: the physics of one has no answer.
        """
        ok, found = self._flat(told, u)
        if not ok:
            raise SheetbendError(f"nothing is known at the end: {self.failure}")
        sizes = np.array([len(own) for own in self.own])
        parts = np.split(found, np.cumsum(sizes**2 + 2)[:-1])
        covariances = [part[2:].reshape(q, q) for part, q in zip(parts, sizes, strict=True)]
        return Told(np.array([part[0] for part in parts]), np.array([part[1] for part in parts]), covariances)

    def _prior(self, u: Array) -> tuple[Array, Array]:
        names = [self.parameters.free[column] for column in self.shared]
        given = [(k, self.parameters[n]) for k, n in enumerate(names) if self.parameters[n].prior is not None]
        rows, r = np.zeros((len(given), len(names))), np.zeros(len(given))
        for row, (k, p) in enumerate(given):
            mean, sd = p.prior or (0.0, 1.0)
            rows[row, k], r[row] = 1.0 / sd, (u[self.shared[k]] - p.to_internal(mean)) / sd
        return rows, r


class ManyApproach(Approach):
    """The same walk with steps from triangles: a recording's own numbers keep their places as long as moving them
    promises next to nothing of its own cost."""

    _J: Arrow | None

    def __init__(self, problem: ManyProblem, u: Array) -> None:
        self._own = problem.own
        super().__init__(problem, u)

    @property
    def arrow(self) -> Arrow:
        """Where it is."""
        if self._J is None:
            _, self._r, self._J = self._evaluated(self.u, True)
        assert self._J is not None  # where it is, the physics has an answer
        return self._J

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
