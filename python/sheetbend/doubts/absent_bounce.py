"""Restitution of contacts that a model gives none, at some sizes of it.

A little of it changes nothing: an approach that would leave slower than what gravity adds in two substeps comes to
rest. So there is no derivative at zero, and sizes are tried. From the best of them on there is one, and the restitution
is fitted along. Contacts with a stiffness give back by themselves.
"""

from __future__ import annotations

import copy
from dataclasses import replace

from ..experiment.experiment import Experiment
from ..problem.problem import FitProblem
from ..quantities.parameters import Parameter
from ..quantities.quantities import Quantity, Term
from .more_parameters import with_parameter

RESTITUTION = Parameter(name="[restitution]", initial=0.5, lower=0.0, upper=1.0, scale=0.1)
SIZES = tuple(k / 10 for k in range(1, 10))


def has_no_bounce(e: Experiment) -> bool:
    """Whether an experiment has rigid contacts with colliders, and none that bounces or dissipates."""
    contacts = e.scene.contacts.contacts
    rigid = any(c.rigid for c in contacts)
    return not e.static and rigid and not any(c.bounces or c.dissipates for c in contacts)


def with_bounce(problem: FitProblem, restitution: float) -> FitProblem:
    """The problem with a restitution of all rigid contacts of those motions that have none."""
    return problem.of([_bouncing(e, restitution) if has_no_bounce(e) else e for e in problem.experiments])


def with_free_bounce(problem: FitProblem) -> FitProblem:
    """The same problem with one more parameter at the end, the restitution."""
    return with_parameter(with_bounce(problem, 0.5), RESTITUTION)


def _bouncing(e: Experiment, restitution: float) -> Experiment:
    name = RESTITUTION.name
    scene = e.scene.shallow()
    scene.quantities = {**e.scene.quantities, name: Quantity(name, restitution, "", positive=False, scale=0.1)}
    scene.contacts = copy.copy(e.scene.contacts)
    scene.contacts.contacts = [replace(c, bounces=c.rigid) for c in e.scene.contacts.contacts]
    bouncing = sum(c.bounces for c in scene.contacts.contacts)
    more = [Term("restitution", k, 1.0, ((name, "identity"),)) for k in range(bouncing)]
    scene.terms = [*e.scene.terms, *more]
    return replace(e, scene=scene)
