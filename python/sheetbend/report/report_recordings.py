"""How well a fit explains and predicts each recording, in its report: markers, forces, and what it did not see."""

from __future__ import annotations

from ..quantities.wording import several, short
from ..result.motions import ForceFit, RecordingFit
from ..result.result import FitData
from .tables import Section

SELDOM = 0.5  # of the fitted frames: a marker that is seen in fewer is named
SHOWN = 5  # markers that are named


def recordings(result: FitData) -> Section:
    rows = [_recording_row(recording) for recording in result.recordings]
    headers: tuple[str, ...] = (
        "recording",
        "residuals",
        "fitted rms",
        "held-out rms",
        "baseline rms",
        "held-out/baseline",
        "unit",
    )
    if all(recording.held_out is None for recording in result.recordings):
        headers, rows = headers[:3] + headers[-1:], [row[:3] + row[-1:] for row in rows]
    notes = tuple(
        (label, words)
        for label, words in (
            ("held out", result.held_out_is),
            ("baseline (no physics)", result.baseline),
            *((recording.name, _seldom_seen(recording)) for recording in result.recordings),
            *((recording.name, _started(recording)) for recording in result.recordings),
            *((recording.name, _corrected(recording)) for recording in result.recordings),
        )
        if words
    )
    return Section("Recordings", headers, tuple(rows), notes)


def forces(result: FitData) -> Section:
    rows = [
        (f.recording, f.sensor, str(f.rows), *("" if x is None else short(x) for x in (f.rms, f.held_out, f.baseline)))
        for f in result.forces
    ]
    units = [(f.unit,) for f in result.forces]
    headers: tuple[str, ...] = ("recording", "sensor", "residuals", "fitted rms", "held-out rms", "constant", "unit")
    every = [(*row, *unit) for row, unit in zip(rows, units, strict=True)]
    if all(f.held_out is None for f in result.forces):
        headers, every = headers[:4] + headers[5:], [row[:4] + row[5:] for row in every]
    note = ("constant", "rms of the prediction that the force stays at its mean over the fitted part")
    return Section("Forces", headers, tuple(every), (note,) if every else ())


def _seldom_seen(recording: RecordingFit) -> str:
    few = sorted((share, name) for name, share in recording.seen.items() if share < SELDOM)
    told = several([f"{name} ({100 * share:.2g} %)" for share, name in few], SHOWN)
    return f"markers seen in few of the fitted frames: {told}" if few else ""


def _corrected(recording: RecordingFit) -> str:
    if recording.corrected_by is None or recording.driven_sigma is None:
        return ""
    found, prior = (short(1e3 * size, 2) for size in (recording.corrected_by, recording.driven_sigma))
    return (
        f"its driven markers are moved by {found} mm in each coordinate (root mean square); driven_sigma is {prior} mm"
    )


def _started(recording: RecordingFit) -> str:
    if recording.start_moved is None:
        return ""
    place, speed = recording.start_moved
    return (
        f"its start is estimated: {short(1e3 * place, 2)} mm and {short(speed, 2)} m/s from the given one in each "
        "coordinate (root mean square)"
    )


def _recording_row(recording: RecordingFit) -> tuple[str, ...]:
    factor, unit = readable(recording)

    def number(value: float | None) -> str:
        return "" if value is None else short(value * factor)

    ratio = ""
    if recording.held_out is not None and recording.baseline:
        ratio = f"{100 * recording.held_out / recording.baseline:.3g} %"
    errors = (number(recording.rms), number(recording.held_out), number(recording.baseline))
    return (recording.name, f"{recording.rows:,}", *errors, ratio, unit)


def held_out_motion(result: FitData) -> Section:
    """How much of the motion that the fit did not see is predicted, and its rhythm."""
    rows = [_motion_row(recording) for recording in result.recordings if recording.motion]
    headers = ("recording", "motion rms", "unit", "held-out/motion", "frequency measured", "simulated", "difference")
    notes = [("motion", "of the measured markers about their mean over the held-out part")]
    if any(row[4] for row in rows):
        notes.append(("frequency", "in Hz, of the highest peak in the spectrum of the held-out part"))
    return Section("Held-out motion", headers, tuple(rows), tuple(notes) if rows else ())


def _motion_row(recording: RecordingFit) -> tuple[str, ...]:
    factor, unit = readable(recording)
    motion, error = recording.motion or 0.0, recording.held_out
    share = "" if error is None else f"{100 * error / motion:.3g} %"
    measured, simulated = recording.measured_frequency, recording.simulated_frequency
    rhythm = ["" if f is None else f"{f:.2f}" for f in (measured, simulated)]
    difference = f"{100 * (simulated / measured - 1):+.2g} %" if measured and simulated else ""
    return (recording.name, short(motion * factor), unit, share, *rhythm, difference)


def readable(recording: RecordingFit | ForceFit) -> tuple[float, str]:
    """Factor and unit in which the errors of a recording or a force sensor are written."""
    sizes = (recording.rms or 0.0, recording.held_out or 0.0, recording.baseline or 0.0)
    return (1e3, "mm") if recording.unit == "m" and max(sizes) < 1 else (1.0, recording.unit)
