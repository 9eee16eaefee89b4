"""Drafts of ropes that slide out of the hand that holds them."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.look import Take, draft, seen
from takes import DAMPING, DENSITY, DRAG, EI, LENGTH, OF_HAND, hand, noisy

Array = np.ndarray
SEGMENTS = 48


def sliding(by: float, at: float = 1.0, seconds: float = 2.5) -> sb.Recording:
    """A rope in a hand with three markers, which slides out by some meters at a time; eight markers on the rope."""
    t, turns, place = hand(seconds)
    down, side = turns @ np.array([0.0, 0.0, -1.0]), turns @ np.array([1.0, 0.0, 0.0])
    shares = np.linspace(0.0, 1.0, SEGMENTS + 1)
    length, x, v = LENGTH, place[0] - LENGTH * shares[:, None] * [0.0, 0.0, 1.0], None
    markers = np.zeros((len(t), 8, 3))
    for first, last, slid in ((0.0, at, 0.0), (at, seconds, by)):
        if slid:  # along itself, in no time
            whole = np.linspace(0.0, length + slid, SEGMENTS + 1)
            end = np.maximum(whole - length, 0.0)[:, None] * (x[-1] - x[-2]) / np.linalg.norm(x[-1] - x[-2])
            x, v = (np.stack([np.interp(whole, length * shares, y[:, k]) for k in range(3)], axis=1) for y in (x, v))
            x, length = x + end, length + slid
        own = (t >= first - 1e-9) & (t <= last + 1e-9)
        scene, since = sb.Scene("take"), t[own] - first
        rope = sb.add_rope(
            scene,
            length=length,
            segments=SEGMENTS,
            density=DENSITY,
            EI=EI,
            bend_damping=DAMPING,
            drag_linear=DRAG,
            points=x,
            velocity=v,
            grip_start=sb.Grip(since, place[own], down[own], side[own]),
        )
        motion = sb.simulate(scene, since, sb.Solver(h=1 / 1000)).positions[:, rope.particles]
        places = (LENGTH / 8 * np.arange(1, 9) + slid) / length * SEGMENTS
        below = np.minimum(places.astype(int), SEGMENTS - 1)
        share = (places - below)[:, None]
        markers[own] = (1 - share) * motion[:, below] + share * motion[:, below + 1]
        x, v = motion[-1], (motion[-1] - motion[-2]) / (since[-1] - since[-2])
    bodies = place[:, None] + np.einsum("fab,kb->fka", turns, OF_HAND)
    return sb.Recording(noisy(np.concatenate([bodies, markers], axis=1), 1), t, name="take")


@pytest.mark.parametrize(("by", "at"), [(0.01, 1.0), (0.007, 1.0), (0.02, 0.7)])
def test_a_rope_that_slides_is_used_before_or_after_that(by: float, at: float) -> None:
    """Its fit missed 5.8 times what noise explains, and its report named no cause."""
    found = draft([Take(seen(sliding(by, at)), "take.csv", {})], "take")
    (told,) = (note for note in found.seen if "slides out of the hand" in note)
    assert f"at {at:.3g} s" in told and ("before" if at > 0.9 else "after") in told
    first, last = tomllib.loads(found.text)["recording"][0]["fit"]
    assert last < at if at > 0.9 else first > at


def test_a_rope_that_stays_in_the_hand_is_used_as_a_whole() -> None:
    """Also where the recording begins in the middle of a swing."""
    whole = sliding(0.0, 1.0, 4.0)
    for first, last in ((0.0, 4.0), (0.7, 1.9), (1.3, 2.5), (1.6, 2.8), (2.4, 4.0)):
        found = draft([Take(seen(whole.piece(first, last)), "take.csv", {})], "take")
        assert not any("slides" in note for note in found.seen), first
