"""Several pendulums, and several ropes at rest, in one file: refused, with the patterns of each."""

from __future__ import annotations

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.look import Take, draft, seen

Array = np.ndarray
TIMES = np.arange(400) / 100


def pendulum(length: float, angle: float, phase: float, pivot: tuple[float, float, float]) -> Array:
    """(frames, 2, 3) m, a pivot and the end of an arm that swings in the plane of x and z."""
    q = angle * np.cos(np.sqrt(9.81 / length) * TIMES + phase)
    end = length * np.stack([np.sin(q), 0.0 * q, -np.cos(q)], axis=1)
    return np.asarray(pivot) + np.stack([np.zeros_like(end), end], axis=1)


def hanging(x: float, y: float, sag: float = 0.05) -> Array:
    """(9, 3) m, markers on a rope of 0.5 m that hangs between two clamps."""
    s = np.linspace(0.0, 1.0, 9)
    return np.stack([x + 0.5 * s, y + 0.0 * s, 1.0 - sag * np.sin(np.pi * s)], axis=1)


def drafted(x: Array, times: Array, names: list[str]) -> str:
    noise = 2e-4 * np.random.default_rng(0).standard_normal(x.shape)
    recording = sb.Recording(x + noise, times, tuple(names), gravity=(0.0, 0.0, -9.81))
    return draft([Take(seen(recording), "take.csv", {})], "take").kind


@pytest.mark.parametrize("second", [(0.5, 0.0, 0.0), (0.0, 0.3, 0.0)], ids=["beside", "behind"])
def test_two_pendulums_are_no_rope(second: tuple[float, float, float]) -> None:
    """A rope was drafted through both pivots and both ends."""
    both = [pendulum(0.3, 0.5, 0.0, (0.0, 0.0, 0.0)), pendulum(0.25, 0.6, 1.0, second)]
    with pytest.raises(sb.RecordingError, match=r"two pendulums .*--markers 'p0,a' or --markers 'p1,b'"):
        drafted(np.concatenate(both, axis=1), TIMES, ["p0", "a", "p1", "b"])
    assert drafted(both[0], TIMES, ["p0", "a"]) == "a pendulum"


@pytest.mark.parametrize("second", [hanging(0.7, 0.0), hanging(0.0, 0.4, 0.08)], ids=["behind", "beside"])
def test_two_ropes_at_rest_are_not_one(second: Array) -> None:
    """One rope was drafted through both, with a straight piece between them."""
    times = np.arange(20) / 20
    x = np.concatenate([hanging(0.0, 0.0), second])
    names = [f"{which}{k}" for which in "ab" for k in range(9)]
    with pytest.raises(sb.RecordingError, match=r"two ropes at rest.*--markers 'a\*' or --markers 'b\*'"):
        drafted(np.repeat(x[None], 20, axis=0), times, names)
    assert drafted(np.repeat(x[None, :9], 20, axis=0), times, names[:9]) == "a rope at rest"
