"""What a reader must know of a fitted rope before using its numbers: sentences about how it was found."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from .model import NAME, RopeModel

LINKS_PER_BENDING_LENGTH = 3.0  # below this EI reads too high and GJ too low


def found_gravity(model: RopeModel, meant: Sequence[Sequence[float]]) -> list[str]:
    """A gravity that was chosen."""
    if len(meant) < 2 or model.gravity == meant[0]:
        return []
    along = ", ".join(f"{g:.3g}" for g in model.gravity)
    return [f"no gravity is given; [{along}] m/s^2 is assumed, since the rope sags along it and it predicts better"]


def found_late(late: float) -> list[str]:
    """Grips whose markers come late."""
    if not late:
        return []
    when = "after" if late > 0 else "before"
    taken = "earlier" if late > 0 else "later"
    return [
        f"the markers of the grips come {1e3 * abs(late):.3g} ms {when} the others, and the grips are taken as so much "
        f"{taken}; if one clock stamps all markers, the model lacks something else"
    ]


def short_links(model: RopeModel, values: Mapping[str, float]) -> list[str]:
    """Links that are long beside the bending length."""
    EI, length = values[f"{NAME}_EI"], values[f"{NAME}_length"]
    bending = (EI / (model.density * 9.81)) ** (1 / 3)
    links = bending / (length / model.segments)
    if links >= LINKS_PER_BENDING_LENGTH:
        return []
    return [
        f"a bending length ({1e3 * bending:.3g} mm) holds only {links:.2g} links: EI may read up to two times too high "
        "and GJ too low; raise max_segments"
    ]
