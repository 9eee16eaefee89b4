"""What follows from the minimum of a fit: the estimates at the limit of short substeps and fine meshes with their
intervals and verdicts, what the fit rests on, and what contradicts it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..doubts.against_priors import against_priors
from ..doubts.beginnings import of_beginnings
from ..doubts.beyond_bounds import beyond_bounds
from ..doubts.bootstrap import bootstrap, wider
from ..doubts.conclude import judged_parameters, of_inputs
from ..doubts.contradictions import between_parts, together
from ..doubts.driven_noise import driven_doubts
from ..doubts.floors import at_floor_of_sweeps
from ..doubts.given import half_widths, premises
from ..doubts.losses import loss_doubts
from ..doubts.missing_force import missing_force
from ..doubts.missing_loss import missing_loss
from ..doubts.prediction import predicted_values
from ..doubts.profiles import Elsewhere
from ..doubts.spin import spins_otherwise
from ..doubts.stuck import bounded_by_sticking
from ..doubts.told import Told, told_numbers
from ..doubts.unstable import unstable_rests
from ..doubts.wrong_given import doubts_of, explained_by, wrong_in_either
from ..doubts.wrong_given import warnings_of as wrong_given_warnings
from ..experiment.experiment import Experiment
from ..minimum.discretization import Refinement, settled, to_the_limit, wanted_refinement
from ..minimum.time_step import Settled
from ..problem.problem import FitProblem
from ..quantities.parameters import Parameters
from ..result.bootstrap import Bootstrap
from ..result.estimate import Given, Premise
from ..statistics.identifiability import Identifiability
from .reached import Reached

IGNORED = ", and their standard deviations do not count"
Systematic = Callable[[FitProblem, np.ndarray], Mapping[str, float]]


@dataclass(frozen=True)
class Asked:
    """What the user of a fit asked of its intervals; the arguments of `fit` with these names say what they mean."""

    refinement: Refinement
    systematic: Systematic | None = None
    given: Mapping[str, float] = field(default_factory=dict)
    profiles: bool = True
    bootstrap: int = 0
    threads: int = 1

    def without_refits(self) -> Asked:
        """Where no refit tells anything."""
        return replace(self, refinement=wanted_refinement(False), systematic=None)


@dataclass(frozen=True)
class Conclusion:
    """What follows from a minimum.

    Attributes:
        at: the estimate with its discretization counted, and the problem of which it is the minimum.
        experiments: as they are compared.
        judged: intervals and verdicts.
        lower: where profiles ended below the minimum.
        values: of all parameters of all experiments.
        given: values that were not fitted, of experiments that are only predicted.
        corrected: corrections of the driven markers of these.
        warnings: for the reader.
        premises: what the fit rests on.
        contradicted: by parameter, which parts of the data ask for different values.
        bootstrap: intervals from data drawn at random, where they were asked for.
    """

    at: Settled
    experiments: tuple[Experiment, ...]
    judged: Identifiability
    lower: tuple[Elsewhere, ...]
    values: dict[str, float]
    given: tuple[Given, ...]
    corrected: dict[str, np.ndarray]
    warnings: tuple[str, ...]
    premises: tuple[Premise, ...]
    contradicted: dict[str, str]
    bootstrap: Bootstrap | None = None


def conclude(
    reached: Reached, experiments: Sequence[Experiment], wanted: Parameters, asked: Asked, refitter: str | None
) -> Conclusion:
    """Draw the conclusion. Ctrl-C passes through.

    Args:
        experiments: all, with those that are only predicted.
        wanted: parameters, private ones not expanded.
        refitter: name of the optimizer of refits; None after Ctrl-C, where whatever needs a refit is left out.
    """
    problem, best, lost = reached.problem, reached.best, reached.lost
    at, compared = settled(asked.refinement, experiments, problem, best, refitter)
    told, silent = ([], "") if refitter is None or lost else told_numbers(at.problem, at.u)
    rests_on = premises(at.problem, at.u, asked.given, told)
    more = dict(half_widths(rests_on, problem.parameters.free))
    for parameter, half_width in ({} if asked.systematic is None else asked.systematic(at.problem, at.u)).items():
        more[parameter] = more.get(parameter, 0.0) + half_width
    values = problem.parameters.to_physical(at.u)
    refined = to_the_limit(at.refits, problem.parameters, values)
    profiled = (at.problem, at.u) if at.searched else (problem, best.u)
    judged, lower = judged_parameters(
        at.problem, at.u, refined, more, refitter if asked.profiles else None, lost, profiled
    )
    judged = at_floor_of_sweeps(_with_shifts(judged, at.moved), at.refits)
    if refitter is not None and asked.profiles and not lost:
        judged = bounded_by_sticking(at.problem, at.u, judged, refitter)
    predicted = predicted_values(compared, wanted, values, refitter, asked.threads)
    warnings, contradicted = ((), {}) if refitter is None else _doubts(reached, at, judged, told, asked.refinement)
    drawn: Bootstrap | None = None
    if asked.bootstrap and refitter is not None and not lost:
        drawn, why = bootstrap(problem, best.u, asked.bootstrap, judged.autocorrelation_time)
        modes = of_inputs(problem)  # a draw without the stretches of an input leaves it to its prior
        told_of = [e for e in judged.estimates if e.name not in modes]
        warnings += (why,) if drawn is None else wider(drawn, told_of)
    if silent:
        ignored = IGNORED if asked.given else ""
        warnings += (f"what errors of the given values would move is not known{ignored}: {silent}",)
    return Conclusion(at, tuple(compared), judged, lower, *predicted, warnings, rests_on, contradicted, drawn)


def _doubts(
    reached: Reached, at: Settled, judged: Identifiability, told: list[Told], refinement: Refinement
) -> tuple[tuple[str, ...], dict[str, str]]:
    """What speaks against the minimum: warnings, and the contradictions by parameter."""
    fitted = (reached.problem, reached.best.u)
    contradicted = of_beginnings(*fitted, judged, reached.begun, refinement)
    contradicted |= between_parts(at.problem, at.u, judged, refinement)
    if reached.lost:
        return (), contradicted
    warnings: tuple[str, ...] = ()
    drawn_off: dict[str, str] = {}
    if not any(e.is_cloud for e in at.problem.experiments):  # whose points nobody follows over time
        warnings, drawn_off = driven_doubts(at.problem, at.u, judged)
    warnings += loss_doubts(at.problem, at.u, judged)
    wrong = wrong_in_either((at.problem, at.u), fitted, told, refinement)
    warnings += wrong_given_warnings(at.problem, wrong)
    spin, undecided = spins_otherwise(*fitted, judged)
    by_prior, off_priors = against_priors(at.problem, at.u, judged)
    warnings += undecided + by_prior
    lacking = (
        doubts_of(at.problem, at.u, judged, wrong),
        missing_loss(at.problem, at.u, fitted, explained_by(at.problem, wrong), refinement),
        missing_force(at.problem, at.u, judged),
        spin,
        unstable_rests(*fitted),
        beyond_bounds(at.problem, at.u, judged),
        off_priors,
    )
    return warnings, together(*lacking, drawn_off, contradicted)


def _with_shifts(judged: Identifiability, by: Mapping[str, float]) -> Identifiability:
    """With how far each estimate was moved to the limit of short substeps."""
    return replace(judged, estimates=tuple(replace(e, moved=by.get(e.name, 0.0)) for e in judged.estimates))
