"""Drafts of ropes between two bodies that hold them, with three markers or more on each."""

from __future__ import annotations

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.look import Take, draft, seen
from sheetbend.look.seen import fixtures
from takes import DENSITY, OF_HAND, RATE, noisy

Array = np.ndarray
SEGMENTS, MARKERS = 48, 9


def turned(angle: Array) -> Array:
    """(frames, 3, 3) about y."""
    c, s, one, zero = np.cos(angle), np.sin(angle), np.ones_like(angle), np.zeros_like(angle)
    return np.moveaxis(np.array([[c, zero, s], [zero, one, zero], [-s, zero, c]]), 2, 0)


def between_grippers(right_moves: bool = True, own: bool = True) -> sb.Recording:
    """A rope of 0.7 m between two grippers that are 0.5 m apart, with three markers on each and nine on the rope.

    Args:
        right_moves: whether both move, or the left one alone.
        own: whether the outer markers of the rope are where the grippers hold it.
    """
    t = np.arange(round(1.5 * RATE) + 1) / RATE
    ease = 1.0 - np.exp(-((np.maximum(t - 0.3, 0.0) / 0.3) ** 2))[:, None]
    way = ease * np.stack([0.05 * np.sin(5 * t), 0.06 * np.sin(3.3 * t), 0.04 * np.sin(4 * t)], axis=1)
    moves = [1.0, 1.0 if right_moves else 0.0]
    places = [np.array([0.0, 0.0, 1.0]) + way, np.array([0.5, 0.0, 1.0]) - moves[1] * way[:, [2, 0, 1]]]
    turns = [turned(moves[0] * ease[:, 0] * 0.4 * np.sin(4 * t)), turned(-moves[1] * ease[:, 0] * 0.3 * np.sin(3 * t))]
    across = np.array([0.0, 1.0, 0.0])
    ways = [turns[0] @ np.array([0.5, 0.0, -0.866]), turns[1] @ np.array([0.5, 0.0, 0.866])]
    grips = [sb.Grip(t, place, along, turn @ across) for place, along, turn in zip(places, ways, turns, strict=True)]
    scene, u = sb.Scene("take"), np.linspace(0.0, 1.0, 20)
    points = np.stack([0.5 * u, 0.0 * u, 1.0 - 0.9 * u * (1.0 - u)], axis=1)
    rope = sb.add_rope(
        scene,
        length=0.7,
        segments=SEGMENTS,
        density=DENSITY,
        EI=4e-4,
        bend_damping=0.01,
        drag_linear=5e-3,
        points=points,
        grip_start=grips[0],
        grip_end=grips[1],
    )
    x = sb.simulate(scene, t, sb.Solver(h=1 / 1000), start=sb.equilibrium(scene).positions).positions
    x = x[:, rope.particles[:: SEGMENTS // (MARKERS - 1)]]
    bodies = [p[:, None] + np.einsum("fab,kb->fka", turn, OF_HAND) for p, turn in zip(places, turns, strict=True)]
    x = np.concatenate([bodies[0], x if own else x[:, 1:-1], bodies[1]], axis=1)
    return sb.Recording(noisy(x, 1), t, name="two")


@pytest.mark.parametrize("right_moves", [True, False], ids=["both move", "one rests"])
@pytest.mark.parametrize("own", [True, False], ids=["rope's end seen", "rope's end unseen"])
def test_a_rope_between_two_bodies_is_no_cloth(own: bool, right_moves: bool) -> None:
    recording = between_grippers(right_moves, own)
    found = draft([Take(seen(recording), "two.csv", {})], "two")
    assert found.kind == "a rope"
    count = len(recording.markers)
    hands = [[f"m{k}" for k in range(3)], [f"m{k}" for k in range(count - 3, count)]]
    for at, hand in zip(("start", "end"), hands, strict=True):
        told = [note for note in found.seen if "which holds the rope" in note and note.startswith(", ".join(hand))]
        assert len(told) == 1, found.seen
        assert f'at = "{at}"\nmarkers = {hand}'.replace("'", '"') in found.text
    assert "clamp" not in " ".join(found.seen)


def test_markers_that_stay_are_a_fixture_where_no_line_goes_through_them() -> None:
    line = np.array([[0.1 * k, 0.0, 0.0] for k in range(6)])
    fixture = np.array([[-0.05, 0.02, 0.0], [-0.05, -0.03, 0.01], [-0.04, 0.0, 0.05]])

    def of(x: Array, still: list[int]) -> list[tuple[int, ...]]:
        return fixtures(np.linalg.norm(x[:, None] - x, axis=2), still)

    assert of(np.concatenate([line, fixture]), [6, 7, 8]) == [(6, 7, 8)]
    assert of(line, [0, 1, 2]) == []  # a clamp that reaches over three markers
    assert of(line, [0, 1, 5]) == []  # both ends of a rope
