"""The parts of a recording that a fit sees and that it predicts: whether they lie within the recording."""

from __future__ import annotations

import math

import numpy as np

from ..errors import InputError, RecordingError
from .recording import Recording

Window = tuple[float, float]
SAME_TIME = 1e-9  # s


def check_windows(
    recording: Recording,
    fit: Window | None,
    held_out: Window | None,
    start_time: float | None = None,
    static: bool = False,
    at: str = "",
) -> None:
    """Windows hold frames of the recording, none reaches beyond it, and no frame that is compared is earlier than the
    start of the scene.

    A window may begin one frame interval before the first frame, and end one after the last. Infinity is an open end.

    Args:
        start_time: of the scene, s; the beginning of `fit`, or of the recording, by default.
        static: the frames show a rest, which starts at no time.
        at: what names the windows in errors, such as "swing.".

    Raises:
        InputError: one does not.
    """
    times = recording.times
    first, last = float(times[0]), float(times[-1])
    interval = float(np.median(np.diff(times))) if len(times) > 1 else math.inf
    for name, window in (("fit", fit), ("held_out", held_out)):
        if window is None:
            continue
        try:
            seen = recording.piece(*window)
        except RecordingError as error:
            raise InputError(at + name, error.problem, window, error.fix) from error
        if math.isfinite(window[1]) and window[1] > last + interval + SAME_TIME:
            fix = f"end at {last + interval:.6g} s, one frame interval after the last frame"
            raise InputError(at + name, f"ends after the recording, which is over at {last:.6g} s", window, fix)
        if static:
            continue
        if name == "fit" and start_time is None and window[0] < first - interval - SAME_TIME:
            fix = f"begin at {first:.6g} s, the first frame; if the motion starts earlier, give start_time too"
            raise InputError(at + name, "begins before the recording", window, fix)
        start = start_time if start_time is not None else fit[0] if fit is not None else first
        if seen.times[0] < start - SAME_TIME:
            _refuse_early(at, name, window, start, start_time is not None, float(seen.times[0]))


def _refuse_early(at: str, name: str, window: Window, start: float, given: bool, frame: float) -> None:
    """A window holds a frame, at `frame` s, of before the scene's start."""
    if name == "fit":
        raise InputError(f"{at}start_time", "lies after the first frame that is compared", start, "start earlier")
    why = "start_time" if given else "where fit begins"
    fix = f"hold out frames from {start:.6g} s on, or start the scene earlier: start_time = {frame:.6g}"
    raise InputError(at + name, f"begins before the scene starts, at {start:.6g} s ({why})", window, fix)
