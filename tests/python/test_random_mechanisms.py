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


@pytest.mark.parametrize("seed", [9, 14, 57, 79, 189])
def test_a_door_on_two_hinges_whose_bodies_turn_apart_in_a_substep(seed: int) -> None:
    """Seeds that diverged within six substeps, or had forces of 40 kN and a gradient that was off by 16 %: bodies that
    keep their spin, or a drag that one of them has, turn the bodies apart where the substep begins."""
    scene, solver, parts = scene_of(seed)
    assert "two hinges" in parts and solver.method == "direct"
    with pytest.warns(sb.RedundantConstraintsWarning, match="have no effect. Fix: remove"):
        motion = sb.simulate(scene, [0.0, 0.002, 0.004], solver)
    assert max(np.abs(f).max() for name, f in motion.forces.items() if name.startswith("j")) < 500.0  # N
    found, _ = differs(seed)
    assert max(found.values()) < BOUND, parts


@pytest.mark.parametrize("seed", [642, 1323, 1331, 652])
def test_gradients_are_exact_where_forces_were_1e4_times_too_large(seed: int) -> None:
    found, parts = differs(seed)
    assert "two hinges" in parts
    assert max(found.values()) < BOUND, parts


@pytest.mark.parametrize("method", ["direct", "newton", "newton_cg", "implicit"])
def test_a_door_in_drag_has_small_forces_between_its_hinges(method: str) -> None:
    scene, solver, _ = scene_of(189)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", sb.RedundantConstraintsWarning)
        motion = sb.simulate(scene, [0.0, 0.002, 0.004], replace(solver, method=method))
    assert max(np.abs(f).max() for name, f in motion.forces.items() if name.startswith("j1")) < 2.0  # N
    found, parts = differs(189, replace(solver, method=method))
    assert max(found.values()) < BOUND, parts


@pytest.mark.parametrize("seed", [477, 572, 596, 664])
def test_newton_holds_a_loop_with_the_forces_of_direct(seed: int) -> None:
    """`newton` left out rows that keep a body rigid, and hinges in line held it instead: seed 572 had 15 kN where
    `direct` has 56 N, and its gradient was off by 1e-5."""
    scene, solver, _ = scene_of(seed)
    assert solver.method == "newton"
    largest = []
    for method in ("newton", "direct"):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", sb.RedundantConstraintsWarning)
            motion = sb.simulate(scene, [0.0, 0.002, 0.004], replace(solver, method=method))
        forces = [f for name, f in motion.forces.items() if name.startswith(("j", "loop"))]
        largest.append(max(np.abs(f).max() for f in forces))
    assert largest[0] < 1.5 * largest[1]
    assert max(differs(seed)[0].values()) < 1e-9


@pytest.mark.parametrize("seed", [189, 477, 572])
def test_implicit_holds_a_loop_with_the_forces_of_direct(seed: int) -> None:
    """Seed 572 did not balance, seed 477 had 15 kN between the hinges of a door where 30 N hold it, and the derivatives
    of both others were refused."""
    scene, solver, parts = scene_of(seed)
    largest = []
    for method in ("implicit", "direct"):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", sb.RedundantConstraintsWarning)
            motion = sb.simulate(scene, [0.0, 0.002, 0.004, 0.012], replace(solver, method=method))
        forces = [f for name, f in motion.forces.items() if name.startswith(("j", "loop"))]
        largest.append(max(np.abs(f).max() for f in forces))
    assert largest[0] < 2.0 * largest[1]
    found, _ = differs(seed, replace(solver, method="implicit"))
    assert max(found.values()) < BOUND, parts
