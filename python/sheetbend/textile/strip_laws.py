"""Load of a free strip against its strain, law by law: what a pull alone can tell apart.

A strip that narrows freely (or a specimen whose Poisson's ratio is zero) is stretched evenly, so its law is one curve.
Two of the laws lock: loops of yarn straighten, and what stretches from then on is the yarn itself (Sperl, Narain and
Wojtan 2020 find both regimes in knits). No constraint of the simulation has a law that locks; `fit_pull` and
`forecast_pull` alone know them.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ..arrays.types import Array

_NEAREST = 1e-9  # of the limit strain: closer to it no load is finite
_STEPS, _CLOSE = 60, 1e-10  # of Newton's method for the logarithm of a load


def green(strain: Array) -> Array:
    """Green strain of an extension."""
    return strain + strain**2 / 2.0


@dataclass(frozen=True)
class StripLaw(ABC):
    """Load = stiffness * shape(strain), of one or more numbers x that are measured against the largest fitted strain.

    Attributes:
        name: as in `fit_pull`.
        words: what the law says, for reports.
        simulated: whether `add_cloth` has it.
        prior: mean and standard deviation of each x, before a pull is seen.
    """

    name: ClassVar[str]
    words: ClassVar[str]
    simulated: ClassVar[bool] = True
    prior: ClassVar[tuple[tuple[float, float], ...]] = ()

    @abstractmethod
    def log_shape(self, strain: Array, x: Array, reach: float) -> Array:
        """Natural logarithm of load/stiffness.

        Args:
            strain: (n,) positive extensions.
            x: (..., d) the law's numbers.
            reach: largest fitted strain.

        Returns:
            (..., n).
        """

    def log_load(self, strain: Array, u: Array, reach: float) -> Array:
        """(..., n) of u (..., 1 + d): the logarithm of the stiffness, N/m, and then x."""
        return u[..., :1] + self.log_shape(strain, u[..., 1:], reach)


class LinearStrip(StripLaw):
    """St. Venant-Kirchhoff."""

    name = "linear"
    words = "tension proportional to Green strain"

    def log_shape(self, strain: Array, x: Array, reach: float) -> Array:
        out: Array = np.log(green(strain)) + np.log1p(strain) + np.zeros((*x.shape[:-1], 1))
        return out


class ExponentialStrip(StripLaw):
    """`laws.Exponential`; x = log(b reach^2), of the Green strain."""

    name = "exponential"
    words = "grows as exp(b strain^2)"
    prior = ((0.0, 1.5),)

    def log_shape(self, strain: Array, x: Array, reach: float) -> Array:
        e = green(strain)
        out: Array = np.log(e) + np.exp(x) * (e / green(np.asarray(reach))) ** 2 + np.log1p(strain)
        return out


class SinhStrip(StripLaw):
    """`laws.Sinh`; x = log(b reach), of the Green strain."""

    name = "sinh"
    words = "grows as exp(b strain)"
    prior = ((0.0, 1.5),)

    def log_shape(self, strain: Array, x: Array, reach: float) -> Array:
        b = np.exp(x) / green(np.asarray(reach))
        t = b * green(strain)
        out: Array = t + np.log(-np.expm1(-2.0 * t) / 2.0) - np.log(b) + np.log1p(strain)
        return out


class LimitStrip(StripLaw):
    """Load = k e/2 ((1 - strain/e)^-2 - 1) below the limit strain e; x = log(e/reach - 1).

    An inextensible wavy thread straightens like this: near its full length the distance left goes with load^-1/2.
    """

    name = "limit"
    words = "loops straighten towards a limit strain"
    simulated = False
    prior = ((0.0, 1.0),)

    def log_shape(self, strain: Array, x: Array, reach: float) -> Array:
        e = reach * (1.0 + np.exp(x))
        left = 1.0 - strain / e
        inside = left > _NEAREST
        out: Array = np.log(e / 2.0) + np.log(np.where(inside, left, 0.5) ** -2 - 1.0)
        return np.where(inside, out, np.inf)


class TwoRegimesStrip(StripLaw):
    """Loops that straighten in series with a yarn that stretches: with f = load/k

        strain = f (1 + (f/e)^p)^(-1/p) + f/y.

    x = log(e/reach), log(y), log(p): strain at which the loops are straight, stiffness of the yarn over that of the
    loops, and how suddenly the loops lock.
    """

    name = "two_regimes"
    words = "loops straighten, then the yarn stretches"
    simulated = False
    prior = ((0.5, 0.5), (3.0, 1.0), (0.3, 0.3))

    def log_shape(self, strain: Array, x: Array, reach: float) -> Array:
        e, y, p = (reach * np.exp(x[..., :1]), np.exp(x[..., 1:2]), np.exp(x[..., 2:3]))
        s = np.asarray(strain) + np.zeros_like(e)
        low, high = np.log(s * y / (1.0 + y)) - 1e-9, np.log(s * y) + 1e-9
        b = e + e / y - s  # the start is the answer for p = 1
        log_f = np.clip(np.log(2.0 * s * e / (b + np.sqrt(b * b + 4.0 * s * e / y))), low, high)
        for _ in range(_STEPS):
            f = np.exp(log_f)
            grown = np.logaddexp(0.0, p * (log_f - np.log(e)))
            loops = np.exp(log_f - grown / p)
            over = loops + f / y - s
            low, high = np.where(over > 0.0, low, log_f), np.where(over > 0.0, log_f, high)
            step = log_f - over / (loops * np.exp(-grown) + f / y)
            step = np.where((step > low) & (step < high), step, (low + high) / 2.0)
            if np.abs(step - log_f).max() < _CLOSE:
                return step
            log_f = step
        return log_f


STRIP_LAWS: dict[str, StripLaw] = {
    law.name: law for law in (LinearStrip(), ExponentialStrip(), SinhStrip(), LimitStrip(), TwoRegimesStrip())
}
LOCKING = tuple(name for name, law in STRIP_LAWS.items() if not law.simulated)
