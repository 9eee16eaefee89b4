"""What the fitted motions are like: their errors beside the recordings, contacts, and how far disturbances grow."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True, kw_only=True)
class RecordingFit:
    """How well one recording is explained: rms distance over markers and frames, in `unit`.

    Attributes:
        rows: number of residuals that took part in the fit.
        rms: over the fitted part; None where all of it was held out.
        held_out: over the part that the fit did not see; None when there is none.
        baseline: over the same part, of a prediction without physics.
        motion: over the same part, of the measured markers about their mean; None for an equilibrium.
        without_physics: of a driven scene, the error of every prediction without physics by kind (`baseline.IN_WORDS`),
            over the held-out part, or where there is none over the fitted one.
        late: s, by which the recording's clock is late, from its `time_offset`: a frame stamped t shows the scene at
            t - late. None without one.
        late_half_width: s, of the 95 % interval of that; None where it is open or the clock was not fitted.
        driven_sigma: prior of the correction of its driven markers, m; None without one.
        corrected_by: root mean square of one coordinate of that correction, m.
        start_moved: m and m/s, root mean squares of one coordinate, by which places and velocities of an estimated
            start differ from the given ones; None of another start.
        measured_frequency, simulated_frequency: first frequency there, Hz; None where the part shows fewer than three
            periods.
        seen: by compared marker, the share of the frames of the fitted part in which it was seen; empty for a cloud,
            and where all was held out.
    """

    name: str
    rows: int
    rms: float | None = None
    held_out: float | None = None
    baseline: float | None = None
    motion: float | None = None
    measured_frequency: float | None = None
    simulated_frequency: float | None = None
    unit: str = "m"
    driven_sigma: float | None = None
    corrected_by: float | None = None
    start_moved: tuple[float, float] | None = None
    without_physics: Mapping[str, float] = field(default_factory=dict)
    late: float | None = None
    late_half_width: float | None = None
    seen: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class ForceFit:
    """How well the forces of one sensor are explained: rms of one component, in `unit`.

    Attributes:
        recording, sensor: names.
        rows: number of residuals that took part in the fit.
        rms: over the fitted part; None where all of it was held out.
        held_out: over the part that the fit did not see; None when there is none.
        baseline: over the held-out part, or the fitted one where nothing is held out, of a constant: the mean of the
            fitted part.
        unit: "N", or "N m" for torques.
    """

    recording: str
    sensor: str
    rows: int
    rms: float | None
    held_out: float | None
    baseline: float | None
    unit: str


@dataclass(frozen=True, kw_only=True)
class ContactFit:
    """What one contact of one fitted motion does, over all substeps; see `ContactCounts`.

    Attributes:
        recording, contact: names.
        particles: that may touch; of ropes and cloths that touch themselves with friction, pairs, here and below.
        most, began, ended: how many touch at once, and how often one begins and ends to.
        sliding, sticking: shares of all touches, particle by particle and substep by substep.
        bdf1: share of the scene's substeps that went with backward Euler, which damps vibrations.
        settled, settled_by: particles that started inside the collider, and the farthest move [m] to its surface.
        deepest: m, how far inside the collider one was at any frame; None of self-contact.
    """

    recording: str
    contact: str
    particles: int
    most: int
    began: int
    ended: int
    sliding: float
    sticking: float
    bdf1: float
    settled: int = 0
    settled_by: float = 0.0
    deepest: float | None = None


@dataclass(frozen=True, kw_only=True)
class Kinks:
    """How many contacts differ at some frame between the motions at the ends of one parameter's interval.

    Attributes:
        name: of the parameter.
        begin, end: touch at the upper end alone, or at the lower end alone.
        stick, slide: touch at both, and stick at the upper and slide at the lower end, or the reverse.
    """

    name: str
    begin: int
    end: int
    stick: int
    slide: int


@dataclass(frozen=True, kw_only=True)
class MotionGrowth:
    """How far small displacements grow along one fitted motion, see `growth.Growth`: each as (at the start, at the end
    of the fit).

    Attributes:
        name: of the experiment.
        largest: growth; None where it overflows or the motion diverges.
        rate: 1/s, of its logarithm.
        until: s from the scene's start, up to which it stays below `growth.ROUGH`; None where it always does.
    """

    name: str
    largest: tuple[float | None, float | None]
    rate: tuple[float, float]
    until: tuple[float | None, float | None]
