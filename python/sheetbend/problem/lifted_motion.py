"""The windows of one motion, and the states at which they begin that are best for given parameters.

The states go on from where they were, by Gauss-Newton steps on the whole chain (`statistics.chain`), until a step
promises nothing. Derivatives cost several times as much as residuals do. So they are made where a Jacobian is asked
for, and other points take those of the last such point as long as residuals change as these say (a chord method;
Kelley 1995, Iterative Methods for Linear and Nonlinear Equations, section 5.4). What that leaves of the cost is of
second order in the change of the derivatives.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from ..arrays.types import Array
from ..experiment.cut import borders, free_particles, shot, start_quantities
from ..experiment.experiment import Experiment
from ..recording.recording import Recording
from ..statistics.chain import Chain, Gap, Window
from .lifted_window import LiftedWindow, Seen

ARRIVED, NEARLY = 1e-11, 1e-9  # of the cost: what a step of the states must promise, by derivatives there and others
BENT = 0.05  # of the change of the residuals: by so much derivatives of another point may miss it
HALVINGS = 8
FREE = 1e12  # m, of gaps that are let free


@dataclass
class Point:
    """A motion at one point: what its windows show, how well, and the states there.

    Attributes:
        u: (parameters,) of the fit, internal.
        states: (borders, q).
        seen: by every window.
        cost: half the sum of squares.
        own: whether the derivatives of `seen` are those there, and not those of the last point that has its own.
    """

    u: Array
    states: Array
    seen: list[Seen]
    cost: float
    own: bool


class Motion:
    """The windows of one experiment.

    Attributes:
        edges: (windows + 1,) s.
        length: s, of a window.
        deviation: m, of a gap in each direction of the state.
        gap_rows: how many rows gaps have.
        states: (borders, q) where it is.
        failure: why the last evaluation has no answer.
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
        self._threads, self._steps, self.failure = threads, own.steps, ""
        self._here: Point | None = None  # where the states were solved for last
        self._tangent: Point | None = None  # the last one with derivatives of its own
        self._along: list[Array] | None = None  # how the best states follow the parameters there
        self._solved: Array | None = None  # u of `_here`, and of the tangent with the states there
        self._tangent_at: tuple[Array, Array] | None = None

    def at(self, u: Array, states: Array, other: Point | None = None) -> Point | None:
        """The point at given parameters and states; None where a window has no answer.

        Args:
            other: whose derivatives it takes; None makes its own.
        """
        starts = [np.zeros(0), *states]
        slopes = [None] * len(starts) if other is None else other.seen
        if self._threads > 1:
            with ThreadPoolExecutor(self._threads) as pool:
                found = list(pool.map(lambda w, s, known: w.at(u, s, known), self.windows, starts, slopes))
        else:
            found = [w.at(u, s, known) for w, s, known in zip(self.windows, starts, slopes, strict=True)]
        if any(one is None for one in found):
            self.failure = next(w.failure for w, one in zip(self.windows, found, strict=True) if one is None)
            return None
        seen = [one for one in found if one is not None]
        cost = sum(float(np.sum(one.data.value[own] ** 2)) for one, own in zip(seen, self._counted, strict=True))
        cost += sum(float(gap.rest @ gap.rest) for gap in self.gaps(seen))
        return Point(u.copy(), states, seen, 0.5 * cost, other is None)

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

    def solve(self, u: Array, jacobian: bool = True) -> Point | None:
        """The point at the states that are best for u; None where there is no answer.

        Args:
            jacobian: whether its derivatives are to be its own.
        """
        here, left = self._begun(u), self._steps
        while here is not None:
            if not here.own and (left or jacobian) and self._bent(here):
                here = self._with_derivatives(u, here.states)
                continue
            steps, promised = self._step(here)
            there = None
            if left and promised > (ARRIVED if here.own else NEARLY) * here.cost:
                left -= 1
                there = self._lower(here, steps)
                if there is None and not here.own:
                    here = self._with_derivatives(u, here.states)
                    continue
            if there is None and (here.own or not jacobian):
                break
            here = self._with_derivatives(u, here.states) if there is None else there
        if here is not None:
            self.states, self._here, self._solved = here.states, here, here.u
        return here

    def _begun(self, u: Array) -> Point | None:
        """The point at which the solution for u begins: the last solution if that was for u, otherwise its states moved
        with the parameters to first order."""
        if self._here is not None and np.array_equal(self._here.u, u):
            return self._here
        known = self._known_tangent()
        if known is None:
            return self._with_derivatives(u, self.states)
        if self._solved is not None and np.array_equal(self._solved, u):
            there = np.array_equal(known.u, u) and np.array_equal(known.states, self.states)
            return known if there else self.at(u, self.states, known)
        moved = [X @ (u - known.u) for X in self._following()[1:]]
        here = self.at(u, known.states + np.reshape(moved, known.states.shape), known)
        return self.at(u, self.states, known) if here is None else here

    def _with_derivatives(self, u: Array, states: Array) -> Point | None:
        here = self.at(u, states)
        if here is not None:
            self._tangent, self._along, self._tangent_at = here, None, (here.u, here.states)
        return here

    def _known_tangent(self) -> Point | None:
        """The last point with derivatives of its own, made again where only its place was kept."""
        if self._tangent is None and self._tangent_at is not None:
            return self._with_derivatives(*self._tangent_at)
        return self._tangent

    def _following(self) -> list[Array]:
        """(q, parameters) of each window, how the best states follow the parameters at the tangent."""
        known = self._known_tangent()
        assert known is not None
        if self._along is None:
            self._along = Chain(self.fitted(known.seen), self.gaps(known.seen)).along()
        return self._along

    def _step(self, here: Point) -> tuple[list[Array], float]:
        """The Gauss-Newton step of all states, and what it promises of the cost."""
        windows, gaps = self.fitted(here.seen), self.gaps(here.seen)
        steps = Chain(windows, gaps).states()
        left = [w.rest + w.state @ s for w, s in zip(windows, steps, strict=True)]
        left += [g.rest + g.before @ a + g.behind @ b for g, a, b in zip(gaps, steps[:-1], steps[1:], strict=True)]
        return steps, here.cost - 0.5 * sum(float(part @ part) for part in left)

    def _lower(self, here: Point, steps: Sequence[Array]) -> Point | None:
        """Along a step as far as the cost is lower; by derivatives of another point all the way or not at all."""
        change = np.reshape(steps[1:], here.states.shape)
        for halving in range(HALVINGS if here.own else 1):
            there = self.at(here.u, here.states + 0.5**halving * change, here)
            if there is not None and there.cost < here.cost:
                return there
        return None

    def _bent(self, here: Point) -> bool:
        """Whether residuals changed since the tangent by another amount than the derivatives there say."""
        known = self._known_tangent()
        assert known is not None
        du, ds = here.u - known.u, [np.zeros(0), *(here.states - known.states)]
        gaps = self.gaps(known.seen)
        told = [
            (one.data.border @ du + one.data.state @ s)[own]
            for one, s, own in zip(known.seen, ds, self._counted, strict=True)
        ] + [g.border @ du + g.before @ a + g.behind @ b for g, a, b in zip(gaps, ds[:-1], ds[1:], strict=True)]
        changed = [
            (one.data.value - other.data.value)[own]
            for one, other, own in zip(here.seen, known.seen, self._counted, strict=True)
        ] + [g.rest - other.rest for g, other in zip(self.gaps(here.seen), gaps, strict=True)]
        off = sum(float(np.sum((a - b) ** 2)) for a, b in zip(changed, told, strict=True))
        return off > BENT**2 * sum(float(part @ part) for part in told) + NEARLY * here.cost

    def residuals(self, here: Point) -> tuple[Array, Array]:
        """Residuals of the data, and of the gaps between windows."""
        gaps = [np.zeros(0), *(g.rest for g in self.gaps(here.seen))]
        return np.concatenate([one.data.value for one in here.seen]), np.concatenate(gaps)

    def jacobian(self, here: Point) -> tuple[Array, Array]:
        """Derivatives of the residuals of data and gaps with respect to the parameters, with states that follow; for a
        point that has its derivatives."""
        assert here.own
        along, gaps = self._following(), self.gaps(here.seen)
        data = [one.data.border + one.data.state @ X for one, X in zip(here.seen, along, strict=True)]
        between = [g.border + g.before @ a + g.behind @ b for g, a, b in zip(gaps, along[:-1], along[1:], strict=True)]
        return np.concatenate(data), np.concatenate([np.zeros((0, len(here.u))), *between])

    @property
    def gap_times(self) -> Array:
        """(gap rows,) s, at which border each is."""
        between = self.edges[1:-1]
        return np.repeat(between, self.gap_rows // max(len(between), 1))

    def with_states(self) -> tuple[Array, Array]:
        """Derivatives of the residuals of data and gaps with respect to the parameters and all states, at the point of
        the last solution."""
        here = self._here
        assert here is not None and here.own
        gaps, ends = self.gaps(here.seen), np.cumsum([0, *(one.data.state.shape[1] for one in here.seen)])
        places = [slice(a, b) for a, b in pairwise(ends)]
        parts = ([one.data.border for one in here.seen], [g.border for g in gaps])
        data, between = (np.concatenate([np.zeros((0, len(here.u))), *part]) for part in parts)
        of_data, of_gaps = (np.zeros((len(part), ends[-1])) for part in (data, between))
        row = 0
        for one, own in zip(here.seen, places, strict=True):
            of_data[row : (row := row + len(one.data.value)), own] = one.data.state
        row = 0
        for g, own, onward in zip(gaps, places[:-1], places[1:], strict=True):
            mine = slice(row, row := row + len(g.rest))
            of_gaps[mine, own], of_gaps[mine, onward] = g.before, g.behind
        return np.hstack([data, of_data]), np.hstack([between, of_gaps])

    def absorbed(self) -> float:
        """What the states took of the data's degrees of freedom, by the last derivatives."""
        here = self._known_tangent()
        if here is None:
            return 0.0
        gaps = self.gaps(here.seen)
        known = Chain(self.fitted(here.seen), gaps).covariances()
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
        here = self.solve(u, jacobian=False)
        starts = [np.zeros(0), *(self.states if here is None else here.states)]
        return np.concatenate([w.simulate(u, s) for w, s in zip(self.windows, starts, strict=True)])

    def saved(self) -> list[Array]:
        """What later evaluations depend on besides u."""
        if self._solved is None or self._tangent_at is None:
            return [np.zeros(1), self.states.ravel()]
        return [np.ones(1), self.states.ravel(), self._solved, self._tangent_at[0], self._tangent_at[1].ravel()]

    def restore(self, numbers: Array, parameters: int) -> Array:
        """Go on from what was saved; gives what is left of the numbers."""
        known, size, shape = numbers[0] > 0, self.states.size, self.states.shape
        of_states, rest = np.split(numbers[1:], [size])
        self.states, self._here, self._tangent, self._along = of_states.reshape(shape).copy(), None, None, None
        self._solved, self._tangent_at = None, None
        if known:
            solved, u, states, rest = np.split(rest, np.cumsum([parameters, parameters, size]))
            self._solved, self._tangent_at = solved.copy(), (u.copy(), states.reshape(shape).copy())
        return rest


def _within(edges: Array, recording: Recording, behind: float) -> Array:
    """The borders that (part of) the recording has frames behind, and both ends."""
    between = edges[1:-1][edges[1:-1] + behind < recording.times[-1] + 1e-9]
    return np.concatenate([edges[:1], between, edges[-1:]])
