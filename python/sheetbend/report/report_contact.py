"""Sections of a report on scenes with contacts: what touches, and what touches otherwise at the ends of intervals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ..quantities.wording import short
from ..result.motions import ContactFit
from ..result.result import FitData
from .tables import Section

SMALLEST = 1e-6  # m, depth that a table has digits for
LOSSES = "the search for a drag or damping that the model lacks is linear, so it may miss a large one"


def contact_sections(result: FitData) -> list[Section]:
    """The two sections on contacts; empty where nothing can touch."""
    touching = touches_section(result.contacts)
    if touching.rows:
        touching = replace(touching, notes=(*touching.notes, ("losses", LOSSES)))
    return [touching, _kinks(result)]


def touches_section(contacts: Sequence[ContactFit]) -> Section:
    """What touches in motions; empty where nothing can."""
    rows = [
        (
            c.recording,
            c.contact,
            f"{c.most} of {c.particles}",
            str(c.began),
            str(c.ended),
            _percent(c.sliding),
            _percent(c.sticking),
            _percent(c.bdf1),
            "" if c.deepest is None else _depth(c.deepest),
        )
        for c in contacts
    ]
    headers = ("recording", "contact", "most at once", "began", "ended", "sliding", "sticking", "bdf1", "deepest")
    notes = (
        ("sliding, sticking", "shares of all touches, over all substeps"),
        ("self-contact", "counted in pairs where it has friction, out of those that there is room for"),
        ("bdf1", "share of the substeps of backward Euler, which damps vibrations"),
        ("deepest", "particle inside the shape at any frame, counted from the contact's radius"),
        *(
            (
                f"start of {c.recording}",
                f"settle moved {c.settled} particle{'s' * (c.settled > 1)} out of {c.contact}, "
                f"by up to {_mm(c.settled_by)} mm",
            )
            for c in contacts
            if c.settled
        ),
    )
    return Section("Contacts", headers, tuple(rows), notes if rows else ())


def _kinks(result: FitData) -> Section:
    rows = [(k.name, *(str(n) if n else "" for n in (k.begin, k.end, k.stick, k.slide))) for k in result.kinks]
    headers = ("parameter", "begin", "end", "stick", "slide")
    note = (
        "",
        "particles that do so at some frame at the upper end of the interval, but not at the lower end. Each makes a "
        "kink in the cost: profiles follow it, linear intervals do not",
    )
    differs = any(k.begin or k.end or k.stick or k.slide for k in result.kinks)
    return Section(
        "Contacts that differ between the ends of an interval", headers, tuple(rows), (note,) if differs else ()
    )


def _mm(length: float) -> str:
    return short(1e3 * length, 2)


def _depth(deepest: float) -> str:
    return f"{_mm(deepest)} mm" if deepest >= SMALLEST else f"< {_mm(SMALLEST)} mm"


def _percent(share: float) -> str:
    return f"{short(100.0 * share, 3)} %"
