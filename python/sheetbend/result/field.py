"""What a fit found of a stiffness that varies smoothly, as plain data."""

from __future__ import annotations

from dataclasses import dataclass

KNOWN, PRIOR_ALONE = 0.1, 0.9  # share of the prior's variance that the data leave
UNSEEN = 0.75  # likewise, of the finest modes: where the data leave less, they see finer ones too


@dataclass(frozen=True, kw_only=True)
class FieldFit:
    """A field of stiffness with a smoothness prior: over the clusters of a solid, the triangles of a cloth, or the
    joints of a rope or rod.

    Attributes:
        name: of the field, such as "toy_stiffness".
        size: root mean square of ln E about its mean that the prior expects.
        size_lower, size_upper: of its 95 % interval, 0 and None at open ends; both None where the size was given.
        length: m, over which neighbors are alike.
        length_lower, length_upper: likewise.
        centers: m, of the places at rest; of a rope the arc length, 0 and 0.
        stiffness: of each place, in `unit`.
        half_widths: of ln E of each place, 95 %, with the prior. They count the uncertainty of a size and a length that
            were found, and what the prior expects of modes finer than those that are fitted.
        left: of each place, the share of the prior's variance of ln E about its mean that the data leave, on average
            over the sizes and lengths that are possible.
        finest: the same share of the finest tenth of the modes that are fitted; None where all modes are fitted.
        unit: of the stiffness.
        place: what one place is called.
    """

    name: str
    size: float
    size_lower: float | None
    size_upper: float | None
    length: float
    length_lower: float | None
    length_upper: float | None
    centers: tuple[tuple[float, float, float], ...]
    stiffness: tuple[float, ...]
    half_widths: tuple[float, ...]
    left: tuple[float, ...]
    finest: float | None = None
    unit: str = "Pa"
    place: str = "cluster"
