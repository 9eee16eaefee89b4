"""Poses over time: their checks and what lies between them."""

from __future__ import annotations

import re

import numpy as np
import pytest
from pytest import approx
from sheetbend.arrays.poses import checked_poses, poses_at
from sheetbend.errors import SceneError

TIMES = np.array([0.0, 0.5, 2.0])
PLACES = np.array([[0.0, 1.0, 2.0], [1.0, 0.0, 2.0], [4.0, -3.0, 2.0]])
HALF = np.array([0.0, 0.2, 0.9])  # rad, half of the angles about z
TURNS = np.stack([0 * HALF, 0 * HALF, np.sin(HALF), np.cos(HALF)], axis=1)


def test_quaternions_get_length_one_and_the_side_of_the_one_before() -> None:
    _, _, q = checked_poses("tool", TIMES, PLACES, TURNS * np.array([[2.0], [-1.0], [-3.0]]))
    assert q == approx(TURNS, abs=1e-15)


def test_between_poses_positions_are_linear_and_rotations_about_the_common_axis() -> None:
    x, q = poses_at(*checked_poses("tool", TIMES, PLACES, TURNS), np.array([0.25, 1.25]))
    assert x == approx(np.array([[0.5, 0.5, 2.0], [2.5, -1.5, 2.0]]))
    assert np.arctan2(q[:, 2], q[:, 3]) == approx(np.array([0.1, 0.55]))  # halfway, by symmetry
    assert np.linalg.norm(q, axis=1) == approx(np.ones(2))


def test_outside_and_on_the_poses_they_are_as_given() -> None:
    x, q = poses_at(TIMES, PLACES, TURNS, np.array([-1.0, 0.5, 2.0, 9.0]))
    assert (x == PLACES[[0, 1, 2, 2]]).all()
    assert q == approx(TURNS[[0, 1, 2, 2]], abs=1e-15)


def test_one_pose_holds_at_all_times() -> None:
    x, q = poses_at(TIMES[:1], PLACES[:1], TURNS[:1], 3.0)
    assert (x == PLACES[0]).all() and (q == TURNS[0]).all()


@pytest.mark.parametrize(
    ("times", "places", "turns", "said"),
    [
        (TIMES[::-1], PLACES, TURNS, "tool.times: must increase"),
        (TIMES, PLACES[:2], TURNS, "tool.positions: has the wrong shape"),
        (TIMES, PLACES, TURNS * np.array([[1.0], [0.0], [1.0]]), "tool.quaternions: has no length (got 1)"),
        (
            TIMES,
            PLACES,
            np.where(TURNS[1, 2] == TURNS, np.nan, TURNS),
            "tool.quaternions: is not finite at index [1, 2]",
        ),
    ],
)
def test_bad_poses_are_refused_by_their_names(
    times: np.ndarray, places: np.ndarray, turns: np.ndarray, said: str
) -> None:
    with pytest.raises(SceneError, match=re.escape(said)):
        checked_poses("tool", times, places, turns)
