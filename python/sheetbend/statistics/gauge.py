"""What the data leave free: parameters without effect and combinations that move no residual (gauges).

From motion alone, mass m and compliance a enter as their product: m -> c m with a -> a/c moves nothing. Such
a direction is a right singular vector of the Jacobian with a singular value near zero. On log scales it is a
monomial in the parameters.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays.types import Array

RANK_TOLERANCE = 1e-6
"""Singular values below this part of the largest count as zero (columns scaled to unit length)."""

FLAT_TOLERANCE = 1e-12
"""Columns below this part of the longest count as zero."""

_TAKES_PART = 1e-3  # components below this part of the largest are rounding, once columns have unit length


@dataclass(frozen=True)
class Gauge:
    """A direction in parameter space that moves no residual.

    Attributes:
        members: the parameters that take part.
        exponents: their steps in internal coordinates: powers for parameters on a log scale.
        words: what stays free and what is known all the same.
    """

    members: tuple[str, ...]
    exponents: tuple[float, ...]
    words: str

    @property
    def powers(self) -> tuple[float, ...]:
        """Of the first member, for each of the others: what is known is other * first^-power."""
        return tuple(_rounded(step / self.exponents[0]) for step in self.exponents[1:])


@dataclass(frozen=True)
class NullSpace:
    """The rank of a Jacobian and what it does not see.

    Attributes:
        rank: number of directions that the data see.
        singular_values: of the Jacobian with columns of unit length, descending; flat columns left out.
        flat: parameters whose column is zero.
        gauges: combinations that stay free.
        determined: parameters that neither is true of, as column numbers.
        pivots: columns to hold so that the others have a unique answer: the flat ones and one per gauge.
    """

    rank: int
    singular_values: Array
    flat: tuple[str, ...]
    gauges: tuple[Gauge, ...]
    determined: tuple[int, ...]
    pivots: tuple[int, ...]


def null_space(
    jacobian: Array, names: Sequence[str], log: Sequence[bool], tolerance: float = RANK_TOLERANCE
) -> NullSpace:
    """Rank, flat parameters and gauges of a Jacobian.

    Args:
        jacobian: (rows, p) derivative in internal coordinates, prior rows included where priors shall count.
        names: of the p parameters.
        log: which of them have a log scale.
        tolerance: see `RANK_TOLERANCE`.
    """
    size = np.sqrt((jacobian**2).sum(0))
    flat = size <= FLAT_TOLERANCE * size.max(initial=0.0)
    seen = [int(i) for i in np.flatnonzero(~flat)]
    if not seen:
        return NullSpace(0, np.zeros(0), tuple(names), (), (), tuple(range(len(names))))
    triangle = np.linalg.qr(jacobian[:, seen] / size[seen], mode="r")  # the same right singular vectors
    _, values, right = np.linalg.svd(triangle)
    values = np.append(values, np.zeros(len(seen) - values.size))
    rank = int((values > tolerance * values[0]).sum())
    basis, columns = _echelon(right[rank:])
    gauges = tuple(_gauge(row / size[seen], [names[i] for i in seen], [log[i] for i in seen]) for row in basis)
    hidden = [int(i) for i in np.flatnonzero(flat)]
    involved = {seen[i] for i in np.flatnonzero(np.any(basis != 0, axis=0))} | set(hidden)
    return NullSpace(
        rank,
        values,
        tuple(names[i] for i in hidden),
        gauges,
        tuple(i for i in range(len(names)) if i not in involved),
        tuple(sorted([*hidden, *(seen[i] for i in columns)])),
    )


def _echelon(basis: Array) -> tuple[Array, list[int]]:
    """The same space with few parameters per vector (Gauss-Jordan, largest pivots), and the pivots."""
    basis, pivots = basis.copy(), []
    for row in range(len(basis)):
        pivot = int(np.argmax(np.abs(basis[row])))
        pivots.append(pivot)
        basis[row] /= basis[row, pivot]
        for other in range(len(basis)):
            if other != row:
                basis[other] -= basis[other, pivot] * basis[row]
    basis[np.abs(basis) < _TAKES_PART * np.abs(basis).max(axis=1, initial=0.0, keepdims=True)] = 0.0
    return basis, pivots


def _gauge(direction: Array, names: Sequence[str], log: Sequence[bool]) -> Gauge:
    part = [int(i) for i in np.flatnonzero(direction)]
    steps = direction[part] / np.abs(direction[part]).min() * np.sign(direction[part[0]])
    steps = np.array([_rounded(step) for step in steps])
    members = tuple(names[i] for i in part)
    if all(log[i] for i in part):
        free = " * ".join(f"{name}^{step:+g}" for name, step in zip(members, steps, strict=True))
        known = ", ".join(
            _monomial(members[0], name, step / steps[0]) for name, step in zip(members[1:], steps[1:], strict=True)
        )
    else:
        labels = [f"ln {names[i]}" if log[i] else names[i] for i in part]
        free = ", ".join(f"{label} {step:+g}" for label, step in zip(labels, steps, strict=True))
        known = ", ".join(
            _sum(labels[0], label, step / steps[0]) for label, step in zip(labels[1:], steps[1:], strict=True)
        )
    return Gauge(members, tuple(map(float, steps)), f"{free} stays free: only {known} is known")


def _rounded(step: float) -> float:
    """To the next half where that is near, else to two digits."""
    half = round(2 * step) / 2
    return half if half != 0 and abs(step - half) <= 0.02 * abs(half) else float(f"{step:.2g}")


def _monomial(pivot: str, name: str, power: float) -> str:
    """The combination of two log parameters that a gauge (pivot^1 * name^power) leaves alone."""
    power = _rounded(power)
    if power == 1:
        return f"the ratio {name}/{pivot}"
    if power == -1:
        return f"the product {pivot} * {name}"
    return f"{name}/{pivot}^{power:g}" if power > 0 else f"{name} * {pivot}^{-power:g}"


def signed_sum(labels: Sequence[str], weights: Sequence[float]) -> str:
    """A sum in words, such as "a - 0.2 * b"; the weights are given to two digits."""
    words = ""
    for label, weight in zip(labels, map(_rounded, weights), strict=True):
        size = "" if abs(weight) == 1 else f"{abs(weight):g} * "
        sign = ("- " if weight < 0 else "+ ") if words else ("-" if weight < 0 else "")
        words += f"{' ' if words else ''}{sign}{size}{label}"
    return words


def _sum(pivot: str, name: str, weight: float) -> str:
    """The combination of two parameters that a gauge (pivot +1, name +weight) leaves alone."""
    weight = _rounded(weight)
    size = "" if abs(weight) == 1 else f"{abs(weight):g} * "
    return f"{name} {'-' if weight > 0 else '+'} {size}{pivot}"
