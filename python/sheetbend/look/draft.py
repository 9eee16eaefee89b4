"""From what recordings show to the text of a configuration: which model, what is seen, and what cannot be known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import RecordingError
from . import cantilever, cloth, pendulum, rope
from .seen import Seen, seen
from .text import comment, joined, table, value


@dataclass(frozen=True)
class Draft:
    """A configuration to begin with.

    Attributes:
        kind: what it takes the recording for, in words.
        seen: sentences about what the recording shows.
        unknown: sentences about what it cannot tell, and what stands in its place.
        text: the whole file.
    """

    kind: str
    seen: tuple[str, ...]
    unknown: tuple[str, ...]
    text: str


@dataclass(frozen=True)
class Take:
    """A recording for a draft: what it shows, and how the configuration calls its file."""

    seen: Seen
    file: str
    units: str | None = None


def draft(takes: Sequence[Take], name: str, density: float | None = None) -> Draft:
    """A configuration for one recording, or for several of the same thing.

    Args:
        density: kg/m of a rope, kg/m^2 of a cloth, where it was weighed.

    Raises:
        RecordingError: recordings of different markers, or one that shows nothing that a model is for.
    """
    first = takes[0].seen
    for take in takes[1:]:
        if take.seen.recording.markers != first.recording.markers:
            fix = "give recordings of the same markers, or make one configuration for each"
            raise RecordingError("markers", f"of {take.file} differ from the first file's", take.file, fix)
    for model in (pendulum, cantilever, cloth, rope):
        found = model.describe(takes, density)
        if found is not None:
            break
    else:
        got = joined(first.recording.markers)
        fix = "write a configuration by hand, see docs/configuration.md"
        raise RecordingError("markers", "move like no rope, cloth or pendulum", got, fix)
    kind, notes, unknown, body = found
    told = (*_told(takes), *notes)
    lines = comment(f"Written by `sheetbend new` from {joined(t.file for t in takes)}. It shows {kind}.")
    lines += ["#", "# Seen:", *(line for s in told for line in _item(s))]
    lines += ["#", "# Not known from the recording:", *(line for s in unknown for line in _item(s))]
    lines += table("[experiment]", {"name": name, "about": f"{kind}, as `sheetbend new` sees it"})
    return Draft(kind, told, tuple(unknown), "\n".join([*lines, *body]) + "\n")


def _item(sentence: str) -> list[str]:
    first, *rest = comment(f"- {sentence}")
    return [first, *(line.replace("# ", "#   ", 1) for line in rest)]


def _told(takes: Sequence[Take]) -> list[str]:
    """About the files themselves."""
    said = []
    for take in takes:
        r = take.seen.recording
        frames, markers = r.mask.shape
        step = float(np.median(np.diff(r.times))) if frames > 1 else 0.0
        time = f"{r.times[-1] - r.times[0]:.3g} s at {1 / step:.4g} Hz" if step else "one frame"
        lost = float(np.mean(~r.mask))
        said.append(
            f"{take.file}: {markers} markers, {time}"
            + (f", {lost:.2%} of the samples not seen" if lost else "")
            + (f", noise {1e3 * take.seen.noise:.2g} mm in each coordinate" if take.seen.noise else "")
        )
    first = takes[0].seen
    x = first.recording.positions
    box = np.nanmax(x, axis=(0, 1)) - np.nanmin(x, axis=(0, 1))
    said.append(f"the markers fill a box of {' x '.join(f'{v:.3g}' for v in box)} m")
    if takes[0].units is not None:
        said.append(f"lengths are taken as {takes[0].units}: in m the markers would be {1e3 * box.max():.3g} m apart")
    if not first.told:
        axis = "xyz"[first.up]
        said.append(f"{axis} is taken as up, the file does not say it: change `gravity` if another axis is")
    return said


__all__ = ["Draft", "Take", "draft", "seen", "value"]
