"""What a report tells of motions that were shot in windows."""

from __future__ import annotations

from ..quantities.wording import short
from ..result.result import FitData
from ..result.shot import ShotMotion
from .tables import Section

PUSHES = (
    ", if these are random. A friction or drag that the model lacks moves the parameters; the report names it where a "
    "fit without `shooting` shows it"
)


def shot_motions(result: FitData) -> Section:
    """How motions were cut, and what the model loses in each."""
    if not result.shot:
        return Section("Motions in windows")
    rows = [
        (m.name, str(m.windows), f"{short(m.length, 3)} s", _loss(m), _interval(m), f"{short(1e3 * m.gap, 2)} mm")
        for m in result.shot
    ]
    lifted = sum((m.windows - 1) * m.numbers for m in result.shot)
    notes = [
        ("lifted", f"{lifted} numbers of states at borders between windows were fitted as well as the parameters"),
        (
            "the model loses",
            "how far the end of a window is from the start of the next, per second of motion; the intervals of the "
            "parameters allow for gaps of this size"
            + (PUSHES if any(m.lower is None or m.lower > 0.0 for m in result.shot) else ""),
        ),
        (
            "gap",
            "rms over the free particles of distances, and of differences of velocities times "
            + ", ".join(f"{short(m.pace, 2)} s" for m in result.shot),
        ),
    ]
    headers = ("recording", "windows", "length", "the model loses", "95 %", "gaps found")
    return Section("Motions in windows", headers, tuple(rows), tuple(notes))


def _loss(m: ShotMotion) -> str:
    return f"{short(1e3 * m.loss, 2)} mm/s" + ("" if m.upper is not None else " (given)")


def _interval(m: ShotMotion) -> str:
    if m.lower is None or m.upper is None:
        return ""
    if m.lower == 0.0:
        return f"less than {short(1e3 * m.upper, 2)} mm/s"
    return f"{short(1e3 * m.lower, 2)} to {short(1e3 * m.upper, 2)} mm/s"
