"""Which parameters some of a fit's experiments have."""

from __future__ import annotations

from collections.abc import Sequence

from ..experiment.experiment import Experiment
from ..quantities.parameters import Parameters


def expanded_to(parameters: Parameters, experiments: Sequence[Experiment]) -> Parameters:
    """The parameters, with each private one expanded to one for each experiment that has it."""
    has = {f"{name}[{e.name}]": q.value for e in experiments for name, q in e.scene.quantities.items()}
    every = parameters.expand([e.name for e in experiments], has)
    private = {f"{p.name}[{e.name}]" for p in parameters.values() if p.private for e in experiments}
    return Parameters(p for name, p in every.items() if name not in private or name in has)


def reaching(parameters: Parameters, names: set[str]) -> Parameters:
    """The parameters that are carried by some of the free ones or by none."""
    free = set(parameters.free)
    return Parameters(
        p for key, p in parameters.items() if (root := parameters.roots[key][0]) in names or root not in free
    )
