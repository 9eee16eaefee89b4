"""A problem whose motions are shot in windows: their states are solved for at every point of the parameters.

That is variable projection (Golub & Pereyra 1973), as driven markers' corrections have it: an optimizer sees the
residuals [data; priors; gaps] at the best states for its parameters, with the Jacobian J + A X, where A is that of the
states and X how the best states follow the parameters (Kaufman 1975). Everything that a fit asks of a compiled problem
it can ask of `Lifted`, so no search, verdict or journal knows of windows. The states go on from where they were, by
Gauss-Newton steps on the whole chain (`statistics.chain`), until a step promises nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, cast

import numpy as np

from .. import _core
from ..arrays.timeseries import Array
from ..experiment.cut import borders, free_particles, shot, start_quantities
from ..experiment.experiment import Experiment
from ..quantities.parameters import Parameters
from ..recording.recording import Recording
from ..statistics.chain import Chain, Gap, Window
from .lifted_window import LiftedWindow, Seen

ARRIVED = 1e-11  # of the cost: what a step of the states must promise
STEPS, HALVINGS = 30, 8
FREE = 1e12  # m, of gaps that are let free

Known = tuple[Sequence[float], Sequence[Sequence[int]], Sequence[Mapping[str, Any]]]
"""theta, the places of every experiment's quantities in it, and the free parameters, as the compiled problem has
them."""


@dataclass
class Point:
    """A motion at one point: what its windows show, how well, and the states there."""

    u: Array
    states: Array
    seen: list[Seen]
    cost: float


class Motion:
    """The windows of one experiment.

    Attributes:
        edges: (windows + 1,) s.
        length: s, of a window.
        deviation: m, of a gap in each direction of the state.
        gap_rows: how many rows gaps have.
        states: (borders, q) where it is.
    """

    def __init__(
        self,
        e: Experiment,
        recording: Recording,
        quantities: Mapping[str, float],
        free: Sequence[Mapping[str, Any]],
        threads: int,
    ) -> None:
        own = shot(e)
        assert own is not None
        self.edges, names = _within(borders(e), recording, own.behind or 0.0), start_quantities(e.scene)
        count = len(self.edges) - 1
        self.windows = [LiftedWindow(e, recording, self.edges, k, quantities, free) for k in range(count)]
        self.length = float(self.edges[-1] - self.edges[0]) / count
        loss = np.inf if own.loss is None else own.loss
        self.deviation = min(loss * self.length / np.sqrt(len(names)), FREE)
        start = np.tile([quantities[name] for name in names], (count - 1, 1))
        self.states = np.array(own.states[: count - 1]) if len(own.states) >= count - 1 > 0 else start
        seen = np.repeat(recording.times <= e.fitted().times[-1], recording.mask.sum(axis=1) * len(e.axes))
        ends = np.cumsum([0] + [w.rows for w in self.windows])
        self._counted = [seen[ends[k] : ends[k + 1]] for k in range(count)]
        self.gap_rows = (count - 1) * 6 * len(free_particles(e.scene))
        self._threads, self.failure = threads, ""
        self._here: Point | None = None
        self._along: tuple[Array, list[Array]] | None = None  # parameters, and how the best states follow them there

    def at(self, u: Array, states: Array) -> Point | None:
        """None where a window has no answer."""
        starts = [np.zeros(0), *states]
        if self._threads > 1:
            with ThreadPoolExecutor(self._threads) as pool:
                found = list(pool.map(lambda w, s: w.at(u, s), self.windows, starts))
        else:
            found = [w.at(u, s) for w, s in zip(self.windows, starts, strict=True)]
        if any(one is None for one in found):
            self.failure = next(w.failure for w, one in zip(self.windows, found, strict=True) if one is None)
            return None
        seen = [one for one in found if one is not None]
        cost = sum(float(np.sum(one.data.value[own] ** 2)) for one, own in zip(seen, self._counted, strict=True))
        cost += sum(float(gap.rest @ gap.rest) for gap in self.gaps(seen))
        return Point(u.copy(), states, seen, 0.5 * cost)

    def gaps(self, seen: Sequence[Seen]) -> list[Gap]:
        """Between neighbors, in units of `deviation`."""
        return [
            Gap(a.end.state, -b.start.state, a.end.border - b.start.border, a.end.value - b.start.value).times(
                1.0 / self.deviation
            )
            for a, b in pairwise(seen)
        ]

    def fitted(self, seen: Sequence[Seen]) -> list[Window]:
        """The rows that states are fitted to."""
        return [
            Window(one.data.state[own], one.data.border[own], one.data.value[own]).compressed()
            for one, own in zip(seen, self._counted, strict=True)
        ]

    def solve(self, u: Array) -> Point | None:
        """At the states that are best for u; None where there is no answer."""
        here = self._begun(u)
        if here is None:
            return None
        for _ in range(STEPS):
            windows, gaps = self.fitted(here.seen), self.gaps(here.seen)
            steps = Chain(windows, gaps).states()
            left = [w.rest + w.state @ s for w, s in zip(windows, steps, strict=True)]
            left += [g.rest + g.before @ a + g.behind @ b for g, a, b in zip(gaps, steps[:-1], steps[1:], strict=True)]
            promised = here.cost - 0.5 * sum(float(part @ part) for part in left)
            if promised <= ARRIVED * here.cost:
                break
            for halving in range(HALVINGS):
                share = 0.5**halving
                there = self.at(u, here.states + share * np.array(steps[1:]).reshape(here.states.shape))
                if there is not None and there.cost < here.cost:
                    break
            else:
                break
            here = there
        self.states, self._here = here.states, here
        self._along = here.u, Chain(self.fitted(here.seen), self.gaps(here.seen)).along()
        return here

    def _begun(self, u: Array) -> Point | None:
        if self._here is not None and np.array_equal(self._here.u, u):
            return self._here
        here = None
        if self._along is not None and not np.array_equal(self._along[0], u):
            moved = [X @ (u - self._along[0]) for X in self._along[1][1:]]
            here = self.at(u, self.states + np.reshape(moved, self.states.shape))
        return self.at(u, self.states) if here is None else here

    def residuals(self, here: Point) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
        """Data rows and gap rows with their derivatives with respect to the parameters, the states following."""
        assert self._along is not None
        along, gaps = self._along[1], self.gaps(here.seen)
        data = [one.data.border + one.data.state @ X for one, X in zip(here.seen, along, strict=True)]
        between = [g.border + g.before @ a + g.behind @ b for g, a, b in zip(gaps, along[:-1], along[1:], strict=True)]
        empty = np.zeros((0, len(here.u)))
        return (
            (np.concatenate([one.data.value for one in here.seen]), np.concatenate(data)),
            (np.concatenate([np.zeros(0), *(g.rest for g in gaps)]), np.concatenate([empty, *between])),
        )

    def absorbed(self) -> float:
        """What the states took of the data's degrees of freedom, where it is."""
        if self._here is None:
            return 0.0
        seen = self._here.seen
        gaps = self.gaps(seen)
        known = Chain(self.fitted(seen), gaps).covariances()
        taken = float(sum(len(P) for P, _ in known))
        for g, (P, cross), (Q, _) in zip(gaps, known[:-1], known[1:], strict=True):
            taken -= float(np.sum((g.before @ P) * g.before) + np.sum((g.behind @ Q) * g.behind))
            taken -= 2.0 * float(np.sum((g.before @ cross) * g.behind))
        return taken

    def simulate(self, u: Array) -> Array:
        """(frames, markers, 3) m at the best states.

        Raises:
            _core.Diverged, ValueError: a window has no answer.
        """
        here = self.solve(u)
        starts = [np.zeros(0), *(self.states if here is None else here.states)]
        return np.concatenate([w.simulate(u, s) for w, s in zip(self.windows, starts, strict=True)])

    def saved(self) -> list[Array]:
        """What later evaluations depend on besides u."""
        if self._along is None:
            return [np.zeros(1), self.states.ravel()]
        return [np.ones(1), self.states.ravel(), self._along[0], *(X.ravel() for X in self._along[1])]

    def restore(self, numbers: Array, parameters: int) -> Array:
        """Go on from what was saved; gives what is left of the numbers."""
        known, (borders, q) = numbers[0] > 0, self.states.shape
        of_states, rest = np.split(numbers[1:], [borders * q])
        self.states, self._here, self._along = of_states.reshape(borders, q).copy(), None, None
        if known:
            u, of_along, rest = np.split(rest, [parameters, parameters * (1 + borders * q)])
            self._along = u.copy(), [np.zeros((0, parameters)), *of_along.reshape(borders, q, parameters)]
        return rest


def _within(edges: Array, recording: Recording, behind: float) -> Array:
    """The borders that (part of) the recording has frames behind, and both ends."""
    between = edges[1:-1][edges[1:-1] + behind < recording.times[-1] + 1e-9]
    return np.concatenate([edges[:1], between, edges[-1:]])


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
        data, gaps = list[tuple[Array, Array]](), list[tuple[Array, Array]]()
        for i in range(len(self.first_rows) - 1):
            if i in self._others:
                ok, r, J = self._others[i].evaluate(u, True)
                data.append((r, J))
                self.failure = self._others[i].failure
            else:
                here = self.motions[i].solve(u)
                ok = here is not None
                self.failure = "" if ok else self.motions[i].failure
                if here is not None:
                    mine, between = self.motions[i].residuals(here)
                    data.append(mine)
                    gaps.append(between)
            if not ok:
                return False, np.zeros(self.rows), np.zeros((self.rows if jacobian else 0, len(u)))
        prior = self._parameters.prior_residuals(u), self._parameters.prior_jacobian()
        parts = [*data, prior, *gaps]
        r = np.concatenate([part for part, _ in parts])
        return True, r, np.concatenate([part for _, part in parts]) if jacobian else np.zeros((0, len(u)))

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
