"""Recordings of gripped ropes that contradict themselves: markers out of order, another gravity, another unit."""

from __future__ import annotations

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.gripped import GrippedMotion
from sheetbend.gripped.order import marker_order
from sheetbend.gripped.plausible import doubts, gravities

Array = np.ndarray
TIMES = np.arange(101) / 100.0
COUNT, LENGTH, GRIP = 10, 0.9, 0.03  # free and inner gripped markers; m between the grips, and in each
DOWN = (0.0, 0.0, -9.81)


def bending(markers: int = COUNT) -> Array:
    """(frames, markers + 2, 3) m: an arc that hangs and bends as its ends come nearer, straight on in the grips."""
    s = LENGTH * np.linspace(-0.5, 0.5, markers)
    s = np.concatenate([[s[0] - GRIP], s, [s[-1] + GRIP]])
    curvature = (2.0 + np.sin(4.0 * TIMES))[:, None]
    angle = curvature * np.clip(s, -LENGTH / 2, LENGTH / 2)
    beyond = s - np.clip(s, -LENGTH / 2, LENGTH / 2)
    x, z = (
        np.sin(angle) / curvature + beyond * np.cos(angle),
        (1.0 - np.cos(angle)) / curvature + beyond * np.sin(angle),
    )
    return np.stack([x, np.zeros_like(x), z], axis=-1)


def recorded(positions: Array, **fields: object) -> sb.Recording:
    n = positions.shape[1]
    return sb.Recording(**{"positions": positions, "times": TIMES, "clamped": (0, 1, n - 2, n - 1), **fields})


def noisy(positions: Array) -> Array:
    return positions + 5e-4 * np.random.default_rng(1).standard_normal(positions.shape)


@pytest.mark.parametrize(
    "order",
    [
        [0, 1, 2, 3, 5, 4, 6, 7, 8, 9, 10, 11],
        [0, 1, 2, 6, 5, 4, 3, 7, 8, 9, 10, 11],
        [0, 1, 2, 4, 5, 6, 7, 8, 3, 9, 10, 11],
        [0, 1, 9, 8, 7, 6, 5, 4, 3, 2, 10, 11],
    ],
    ids=["two", "a stretch", "one elsewhere", "all between the grips"],
)
def test_markers_out_of_order_are_refused_with_their_order(order: list[int]) -> None:
    with pytest.raises(sb.RecordingError, match="not in order along the rope") as caught:
        GrippedMotion.of(recorded(noisy(bending())[:, order]), 0.08)
    right = [f"m{order.index(k)}" for k in range(12)]
    assert f"give them as {', '.join(right)} " in caught.value.fix


@pytest.mark.parametrize(("order", "end"), [([1, 0, *range(2, 12)], "first"), ([*range(10), 11, 10], "last")])
def test_a_grip_that_points_away_from_the_rope_is_refused(order: list[int], end: str) -> None:
    with pytest.raises(sb.RecordingError, match=f"of the {end} grip of .* point away from the rope"):
        GrippedMotion.of(recorded(noisy(bending())[:, order]), 0.08)


def test_strands_that_come_near_each_other_are_no_other_order() -> None:
    """Twelve markers along a hairpin whose two strands are nearer than neighbors, and move against each other."""
    s = np.linspace(0.0, 1.0, 12)
    side = np.where(s < 0.5, -1.0, 1.0)
    slide = 0.03 * np.sin(6.0 * TIMES)[:, None] * side
    x = np.stack([np.broadcast_to(0.02 * side, slide.shape), 0.0 * slide, np.abs(s - 0.5) + slide], axis=-1)
    assert marker_order(noisy(x)) == list(range(12))


def test_gaps_do_not_hide_the_order() -> None:
    positions = noisy(bending())[:, [0, 1, 2, 3, 5, 4, 6, 7, 8, 9, 10, 11]]
    positions[30:60, 4:6] = np.nan
    assert marker_order(positions) == [0, 1, 2, 3, 5, 4, 6, 7, 8, 9, 10, 11]


class TestDoubts:
    def test_none_about_a_rope_that_hangs_down(self) -> None:
        assert doubts([GrippedMotion.of(recorded(bending()), 0.08)], DOWN) == ()

    @pytest.mark.parametrize("gravity", [(0.0, -9.81, 0.0), (0.0, 0.0, 9.81)], ids=["y up", "z down"])
    @pytest.mark.parametrize("told", [True, False], ids=["by the file", "by the caller"])
    def test_another_gravity_than_the_sag_is_named(self, gravity: tuple[float, float, float], told: bool) -> None:
        motion = GrippedMotion.of(recorded(bending(), gravity=gravity if told else None), 0.08)
        (doubt,) = doubts([motion], DOWN if told else gravity)
        assert "sags along" in doubt and "check `gravity`" in doubt

    def test_a_straight_rope_says_nothing_of_gravity(self) -> None:
        straight = np.tile(np.linspace(0.0, 1.0, 12)[:, None] * [1.0, 0.0, 0.0], (101, 1, 1))
        assert doubts([GrippedMotion.of(recorded(straight), 0.08)], (0.0, -9.81, 0.0)) == ()

    def test_an_axis_along_which_the_rope_sags_may_point_down_too(self) -> None:
        upright, turned = (GrippedMotion.of(recorded(bending()[:, :, axes]), 0.08) for axes in ([0, 1, 2], [1, 2, 0]))
        assert gravities([upright]) == (DOWN,)
        assert gravities([turned]) == (DOWN, (0.0, -9.81, 0.0))

    def test_a_sag_along_no_axis_adds_no_gravity(self) -> None:
        c = np.sqrt(0.5)
        askew = bending() @ np.array([[1.0, 0.0, 0.0], [0.0, c, c], [0.0, c, -c]])
        assert gravities([GrippedMotion.of(recorded(askew), 0.08)]) == (DOWN,)

    @pytest.mark.parametrize("unit", [1e3, 1e-3], ids=["mm read as m", "m read as mm"])
    def test_another_unit_is_named(self, unit: float) -> None:
        motion = GrippedMotion.of(recorded(unit * bending()), 0.08)
        assert any("check `units`" in doubt for doubt in doubts([motion], DOWN))
