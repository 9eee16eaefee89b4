"""What numbers that a fit takes as given change of the residuals of one of its experiments."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from .. import _core
from ..arrays.types import Array
from ..errors import SheetbendError
from ..experiment.experiment import Experiment
from ..problem.problem import FitProblem
from ..quantities.quantities import Term

Input = tuple[str, np.ndarray, np.ndarray]
"""Name of an input array of a scene, entries of it (k,), and what is added to each (k,)."""
Part = tuple[str, Input, Callable[[float], str]]
"""What a model may lack: its name, what one unit of it adds to an input, and what a size of it says of the model."""


def tangents(
    problem: FitProblem,
    u: Array,
    i: int,
    added: Mapping[str, Array | Input | list[Input]],
    quantities: Sequence[tuple[str, int, bool]] = (),
    corrected: Array | None = None,
) -> Array:
    """(rows, numbers) derivatives of the residuals of the i-th experiment, quantities first.

    Args:
        u: (free,) the point.
        added: by name, what one unit of it adds: to gravity (3,) m/s^2, or to another input array, or to several.
        quantities: name, place among the scene's quantities, and whether the derivative is that with respect to the
            logarithm.
        corrected: the experiment's corrections there (`FitProblem.corrections`).

    Raises:
        SheetbendError: the motion has no answer there.
    """
    e = problem.experiment_at(i, u)
    theta, slots, _ = problem.known(u)
    own = theta[slots[i]]
    names = list(added)
    free: list[dict[str, Any]] = [
        {"name": name, "log": log, "slots": [slot], "factors": [1.0], "prior": None}
        for name, slot, log in [*quantities, *((name, len(own) + n, False) for n, name in enumerate(names))]
    ]
    at = [float(np.log(own[slot]) if log else own[slot]) for _, slot, log in quantities] + [0.0] * len(names)
    d = e.core(problem.recordings[i], corrected)
    terms = [
        Term(array, where, by, ((name, "identity"),)) for name, v in added.items() for array, where, by in inputs_of(v)
    ]
    terms = [*e.extra_terms(), *e.sensor_terms(), *terms]
    map_ = e.scene.compiled.map(3 * len(e.compared) + 1, terms, [*e.scene.quantities, *names])
    d["map"] = map_ | {"base": d["map"]["base"]}
    core = _core.Problem(
        experiments=[d],
        theta=[*own, *np.zeros(len(names))],
        slots=[list(range(len(own) + len(names)))],
        free=free,
        threads=problem.threads,
    )
    ok, _, columns = core.evaluate(np.array(at))
    if not ok:
        raise SheetbendError(core.failure)
    return np.asarray(columns)


def residuals(problem: FitProblem, u: Array, i: int, e: Experiment, corrected: Array | None = None) -> Array:
    """(rows,) residuals of the i-th experiment at u (free,), on another scene that has the same quantities.

    Args:
        e: the experiment on that scene.
        corrected: the experiment's corrections there (`FitProblem.corrections`).

    Raises:
        SheetbendError: the motion has no answer there.
    """
    theta, slots, _ = problem.known(u)
    own, d = theta[slots[i]], e.core(problem.recordings[i], corrected)
    core = _core.Problem(experiments=[d], theta=own, slots=[list(range(len(own)))], free=[], threads=problem.threads)
    ok, r, _ = core.evaluate(np.zeros(0), jacobian=False)
    if not ok:
        raise SheetbendError(core.failure)
    return np.asarray(r)


def inputs_of(added: Array | Input | list[Input] | None) -> list[Input]:
    """What one unit of an error adds, as a list."""
    if added is None:
        return []
    if isinstance(added, list):
        return added
    return [added if isinstance(added, tuple) else ("gravity", np.arange(3), added)]
