"""Groups of constraints of one kind."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import node_array, per_item
from ..errors import SceneError
from ..quantities.kinds import KINDS, VISCOUS_COMPLIANCE
from .rest_values import rest_values

Array = np.ndarray


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


def places_in_rest(groups: Sequence[Group], name: str) -> Array:
    """(count, parameters) where the parameters of a group's constraints stand in the input array "rest"."""
    start = 0
    for group in groups:
        if group.name == name:
            return start + np.arange(group.rest.size).reshape(group.rest.shape)
        start += group.rest.size
    raise KeyError(name)


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
