"""What a fit found of a force or a wind over time that nobody measured, as plain data."""

from __future__ import annotations

from dataclasses import dataclass

Vector = tuple[float, float, float]


@dataclass(frozen=True, kw_only=True)
class OverTimeFit:
    """An unknown input over time in one recording, with its smoothness prior.

    Attributes:
        name: of the input, such as "push".
        recording: in which it was found.
        kind: "force" or "wind".
        unit: of its values.
        size: root mean square along each axis that the prior expects.
        size_lower, size_upper: of its 95 % interval, 0 and None at open ends; both None where the size was given.
        length: s, over which the input stays alike.
        length_lower, length_upper: likewise.
        times: s of the scene, knots between which the input is linear.
        values: along x, y and z at each knot.
        half_widths: of the values, 95 %, with the prior. They count the uncertainty of a size and a length that were
            found, and of all other parameters.
        left: of each value, the share of the prior's variance that the data leave, on average over the sizes and
            lengths that are possible.
        modes: names of its parameters.
    """

    name: str
    recording: str
    kind: str
    unit: str
    size: float
    size_lower: float | None
    size_upper: float | None
    length: float
    length_lower: float | None
    length_upper: float | None
    times: tuple[float, ...]
    values: tuple[Vector, ...]
    half_widths: tuple[Vector, ...]
    left: tuple[Vector, ...]
    modes: tuple[str, ...]
