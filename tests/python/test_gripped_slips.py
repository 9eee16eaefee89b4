"""A rope that slips through its grips: found from where its first free marker is, and followed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.gripped import GrippedMotion
from sheetbend.gripped.slips import held, slips, slips_said
from test_gripped_motion import GRIP, LENGTH, arch

TIMES = np.arange(300) * 0.01
MARKERS = 9
INSIDE = np.linspace(0.0, 1.0, MARKERS + 2)[1:-1]


def recorded(slid: np.ndarray, marker: bool = False) -> GrippedMotion:
    """A bent rope that is swung and bent further, which slides by `slid` m (frames,) out of its start grip and into its
    end grip, or whose first free marker goes along it so far; with noise."""
    frames = []
    for t, out in zip(TIMES, slid / LENGTH, strict=True):
        shares = np.concatenate([[-GRIP / LENGTH, 0.0], INSIDE, [1.0, 1.0 + GRIP / LENGTH]])
        free = np.arange(2, MARKERS + 2)
        shares[free[:1] if marker else free] += out
        x = arch(shares)
        x[:, 1] += 0.3 * np.sin(2 * t) * (x[:, 0] - x[1, 0]) ** 2  # out of its plane, by some tenths of a radian
        turn = np.array([[np.cos(t), -np.sin(t), 0.0], [np.sin(t), np.cos(t), 0.0], [0.0, 0.0, 1.0]])
        frames.append(x @ turn.T)
    noise = 5e-4 * np.random.default_rng(4).standard_normal((len(TIMES), MARKERS + 4, 3))
    clamped = (0, 1, MARKERS + 2, MARKERS + 3)
    return GrippedMotion.of(sb.Recording(np.array(frames) + noise, TIMES, clamped=clamped, name="swung"), 0.08)


def ramp(by: float, middle: float) -> np.ndarray:
    return by * np.clip((TIMES - middle) / 0.2 + 0.5, 0.0, 1.0)


@pytest.mark.parametrize("by", [3e-3, -2e-3])
def test_a_slip_is_found_and_followed(by: float) -> None:
    motion, still = recorded(ramp(by, 1.4)), recorded(np.zeros(len(TIMES)))
    found = slips(motion)
    assert [(s.end, s.by, s.time) for s in found] == [
        (False, pytest.approx(by, abs=4e-4), pytest.approx(1.4, abs=0.1)),
        (True, pytest.approx(-by, abs=4e-4), pytest.approx(1.4, abs=0.1)),
    ]
    words = " ".join(slips_said(motion, found))
    assert ("out of its start grip" if by > 0 else "out of its end grip") in words
    moved = held(motion, found)
    for slip, k in zip(found, motion.inner, strict=True):
        along = np.einsum("fx,fx->f", moved.positions[:, k] - motion.positions[:, k], motion.directions(slip.end))
        assert along[0] == 0.0 and along[-1] == pytest.approx((-1.0 if slip.end else 1.0) * slip.by, rel=1e-6)
    assert np.abs(moved.fractions - still.fractions).max() < 0.3 * np.abs(motion.fractions - still.fractions).max()


def test_a_rope_that_only_bends_does_not_slip() -> None:
    motion = recorded(np.zeros(len(TIMES)))
    assert slips(motion) == () and held(motion, ()) is motion


def test_a_marker_that_goes_along_the_rope_is_no_slip() -> None:
    assert slips(recorded(ramp(3e-3, 1.4), marker=True)) == ()


def test_too_few_frames_tell_none() -> None:
    motion = recorded(ramp(3e-3, 1.4))
    short = replace(motion, recording=motion.recording.frames(slice(0, 20)), positions=motion.positions[:20])
    assert slips(short) == ()
