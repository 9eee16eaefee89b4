"""What a problem solves for on the way: at every point of its parameters, numbers of its experiments that are no
parameters (`projection.h`). These are starts of motions, and corrections of the markers that scenes follow."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping

import numpy as np

from .. import _core
from ..experiment.correction import Correction
from ..experiment.estimated_start import EstimatedStart
from ..experiment.experiment import Experiment
from ..experiment.found_start import started
from ..quantities.parameters import Parameters
from ..recording.recording import Recording


class OnTheWay(ABC):
    """What `FitProblem` says of such numbers.

    Attributes:
        experiments, recordings, parameters, core: see there.
    """

    experiments: tuple[Experiment, ...]
    recordings: tuple[Recording, ...]
    parameters: Parameters
    core: _core.Problem
    _corrected: Mapping[str, np.ndarray] | None

    @abstractmethod
    def evaluate(self, u: np.ndarray, jacobian: bool = True) -> tuple[bool, np.ndarray, np.ndarray]:
        """(ok, residuals, Jacobian)."""

    @property
    def prior_rows(self) -> tuple[int, int]:
        """First row of the parameters' priors, and one past the last; those of corrections follow."""
        first = self.core.data_rows
        return first, first + len(self.parameters.prior_residuals(self.parameters.initial()))

    @property
    def estimates_corrections(self) -> bool:
        """Whether numbers of an experiment are solved for on the way: its start, or corrections of the markers that its
        scene follows."""
        return self.core.rows > self.prior_rows[1]

    @property
    def corrects_markers(self) -> bool:
        """Whether corrections of driven markers are solved for."""
        return self._corrected is None and any(e.driven_noise is not None for e in self.experiments)

    def corrections(self, u: np.ndarray) -> dict[str, np.ndarray]:
        """(knots, markers, 3) m by name of experiment, what is added at u to the markers that its scene follows; of
        those that estimate it."""
        found: dict[str, np.ndarray] = {}
        for i, own in self.correction_rows.items():
            e, correction = self.experiments[i], self._estimated(i)[0]
            if correction is not None and e.driven_noise is not None:
                numbers = self.evaluate(u)[1][own][-int(np.prod(correction.shape)) :]
                found[e.name] = e.driven_noise * numbers.reshape(correction.shape)
        return found

    def starts(self, u: np.ndarray) -> dict[str, np.ndarray]:
        """(numbers,) by name of experiment, what is estimated at u of its start, in units of the prior's deviations."""
        found: dict[str, np.ndarray] = {}
        for i, own in self.correction_rows.items():
            start = self._estimated(i)[1]
            if start is not None:
                found[self.experiments[i].name] = self.evaluate(u)[1][own][: start.count]
        return found

    def experiment_at(self, experiment: int, u: np.ndarray) -> Experiment:
        """One experiment; where its start is estimated, with what it is at u."""
        e = self.experiments[experiment]
        return e if e.estimated_start is None else started(e, self.starts(u)[e.name])

    def respond(self, experiment: int, u: np.ndarray, changes: np.ndarray) -> np.ndarray:
        """(count, data rows of the experiment) to first order, what changes (count, knots * markers * 3) m of the
        driven markers make of the residuals, everything else held."""
        start = self.experiments[experiment].estimated_start
        none = np.zeros((len(changes), 0 if start is None else start.count))
        return np.asarray(self.core.respond(experiment, u, np.hstack([none, changes])))

    def _estimated(self, experiment: int) -> tuple[Correction | None, EstimatedStart | None]:
        """What is solved for on the way of an experiment."""
        e, recording = self.experiments[experiment], self.recordings[experiment]
        corrects = self._corrected is None and e.driven_noise is not None
        return e.correction(recording) if corrects else None, e.estimated_start

    @property
    def correction_rows(self) -> dict[int, slice]:
        """The rows that corrections leave, by the place of their experiment."""
        found: dict[int, slice] = {}
        end = self.prior_rows[1]
        if self.estimates_corrections:
            for i in range(len(self.experiments)):
                correction, start = self._estimated(i)
                count = (0 if correction is None else int(np.prod(correction.shape))) + (start.count if start else 0)
                if count:
                    found[i] = slice(end, end := end + count)
        return found
