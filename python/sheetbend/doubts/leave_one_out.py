"""Leave-one-out prediction: each recording as a fit to the others predicts it, for recordings that hold nothing out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from ..errors import InputError
from ..experiment.experiment import Experiment
from ..minimum.optimizers import refit
from ..problem.problem import FitProblem
from ..problem.workers import Common
from ..quantities.parameters import Parameters
from .prediction import Comparison, compare, predicted_values

MEANING = "every recording is predicted by a fit to the others, its private parameters at their mean"


def companions(e: Experiment, experiments: Sequence[Experiment], wanted: Parameters) -> list[Experiment]:
    """The other experiments that share a fitted quantity with one.

    Raises:
        InputError: there are none, so that nothing could predict it.
    """
    shared = {p.name for p in wanted.values() if not p.private and p.name in e.scene.quantities}
    others = [o for o in experiments if o is not e and shared & set(o.scene.quantities)]
    if not others:
        raise InputError(
            "leave_one_out",
            f"leaves nothing to predict '{e.name}' from",
            sorted(shared),
            "fit several recordings of it",
        )
    return others


def each_left_out(
    experiments: Sequence[Experiment], wanted: Parameters, values: Mapping[str, float], refitter: str, threads: int
) -> dict[str, Comparison]:
    """Each experiment that has no held-out part of its own, by name, as a fit to its companions predicts it.

    Args:
        experiments: the fitted ones.
        values: where the fit to all of them ended, by expanded name; the refits start there.
    """
    left = [i for i, e in enumerate(experiments) if e.held_out is None]
    common = Common((tuple(experiments), wanted, dict(values), refitter, threads))
    return {experiments[i].name: found for i, found in zip(left, common.map(_left_out, left), strict=True)}


def _left_out(common: tuple[Sequence[Experiment], Parameters, Mapping[str, float], str, int], left: int) -> Comparison:
    experiments, wanted, values, refitter, threads = common
    e = experiments[left]
    others = companions(e, experiments, wanted)
    known = set().union(*(o.scene.quantities for o in others))
    part = Parameters(p for p in wanted.values() if p.name in known)
    problem = FitProblem(others, part, threads=threads)
    end = refit(problem, problem.parameters.to_internal(values), refitter)
    every = [*others, replace(e, predict="mean")]
    found, _, _ = predicted_values(every, part, problem.parameters.to_physical(end.u), refitter, threads)
    return compare(every, part, found, threads)[-1]
