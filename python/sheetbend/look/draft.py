"""From what recordings show to the text of a configuration: which model, what is seen, and what cannot be known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from types import ModuleType

import numpy as np

from ..errors import RecordingError
from . import cantilever, cloth, flight, gripped, one_body, one_point, pendulum, rope
from .gaps import unfilled, without_gaps
from .objects import check_one_object
from .seen import Seen
from .take import Description, Measured, Take
from .text import comment, joined, table

REPEATED = 3  # frames like the one before from which on it is told
FEWEST = 3  # markers of anything but a pendulum
OF_ONE_MODEL = (
    ("poses", cloth, "are for a cloth that a robot holds", "leave them out: a rope takes markers on what holds it"),
    ("weight", rope, "hangs at a rope or cable", "leave it out; correct the masses in the configuration"),
    ("margin", cloth, "is of a cloth beyond its outer markers", "leave it out; --length is that of a rope or beam"),
    ("at", one_point, "is of a beam that one marker shows", "leave it out: it says where the only marker on a beam is"),
)
"""What is measured for one model alone: the field, the model, what it is for, and what to do with another model."""


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


def draft(takes: Sequence[Take], name: str, measured: Measured | None = None) -> Draft:
    """A configuration for one recording, or for several of the same thing.

    Raises:
        RecordingError: recordings of different markers, or one that shows nothing that a model is for.
    """
    measured = measured or Measured()
    first = takes[0].seen
    for take in takes:
        check_one_object(take.seen)
    own = [take.file for take in takes if take.seen.recording.markers != first.recording.markers]
    for model in (pendulum, flight, one_point, cantilever, cloth, gripped, rope):
        found = _described(model, takes if not own or model is rope else takes[:1], measured)
        if found is not None:
            break
    else:
        frames = len(first.recording.times)
        if frames < pendulum.LEAST_FRAMES:
            fix = "record the motion for longer or at a higher rate, or write a configuration by hand"
            raise RecordingError(first.recording.name, "holds too few frames to tell what moves", frames, fix)
        got = joined(first.recording.markers)
        if len(first.recording.markers) < FEWEST:
            fix = (
                "of a pendulum, give its pivot too, as a marker that stays; record three or more on a rope, and more "
                "on a cloth"
            )
            problem = "are too few to tell what moves, unless it is a pendulum in a plane or a beam that swings"
            raise RecordingError("markers", problem, got, fix)
        fix = "write a configuration by hand, see docs/configuration.md, and docs/bodies.md for rigid bodies"
        raise RecordingError(
            "markers", "do not move like a rope, beam, cloth, pendulum or a body in free flight", got, fix
        )
    if own and model is not rope:
        fix = "give recordings of the same markers, or make one configuration for each"
        raise RecordingError("markers", f"of {joined(own)} differ from the first file's", found.kind, fix)
    for field, its, problem, fix in OF_ONE_MODEL:
        if getattr(measured, field) is not None and model is not its:
            raise RecordingError(field, f"{problem}, and this is", found.kind, fix)
    told = (*_told(takes, found.up), *found.notes)
    stiff = model in (cloth, gripped, rope) and all(one_body.rigid(take.seen) for take in takes)
    unknown = [*found.unknown, *([one_body.WORDS] if stiff else [])]
    return written(found.kind, name, [t.file for t in takes], told, unknown, found.lines)


def _described(model: ModuleType, takes: Sequence[Take], measured: Measured) -> Description | None:
    """What a model makes of the takes, from pieces of them where what moves it is lost for too long in the whole,
    if these show as much."""
    found: Description | None = model.describe(takes, measured)
    if found is None:
        return None
    pieces = [without_gaps(take, found.driving) for take in takes]
    shorter = [take if piece is None else piece[0] for take, piece in zip(takes, pieces, strict=True)]
    cut: Description | None = model.describe(shorter, measured) if any(pieces) else found
    best = found if cut is None or cut.kind != found.kind else cut  # a piece may be at rest
    notes = [piece[1] for piece in pieces if piece is not None and best is cut]
    gaps = [line for take in (shorter if best is cut else takes) for line in unfilled(take, found.driving)]
    return best._replace(notes=[*notes, *best.notes], unknown=[*gaps, *best.unknown])


def written(
    kind: str,
    name: str,
    files: Sequence[str],
    told: Sequence[str],
    unknown: Sequence[str],
    lines: Sequence[str],
    source: str = "recording",
) -> Draft:
    """The configuration with its head: what is seen in the files, and what they do not tell, as comments."""
    head = comment(f"Written by `sheetbend new` from {joined(files)}. It shows {kind}.")
    head += ["#", "# Seen:", *(line for s in told for line in _item(s))]
    head += ["#", f"# Not known from the {source}:", *(line for s in unknown for line in _item(s))]
    head += table("[experiment]", {"name": name, "about": f"{kind}, drafted by sheetbend new"})
    return Draft(kind, tuple(told), tuple(unknown), "\n".join([*head, *lines]) + "\n")


def _item(sentence: str) -> list[str]:
    first, *rest = comment(f"- {sentence}")
    return [first, *(line.replace("# ", "#   ", 1) for line in rest)]


def _told(takes: Sequence[Take], up: str | None) -> list[str]:
    """About the files themselves; `up` is the way that the motion shows to be up."""
    said = []
    for take in takes:
        r = take.seen.recording
        markers = r.mask.shape[1]
        step = _step(r.times)
        time = f"{r.times[-1] - r.times[0]:.3g} s at {1 / step:.4g} Hz" if step else "one frame"
        lost = float(np.mean(~r.mask))
        said.append(
            f"{take.file}: {markers} markers, {time}"
            + (f", {lost:.2%} of the samples not seen" if lost else "")
            + (f", noise {1e3 * take.seen.noise:.2g} mm in each coordinate" if take.seen.noise else "")
        )
        said += r.mends
    first = takes[0].seen
    pieces = first.recording.metadata.get("joined", {})
    if isinstance(pieces, dict) and pieces:
        each = ", ".join(f"{name} goes on as {joined(more)}" for name, more in pieces.items())
        said.append(f"markers without a label that were lost and found again are joined: {each}")
    unread = first.recording.metadata.get("columns_not_read")
    if isinstance(unread, list) and unread:
        said.append(f"columns that hold no coordinate of a marker are not read: {joined(map(str, unread))}")
    said += first.strangers
    x = first.recording.positions
    box = np.nanmax(x, axis=(0, 1)) - np.nanmin(x, axis=(0, 1))
    said.append(f"the markers fill a box of {' x '.join(f'{v:.3g}' for v in box)} m")
    if again := _repeated(first):
        said.append(
            f"{again} frames repeat the one before while all moves on: the camera, or who filled its gaps, wrote them "
            "twice. Leave them out of the file, with their times if these count on"
        )
    if first.speed > 0:
        said.append(f"the fastest marker moves at {first.speed:.2g} m/s")
        far, near = first.speed * _step(first.recording.times), _neighbors(first)
        if far > near:
            said.append(
                f"between two frames it moves up to {far:.2g} m, farther than from one marker to the next: the motion "
                "between frames is not known. Record at a higher rate"
            )
    if takes[0].about_units:
        said.append(takes[0].about_units)
    if first.up_by == "guess" and up is not None:
        said.append(f"{up} points up, as the motion shows")
    elif first.up_by == "guess":
        axis = "xyz"[first.up]
        said.append(
            f"{axis} is taken as up, because the file does not say it. If another axis is, begin again with "
            f"--up {'y' if axis == 'z' else 'z'} or so"
        )
    else:
        down = int(np.argmax(np.abs(first.gravity)))
        axis = ("-" if first.gravity[down] > 0 else "") + "xyz"[down]
        said.append(f"{axis} points up, as {'the file says' if first.up_by == 'file' else 'given'}")
    return said


def _repeated(s: Seen) -> int:
    """Frames in which nothing has moved at all, between two in which it moves about as fast as ever; 0 of few."""
    x = np.nan_to_num(s.recording.positions).reshape(len(s.recording.times), -1)
    step = np.abs(np.diff(x, axis=0)).max(axis=1)
    if not step.any():  # shapes at rest, or one frame
        return 0
    digit = step[step > 0.0].min()  # rounding makes steps of one last digit as often as of none
    moves = step > max(0.5 * np.median(step), 2.5 * digit)
    between = step[1:-1][moves[:-2] & moves[2:]]
    again, rounded = int((between == 0.0).sum()), int(((between > 0.0) & (between < 1.5 * digit)).sum())
    return again if again >= REPEATED + 2 * rounded else 0


def _neighbors(s: Seen) -> float:
    """m, from a marker to the nearest other one: the median."""
    if len(s.apart) < 2:
        return float("inf")
    return float(np.median(np.sort(s.apart, axis=1)[:, 1]))


def _step(times: np.ndarray) -> float:
    """s between frames: the mean where they are even but for rounded times, else the median; 0 of one frame."""
    if len(times) < 2:
        return 0.0
    steps = np.diff(times)
    median = float(np.median(steps))
    return float(steps.mean()) if steps.max() < 1.5 * median else median


__all__ = ["Draft", "draft"]
