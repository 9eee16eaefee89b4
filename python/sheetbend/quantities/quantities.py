"""Named physical quantities of a scene and how the solver's inputs are made of them.

An input (a compliance, a mass, a rest length, a coordinate) is a sum of terms, each a coefficient times a product of
simple functions of named quantities: a link's compliance is `length/segments * 1/EA`. Fields that must stay positive
have exponentials of weighted quantities among the factors. The map and its derivative are compiled
(adjoint/observe/parameter_map.h).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import check_label, is_bound, is_number
from ..errors import SceneError

FUNCTIONS = {"identity": 0, "inverse": 1, "square": 2, "sin": 3, "cos": 4, "sqrt": 5, "inverse_sqrt": 6, "exp": 7}
FUNCTIONS |= {"over_one_plus": 8, "over_one_minus_twice": 9}  # 1/(1 + x), 1/(1 - 2 x)
ZERO_OR_MORE = (0.0, math.inf)  # limits of a quantity that starts at zero and cannot be negative


@dataclass(frozen=True)
class Quantity:
    """A named physical number of a scene, differentiable and fittable.

    Attributes:
        name: `<group>_<quantity>`.
        value: in `unit`.
        unit: SI.
        positive: whether only positive values make sense (such are fitted on a log scale by default).
        scale: a natural size in `unit` where zero is a sensible value (angles, offsets), else None.
        limits: least and largest value that make sense, where that is not just positive.
        beyond: what to change where a fit stops at one of them, in words.
        unsure: relative error that a positive one may have where a fit takes it as given.
    """

    name: str
    value: float
    unit: str
    positive: bool = True
    scale: float | None = None
    limits: tuple[float, float] | None = None
    beyond: str = "no value beyond makes sense: doubt the model"
    unsure: float = 0.01

    def __post_init__(self) -> None:
        check_label("quantity", self.name)
        if not is_number(self.value):
            raise SceneError(self.name, "must be a finite number", self.value, f"give a value in {self.unit}")
        object.__setattr__(self, "value", float(self.value))
        for field, bounds in (("scale", (self.scale,)), ("limits", self.limits or ())):
            if not isinstance(bounds, tuple | list) or not all(b is None or is_bound(b) for b in bounds):
                raise SceneError(f"{self.name}.{field}", "must be numbers", bounds, "give numbers, or leave it out")
        if self.positive and not self.value > 0.0:
            raise SceneError(self.name, "must be positive", self.value, f"give a positive value in {self.unit}")


@dataclass(frozen=True)
class Term:
    """coefficient * prod f(quantity) * exp(sum weight * quantity), added to entry `index` of the input array `array`;
    or to several entries, with index (k,), each distinct, and one coefficient (and weight) for all or (k,).

    A factor may be an intermediate value (`intermediate`) instead of a quantity. Terms of the array "intermediate",
    which come before, make it."""

    array: str
    index: int | np.ndarray
    coefficient: float | np.ndarray
    factors: tuple[tuple[str, str], ...]  # (quantity, function)
    exponents: tuple[tuple[str, float | np.ndarray], ...] = ()  # (quantity, weight)

    @property
    def quantities(self) -> tuple[str, ...]:
        """Names of the quantities in it."""
        return tuple(name for name in self.made_of if intermediate_of(name) is None)

    @property
    def made_of(self) -> tuple[str, ...]:
        """Names of the quantities and intermediate values in it, one for each factor."""
        return tuple(name for name, _ in (*self.factors, *self.exponents))

    def places(self, offset: int, size: int) -> np.ndarray:
        """(k,) where its entries stand in the flat inputs, whose array begins at `offset`; those of hidden nodes count
        from the end of their array."""
        own = np.ravel(self.index)
        return offset + np.where(own < 0, own + size, own)


def intermediate(k: int) -> str:
    """What an intermediate value is called as a factor."""
    return f"intermediate[{k}]"


def intermediate_of(name: str) -> int | None:
    """Which intermediate value a factor is, or None if it is a quantity."""
    return int(name[13:-1]) if name.startswith("intermediate[") else None


class Builder(Protocol):
    """A scene under construction, as seen by what adds particles' loads and named numbers to it."""

    terms: list[Term]
    has_drag: bool

    @property
    def particle_count(self) -> int: ...

    @property
    def positions(self) -> np.ndarray: ...

    @property
    def nodes(self) -> np.ndarray: ...

    def node_array(self, field: str, nodes: ArrayLike) -> np.ndarray: ...

    def add_quantity(
        self,
        name: str,
        value: float,
        unit: str,
        positive: bool = True,
        scale: float | None = None,
        limits: tuple[float, float] | None = None,
        shared: bool = False,
        beyond: str = Quantity.beyond,
        unsure: float = Quantity.unsure,
    ) -> str: ...

    def add_terms(self, terms: Sequence[Term]) -> None: ...


def term(array: str, index: int, coefficient: float, **functions: str) -> Term:
    """A term with functions by quantity, such as `term("compliance", 3, 0.02, rope_EA="inverse")`."""
    return product(array, index, coefficient, functions)


def product(array: str, index: int, coefficient: float, functions: Mapping[str, str]) -> Term:
    """A term with one entry: a coefficient times functions of quantities, by name of the quantity."""
    return Term(array, int(index), float(coefficient), tuple(functions.items()))
