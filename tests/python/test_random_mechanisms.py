"""Gradients of random scenes of bodies, joints and what hangs on them."""

from __future__ import annotations

import pytest
import sheetbend as sb
from random_mechanisms import BOUND, differs, scene_of


@pytest.mark.parametrize("seed", [1, 4, 24, 27, 31, 42, 53, 60])
def test_gradient_of_a_random_mechanism_is_exact(seed: int) -> None:
    found, parts = differs(seed)
    assert max(found.values()) < BOUND, parts


@pytest.mark.parametrize("seed", [9, 14, 57, 79])
def test_spin_is_not_kept_beside_constraints_that_follow_from_others(seed: int) -> None:
    """Seeds that diverged within six substeps: a door on two hinges beside bodies that keep their spin."""
    scene, solver, parts = scene_of(seed)
    assert "two hinges" in parts and "spin kept" in parts
    with pytest.raises(sb.SceneError, match=r"follow from others.*second hinge of a door"):
        sb.simulate(scene, [0.0, 0.01], solver)
