"""A recording's clock against that of the scene: by how much it is late, and whether frames lie outside of the motion.

The scene is simulated at time + offset of every frame, so an offset of -0.3 s belongs to a camera that is 0.3 s late:
what its frame at 1 s shows happened at 0.7 s of the scene's clock.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..quantities.wording import figures, short
from ..result.estimate import Estimate
from ..result.motions import RecordingFit
from .experiment import Experiment


def told_clocks(
    recordings: Sequence[RecordingFit],
    experiments: Sequence[Experiment],
    values: Mapping[str, float],
    estimates: Sequence[Estimate],
) -> tuple[RecordingFit, ...]:
    """Rows of a report with what each recording's clock is off by, where it has a `time_offset`.

    Args:
        values: of all parameters, by expanded name.
    """
    half = {e.name: e.half_width for e in estimates}
    found = []
    for row, e in zip(recordings, experiments, strict=True):
        if e.time_offset is not None:
            name, offset = _offset(e, values)
            row = replace(row, late=-offset, late_half_width=half.get(name))
        found.append(row)
    return tuple(found)


def lateness(recording: RecordingFit) -> str:
    """The sign of a clock's offset in words; "" without one."""
    if recording.late is None:
        return ""
    side = "late" if recording.late >= 0 else "early"
    size = short(abs(recording.late))
    if recording.late_half_width is not None:
        numbers = (abs(recording.late), recording.late_half_width)
        size = " +/- ".join(figures(numbers, recording.late_half_width))
    return f"its clock is {size} s {side}: a frame stamped 1 s shows what happened at {short(1.0 - recording.late)} s"


def outside(experiments: Sequence[Experiment], values: Mapping[str, float]) -> Iterator[str]:
    """Doubts about recordings whose shifted frames begin before the scene does, or end after it: there the motion is
    extrapolated."""
    for e in experiments:
        if e.time_offset is None or e.static:
            continue
        _, offset = _offset(e, values)
        held = e.held()
        times = np.concatenate([e.fitted().times, *([] if held is None else [held.times])])
        before, after = e.t0 - float(times.min()) - offset, offset
        if before > e.solver.h:
            yield (
                f"{e.name}: its clock puts the first frame {short(before, 2)} s before the scene starts, where the "
                f"motion is extrapolated: lower start_time to {short(float(times.min()) + offset - e.solver.h)} s or "
                "less, or leave the first frames out"
            )
        if after > e.solver.h:
            yield (
                f"{e.name}: its clock puts the last frame {short(after, 2)} s behind the end of the motion, where "
                "it is extrapolated: shift the recording's times so that the offset is negative"
            )


def _offset(e: Experiment, values: Mapping[str, float]) -> tuple[str, float]:
    """Expanded name and value, s, of a recording's time offset."""
    assert e.time_offset is not None
    own = f"{e.time_offset}[{e.name}]"
    name = own if own in values else e.time_offset
    return name, values.get(name, e.scene.quantities[e.time_offset].value)
