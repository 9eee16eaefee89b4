"""The compiled least-squares problem of experiments and parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property, partial
from typing import Any

import numpy as np

from .. import _core
from ..errors import InputError, refusal
from ..experiment.experiment import Experiment
from ..motion.core_terms import divergence
from ..motion.equilibrium import no_rest
from ..quantities.parameters import Parameters
from ..recording.recording import Recording
from ..statistics.layout import Layout
from . import digests
from .coordinates import Coordinates, sums_of
from .counts import count
from .data_rows import layout_of, times_of
from .evaluator import Evaluator
from .journal import Timed
from .lifted import Known, Lifted, WithStates, lifted
from .on_the_way import OnTheWay
from .parts import expanded_to, reaching
from .spread import Spread

NOTHING = np.zeros((0, 1, 3))  # no correction at any knot
CHEAP = 3.0  # times the residuals: a Jacobian that costs less is made with them


class FitProblem(OnTheWay):
    """Experiments with shared and private parameters, compiled for one set of recordings' parts.

    Attributes:
        experiments: in order.
        parameters: with private ones expanded to one per experiment that has them.
        core: the compiled problem, or what stands for it (`lifted`).
        places: theta, where each experiment's quantities are in it, and the free parameters, as it was compiled from.
        evaluator: evaluates it, through the journal that was open when it was made.
        seconds: that the last evaluation from here took, with (True) and without a Jacobian.
    """

    def __init__(
        self,
        experiments: Sequence[Experiment],
        parameters: Parameters,
        recordings: Sequence[Recording] | None = None,
        threads: int = 1,
        expanded: Parameters | None = None,
        corrected: Mapping[str, np.ndarray] | None = None,
    ) -> None:
        """With `corrected`, by experiment (knots, markers, 3) m, no experiment estimates a correction of its own."""
        self.experiments = tuple(experiments)
        self.given, self.threads, self._corrected = parameters, threads, corrected
        self._last: tuple[np.ndarray, tuple[bool, np.ndarray, np.ndarray]] | None = None
        self.seconds: dict[bool, float] = {}
        self.recordings = tuple(recordings if recordings is not None else (e.fitted() for e in experiments))
        names = [e.name for e in experiments]
        if len(set(names)) != len(names):
            raise InputError("experiments", "share a name", names, "give each a name of its own")
        self.parameters = expanded_to(parameters, self.experiments) if expanded is None else expanded
        self._made_from: dict[str, Any] = {
            "experiments": self.experiments,
            "parameters": parameters,
            "recordings": self.recordings,
            "threads": threads,
            "expanded": self.parameters,
            "corrected": corrected,
        }
        theta, slots, slot_of = self._slots()
        held = [None if corrected is None else corrected.get(e.name, NOTHING) for e in self.experiments]
        cores = [e.core(r, b) for e, r, b in zip(self.experiments, self.recordings, held, strict=True)]
        free = self._free(slot_of)
        self.sensed = [core["sensors"] for core in cores]
        try:
            plain = _core.Problem(experiments=cores, theta=theta, slots=slots, free=free, threads=threads)
        except ValueError as error:
            raise refusal(error, InputError, [len(r.times) for r in self.recordings]) from error
        self.places: Known = theta, slots, free
        self.core = lifted(plain, self.experiments, self.recordings, cores, self.places, self.parameters, threads)
        scenes = [e.scene for e in self.experiments]
        cores = [{**c, "shooting": repr(e.shooting)} for c, e in zip(cores, self.experiments, strict=True)]
        self._spread = Spread.of(self)
        self.evaluator = Evaluator(
            self._spread or self.core, lambda: digests.of_problem(scenes, cores, theta, slots, free)
        )

    def __reduce__(self) -> tuple[Any, ...]:
        return partial(FitProblem, **self._made_from), ()

    def replaced(self, **changes: Any) -> FitProblem:
        """The same problem with some of the arguments that it was made with changed."""
        return FitProblem(**{**self._made_from, **changes})

    @cached_property
    def coordinates(self) -> Coordinates:
        """In which a search takes its steps."""
        sums = [s for e in self.experiments for s in sums_of(e.scene, self._keys(e), self.parameters)]
        return Coordinates(self.parameters, sums)

    def known(self, u: np.ndarray) -> tuple[np.ndarray, list[list[int]], dict[int, tuple[str, float]]]:
        """All values at u, where each experiment's quantities are among them, and by place the parameter that is there:
        the one that carries its value, and the factor to it."""
        _, slots, slot_of = self._slots()
        return self.core.physical(u), slots, {slot: self.parameters.roots[name] for name, slot in slot_of.items()}

    def check_start(self) -> None:
        """Refuse starting values that make a stiffness, mass or length negative.

        Raises:
            SceneError: names the quantities.
        """
        theta, slots, _ = self.known(self.parameters.initial())
        for e, mine in zip(self.experiments, slots, strict=True):
            e.scene.compiled.domain.check_quantities(theta[None, mine])
            e.scene.compiled.inputs(theta[mine])

    def holding(self, name: str, value: float) -> FitProblem:
        """The same problem with one (expanded) parameter held at a value."""
        held = self.parameters.replace(name, fixed=True, initial=value, prior=None, lower=-np.inf, upper=np.inf)
        return self.replaced(expanded=held)

    def of(self, experiments: Sequence[Experiment]) -> FitProblem:
        """The same problem of other experiments with the same recordings, such as these with another solver."""
        return self.replaced(experiments=experiments)

    def follow(self, other: FitProblem) -> FitProblem:
        """This problem, with corrections that begin where those of another one ended, of the same recordings or of
        parts of them: most of the search for them is saved."""
        if self is not other and self.estimates_corrections and other.estimates_corrections:
            self.core.follow(other.core)
        return self

    def on(self, recordings: Sequence[Recording]) -> FitProblem:
        """The same problem on parts of the recordings."""
        return self.replaced(recordings=recordings)

    def uncorrected(self, recordings: Sequence[Recording]) -> FitProblem:
        """The same problem on (parts of) the recordings, with the markers that scenes follow taken for the truth."""
        return self.replaced(recordings=recordings, corrected={})

    def moved(self, by: Mapping[str, np.ndarray]) -> FitProblem:
        """The same problem with the markers that scenes follow moved, by experiment (knots * markers * 3,) m."""
        shapes = {e.name: e.correction(r) for e, r in zip(self.experiments, self.recordings, strict=True)}
        given = {name: np.reshape(x, shape.shape) for name, x in by.items() if (shape := shapes[name]) is not None}
        return self.replaced(corrected=given)

    def around(self, name: str) -> FitProblem:
        """The part that one free (expanded) parameter is tied to, through shared parameters; the rest of the minimum
        does not depend on it. The problem itself where that is all of it."""
        free_of = [set(self.acting_on(e)) for e in self.experiments]
        names: set[str] = {name}
        chosen: list[int] = []
        while (reached := [i for i, mine in enumerate(free_of) if mine & names]) != chosen:
            chosen = reached
            names |= set().union(*(free_of[i] for i in chosen))
        return self if len(chosen) == len(self.experiments) else self.piece(chosen)

    def piece(self, chosen: Sequence[int]) -> FitProblem:
        """The part of some experiments, by number, with the parameters that reach them."""
        experiments, recordings = [self.experiments[i] for i in chosen], [self.recordings[i] for i in chosen]
        names = set().union(*map(self.acting_on, experiments))
        part = reaching(self.parameters, names)
        return self.replaced(experiments=experiments, recordings=recordings, expanded=part)

    def acting_on(self, e: Experiment) -> tuple[str, ...]:
        """The free (expanded) parameters that an experiment's motion depends on, in their order."""
        roots = self.parameters.roots
        mine = {roots[key][0] for key in self._keys(e).values() if key in self.parameters}
        return tuple(name for name in self.parameters.free if name in mine)

    def values_of(self, e: Experiment, u: np.ndarray) -> dict[str, float]:
        """Physical values at u (free,) of the quantities of an experiment's scene that are parameters."""
        values = self.parameters.to_physical(u)
        return {name: values[key] for name, key in self._keys(e).items() if key in values}

    def carried_by(self, e: Experiment) -> dict[str, tuple[str, float]]:
        """Of the quantities of an experiment's scene that are parameters: the one that carries the value, and the
        factor to it."""
        roots = self.parameters.roots
        return {name: roots[key] for name, key in self._keys(e).items() if key in roots}

    def _keys(self, e: Experiment) -> dict[str, str]:
        """Expanded parameter name of each quantity of an experiment, whether or not it is a parameter."""
        private = {p.name for p in self.given.values() if p.private}
        return {name: f"{name}[{e.name}]" if name in private else name for name in e.scene.quantities}

    def _slots(self) -> tuple[list[float], list[list[int]], dict[str, int]]:
        """theta, per experiment the place of each of its quantities in it, and the place of each expanded parameter."""
        values = dict(self.parameters)
        theta: list[float] = []
        slot_of: dict[str, int] = {}
        slots = []
        for e in self.experiments:
            mine = []
            for name, key in self._keys(e).items():
                quantity = e.scene.quantities[name]
                if key in values and key in slot_of:
                    mine.append(slot_of[key])
                    continue
                mine.append(len(theta))
                initial = values[key].initial if key in values else quantity.value
                theta.append(quantity.value if initial is None else initial)
                if key in values:
                    slot_of[key] = mine[-1]
            slots.append(mine)
        return theta, slots, slot_of

    def _free(self, slot_of: Mapping[str, int]) -> list[dict[str, Any]]:
        chain = {name: (root, factor) for name, (root, factor) in self.parameters.roots.items() if name in slot_of}
        lists = []
        for name in self.parameters.free:
            p = self.parameters[name]
            tied = [(slot_of[other], factor) for other, (root, factor) in chain.items() if root == name]
            prior = None if p.prior is None else (p.to_internal(p.prior[0]), p.prior[1])
            lists.append(
                {
                    "name": name,
                    "log": p.log,
                    "slots": [s for s, _ in tied],
                    "factors": [f for _, f in tied],
                    "prior": prior,
                }
            )
        return lists

    def evaluate(self, u: np.ndarray, jacobian: bool = True) -> tuple[bool, np.ndarray, np.ndarray]:
        """(ok, residuals (rows,), Jacobian (rows, free)); rows of data first, then those of the parameters' priors and
        of corrections'. Not ok where the physics has no answer. The last Jacobian is kept: everything that is told of
        a minimum asks for it."""
        if jacobian and self._last is not None and np.array_equal(self._last[0], u):
            return self._last[1]
        found, seconds = self.evaluator(u, jacobian)
        count(1, int(jacobian))
        if found[0] and seconds is not None:
            self.seconds[jacobian] = seconds
        if jacobian:
            self._last = np.array(u, dtype=float), found
        return found

    def with_states(self, u: np.ndarray) -> WithStates | None:
        """Where motions are shot in windows, derivatives at u with their states as numbers of their own."""
        return self.core.with_states(u) if isinstance(self.core, Lifted) else None

    def keep(self, u: np.ndarray, r: np.ndarray, J: np.ndarray) -> None:
        """Take what was evaluated at u past the problem for the last Jacobian; not where corrections go on from it."""
        if not self.estimates_corrections:
            self._last = np.array(u, dtype=float), (True, r, J)

    def known_at(self, w: np.ndarray) -> tuple[np.ndarray, Timed] | None:
        """The last Jacobian with its point, where that is w (free,) and a search may begin with it: where coordinates
        are the parameters themselves, and no correction goes on from it."""
        if self._last is None or self.coordinates.charts or self.estimates_corrections:
            return None
        u, found = self._last
        return (u, (found, self.seconds.get(True))) if np.array_equal(u, w) else None

    def cost(self, u: np.ndarray) -> float:
        """Half the sum of squares at u (free,); infinite where the physics has no answer."""
        ok, r, _ = self.evaluate(u, jacobian=False)
        return 0.5 * float(r @ r) if ok else np.inf

    @property
    def absorbed(self) -> float:
        """Degrees of freedom of the data's residuals that corrections and states of windows take."""
        return sum(map(self.core.absorbed, range(len(self.experiments))))

    @property
    def failure(self) -> str:
        """Why the last evaluation was not ok."""
        return (self._spread or self.core).failure or "a residual is not finite"

    def evaluate_exactly(self, u: np.ndarray) -> tuple[bool, np.ndarray, np.ndarray]:
        """`evaluate` with corrections linearized at u itself, as intervals need it; a fit's own steps may use an
        earlier linearization, which leaves the gradient exact."""
        if self.estimates_corrections:
            self.core.relinearize()
            self._last = None
        return self.evaluate(u)

    @property
    def cheap_jacobian(self) -> bool:
        """Whether a Jacobian costs little more than the residuals alone, as where both share the factors of a cloth, or
        is always made along, as where corrections go on from the last evaluation: no last digit hangs on a clock."""
        if self.estimates_corrections:
            return True
        return True in self.seconds and self.seconds[True] < CHEAP * self.seconds.get(False, 0.0)

    def simulate(self, u: np.ndarray) -> list[np.ndarray]:
        """Simulated markers (frames, markers, 3) of every experiment."""
        return [self.simulate_one(i, u) for i in range(len(self.recordings))]

    def simulate_one(self, experiment: int, u: np.ndarray) -> np.ndarray:
        """The same of one; threads may call it at the same time.

        Raises:
            DivergenceError, NoEquilibriumError: the physics has no answer.
            InputError: a stiffness, mass or length is negative.
        """
        scene = self.experiments[experiment].scene
        try:
            with divergence(scene):
                markers = self.core.simulate(experiment, u)
        except _core.NoEquilibrium as error:
            raise no_rest(scene, str(error), scene.positions) from error
        except ValueError as error:
            raise refusal(error, InputError, self.parameters.to_physical(u)) from error
        return markers.reshape(self.recordings[experiment].positions.shape)

    def readings(self, experiment: int, u: np.ndarray) -> list[np.ndarray]:
        """What the force sensors of one experiment read at u: (samples, 6) of each, N and N m in its axes."""
        with divergence(self.experiments[experiment].scene):
            every = self.core.readings(experiment, u)
        ends = np.cumsum([len(sensor["measured"]) for sensor in self.sensed[experiment]])
        return np.split(every, ends[:-1]) if len(ends) else []

    @cached_property
    def _layout(self) -> Layout:
        return layout_of(self.experiments, self.recordings, self.sensed)

    def rows_layout(self) -> Layout:
        """Where each data row comes from, see `data_rows`."""
        return self._layout

    def row_times(self) -> np.ndarray:
        """(rows,) s, when each data row was recorded; of an equilibrium NaN."""
        return times_of(self.experiments, self.recordings, self.sensed)
