"""What one would predict without any physics: the errors that a fitted simulation has to beat.

hold   every free marker stays where it is first seen in the piece to predict.
rest   every free marker stays at its mean position in the data that were fitted.
blend  on a rope held at both ends, every free marker follows the ends: from where it is first seen it moves
       by (1 - s) times the motion of the first end plus s times that of the last, s being its share of the
       arc length. This is exact when both ends move alike and the rope is carried along. Where a grip drives
       several markers, the end is the one next to the free ones.

A cloud's points have no names; for it there is

still  every point is where the last fitted frame has its closest point. What lies between two points of that frame
       counts as error, about half the distance of neighbors.

For a scene that drives particles, carried.py adds two more: every marker moves rigidly with the grips.

hold and blend are given where each free marker is first seen in the piece; blend also the recorded ends
throughout, as a simulation is. Errors are distances in space, m, over free markers.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays.checks import check_kind, is_several
from ..arrays.timeseries import mean_position
from ..arrays.types import Array
from ..errors import RecordingError
from .cloud import Cloud
from .recording import Recording

IN_WORDS = {
    "hold": "every marker stays where it is first seen",
    "rest": "every marker stays at its mean position in the fitted data",
    "blend": "every marker follows the two ends, weighted by arc length",
    "still": "every point is at the closest point of the last fitted frame",
    "carried": "every marker moves rigidly with the grips from where it is first seen",
    "carried shape": "the mean shape of the fitted data moves rigidly with the grips",
}


@dataclass(frozen=True, eq=False)
class NoPhysics:
    """The strongest prediction without physics for a held-out piece.

    Attributes:
        kind: "hold", "rest", "blend", "still", "carried" or "carried shape".
        words: for reports, what it predicts.
        errors: rms error of each baseline that applies, m.
        positions: (frames, markers, 3) m, the prediction.
        rms: its error, m (`rms_about` over `scored`).
        scored: (frames, markers) bool, the samples that count: free, seen, and not given to the prediction.
            Score the simulation on the same ones: `rms_about(held_out, simulated, scored)`.
    """

    kind: str
    words: str
    errors: dict[str, float]
    positions: Array
    rms: float
    scored: NDArray[np.bool_]


def hold_baseline(recording: Recording) -> Array:
    """Each marker where it is first seen in the recording: (frames, markers, 3) m, NaN if it never is."""
    return np.broadcast_to(_first_seen(recording), recording.positions.shape).copy()


def rest_baseline(fitted: Recording | Sequence[Recording]) -> Array:
    """The rest shape: each marker's mean position over the frames in which it is seen.

    Args:
        fitted: one recording, or several of the same markers (rehangings of one wire), whose frames all
            count alike.

    Returns:
        (markers, 3) m; NaN for a marker not seen there.

    Raises:
        RecordingError: the recordings have different markers, or there is none.
    """
    recordings = [fitted] if isinstance(fitted, Recording) else list(fitted) if is_several(fitted) else []
    if not recordings or not all(isinstance(r, Recording) for r in recordings):
        got = fitted if recordings or not is_several(fitted) else 0
        raise RecordingError("fitted", "must be a recording, or at least one in a list", got, "give what was fitted")
    for other in recordings[1:]:
        _check_same_markers(recordings[0], other)
    return mean_position(np.concatenate([recording.positions for recording in recordings]))


def blend_baseline(recording: Recording) -> Array:
    """Each free marker follows the two ends of a rope, weighted by arc length.

    With f the frame in which marker i is first seen, a and b the innermost clamped markers at the two ends, and s
    the marker's share of the arc length from a to b:

        x_i(t) = x_i(f) + (1 - s) (a(t) - a(f)) + s (b(t) - b(f))

    The arc length sums the distances between neighbors, each the median over the frames that show both.

    Args:
        recording: markers in order along the rope, one or more of them clamped at each end and none between.

    Returns:
        (frames, markers, 3) m; NaN for a marker that is never seen. Clamped markers are as recorded, gaps filled.

    Raises:
        RecordingError: other markers are clamped, there is no free marker between, a clamped one has a gap
            that `Recording.filled` refuses, or two neighbors are never seen together.
    """
    if not is_gripped_rope(recording):
        raise RecordingError(
            "clamped",
            "must be the first and the last marker, or several in a row from there, with others between",
            recording.clamped,
            "select the markers in their order along the rope, or use hold_baseline",
        )
    driven = recording.filled().positions
    free = np.array(recording.free)
    a, b = free[0] - 1, free[-1] + 1
    s = _arc_length_share(recording.select(range(a, b + 1)))[1:-1, None]
    weighted = (1 - s) * driven[:, None, a] + s * driven[:, None, b]
    first = np.argmax(recording.mask, axis=0)[free]
    prediction = driven.copy()
    prediction[:, free] = _first_seen(recording)[free] + weighted - weighted[first, np.arange(len(free))]
    return prediction


def is_gripped_rope(recording: Recording) -> bool:
    """Whether the clamped markers are one or more in a row at each end, with free ones between: what blend needs."""
    free = recording.free
    return (
        bool(free)
        and free[0] > 0
        and free == tuple(range(free[0], free[-1] + 1))
        and free[-1] + 1 < len(recording.markers)
    )


def rms_about(recording: Recording, reference: ArrayLike, scored: NDArray[np.bool_] | None = None) -> float:
    """Root mean square distance between free markers and a reference, m.

    Args:
        recording: what was measured.
        reference: (markers, 3) or (frames, markers, 3) m: a rest shape, a baseline, a simulation.
        scored: (frames, markers) bool, the samples that count; None takes all that are seen and free.

    Returns:
        sqrt(mean of |x - reference|^2), a distance in space (not one coordinate's).

    Raises:
        RecordingError: a shape is wrong, no sample counts, or the reference is not finite where one does.
    """
    reference = np.asarray(reference, dtype=np.float64)
    shape = recording.positions.shape
    if reference.shape not in (shape, shape[1:]):
        fix = f"give one position per marker {shape[1:]} or per frame and marker {shape}"
        raise RecordingError("reference", "does not fit the recording", reference.shape, fix)
    counts = _free_and_seen(recording)
    if scored is not None:
        if np.shape(scored) != shape[:2]:
            fix = f"give one bool per frame and marker, {shape[:2]}"
            raise RecordingError("scored", "does not fit the recording", np.shape(scored), fix)
        counts &= scored
    if not counts.any():
        fix = "choose a piece in which free markers are seen"
        raise RecordingError("scored", "leaves nothing to compare", 0, fix)
    distance = (recording.positions - reference)[counts]
    if not np.isfinite(distance).all():
        fix = "predict every sample that is scored, or leave it out of scored"
        raise RecordingError("reference", "is not finite at a sample that counts", reference.shape, fix)
    return float(np.sqrt(np.mean(np.sum(distance**2, axis=-1))))


def baseline(
    fitted: Recording | Sequence[Recording], held_out: Recording, more: Mapping[str, Array] | None = None
) -> NoPhysics:
    """Compute the strongest baseline for a held-out part: the one with the smallest error of those that apply.

    Taking the smallest favors the baseline, so a simulation that beats it beats them all. `rest` applies
    when the fitted data show every free marker that the piece shows; `hold` when the piece has two frames
    or more; `blend` when it is also a rope clamped at both ends.

    Args:
        fitted: what the fit saw, one recording or several with the markers of `held_out`.
        held_out: the piece to predict. Its first sight of each free marker is given to `hold` and `blend`
            and scored for none, except in a single frame (a static shape), where only `rest` applies.
        more: further predictions (frames, markers, 3) m by kind: "carried" and "carried shape"
            (`carried.carried_baselines`).

    Raises:
        RecordingError: the markers differ, nothing is left to score, or no baseline applies.
    """
    check_kind("held_out", held_out, Recording, "give a piece of a recording", RecordingError)
    check_kind("more", more or {}, Mapping, "give arrays (frames, markers, 3) by name", RecordingError)
    if isinstance(held_out, Cloud):
        return _still([fitted] if isinstance(fitted, Recording) else fitted, held_out)
    rest = rest_baseline(fitted)
    _check_same_markers(fitted if isinstance(fitted, Recording) else fitted[0], held_out)
    scored = _free_and_seen(held_out)
    candidates: dict[str, Array] = dict(more or {})
    if not np.isnan(rest[scored.any(axis=0)]).any():
        candidates["rest"] = np.broadcast_to(rest, held_out.positions.shape).copy()
    if len(held_out.times) > 1:
        scored[np.argmax(held_out.mask, axis=0), np.arange(len(held_out.markers))] = False
        candidates["hold"] = hold_baseline(held_out)
        if is_gripped_rope(held_out):
            candidates["blend"] = blend_baseline(held_out)
    if not candidates:
        fix = "give fitted recordings that show every marker, or a held-out piece of several frames"
        raise RecordingError("held_out", "has no baseline: one frame, of markers not seen before", 1, fix)
    errors = {kind: rms_about(held_out, prediction, scored) for kind, prediction in candidates.items()}
    kind = min(errors, key=errors.__getitem__)
    words = f"{kind}: {IN_WORDS[kind]}"
    return NoPhysics(kind, words, errors, candidates[kind], errors[kind], scored)


def _still(fitted: Sequence[Recording], held_out: Cloud) -> NoPhysics:
    last = [r.positions[k][r.mask[k]] for r in fitted for k in np.flatnonzero(r.mask.any(axis=1))[-1:]]
    guesses = [held_out.closest_among(points) for points in last]
    errors = [rms_about(held_out, guess) for guess in guesses]
    best = int(np.argmin(errors))
    words = f"still: {IN_WORDS['still']}"
    return NoPhysics("still", words, {"still": errors[best]}, guesses[best], errors[best], held_out.mask)


def _check_same_markers(one: Recording, other: Recording) -> None:
    if one.markers != other.markers:
        fix = f"select the same markers in both: {', '.join(one.markers)}"
        raise RecordingError("markers", f"of {other.name} differ from those of {one.name}", other.markers, fix)


def _free_and_seen(recording: Recording) -> NDArray[np.bool_]:
    """(frames, markers), a fresh array."""
    counts = recording.mask
    counts[:, recording.clamped] = False
    return counts


def _first_seen(recording: Recording) -> Array:
    """(markers, 3) m; NaN for a marker that is never seen."""
    return recording.positions[np.argmax(recording.mask, axis=0), np.arange(len(recording.markers))]


def _arc_length_share(recording: Recording) -> Array:
    """(markers,) from 0 at the first marker to 1 at the last."""
    distance = np.linalg.norm(np.diff(recording.positions, axis=1), axis=2)
    together = ~np.isnan(distance)
    if not together.any(axis=0).all():
        i = int(np.flatnonzero(~together.any(axis=0))[0])
        pair = recording.markers[i : i + 2]
        raise RecordingError("markers", "are never seen together", pair, "select markers that are, or a longer piece")
    arc = np.append(0.0, np.cumsum(np.nanmedian(distance, axis=0)))
    return arc / arc[-1]
