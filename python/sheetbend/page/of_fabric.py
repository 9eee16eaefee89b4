"""The page of a fabric that was found from a laboratory's tests."""

from __future__ import annotations

from collections.abc import Sequence

from ..report.tables import Section
from ..result.estimate import UNSOUND, Estimate
from .packed import packed_motions
from .render import render, table
from .shown import Shown


def fabric_page(
    title: str,
    sections: Sequence[Section],
    motions: Sequence[Shown],
    pictures: Sequence[tuple[str, str]],
    *,
    estimates: Sequence[Estimate] = (),
    about: str = "",
    configuration: str = "",
    command: str = "",
    version: str = "",
) -> str:
    """The page as HTML text.

    Args:
        title: of the page.
        sections: of the report.
        motions: a drape in space, or nothing.
        pictures: caption and PNG in base64 of each.
        estimates: whose verdicts are counted at the top.
        about, configuration, command, version: see `result_page`.

    Raises:
        MissingExtraError: jinja2 is not installed.
    """
    verdicts = [e.verdict for e in estimates]
    good = all(v == "identified" for v in verdicts)
    return render(
        "fabric.html",
        title=title,
        about=about,
        tone="good" if good else "mixed",
        counts=[(v, verdicts.count(v), v in UNSOUND) for v in dict.fromkeys(verdicts)],
        parts=[table(section) for section in sections],
        pictures=pictures,
        configuration=configuration,
        command=command,
        version=version,
        data={"motions": packed_motions(motions)},
    )
