"""Markers that a part of a recording never sees: the fit goes on, and they count where they are seen."""

from __future__ import annotations

import numpy as np
import pytest
import sheetbend as sb

NOISE, SOLVER = 5e-4, sb.Solver(h=1 / 300)


def rope() -> sb.Scene:
    return sb.rope(0.5, 10, density=0.05, EI=1e-3, bend_damping=5e-3, drag_linear=0.01, clamp_start=(1.0, 0.0, 0.0))


def seen(lost: dict[int, slice], **parts: object) -> sb.Experiment:
    """A rope that swings down for a second, some of whose markers are lost in some frames."""
    times = np.arange(61) / 60
    x = sb.simulate(rope(), times, SOLVER).positions
    x = x + NOISE * np.random.default_rng(3).standard_normal(x.shape)
    for marker, frames in lost.items():
        x[frames, marker] = np.nan
    markers = [sb.on_particle(i) for i in range(11)]
    recording = sb.Recording(x, times, name="swing")
    return sb.Experiment(scene=rope(), recording=recording, markers=markers, solver=SOLVER, sigma=NOISE, **parts)


def test_a_marker_may_be_lost_throughout_the_fitted_or_the_held_out_part() -> None:
    """Such fits ended in an error after their work: the piece was checked as a whole recording is."""
    e = seen({4: slice(0, 41), 7: slice(40, 61)}, fit=(0.0, 0.66), held_out=(0.66, 1.01))
    fit = sb.fit(e, parameters={"rope_EI": {"initial": 2e-3}}, refine=False, profiles=False)
    assert fit["rope_EI"].lower < 1e-3 < fit["rope_EI"].upper
    assert "swing" in fit.report() and len(e.fitted().markers) == 10  # the clamped end is given
    held = e.held()
    assert held is not None and not held.mask[:, held.markers.index("m7")].any()
    assert held.clamped == () and held.name == "swing"


def test_a_marker_that_frames_at_rest_never_see_has_no_mean() -> None:
    """The others have that of the frames that see them."""
    x = np.zeros((3, 3, 3))
    x[:, 0, 2], x[:2, 1, 2], x[2, 1] = (1.0, 2.0, 6.0), (1.0, 3.0), np.nan
    x[1:, 2] = np.nan
    mean = sb.Recording(x, [0.5, 0.6, 0.7], clamped=(1,)).piece(0.55).mean()
    assert mean.times.tolist() == [0.6] and mean.positions[0, :2, 2].tolist() == [4.0, 3.0]
    assert np.isnan(mean.positions[0, 2]).all() and mean.clamped == (1,)


def test_compared_markers_are_named_once() -> None:
    recording = sb.Recording(np.zeros((2, 3, 3)), [0.0, 0.1], markers=("a", "b", "c"), clamped=(0, 1))
    chosen = recording.compared(["c", "a"], "part")
    assert (chosen.markers, chosen.clamped, chosen.name) == (("c", "a"), (), "part")
    with pytest.raises(sb.RecordingError, match="markers"):
        recording.compared(["a", "a"], "part")
    with pytest.raises(sb.RecordingError, match="name"):
        recording.compared(["a"], "../part")
