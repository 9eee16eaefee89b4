"""One window of a motion that is shot in several: compiled, with its start's numbers as unknowns beside the parameters.

Beside the recorded markers it tells where the free particles are shortly behind its own start and shortly behind the
start of the next window, at two instants each, from which gaps between windows follow.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import _core
from ..arrays.types import Array
from ..experiment.cut import free_particles, piece, shot, start_quantities
from ..experiment.experiment import Experiment
from ..objects.markers import on_particle
from ..recording.recording import Recording

Numbers = NDArray[np.intp]
FAR = 1e6  # m, of what is no residual: robust losses leave it as it is


@dataclass(frozen=True)
class Rows:
    """Numbers with their derivatives.

    Attributes:
        value: (rows,).
        state: (rows, q) with respect to the window's state.
        border: (rows, parameters) with respect to those of the fit.
    """

    value: Array
    state: Array
    border: Array


@dataclass(frozen=True)
class Seen:
    """A window at one point: residuals of its data, and states in m shortly behind its start and its end."""

    data: Rows
    start: Rows
    end: Rows


class LiftedWindow:
    """One window of an experiment.

    Attributes:
        states: how many numbers of its start are unknown; 0 for the first, whose start is a matter of parameters.
        rows: how many data rows it has.
    """

    def __init__(
        self,
        e: Experiment,
        recording: Recording,
        edges: Array,
        number: int,
        quantities: Mapping[str, float],
        free: Sequence[Mapping[str, Any]],
    ) -> None:
        """
        Args:
            recording: of which the window is a part.
            edges: (windows + 1,) s, see `cut.borders`.
            quantities: values of the experiment's quantities, in their order.
            free: the fit's parameters, as the compiled problem takes them; their slots count the quantities.
        """
        own = shot(e)
        assert own is not None and own.behind is not None and own.pace is not None
        self._behind, self._pace = own.behind, own.pace
        core = e.core(piece(recording, edges, number, own.behind))
        core["t0"] = float(edges[number]) - e.t0
        if number:
            core |= {"start": "given", "name": f"{e.name} from {edges[number]:.6g} s"}
        watched = [number] * (number > 0) + [number + 1] * (number < len(edges) - 2)  # borders
        shown = self._watch(core, e, [float(edges[k]) - e.t0 + j * own.behind for k in watched for j in (1, 2)])
        self._start = shown[:2] if number else []
        self._end = shown[-2:] if number < len(edges) - 2 else []
        names = list(quantities)
        lifted = [names.index(name) for name in start_quantities(e.scene)] if number else []
        self._columns, border = _without(free, lifted)
        state = [{"name": names[s], "log": False, "slots": [s], "factors": [1.0], "prior": None} for s in lifted]
        self.states, self.rows, self._parameters = len(lifted), len(self._data), len(free)
        self._core = _core.Problem(
            experiments=[core],
            theta=list(quantities.values()),
            slots=[range(len(names))],
            free=[*border, *state],
            threads=1,
        )

    def _watch(self, core: dict[str, Any], e: Experiment, instants: Sequence[float]) -> list[Numbers]:
        """Lets the compiled experiment show the free particles at some instants (s), as markers whose residuals times
        `FAR` are their places; returns the rows of each instant."""
        observed, particles = core["observed"], free_particles(e.scene)
        frames, markers = np.asarray(observed["times"]), len(observed["markers"])
        times = np.union1d(frames, instants)
        self._frames, places = np.searchsorted(times, frames), np.searchsorted(times, instants)
        measured = np.full((len(times), markers + len(particles), 3), np.nan)
        measured[self._frames, :markers] = observed["measured"]
        measured[places, markers:] = 0.0
        sigma = np.full(measured.shape[:2], FAR)
        sigma[self._frames, :markers] = observed["sigma"]
        core["observed"] = {
            **observed,
            "times": times,
            "measured": measured,
            "sigma": sigma,
            "axes": [0, 1, 2],
            "markers": [*observed["markers"], *(on_particle(p).core(e.scene) for p in particles)],
        }
        core["map"]["base"] = np.append(core["map"]["base"], np.zeros(3 * len(particles)))
        frame, marker = np.nonzero(np.isfinite(measured[..., 0]))
        counts = np.array([a in e.axes for a in "xyz"])
        self._data = np.flatnonzero(np.ravel((marker < markers)[:, None] & counts))
        self._markers, self._particles = markers, len(particles)
        return [np.flatnonzero(np.repeat((marker >= markers) & (frame == at), 3)) for at in places]

    @property
    def failure(self) -> str:
        """Why the last evaluation was not ok."""
        return self._core.failure or "a residual is not finite"

    def at(self, u: Array, state: Array, other: Seen | None = None) -> Seen | None:
        """The window at the fit's parameters u and a state (states,); None where the motion has no answer.

        Args:
            other: a point whose derivatives it takes, at a small part of the cost; None makes its own.
        """
        ok, r, J = self._core.evaluate(np.append(u[self._columns], state), other is None)
        if not ok or not np.isfinite(r).all() or not np.isfinite(J).all():
            return None
        values = self._shown(r)
        if other is not None:
            return Seen(
                *(replace(a, value=v) for a, v in zip((other.data, other.start, other.end), values, strict=True))
            )
        own = len(self._columns)
        border = np.zeros((len(r), self._parameters))
        border[:, self._columns] = J[:, :own]
        return Seen(*map(Rows, values, self._shown(J[:, own:]), self._shown(border)))

    def _shown(self, every: Array) -> tuple[Array, Array, Array]:
        """From all rows of the compiled problem those of the data, and of the states in m behind its start and end."""

        def place(shown: Sequence[Numbers]) -> Array:
            if not shown:
                return every[:0]
            early, late = (FAR / np.sqrt(self._particles) * every[which] for which in shown)
            return np.concatenate([early, self._pace / self._behind * (late - early)])

        return every[self._data], place(self._start), place(self._end)

    def data(self, u: Array, state: Array) -> Rows | None:
        """Residuals alone."""
        seen = self.at(u, state)
        return None if seen is None else seen.data

    def start(self, u: Array, state: Array) -> Rows | None:
        """Where the particles are shortly behind the start."""
        seen = self.at(u, state)
        return None if seen is None else seen.start

    def simulate(self, u: Array, state: Array) -> Array:
        """(frames, markers, 3) m of the recording's markers.

        Raises:
            _core.Diverged, ValueError: the motion has no answer.
        """
        every = self._core.simulate(0, np.append(u[self._columns], state))
        return every.reshape(-1, self._markers + self._particles, 3)[self._frames, : self._markers]


def _without(free: Sequence[Mapping[str, Any]], lifted: Sequence[int]) -> tuple[list[int], list[dict[str, Any]]]:
    """Which parameters set any quantity (by its slot) that is not lifted, and these without the lifted ones and their
    priors."""
    columns, kept = [], []
    for column, p in enumerate(free):
        tied = [(s, f) for s, f in zip(p["slots"], p["factors"], strict=True) if s not in lifted]
        if tied:
            columns.append(column)
            kept.append({**p, "slots": [s for s, _ in tied], "factors": [f for _, f in tied], "prior": None})
    return columns, kept
