"""Least squares over many recordings without a Jacobian of all of them (`arrow`), and the walk to its minimum."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..arrays.types import Array
from ..errors import InputError, SheetbendError
from ..experiment.experiment import Experiment
from ..problem.coordinates import Coordinates
from ..problem.counts import count
from ..problem.journal import Evaluation, current
from ..problem.parts import expanded_to
from ..problem.recordings import Item, Recordings, norms, sharing_scenes, told, triangles
from ..problem.workers import Common
from ..quantities.parameters import Parameters
from .approach import RIDGE, Approach
from .arrow import Arrow

CHUNK = 16  # recordings in a piece of work
SMALL = 1e-4  # of the cost of one row: what a step must promise

Work = Callable[[Recordings, Item], Array | str]


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
