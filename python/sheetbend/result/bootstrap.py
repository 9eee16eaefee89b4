"""What a bootstrap of a fit found, as plain data."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class BootstrapInterval:
    """95 % of one parameter's estimates lie between `lower` and `upper`, in its unit."""

    name: str
    lower: float
    upper: float


@dataclass(frozen=True, kw_only=True)
class Bootstrap:
    """Estimates from parts of the data that were drawn at random.

    Attributes:
        drawn: what was drawn with replacement, in words, such as "12 recordings".
        draws: number of fits.
        lost: number of these that did not settle near the minimum; they do not count.
        intervals: of every free parameter.
    """

    drawn: str
    draws: int
    lost: int
    intervals: tuple[BootstrapInterval, ...]
