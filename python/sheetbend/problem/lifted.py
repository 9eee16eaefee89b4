"""A problem whose motions are shot in windows: their states are solved for at every point of the parameters.

That is variable projection (Golub & Pereyra 1973), as driven markers' corrections have it: an optimizer sees the
residuals [data; priors; gaps] at the best states for its parameters, with the Jacobian J + A X, where A is that of the
states and X how the best states follow the parameters (Kaufman 1975). Everything that a fit asks of a compiled problem
it can ask of `Lifted`, so no search, verdict or journal knows of windows. How the states are found is in
`lifted_motion`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from .. import _core
from ..arrays.types import Array
from ..experiment.cut import shot
from ..experiment.experiment import Experiment
from ..quantities.parameters import Parameters
from ..recording.recording import Recording
from ..statistics.layout import Integers
from .lifted_motion import Motion

Known = tuple[Sequence[float], Sequence[Sequence[int]], Sequence[Mapping[str, Any]]]
"""theta, the places of every experiment's quantities in it, and the free parameters, as the compiled problem has
them."""


@dataclass(frozen=True)
class WithStates:
    """Derivatives at a point in which states are numbers of their own, and do not follow the parameters.

    Attributes:
        jacobian: (rows, parameters) with the states held.
        states: by place of the experiment, (rows, numbers) with respect to its states.
        border: (gap rows,) s, where the gap is that a row belongs to.
        motion: (gap rows,) place of its experiment.
    """

    jacobian: Array
    states: dict[int, Array]
    border: Array
    motion: Integers


class Lifted:
    """Stands for the compiled problem, see above.

    Attributes:
        motions: of the experiments that are shot in windows, by their place.
        rows, data_rows, first_rows: as the compiled problem has them; the gaps' rows come last.
        failure: why the last evaluation was not ok.
    """

    def __init__(
        self,
        plain: _core.Problem,
        motions: Mapping[int, Motion],
        others: Mapping[int, _core.Problem],
        parameters: Parameters,
    ) -> None:
        """
        Args:
            plain: the compiled problem without windows.
            others: problems of one experiment, for those that are not shot in windows, without priors.
        """
        self._plain, self._parameters, self.failure = plain, parameters, ""
        self.motions, self._others = dict(motions), dict(others)
        self.first_rows, self.data_rows = plain.first_rows, plain.data_rows
        self.rows = plain.rows + sum(motion.gap_rows for motion in motions.values())

    @property
    def parameters(self) -> int:
        """Number of free ones."""
        return len(self._parameters.free)

    def evaluate(self, u: Array, jacobian: bool = True) -> tuple[bool, Array, Array]:
        """See `FitProblem.evaluate`."""
        r, J = self._residuals(u, jacobian)
        if not r:
            return False, np.zeros(self.rows), np.zeros((self.rows if jacobian else 0, len(u)))
        return True, np.concatenate(r), np.concatenate(J) if jacobian else np.zeros((0, len(u)))

    def _residuals(self, u: Array, jacobian: bool) -> tuple[list[Array], list[Array]]:
        """Parts of the residuals, and of the Jacobian where it is wanted; none where there is no answer."""
        r, J, gaps, of_gaps = list[Array](), list[Array](), list[Array](), list[Array]()
        for i in range(len(self.first_rows) - 1):
            if i in self._others:
                ok, mine, slopes = self._others[i].evaluate(u, jacobian)
                self.failure = self._others[i].failure
                r.append(mine)
                J.append(slopes)
            else:
                here = self.motions[i].solve(u, jacobian)
                ok = here is not None
                self.failure = "" if ok else self.motions[i].failure
                if here is not None:
                    for parts, part in zip((r, gaps), self.motions[i].residuals(here), strict=True):
                        parts.append(part)
                if here is not None and jacobian:
                    for parts, part in zip((J, of_gaps), self.motions[i].jacobian(here), strict=True):
                        parts.append(part)
            if not ok:
                return [], []
        return [*r, self._parameters.prior_residuals(u), *gaps], [*J, self._parameters.prior_jacobian(), *of_gaps]

    def with_states(self, u: Array) -> WithStates | None:
        """Derivatives with respect to parameters and states at u; None where there is no answer."""
        J = self._residuals(u, True)[1]
        if not J:
            return None
        jacobian, first = np.concatenate(J), self.rows - sum(motion.gap_rows for motion in self.motions.values())
        border: list[Array] = [np.zeros(0)]
        of_motion: list[Integers] = [np.zeros(0, dtype=int)]
        states: dict[int, Array] = {}
        for i, motion in self.motions.items():
            data, gaps = motion.with_states()
            rows = np.r_[self.first_rows[i] : self.first_rows[i + 1], first : first + motion.gap_rows]
            every = np.vstack([data, gaps])
            jacobian[rows] = every[:, : len(u)]
            states[i] = np.zeros((self.rows, every.shape[1] - len(u)))
            states[i][rows] = every[:, len(u) :]
            border.append(motion.gap_times)
            of_motion.append(np.full(motion.gap_rows, i))
            first += motion.gap_rows
        return WithStates(jacobian, states, np.concatenate(border), np.concatenate(of_motion))

    def absorbed(self, experiment: int) -> float:
        """What states at borders took of the data's degrees of freedom in the last evaluation."""
        return self.motions[experiment].absorbed() if experiment in self.motions else 0.0

    def simulate(self, experiment: int, u: Array) -> Array:
        """Markers (frames, markers, 3) m of one experiment.

        Raises:
            _core.Diverged, ValueError: the motion has no answer.
        """
        own = self.motions.get(experiment)
        return self._plain.simulate(experiment, u) if own is None else own.simulate(u)

    def physical(self, u: Array) -> Array:
        """Every value at u, of all quantities."""
        return self._plain.physical(u)

    def readings(self, experiment: int, u: Array) -> Array:
        """What force sensors read: (samples, 6) of one after the other."""
        return self._plain.readings(experiment, u)

    def relinearize(self) -> None:
        """States are solved for to the end at every point."""

    def follow(self, other: Lifted) -> None:
        """Go on from the states of another problem of the same motions."""
        if (other.rows, other.parameters) == (self.rows, self.parameters):
            self.restore(other.state())

    def state(self) -> Array:
        """What evaluations depend on besides u: they go on from the states of the last one."""
        return np.concatenate([part for motion in self.motions.values() for part in motion.saved()])

    def restore(self, state: Array) -> None:
        """Go on from such a state."""
        for motion in self.motions.values():
            state = motion.restore(state, self.parameters)


