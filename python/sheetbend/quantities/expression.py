"""Sums of products of functions of quantities, added and multiplied like numbers, from which terms are made.

The pose of a body and the places of points on it are products of rotations, shifts and scalars. Arrays of `Expression`
(dtype object) are multiplied by NumPy's `@`; `terms_of` turns the result into the terms of a scene's inputs, so that
every derivative is exact.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.rotations import cross_matrix
from ..arrays.types import Array
from .quantities import Term

Factors = tuple[tuple[str, str], ...]  # (quantity, function), sorted
VALUES: Mapping[str, Callable[[float], float]] = {
    "identity": float,
    "inverse": lambda x: 1.0 / x,
    "square": lambda x: x * x,
    "sin": math.sin,
    "cos": math.cos,
    "sqrt": math.sqrt,
    "inverse_sqrt": lambda x: 1.0 / math.sqrt(x),
    "exp": math.exp,
    "over_one_plus": lambda x: 1.0 / (1.0 + x),
    "over_one_minus_twice": lambda x: 1.0 / (1.0 - 2.0 * x),
}


class Expression:
    """A sum of coefficients times products of functions of quantities.

    Attributes:
        parts: coefficient by factors; the constant has none.
    """

    def __init__(self, parts: Mapping[Factors, float]) -> None:
        self.parts = {factors: c for factors, c in parts.items() if c != 0.0}

    @classmethod
    def of(cls, quantity: str, function: str = "identity") -> Expression:
        return cls({((quantity, function),): 1.0})

    def __add__(self, other: Expression | float) -> Expression:
        parts = dict(self.parts)
        for factors, c in _parts(other).items():
            parts[factors] = parts.get(factors, 0.0) + c
        return Expression(parts)

    def __mul__(self, other: Expression | float) -> Expression:
        parts: dict[Factors, float] = {}
        for (f, c), (g, d) in product(self.parts.items(), _parts(other).items()):
            factors = tuple(sorted(f + g))
            parts[factors] = parts.get(factors, 0.0) + c * d
        return Expression(parts)

    __radd__, __rmul__ = __add__, __mul__

    def __neg__(self) -> Expression:
        return self * -1.0

    def __sub__(self, other: Expression | float) -> Expression:
        return self + other * -1.0

    def __rsub__(self, other: float) -> Expression:
        return -self + other

    @property
    def constant(self) -> float:
        """The coefficient of the part without factors."""
        return self.parts.get((), 0.0)

    def at(self, values: Mapping[str, float]) -> float:
        """The value of the expression at values of its quantities."""
        return sum(c * math.prod(VALUES[f](values[q]) for q, f in factors) for factors, c in self.parts.items())


def _parts(of: Expression | float) -> Mapping[Factors, float]:
    return of.parts if isinstance(of, Expression) else {(): float(of)}


def expressions(values: Any) -> Array:
    """An array of numbers or expressions as one of expressions, of the same shape."""
    given = np.asarray(values, dtype=object)
    found = np.empty(given.shape, dtype=object)
    for place in np.ndindex(given.shape):
        entry = given[place]
        found[place] = entry if isinstance(entry, Expression) else Expression({(): float(entry)})
    return found


def cross(a: Array, b: Array) -> Array:
    """The vector product of two vectors (3,) of expressions."""
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]], dtype=object)


def vector(names: Sequence[str]) -> Array:
    """The vector of quantities of these names."""
    return expressions([Expression.of(name) for name in names])


def rotation_products(names: Sequence[str]) -> Iterator[tuple[dict[str, str], Array]]:
    """Factors and matrices (3, 3) whose sum of products is Rz(c) Ry(b) Rx(a), with the angles a, b, c in rad under
    three names: about x first."""
    for parts in product(*(_plane_rotation(axis, q) for axis, q in enumerate(names))):
        (of_x, x), (of_y, y), (of_z, z) = parts
        matrix = z @ y @ x
        if matrix.any():
            yield {**of_x, **of_y, **of_z}, matrix


def _plane_rotation(axis: int, quantity: str) -> list[tuple[dict[str, str], Array]]:
    """The rotation about a coordinate axis as a sum: what it keeps, and what goes with the cosine and the sine."""
    along = np.outer(np.eye(3)[axis], np.eye(3)[axis])
    return [({}, along), ({quantity: "cos"}, np.eye(3) - along), ({quantity: "sin"}, cross_matrix(np.eye(3)[axis]))]


def rotation(names: Sequence[str]) -> Array:
    """The rotation of `rotation_products` as a matrix of expressions."""
    found = expressions(np.zeros((3, 3)))
    for factors, matrix in rotation_products(names):
        found = found + matrix * Expression({tuple(sorted(factors.items())): 1.0})
    return found


def names_in(of: Array) -> set[str]:
    """Names of the quantities in an array of expressions."""
    return {name for e in of.ravel() for factors in e.parts for name, _ in factors}


def numbers(of: Array, values: Mapping[str, float]) -> Array:
    """The numbers of an array of expressions at values of its quantities."""
    flat = [e.at(values) for e in of.ravel()]
    return np.reshape(flat, of.shape)


def by_factors(of: Array) -> dict[Factors, Array]:
    """Coefficients, in the shape of an array of expressions, by factors."""
    found: dict[Factors, Array] = {}
    for place in np.ndindex(of.shape):
        one: Any = of[place]
        for factors, c in one.parts.items():
            found.setdefault(factors, np.zeros(of.shape))[place] = c
    return found


def terms_of(array: str, index: ArrayLike, of: Array) -> list[Term]:
    """Terms that make entries `index` of an input array what expressions of the same shape say, constants included."""
    places, found = np.asarray(index), []
    for factors, c in by_factors(of).items():
        own = c != 0.0
        found.append(Term(array, places[own], c[own], factors))
    return found
