"""Simulated or recorded motions as one HTML file."""

from __future__ import annotations

from collections.abc import Sequence

from .packed import packed_motions
from .render import render
from .shown import Shown


def motion_page(motions: Sequence[Shown], title: str, about: str = "", version: str = "") -> str:
    """The page as HTML text.

    Raises:
        MissingExtraError: jinja2 is not installed.
    """
    return render("motion.html", title=title, about=about, version=version, data={"motions": packed_motions(motions)})