def of_one(e: Experiment, known: Known, i: int) -> tuple[dict[str, float], list[dict[str, Any]]]:
    """Values of one experiment's quantities, by name, and the free parameters with their places among these."""
    theta, mine, free = known[0], known[1][i], list[dict[str, Any]]()
    place = {slot: k for k, slot in enumerate(mine)}
    for p in known[2]:
        here = [(place[s], f) for s, f in zip(p["slots"], p["factors"], strict=True) if s in place]
        free.append({**p, "slots": [s for s, _ in here], "factors": [f for _, f in here], "prior": None})
    return {name: theta[slot] for name, slot in zip(e.scene.quantities, mine, strict=True)}, free


def lifted(
    plain: _core.Problem,
    experiments: Sequence[Experiment],
    recordings: Sequence[Recording],
    cores: Sequence[Mapping[str, Any]],
    known: Known,
    parameters: Parameters,
    threads: int,
) -> _core.Problem:
    """A compiled problem, or what stands for it where an experiment is shot in windows.

    Args:
        cores: of every experiment.
        known: as `plain` has it.
    """
    if not any(map(shot, experiments)):
        return plain
    theta, slots, free = known
    motions: dict[int, Motion] = {}
    others: dict[int, _core.Problem] = {}
    for i, (e, mine) in enumerate(zip(experiments, slots, strict=True)):
        if shot(e) is None:
            own = [{**p, "prior": None} for p in free]
            others[i] = _core.Problem(experiments=[cores[i]], theta=theta, slots=[mine], free=own, threads=threads)
        else:
            motions[i] = Motion(e, recordings[i], *of_one(e, known, i), threads)
    return cast(_core.Problem, Lifted(plain, motions, others, parameters))  # as far as a fit asks
