"""Neighbors that exchange their labels in a recording of few frames a second."""

from __future__ import annotations

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.recording.exchanged import put_back_neighbors

RATE, LINK = 30, 0.15


def chain(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Times and places of 7 markers 150 mm apart on a chain that swings at up to some 5 m/s and folds, a tenth lost."""
    rng, t = np.random.default_rng(seed), np.arange(151) / RATE
    phase, rate = rng.uniform(0.0, 6.0, 6), rng.uniform(3.0, 6.0, 6)
    angle = 0.9 * np.sin(4.0 * t)[:, None] + 0.5 * np.sin(rate * t[:, None] + phase)
    links = LINK * np.stack([np.sin(angle), 0.2 * np.sin(angle + 1.0), -np.cos(angle)], axis=2)
    x = np.concatenate([np.zeros((len(t), 1, 3)), np.cumsum(links, axis=1)], axis=1)
    x += rng.normal(0.0, 1e-3, x.shape)
    x[rng.random(x.shape[:2]) < 0.1] = np.nan
    return t, x


@pytest.mark.parametrize("seed", [*range(6), 28])  # of 28 a marker is lost where an exchange begins
def test_neighbors_get_their_labels_back(seed: int) -> None:
    """A rope of 0.9 m was drafted with 1.34 m: a marker goes farther between two frames than to its neighbor."""
    t, right = chain(seed)
    x, names = right.copy(), [f"c{k}" for k in range(7)]
    for a, first, last in ((2, 40, 55), (4, 90, 93), (5, 120, 151)):
        x[first:last, [a, a + 1]] = x[first:last, [a + 1, a]]
    found, said = put_back_neighbors(t, x, names)
    wrong = ~np.isclose(found, right, equal_nan=True).all(axis=2)
    assert len(said) == 3 and wrong.sum() <= 4  # of a frame beside a lost one nothing tells the labeling
    assert "c2 and c3 have each other's label from" in said[0]
    assert any("c5 and c6" in sentence for sentence in sb.Recording(x, t, names).mended().mends)


@pytest.mark.parametrize("seed", range(6))
def test_right_labels_stay(seed: int) -> None:
    t, x = chain(seed)
    found, said = put_back_neighbors(t, x, [f"c{k}" for k in range(7)])
    assert not said and np.array_equal(found, x, equal_nan=True)


def test_a_slack_rope_that_is_pulled_straight_is_right() -> None:
    """Most of the time its neighbors are much nearer than the rope between them is long."""
    t = np.arange(151) / RATE
    fold = np.where(t < 4.0, 1.2, 1.2 * np.clip(1.0 - 4.0 * (t - 4.0), 0.0, 1.0))
    ways = fold[:, None] * np.where(np.arange(6) % 2, 1.0, -1.0)
    links = LINK * np.stack([np.cos(ways), np.sin(ways), 0.0 * ways], axis=2)
    x = np.concatenate([np.zeros((len(t), 1, 3)), np.cumsum(links, axis=1)], axis=1)
    assert put_back_neighbors(t, x, [f"c{k}" for k in range(7)])[1] == []


@pytest.mark.parametrize("unfolds", [False, True])
@pytest.mark.parametrize("lost", [0.0, 0.1])
def test_a_cloth_that_is_folded_most_of_the_time_is_right(unfolds: bool, lost: float) -> None:
    """Markers of the two layers are nearest neighbors then, and far apart where the cloth is flat: two pairs of columns
    were exchanged there."""
    rng, t = np.random.default_rng(0), np.arange(151) / RATE
    folded = 1.0 - np.clip(t - 3.5, 0.0, 1.0) if unfolds else np.clip(t - 1.0, 0.0, 1.0)
    column, row = (LINK * k.ravel() for k in np.meshgrid(np.arange(5.0), np.arange(4.0)))
    beyond, angle = np.maximum(column - 2.0 * LINK, 0.0), (np.pi - 0.2) * folded[:, None]
    x = np.minimum(column, 2.0 * LINK) + beyond * np.cos(angle)
    x = np.stack([x, np.broadcast_to(row, x.shape), beyond * np.sin(angle)], axis=2)
    x += rng.normal(0.0, 1e-3, x.shape)
    x[rng.random(x.shape[:2]) < lost] = np.nan
    assert put_back_neighbors(t, x, [f"c{k}" for k in range(20)])[1] == []
