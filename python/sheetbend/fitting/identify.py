"""What recordings of planned experiments would tell of parameters.

The Jacobian of a fit needs no data. Residuals are drawn with the size and the correlation over time that the user
expects of the noise, what a fit takes out of them is taken out to first order, and what is left goes through the same
statistics as the residuals of a fit. So the prediction counts what a fit counts: autocorrelation, degrees of freedom,
priors, floors of the solver, and gauges. Floors, verdicts and words are those that a fit would print, but for profiles:
wide intervals are linear.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..arrays.checks import MOST_WHOLE, check_count, check_kind, is_number
from ..arrays.types import Array
from ..doubts.floors import solver_floors
from ..doubts.roughness import rough_parameters
from ..errors import InputError, SheetbendError
from ..experiment.experiment import Experiment
from ..experiment.wanted import ParameterLike, as_parameters
from ..minimum.growth import growths, in_words
from ..objects.over_time import OverTime
from ..optional import require
from ..problem.linear_algebra import one_blas_thread
from ..problem.problem import FitProblem
from ..problem.smooth import Field, Smooth, with_fields
from ..quantities.parameters import Parameters
from ..recording.recording import Recording
from ..result.estimate import Estimate
from ..scene.scene import Scene
from ..statistics.identifiability import Identifiability
from ..statistics.identifiability import identify as judged
from ..statistics.intervals import NORMAL, open_estimate
from ..statistics.judge import Nuisance
from ..statistics.layout import Layout
from .experiments import experiments_of
from .plan import Plan, PlannedInput, Variant
from .variants import changes

DRAWS = 11  # of the noise; odd, so that there is one in the middle
KNOWN = 0.05  # of a logarithm or a natural scale: combinations that are known so well are not named
TAKES_PART = 0.2  # of the weakest combination's largest part
SEED = 8


@dataclass(frozen=True)
class _Noise:
    """Noise of planned recordings: its size in m (None for the experiments' sigma), and the correlation of neighboring
    frames."""

    sigma: float | None
    correlation: float

    def __post_init__(self) -> None:
        if self.sigma is not None and not (is_number(self.sigma) and self.sigma > 0):
            raise InputError("noise", "must be positive", self.sigma, "give the markers' noise in m")
        if not is_number(self.correlation) or not -1.0 < self.correlation < 1.0:
            fix = "give a correlation of neighboring frames between -1 and 1"
            raise InputError("autocorrelation", "is none", self.correlation, fix)

    def drawn(self, problem: FitProblem, layout: Layout) -> Array:
        """(rows, draws) residuals, in units of the experiments' sigma: a stationary process along every series."""
        rng = np.random.default_rng(SEED)
        sizes = np.array([1.0 if self.sigma is None else self.sigma / e.sigma for e in problem.experiments])
        size = np.where(layout.clocks == 0, sizes[layout.recording], 1.0)  # forces have their own sigma
        e = rng.standard_normal((DRAWS, len(layout.frame))).T
        if self.correlation:
            series = np.stack([layout.recording, layout.clocks, layout.channel])
            order = np.lexsort((layout.frame, *series))
            still = np.array([one.static for one in problem.experiments])[layout.recording]
            before = order[0]
            for row in order[1:]:
                if (series[:, row] == series[:, before]).all() and not still[row]:
                    rho = self.correlation ** int(layout.frame[row] - layout.frame[before])
                    e[row] = rho * e[before] + math.sqrt(1.0 - rho**2) * e[row]
                before = row
        return np.asarray(size[:, None] * e)

    def words(self, experiments: Sequence[Experiment]) -> str:
        """The noise in words, for the report."""
        sizes = sorted({e.sigma if self.sigma is None else self.sigma for e in experiments})
        size = " to ".join(f"{1e3 * s:.3g}" for s in (sizes if len(sizes) < 2 else (sizes[0], sizes[-1])))
        alike = f", {self.correlation:g} from frame to frame" if self.correlation else ", independent in every frame"
        return f"noise of {size} mm in each coordinate of a marker{alike}; the time step and the mesh count as exact"


@one_blas_thread()
def identify(
    scene: Scene | Experiment | Sequence[Experiment],
    recording: Recording | None = None,
    parameters: Mapping[str, ParameterLike] | Iterable[str] = (),
    *,
    noise: float | None = None,
    autocorrelation: float = 0.0,
    instead: Mapping[str, Sequence[Experiment]] | None = None,
    smooth: Mapping[str, Smooth] | None = None,
    suggest: bool = True,
    threads: int = 1,
    **experiment: Any,
) -> Plan:
    """Predict what a fit to recordings of these experiments would print.

    Args:
        scene: a scene with its `recording` (and any field of `Experiment` as keyword), or one or several experiments.
            Of their recordings only the frames and the seen markers count, not where the markers are.
        parameters: as `fit` takes them; their initial values are those to plan with.
        noise: m, of one coordinate of a marker; the experiments' `sigma` by default.
        autocorrelation: correlation of a marker's errors from one frame to the next, as of a model that is not quite
            right; 0 for independent ones.
        instead: other plans to compare with, by what is changed in words, such as the same experiments with a mass
            hung on.
        smooth: fields of stiffness, as `fit` takes them. A size or length that `Smooth` does not give cannot be found
            without data: 0.5 (of unknown inputs half of their `scale`) and a quarter of the extent are taken.
        suggest: also predict what a further marker, a force sensor, the same recordings once more, or each parameter
            measured to 1 % would give.
        threads: over experiments and Jacobian columns.

    Raises:
        InputError: anything inconsistent.
        SheetbendError: the motion diverges or has no equilibrium at the planned values.
        MissingExtraError: SciPy is not installed.
    """
    require("scipy.special", "fit")
    check_kind("instead", {} if instead is None else instead, Mapping, "give lists of experiments by words")
    check_count("threads", threads, 1, MOST_WHOLE, InputError)
    experiments = _planned(scene, recording, experiment)
    wanted, fields = with_fields(as_parameters(parameters, experiments), experiments, smooth or {})
    expected = _Noise(noise, autocorrelation)
    found = _Predicted(experiments, wanted, expected, threads)
    variants = []
    for name, others in (instead or {}).items():
        variants.append(_variant(name, _planned(others, None, {}), wanted, expected, threads))
    if suggest:
        for name, others, parameters_there in changes(experiments, found.problem.parameters, wanted):
            variants.append(_variant(name, others, parameters_there, expected, threads))
    grown = growths(found.problem, found.u)
    inputs = tuple(_inputs(fields, {e.name: e.half_width for e in found.estimates}))
    return Plan(
        estimates=found.estimates,
        rank=found.judged.rank,
        gauges=tuple(gauge.words for gauge in found.judged.gauges),
        weakest=found.weakest({mode for one in inputs for mode in one.modes}),
        noise=(expected.words(experiments),),
        growth=tuple(in_words(g) for g in grown),
        variants=tuple(variants),
        inputs=inputs,
    )


def _inputs(fields: Sequence[Field], half_widths: Mapping[str, float | None]) -> Iterator[PlannedInput]:
    """The mean square of an input along an axis is the sum of its modes' squares, whose shapes have one of 1."""
    for field in fields:
        for (modes, names), recording in zip(field.each, field.own or [""], strict=True):
            if isinstance(modes, OverTime):
                known = [half for name in names if (half := half_widths[name]) is not None]
                half = math.sqrt(sum(h**2 for h in known) / 3.0) if len(known) == len(names) else None
                name = f"{modes.name}[{recording}]" if recording else modes.name
                yield PlannedInput(name, modes.unit, half, NORMAL * field.size, names)


def _planned(
    scene: Scene | Experiment | Sequence[Experiment], recording: Recording | None, fields: Mapping[str, Any]
) -> list[Experiment]:
    wanted = "give one with the planned frames and markers; their places do not count"
    experiments = [e for e in experiments_of(scene, recording, fields, wanted) if e.predict is None]
    if not experiments:
        raise InputError("experiments", "are empty", 0, "give at least one that is fitted")
    return experiments


def _variant(name: str, experiments: Sequence[Experiment], wanted: Parameters, noise: _Noise, threads: int) -> Variant:
    found = _Predicted(experiments, wanted, noise, threads)
    return Variant(name, {e.name: e.half_width for e in found.estimates}, {e.name: e.verdict for e in found.estimates})


class _Predicted:
    """The estimates to expect of a plan.

    Attributes:
        problem: with recordings that the planned values explain exactly.
        u: (free,) the planned values, internal.
        judged: of the draw in the middle.
        estimates: one for each parameter, of the draw whose half-width is the median.
    """

    def __init__(self, experiments: Sequence[Experiment], wanted: Parameters, noise: _Noise, threads: int) -> None:
        self.problem = _explained(FitProblem(experiments, wanted, threads=threads))
        self.u = self.problem.parameters.initial()
        ok, _, J = self.problem.evaluate_exactly(self.u)
        if not ok:
            raise SheetbendError(f"the plan has no answer: {self.problem.failure}")
        rough = rough_parameters(self.problem, self.u, J[: self.problem.core.data_rows], growths(self.problem, self.u))
        every = self._judged(J, noise)
        self.judged = every[len(every) // 2]
        values = self.problem.parameters.to_physical(self.u)
        self.estimates = tuple(
            open_estimate(self.problem.parameters[name], values[name], rough[name], verdict="rough")
            if name in rough
            else _median([found.estimates[i] for found in every])
            for i, name in enumerate(self.problem.parameters.free)
        )

    def _judged(self, J: Array, noise: _Noise) -> list[Identifiability]:
        problem, layout = self.problem, self.problem.rows_layout()
        rows, behind = problem.prior_rows
        data, prior = J[:rows], J[rows:]
        errors = noise.drawn(problem, layout)
        size = np.maximum(np.linalg.norm(J, axis=0), np.finfo(float).tiny)
        full = np.concatenate([errors, np.zeros((len(prior), DRAWS))])
        left = errors - (data / size) @ np.linalg.lstsq(J / size, full, rcond=1e-9)[0]
        absorbed = problem.absorbed
        return [
            judged(
                problem.parameters,
                self.u,
                r,
                data,
                layout=layout,
                floors=solver_floors(problem.experiments, problem.parameters),
                nuisance=Nuisance(J[behind:], absorbed),
            )
            for r in left.T
        ]

    def weakest(self, apart: set[str]) -> str:
        """The combination of parameters that is determined least, in words, those in `apart` left out."""
        parameters = self.problem.parameters
        known = [i for i, e in enumerate(self.judged.estimates) if e.half_width is not None and e.name not in apart]
        names = [parameters.free[i] for i in known]
        if len(known) < 2:
            return ""
        sd = np.array([self._sd(i) for i in known])
        R = np.eye(len(known))
        for pair in self.judged.correlations:
            if pair.first in names and pair.second in names:
                a, b = names.index(pair.first), names.index(pair.second)
                R[a, b] = R[b, a] = pair.value
        values, vectors = np.linalg.eigh(R * np.outer(sd, sd))
        spread = NORMAL * math.sqrt(max(float(values[-1]), 0.0))
        if spread < KNOWN:
            return ""
        weight = vectors[:, -1] / vectors[np.argmax(np.abs(vectors[:, -1])), -1]
        parts = [(w, name) for w, name in sorted(zip(weight, names, strict=True), reverse=True) if abs(w) > TAKES_PART]
        if len(parts) < 2:
            return f"{parts[0][1]}, to {100 * spread:.2g} %"
        along = " and ".join(f"{name} ({w:+.2g})" for w, name in parts)
        return f"together {along}: they can move along by {100 * spread:.2g} % times these numbers"

    def _sd(self, i: int) -> float:
        """Internal standard deviation of a parameter, over its natural scale."""
        e, p = self.judged.estimates[i], self.problem.parameters[self.problem.parameters.free[i]]
        half = (e.half_width or 0.0) / NORMAL
        return half / abs(e.value) if p.log else half / (p.scale or 1.0)


def _explained(problem: FitProblem) -> FitProblem:
    """The problem with recordings that its parameters' initial values make."""
    u = problem.parameters.initial()
    problem.check_start()
    recordings = [
        replace(r, positions=np.where(r.mask[..., None], x, np.nan))
        for r, x in zip(problem.recordings, problem.simulate(u), strict=True)
    ]
    return problem.on(recordings)


def _median(estimates: Sequence[Estimate]) -> Estimate:
    """The one in the middle by half-width; open ones are the widest."""
    ordered = sorted(estimates, key=lambda e: math.inf if e.half_width is None else e.half_width)
    return ordered[len(ordered) // 2]
