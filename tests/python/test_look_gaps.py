"""What a recording with gaps shows, and one whose times are rounded."""

from __future__ import annotations

import tomllib
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.config import build, parse
from sheetbend.look import Take, draft, rope, seen
from sheetbend.look.gaps import unfilled, without_gaps
from takes import NOISE, rope_in_hand

RATE, REST = 120, 0.5


def hanging(gaps: bool) -> sb.Recording:
    """Ten markers of a straight line that hangs 2 m above the floor at rest, and then swings as a rigid one does."""
    t = np.round(np.arange(361) / RATE, 4)
    angle = 0.5 * np.sin(3.0 * np.maximum(t - REST, 0.0))
    along = np.linspace(0.0, 0.9, 10)
    x = along[None, :, None] * np.stack([np.sin(angle), 0 * t, -np.cos(angle)], axis=1)[:, None] + [0.0, 0.0, 2.0]
    x += np.random.default_rng(4).normal(0.0, NOISE, x.shape)
    if gaps:
        for k in range(1, 10):
            x[20 * k : 20 * k + 12, k] = np.nan
    return sb.Recording(x, t)


@pytest.mark.parametrize("gaps", [False, True])
def test_gaps_are_no_motion(gaps: bool) -> None:
    """A lost marker counted as one at the origin: it flew at 20 m/s, and rests ended at the first gap."""
    got = seen(hanging(gaps))
    assert 1.2 < got.speed < 1.5  # 0.9 m at 1.5 rad/s
    assert REST - 0.01 < got.rest < REST + 0.15


def test_the_rate_of_rounded_times() -> None:
    """Times of four digits at 120 Hz are 0.0083 s apart in the median, which was called 120.5 Hz."""
    found = draft([Take(seen(hanging(False)), "take.csv")], "take")
    assert any("at 120 Hz" in sentence for sentence in found.seen)


def test_milliseconds_that_pass_for_seconds_are_refused() -> None:
    """A swinging rope was drafted as 1000 times slower than it is."""
    fast = hanging(False)
    slow = sb.Recording(fast.positions, 1000 * fast.times, name="take")
    with pytest.raises(sb.RecordingError, match=r"8.3 s apart.*time_ms"):
        seen(slow)


def hand_lost(spans: list[tuple[float, float]]) -> sb.Recording:
    """A rope in a hand, all three markers of which are lost in spans of time, from a first s up to before another."""
    take = rope_in_hand("body")
    x = take.positions.copy()
    for start, stop in spans:
        x[(take.times >= start - 1e-9) & (take.times <= stop - 1e-9), :3] = np.nan
    return sb.Recording(x, take.times, take.markers, name="hand")


@pytest.mark.parametrize(("lost", "kept"), [([(1.0, 1.4)], [140, 251]), ([(0.0, 0.2), (2.2, 2.5)], [20, 220])])
def test_a_hand_that_is_lost_for_a_while(tmp_path: Path, lost: list[tuple[float, float]], kept: list[int]) -> None:
    """The draft did not run, and NumPy warned of a mean of nothing: all three markers on the hand are behind something
    for 0.4 s, or come into view late and leave it early."""
    recording = hand_lost(lost)
    recording.save(tmp_path / "take.npz")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = draft([Take(seen(recording), "take.npz")], "take")
    (tmp_path / "take.toml").write_text(found.text)
    build(parse(tmp_path / "take.toml"), tmp_path)
    (read,) = tomllib.loads(found.text)["recording"]
    assert read["frames"] == kept
    assert read["fit"][0] == pytest.approx(kept[0] / 100) and read["held_out"][1] <= kept[1] / 100 + 1e-2
    assert any("a, b, c, by which it is moved, are lost" in sentence for sentence in found.seen)


@pytest.mark.parametrize(
    ("starts", "kind"), [(np.arange(0.0, 2.5, 0.3), "short pieces"), (np.arange(0.35, 2.4, 0.35), "a piece at rest")]
)
def test_a_hand_that_is_lost_again_and_again(starts: np.ndarray, kind: str) -> None:
    """Pieces under 30 frames were left whole without a word, although such a draft does not run. Where the longest
    piece was the rest at the start, 0.34 s long, a rope that swings was drafted as one at rest."""
    recording = hand_lost([(start, start + 0.14) for start in starts])
    found = draft([Take(seen(recording), "take.npz")], "take")
    assert found.kind == "a rope" and "frames" not in tomllib.loads(found.text)["recording"][0]
    said = [sentence for sentence in found.unknown if "a, b, c while they are lost for longer than 0.1 s" in sentence]
    assert len(said) == 1 and "does not run until they are filled" in said[0], kind


def test_a_piece_that_no_model_knows(monkeypatch: pytest.MonkeyPatch) -> None:
    """The draft of the whole was dropped in silence, and the recording refused as none of a rope."""
    recording = hand_lost([(1.0, 1.4)])
    whole, describe = len(recording.times), rope.describe
    monkeypatch.setattr(
        rope, "describe", lambda t, m: describe(t, m) if len(t[0].seen.recording.times) == whole else None
    )
    found = draft([Take(seen(recording), "take.npz")], "take")
    assert found.kind == "a rope" and any("from 0.99 to 1.4 s" in sentence for sentence in found.unknown)
    assert not any("only the longest piece" in sentence for sentence in found.seen)


def test_a_marker_that_is_never_seen_leaves_no_piece() -> None:
    """An IndexError, where a marker that moves a rope is lost in all frames of the recording."""
    recording = hand_lost([(0.0, 2.5)])
    whole = Take(seen(rope_in_hand("body")), "take.npz")
    take = replace(whole, seen=replace(whole.seen, recording=recording))
    assert without_gaps(take, ("a", "r1")) is None
    (said,) = unfilled(take, ("a", "r1"))
    assert "from 0 to 2.5 s" in said
