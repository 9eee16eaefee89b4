"""Where ropes and rods of a configuration lie at the start of a scene, from the markers on them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..arrays.smoothing import state_at
from ..arrays.timeseries import interpolate
from ..arrays.types import Array
from ..errors import ConfigError
from .moment import Moment
from .rope_schema import Rod, Rope

Seats = Sequence[tuple[float | None, int]]
"""Markers on a rope, in order along it: the arc length (None where they are equally spaced from end to end), and the
marker's number."""

LEAST_SPAN, MOST_SPAN = 0.02, 2.0  # of a rope's length: another unit's, beyond
AT_END = 1e-6  # of the length: a marker so near sits on the end


def through_markers(path: str, moment: Moment | None, seats: Seats, length: float | None) -> Array:
    """(k, 3) m, the markers on a rope at the start, those between its first and last that are not seen left out.

    Raises:
        ConfigError: there is no recording, an end is not seen, or the markers cannot be those of a rope so long.
    """
    placed = [number for _, number in seats]
    moment = _recorded(path, moment)
    shape = moment.shape[placed]
    seen = shape[~np.isnan(shape[:, 0])]
    if len(seen) < 2:
        raise ConfigError(
            path,
            "needs two markers on the rope that are seen at the start",
            len(seen),
            "place markers on it, or give the points",
        )
    ends = [moment.recording.markers[k] for k in (placed[0], placed[-1]) if np.isnan(shape[k, 0])]
    if ends:
        at = moment.recording.times[moment.recording.mask[:, [placed[0], placed[-1]]].all(axis=1)]
        fix = f"start where both are seen, such as at {at[0]:g} s" if len(at) else "give the points"
        raise ConfigError(path, "needs the first and the last marker on the rope, not seen at the start", ends, fix)
    _check_span(path, seen, length)
    return seen


def curve(
    path: str, section: Rope | Rod, moment: Moment | None, seats: Seats, length: float, ends: Mapping[str, Array]
) -> tuple[Array, Array | None]:
    """Nodes (segments + 1, 3) m of a smooth curve through the markers at their arc lengths and through the places (3,)
    of held ends, straight beyond them; and their velocities, m/s, where the section asks for those.

    Raises:
        ConfigError: as `through_markers`; or of velocities, that too few frames are seen about the start.
    """
    moment = _recorded(path, moment)
    numbers = [number for _, number in seats]
    s = np.array([k for k, _ in _spread(seats, length)])
    if section.velocity is None:
        x = moment.shape[numbers]
        v = np.zeros_like(x)
    else:
        found = state_at(moment.whole.times, moment.whole.positions[:, numbers], moment.t0, section.smoothing)
        x, v = found
    for end, edge in (("start", 0.0), ("end", length)):
        if end in ends and (not len(s) or np.abs(s - edge).min() > AT_END * length):
            own = np.abs(s - edge).argmin() if len(s) else None
            s, x = np.append(s, edge), np.concatenate([x, ends[end][None]])
            v = np.concatenate([v, v[own][None] if own is not None else np.zeros((1, 3))])
    order = np.argsort(s)
    seen = order[~np.isnan(x[order, 0])]
    if len(seen) < 2:
        fix = "place markers on it, or give the points"
        raise ConfigError(path, "needs two markers on the rope that are seen at the start", len(seen), fix)
    span = x[seen]
    _check_span(path, span, float(s[seen[-1]] - s[seen[0]]))
    at = np.linspace(0.0, length, section.segments + 1)
    nodes = _along(s[seen], x[seen], at)
    return nodes, None if section.velocity is None else _along(s[seen], v[seen], at, hold=True)


def _spread(seats: Seats, length: float) -> list[tuple[float, int]]:
    """With arc lengths for those that are equally spaced."""
    even = np.linspace(0.0, length, len(seats))
    return [(even[k] if arc is None else arc, number) for k, (arc, number) in enumerate(seats)]


def _along(s: Array, x: Array, at: Array, hold: bool = False) -> Array:
    """The C1 cubic through x (k, 3) at s (k,); beyond its ends a straight line, or (hold) its values."""
    inside = np.clip(at, s[0], s[-1])
    found = interpolate(s, x[:, None], inside, "cubic", np.inf)[:, 0]
    if hold:
        return found
    step = 1e-3 * (s[-1] - s[0])
    near = interpolate(s, x[:, None], np.array([s[0] + step, s[-1] - step]), "cubic", np.inf)[:, 0]
    for end, inner, beyond in ((0, near[0], at < s[0]), (-1, near[1], at > s[-1])):
        slope = x[end] - inner
        found[beyond] += np.abs(at[beyond] - s[end])[:, None] * slope / np.linalg.norm(slope)
    return found


def _recorded(path: str, moment: Moment | None) -> Moment:
    if moment is None:
        raise ConfigError(path, "needs a recording", "recording", "add a [[recording]], or give the points")
    return moment


def _check_span(path: str, seen: Array, length: float | None) -> None:
    span = float(np.linalg.norm(np.diff(seen, axis=0), axis=1).sum())
    if length is not None and not LEAST_SPAN * length < span < MOST_SPAN * length:
        fix = "correct the length, or the `units` of the recording"
        raise ConfigError(path, f"are {span:.3g} m long at the start, and the rope has a length of", length, fix)
