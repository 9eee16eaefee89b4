"""Groups of constraints of one kind."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import node_array, per_item
from ..arrays.types import Array
from ..errors import SceneError
from ..quantities.kinds import KINDS, VISCOUS_COMPLIANCE
from .rest_values import rest_values

OF_CONSTRAINTS = ("compliance", "damping", "rest")
"""Input arrays with entries of constraints, one group after the other."""


@dataclass(frozen=True)
class Group:
    """A named set of constraints of one kind: particles (count, arity), base compliance and damping (count,), rest
    (count, parameters)."""

    name: str
    kind: str
    particles: Array
    compliance: Array
    damping: Array
    damped: bool
    rest: Array


@dataclass(frozen=True)
class GroupPlaces:
    """Where a group stands in arrays over the constraints of all groups.

    Attributes:
        group: whose places these are.
        first: number of its first constraint.
        first_row: number of its first scalar constraint, among Lagrange multipliers.
        first_parameter: place of its first parameter in the input array "rest".
    """

    group: Group
    first: int
    first_row: int
    first_parameter: int

    @property
    def constraints(self) -> Array:
        """(count,) entries of the input arrays "compliance" and "damping"."""
        return self.first + np.arange(len(self.group.particles))

    @property
    def rest(self) -> Array:
        """(count, parameters) entries of the input array "rest"."""
        return self.first_parameter + np.arange(self.group.rest.size).reshape(self.group.rest.shape)

    def of(self, array: str) -> Array:
        """Entries of one of the input arrays `OF_CONSTRAINTS`."""
        return self.rest if array == "rest" else self.constraints


def places_of_groups(groups: Sequence[Group]) -> Iterator[GroupPlaces]:
    """Every group with its places, in the order of the arrays."""
    first = row = parameter = 0
    for group in groups:
        yield GroupPlaces(group, first, row, parameter)
        first += len(group.particles)
        row += len(group.particles) * KINDS[group.kind]["rows"]
        parameter += group.rest.size


def make_group(
    name: str,
    kind: str,
    particles: ArrayLike,
    positions: Array,
    hidden: int,
    *,
    compliance: ArrayLike | None,
    damping: ArrayLike | None,
    viscosity: ArrayLike | None,
    rest: ArrayLike | None,
    normal: ArrayLike | None,
) -> Group:
    """A group among nodes at positions (n, 3) m, of which the last are hidden; the rest as in `Scene.add_constraints`.

    Raises:
        SceneError: wrong shapes, negative or missing values, zero lengths.
    """
    arity = KINDS[kind]["arity"]
    flat = node_array(f"{name}.particles", particles, len(positions) - hidden, hidden)
    if np.ndim(particles) != 2 or np.shape(particles)[1] != arity:
        raise SceneError(
            f"{name}.particles", "have the wrong shape", np.shape(particles), f"give (count, {arity}) for {kind}"
        )
    stencil = flat.reshape(-1, arity)
    count, label = len(stencil), "damping"
    if viscosity is not None:
        if compliance is not None or damping is not None:
            raise SceneError(f"{name}.viscosity", "excludes compliance and damping", viscosity, "give one or the other")
        compliance, damping, label = VISCOUS_COMPLIANCE, viscosity, "viscosity"
    alpha = per_item(f"{name}.compliance", 0.0 if compliance is None else compliance, count)
    beta = per_item(f"{name}.{label}", 0.0 if damping is None else damping, count)
    for field, values in (("compliance", alpha), (label, beta)):
        if (values < 0).any():
            raise SceneError(f"{name}.{field}", "must not be negative", float(values.min()), "give zero or more")
    about = KINDS[kind]["compliance"]
    if about["never_zero"] and not (alpha > 0).all():
        fix = f"give a positive compliance, {about['made_of']}"
        raise SceneError(f"{name}.compliance", f"is rigid, and {about['never_zero']}", float(alpha.min()), fix)
    inside = rest_values(name, kind, positions[stencil], rest, normal)
    return Group(name, kind, stencil, alpha, beta, damping is not None, inside)
