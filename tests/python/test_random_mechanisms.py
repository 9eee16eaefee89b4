"""Gradients of random scenes of bodies, joints and what hangs on them."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
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


def test_a_door_on_two_hinges_is_right_with_implicit_and_direct_warns() -> None:
    """Drag turns its two bodies apart in the prediction of a substep, so that `direct` does not see which rows follow
    from others. `implicit` finds the forces, and refuses their derivative."""
    scene, solver, parts = scene_of(189)
    assert parts == "direct, body, ball, body, two hinges"
    with pytest.warns(sb.RedundantConstraintsWarning, match=r"not recognized, and the forces between them"):
        sb.simulate(scene, [0.0, 0.002], solver)
    careful = replace(solver, method="implicit")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", sb.RedundantConstraintsWarning)
        motion = sb.simulate(scene, [0.0, 0.004], careful)
    assert max(np.abs(f).max() for name, f in motion.forces.items() if name.startswith("j1")) < 2.0  # N
    with pytest.raises(sb.UnbalancedError, match="nearly follow from one another"):
        differs(189, careful)
