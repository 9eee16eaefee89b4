"""Which recordings of a set can be used: mended where that is possible, left out with a word where it is not.

One bad file of many costs that file, not the fit, and a grip that is lost for a while costs part of a file. Left out is
what no motion can be made of, and what is no recording
of the same rope as most others: another number of markers, other distances between them, another length, or a sag along
another axis.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import overload

import numpy as np
from numpy.typing import NDArray

from ..arrays.checks import is_list
from ..arrays.types import Array
from ..errors import InputError, RecordingError
from ..quantities.wording import several
from ..recording.recording import Recording
from .alike import FEWEST, alike
from .end_links import usual_links
from .mend import mended, steadied_order
from .motion import GrippedMotion, gripped_ends
from .plausible import sag_axis
from .stretch import longest_stretch

LEFT_OUT = " is left out: "
MOST_NAMED = 3  # recordings of which the same is said
OTHER = 0.02  # relative difference of length, and of marker places over the length, that another rope has at least
SCATTERED = 6.0  # the same over the median difference of the others


@dataclass(frozen=True, eq=False)
class Screened(Sequence[GrippedMotion]):
    """The motions that can be used, a sequence, with words on the others.

    Attributes:
        motions: in the given order.
        notes: a sentence on each recording that was mended or left out.
    """

    motions: tuple[GrippedMotion, ...]
    notes: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.motions)

    @overload
    def __getitem__(self, index: int) -> GrippedMotion: ...

    @overload
    def __getitem__(self, index: slice) -> Sequence[GrippedMotion]: ...

    def __getitem__(self, index: int | slice) -> GrippedMotion | Sequence[GrippedMotion]:
        return self.motions[index]


def screened(recordings: Sequence[Recording | GrippedMotion], smoothing: float, units: bool = True) -> Screened:
    """Bring recordings to one unit, order and direction (`alike`), mend them, smooth them over `smoothing` s, and leave
    out those that cannot be used.

    Args:
        recordings: of one rope. Motions stay as they are; what was screened already is returned.
        units: whether all of them may be in another unit than meters.

    Raises:
        RecordingError: more than half of the recordings cannot be used: the first one's reason.
    """
    if isinstance(recordings, Screened):
        return recordings
    if not is_list(recordings):
        raise InputError("recordings", "must be a list", recordings, "give what sb.read_recordings returns")
    for i, recording in enumerate(recordings):
        if not isinstance(recording, Recording | GrippedMotion):
            fix = "give what sb.read_recordings returns"
            raise InputError(f"recordings[{i}]", "must be a Recording", recording, fix)
    kept: list[GrippedMotion] = []
    notes: list[tuple[str, str]] = []
    errors: list[RecordingError] = []
    again = _repeated(recordings)
    own = [r for i, r in enumerate(recordings) if isinstance(r, Recording) and i not in again]
    changed, changes = alike(own, units)
    brought = {id(r): (other, words) for r, other, words in zip(own, changed, changes, strict=True)}
    links = _links(changed)
    for i, recording in enumerate(recordings):
        if isinstance(recording, GrippedMotion):
            kept.append(recording)
            continue
        if i in again:
            notes.append((recording.name, f"{LEFT_OUT}it has the same positions as {again[i]}"))
            continue
        same, done = brought[id(recording)]
        words: tuple[str, ...] = ()
        try:
            inner = gripped_ends(same)
            usual = links.get(len(same.markers))
            sound, words = mended(same, inner, usual)
            motion, cut = _usable(sound, inner, smoothing, usual)
            kept.append(motion)
        except RecordingError as error:
            reasons = "; ".join(words)
            if words:
                error = RecordingError(error.field, f"{error.problem} ({reasons})", error.got, error.fix)
            errors.append(error)
            why = reasons or f"{error.field} {error.problem}; {error.fix}"
            notes.append((recording.name, f"{LEFT_OUT}{why}"))
        else:
            notes += [(recording.name, f": {what}") for what in (*recording.mends, *done, *words, *cut)]
    if 2 * len(errors) > len(recordings):
        raise errors[0]
    same_rope, others = _of_one_rope(kept)
    return Screened(tuple(same_rope), (*_gathered(notes), *others))


def _gathered(notes: Sequence[tuple[str, str]]) -> list[str]:
    """Sentences on recordings; what is said of several is said once."""
    of: dict[str, list[str]] = {}
    for name, what in notes:
        of.setdefault(what, []).append(name)
    return [several(names, MOST_NAMED) + (what if len(names) == 1 else _of_several(what)) for what, names in of.items()]


def _of_several(what: str) -> str:
    """What is said of one recording, in the plural."""
    return what.replace(f"{LEFT_OUT}it has ", " are left out: they have ").replace(LEFT_OUT, " are left out: ")


def _repeated(recordings: Sequence[Recording | GrippedMotion]) -> dict[int, str]:
    """By number of a recording the name of an earlier one with the same positions, which may be the same object."""
    first: dict[bytes, tuple[int, str]] = {}
    again = {}
    for i, r in enumerate(recordings):
        if isinstance(r, Recording):
            number, name = first.setdefault(hashlib.sha256(r.positions.tobytes()).digest(), (i, r.name))
            if number != i:
                again[i] = name
    return again


def _links(recordings: Sequence[Recording]) -> dict[int, Array]:
    """The usual lengths of links of the recordings that have two grips (`usual_links`)."""
    positions, inner = [], []
    for recording in recordings:
        with suppress(RecordingError):  # the reason is told where the recording itself is screened
            inner.append(gripped_ends(recording))
            positions.append(steadied_order(recording)[0])
    return usual_links(positions, inner)


def _usable(
    recording: Recording, inner: tuple[int, int], smoothing: float, usual: Array | None
) -> tuple[GrippedMotion, tuple[str, ...]]:
    """A recording as a motion, or else its longest part that can be one, and words on that.

    Raises:
        RecordingError: no part can.
    """
    try:
        return GrippedMotion.of(recording, smoothing, usual), ()
    except RecordingError as error:
        part = longest_stretch(recording, inner)
        if part is None:
            raise
        motion = GrippedMotion.of(recording.frames(part), smoothing, usual)
        first, last = motion.recording.times[[0, -1]]
        return motion, (f"only {first:.4g} to {last:.4g} s are used, since {error.field} {error.problem}",)


def _of_one_rope(motions: Sequence[GrippedMotion]) -> tuple[list[GrippedMotion], list[str]]:
    """Those of the rope that most are of, and words on the others."""
    if len(motions) < FEWEST:
        return list(motions), []
    counts = [len(m.fractions) for m in motions]
    usual = max(set(counts), key=counts.count)
    notes = [
        f"{m.recording.name} is left out: it has {n} markers, most others {usual}"
        for m, n in zip(motions, counts, strict=True)
        if n != usual
    ]
    those = [m for m, n in zip(motions, counts, strict=True) if n == usual]
    length = float(np.median([m.length for m in those]))
    longer = np.array([abs(m.length / length - 1.0) for m in those])
    places = np.array([m.fractions[m.inner[0] : m.inner[1] + 1] for m in those])
    moved = np.abs(places - np.median(places, axis=0)).max(axis=1)
    same = []
    for m, by_length, by_place, by_axis in zip(those, _odd(longer), _odd(moved), _turned(those), strict=True):
        if by_length:
            what = f"its rope is {m.length:.3g} m long, that of the others {length:.3g} m"
        elif by_place:
            what = "its markers have other distances along the rope than the others'"
        elif by_axis:
            what = "its rope sags along another axis than the others': turn its axes as theirs are"
        else:
            same.append(m)
            continue
        notes.append(f"{m.recording.name} is left out: {what}")
    return same, notes


def _turned(motions: Sequence[GrippedMotion]) -> list[bool]:
    """Which sag along another axis than all others, which sag along one."""
    sags = [sag_axis([m]) for m in motions]
    usual = max(set(sags), key=sags.count)
    odd = [sag is not None and sag != usual for sag in sags]
    rest = sum(sag == usual for sag in sags)
    return odd if usual is not None and rest + sum(odd) == len(sags) and rest > sum(odd) else [False] * len(sags)


def _odd(differences: Array) -> NDArray[np.bool_]:
    """Which are too large for the same rope."""
    return np.asarray(differences > max(OTHER, SCATTERED * float(np.median(differences))))
