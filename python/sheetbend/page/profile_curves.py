"""Profiles as small pictures in SVG: the cost over one parameter, beside the parabola of the linear picture."""

from __future__ import annotations

from dataclasses import dataclass

from ..quantities.wording import figures, raised
from ..result.estimate import ProfileCurve
from ..result.result import FitData

MOST = 48  # pictures
WIDTH, HEIGHT = 200.0, 90.0
_TOP = 1.3  # rise at the upper edge


@dataclass(frozen=True)
class ProfilePicture:
    """One small picture: points of lines as SVG writes them, in a box of WIDTH and HEIGHT, and what is written below.

    Attributes:
        name: of the parameter, and its unit.
        curve, parabola: lines.
        end: height of the dotted line where intervals end.
        estimate: place of the estimate along the box.
        first, middle, last: values at both sides of the box, and the estimate.
    """

    name: str
    curve: str
    parabola: str
    end: float
    estimate: float
    first: str
    middle: str
    last: str


def profile_pictures(result: FitData) -> list[ProfilePicture]:
    """Pictures of the first `MOST` profiles of estimated parameters."""
    units = {e.name: e.unit for e in result.estimates}
    curves = [curve for curve in result.profiles if curve.name in units]
    return [_picture(curve, units[curve.name]) for curve in curves[:MOST]]


def _picture(curve: ProfileCurve, unit: str) -> ProfilePicture:
    first, last = curve.values[0], curve.values[-1]
    middle = curve.values[curve.rises.index(0.0)]
    scale = WIDTH / (last - first)
    written = figures([middle, first, last], (last - first) / 2)

    def line(rises: tuple[float, ...]) -> str:
        places = zip(curve.values, rises, strict=True)
        return " ".join(f"{scale * (x - first):.1f},{_down(rise):.1f}" for x, rise in places)

    return ProfilePicture(
        name=f"{curve.name} [{raised(unit)}]" if unit else curve.name,
        curve=line(curve.rises),
        parabola=line(curve.parabola),
        end=round(_down(1.0), 1),
        estimate=round(scale * (middle - first), 1),
        first=written[1],
        middle=written[0],
        last=written[2],
    )


def _down(rise: float) -> float:
    return HEIGHT * (1.0 - min(rise, _TOP) / _TOP)
