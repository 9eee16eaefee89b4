"""The result of a fit, from the minimum that it reached and what follows from it."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..doubts.bootstrap import moved_by
from ..doubts.conclude import misfit, warnings_of
from ..doubts.contradictions import doubtful, elsewhere, held_out_motion
from ..doubts.implausible import implausible
from ..doubts.leave_one_out import MEANING
from ..doubts.misread import misread
from ..doubts.misread_forces import misread_forces
from ..doubts.prediction import Comparison
from ..doubts.profiles import Elsewhere
from ..doubts.stationary import unfinished
from ..doubts.touching import kinks, pressed_in, what_touches
from ..doubts.unexplained import unexplained
from ..experiment.clock import outside, told_clocks
from ..experiment.found_start import start_moved
from ..minimum.continuity import shot_motions
from ..minimum.field_fits import Fields
from ..minimum.fine_meshes import at_the_limit
from ..problem.counts import counted
from ..problem.smooth import Field
from ..report.dependence import with_dependences
from ..report.fit_result import FitResult
from ..result.motions import ContactFit, RecordingFit
from .conclusion import Conclusion
from .reached import Reached
from .rows import curves, every_end, given_rows, growth_rows, recording_fit, start_rows


@dataclass(frozen=True)
class Clock:
    """When a fit began, and how many evaluations and Jacobians this process had made by then."""

    began: float
    evaluations: int
    jacobians: int

    @classmethod
    def started(cls) -> Clock:
        """Now."""
        return cls(time.perf_counter(), *counted())

    def seconds(self) -> float:
        """Since then."""
        return time.perf_counter() - self.began

    def since(self) -> tuple[int, int]:
        """Evaluations and Jacobians since then."""
        evaluations, jacobians = counted()
        return evaluations - self.evaluations, jacobians - self.jacobians


@dataclass(frozen=True)
class Compared:
    """The recordings beside what the estimates predict.

    Attributes:
        comparisons: measured against simulated, per experiment.
        left_out: of the experiments that a fit to the others predicts.
        corrected: corrections of driven markers by experiment.
    """

    comparisons: tuple[Comparison, ...]
    left_out: Mapping[str, Comparison]
    corrected: dict[str, np.ndarray]


def result_of(
    reached: Reached,
    conclusion: Conclusion,
    compared: Compared,
    fields: Sequence[Field],
    interrupted: bool,
    clock: Clock,
) -> FitResult:
    """The result.

    Args:
        fields: with their priors.
        interrupted: by Ctrl-C, at any time.
    """
    problem, best, found = reached.problem, reached.best, reached.found
    at, judged, drawn = conclusion.at, conclusion.judged, conclusion.bootstrap
    parameters, comparisons, left_out = problem.parameters, compared.comparisons, compared.left_out
    errors = _recordings(reached, conclusion, compared)
    stopped, ahead = unfinished(problem, best, judged)
    missed = unexplained(problem, comparisons, judged.autocorrelation_time, at.u)
    contradicted = _contradicted(reached, conclusion, compared, errors, interrupted) | missed | stopped
    estimates, limit = at_the_limit(doubtful(judged.estimates, contradicted, missed), at.refits, parameters, at.u)
    values = conclusion.values | parameters.to_physical(limit)
    each = every_end(reached.ends, found.raced)
    searched = sum(m.evaluations for m in reached.ends), sum(m.jacobians for m in reached.ends)
    evaluations, jacobians = clock.since()
    contacts = what_touches(at.problem, at.u)
    ended = warnings_of([m for m, _ in each], interrupted, problem, estimates, ahead)
    warnings = tuple(_warnings(reached, conclusion, contacts, interrupted))
    found_fields = Fields(at.problem, at.u, fields)
    baselines = (c.baseline_words for c in (*comparisons, *left_out.values()) if c.baseline_words)
    result = FitResult(
        estimates=estimates,
        recordings=told_clocks(errors, conclusion.experiments, conclusion.values, estimates),
        cost=best.cost if at.problem is problem else at.cost,
        first_cost=best.first,
        jacobian_seconds=problem.seconds.get(True),
        rows=problem.core.data_rows,
        optimizer=found.optimizer,
        iterations=best.iterations,
        seconds=clock.seconds(),
        converged=best.converged,
        interrupted=interrupted,
        message=best.message,
        given=given_rows(parameters, values) + conclusion.given,
        correlations=judged.correlations,
        gauges=tuple(g.words for g in judged.gauges),
        baseline="; ".join(dict.fromkeys(baselines)),
        held_out_is=MEANING if left_out else "",
        autocorrelation_time=judged.autocorrelation_time,
        starts=start_rows(each, parameters),
        condition=None if found.condition is None else found.condition.words,
        profiles=curves(judged.profiles, parameters, limit),
        bootstrap=None if drawn is None else moved_by(drawn, parameters, limit - best.u),
        refits=at.refits,
        not_counted=at.not_counted,
        premises=conclusion.premises,
        misfit=misfit(at.problem, at.u),
        forces=tuple(row for c in comparisons for one in c.forces for row in one.fits()),
        growth=growth_rows(found.growths, reached.growths),
        contacts=contacts,
        shot=shot_motions(problem, best.u),
        fields=found_fields.stiffness(),
        over_time=found_fields.over_time(),
        kinks=() if interrupted else kinks(at.problem, at.u, estimates),
        windows=best.windows,
        evaluations=searched[0],
        jacobians=searched[1],
        judging=(evaluations - searched[0], jacobians - searched[1]),
        warnings=(*ended, *warnings),
    )
    return replace(result, estimates=with_dependences(result))


def _warnings(
    reached: Reached, conclusion: Conclusion, contacts: Sequence[ContactFit], interrupted: bool
) -> Iterator[str]:
    """What the conclusion warns of, contacts that press in, and recordings and forces that seem misread."""
    problem, best, at = reached.problem, reached.best, conclusion.at
    yield from conclusion.warnings
    yield from at.warnings
    yield from pressed_in(at.problem, at.u, contacts)
    yield from outside(conclusion.experiments, conclusion.values)
    if not interrupted:
        yield from misread(problem, best.u)
        yield from misread_forces(problem, best.u)
        yield from implausible(problem)


def _recordings(reached: Reached, conclusion: Conclusion, compared: Compared) -> tuple[RecordingFit, ...]:
    """The errors of each recording."""
    at, fitted, rows = conclusion.at, reached.problem.experiments, reached.problem.core.first_rows
    count = {e.name: rows[i + 1] - rows[i] for i, e in enumerate(fitted)}
    starts = {e.name: start_moved(e, at.problem.starts(at.u)[e.name]) for e in fitted if e.start == "estimated"}
    return tuple(recording_fit(c, count, compared.left_out, compared.corrected, starts) for c in compared.comparisons)


def _contradicted(
    reached: Reached,
    conclusion: Conclusion,
    compared: Compared,
    errors: Sequence[RecordingFit],
    interrupted: bool,
) -> dict[str, str]:
    """By parameter, what other data, other starts, and other parts of the data ask for."""
    problem, best = reached.problem, reached.best
    other_starts = [
        Elsewhere(m.cost - best.cost, problem.parameters.to_physical(m.u), "another start") for m in reached.ends[1:]
    ]
    return (
        held_out_motion(problem, compared.comparisons, errors, interrupted)
        | elsewhere(problem, conclusion.judged, best.cost, [*other_starts, *conclusion.lower])
        | conclusion.contradicted
    )
