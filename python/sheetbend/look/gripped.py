"""A rope between two grips in a recording: the recipe of `[[gripped_rope]]` finds all that such a rope needs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import PurePosixPath
from typing import Any

from ..errors import RecordingError
from .held import between_grips, gripping, parts
from .lying import table_under
from .take import Description, Measured, Take
from .text import joined, table


def describe(takes: Sequence[Take], measured: Measured) -> Description | None:
    """A rope whose ends are held by two or more markers each; None for other recordings."""
    s = takes[0].seen
    _, order = parts(s)
    if s.static or not between_grips(s) or table_under(s, order) is not None:
        return None
    r = s.recording
    paths = [PurePosixPath(take.file) for take in takes]
    folders = {path.parent for path in paths}
    suffixes = {path.suffix for path in paths}
    if len(folders) > 1 or len(suffixes) > 1:
        fix = "put the recordings into one folder, with nothing else in it"
        raise RecordingError(
            "files", "of one rope between two grips lie in several folders", joined(map(str, paths)), fix
        )
    clamped = sorted(gripping(s) & set(order))
    notes = [
        f"a rope through {joined(r.markers[k] for k in order)}, held at both ends: "
        f"{joined(r.markers[k] for k in clamped)} are in the grips"
    ]
    unknown = [
        "how the rope lies in its grips, its shape at rest and its twist: the recipe for ropes between two grips tries "
        "them one after another, and keeps what predicts recordings that it was not fitted to",
        "the density: the motion shows only the ratios of stiffness and drag to it. Weigh the rope and give --density"
        if measured.density is None
        else "the mass of the markers: give `marker_mass`, or 0 if they were weighed with the rope",
    ]
    if len(takes) == 1:
        unknown.append(
            "other motions: with one recording, its last quarter judges the fit. Put all recordings of the "
            "rope into one folder, and set `pattern`"
        )
    rope: dict[str, Any] = {"name": "rope", "density": measured.density, "train": str(paths[0].parent)}
    rope["pattern"] = paths[0].name if len(takes) == 1 else f"*{paths[0].suffix}"
    rope |= {"units": takes[0].units, "clamped": [r.markers[k] for k in clamped]}
    rope["gravity"] = None if s.up_by == "file" else s.gravity.tolist()
    return Description("a rope between two grips", notes, unknown, table("[[gripped_rope]]", rope))
