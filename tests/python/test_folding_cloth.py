"""A cloth that is folded twice on a rough table, by two of its edges: three layers, and nothing passes through."""

from __future__ import annotations

import runpy
from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb

pytestmark = pytest.mark.slow

BENCH = runpy.run_path(str(Path(__file__).resolve().parents[2] / "experiments" / "bench" / "folding_cloth.py"))
SOLVER = sb.Solver(h=6e-3, method="implicit", integrator="bdf1")


def test_it_lies_in_three_layers_and_nothing_has_passed_through() -> None:
    scene, mesh, end = BENCH["scene_of"](400, 0.5, 0.3)
    edges = scene.contacts.pieces[0].edges
    x = sb.simulate(scene, np.arange(int(np.ceil(end / SOLVER.h)) + 1) * SOLVER.h, SOLVER).positions
    assert [BENCH["crossings"](frame, edges, mesh.triangles) for frame in x[::4]] == [0] * len(x[::4])
    thickness, width = BENCH["THICKNESS"], np.ptp(mesh.vertices[:, 0])
    flap = BENCH["flap_of"](width)
    assert np.ptp(x[-1, :, 0]) < width - 2 * flap  # as sharp folds would leave; their loops draw it in
    right, left = (x[-1, np.isclose(mesh.vertices[:, 0], side)] for side in (width, 0.0))
    assert right[:, 2].min() > 0.5 * thickness + 0.9 * thickness  # on the lowest layer
    assert left[:, 2].min() > right[:, 2].max() + 0.9 * thickness
    assert x[..., 2].min() > 0.5 * thickness - 5e-5
    through = x[-1].copy()  # what the test of crossings says of a line of the upper layer that was pulled through
    through[np.isclose(mesh.vertices[:, 0], 3 * BENCH["EDGE"]), 2] = -thickness
    assert BENCH["crossings"](through, edges, mesh.triangles) > 0


def test_a_long_flap_follows_its_hand() -> None:
    """A strip as long as a cloth of 5,041 vertices, until its first fold lies: flat, on what lay there."""
    scene, mesh, end = BENCH["scene_of"](5041, 0.5, 0.3, 2)
    x = sb.simulate(scene, np.arange(int(0.5 * end / SOLVER.h)) * SOLVER.h, SOLVER).positions
    assert [BENCH["crossings"](frame, scene.contacts.pieces[0].edges, mesh.triangles) for frame in x[::6]] == [0] * len(
        x[::6]
    )
    thickness, along = BENCH["THICKNESS"], mesh.vertices[:, 0]
    assert x[..., 2].min() > 0.5 * thickness - 5e-5
    flap = BENCH["flap_of"](along.max())
    far = along > along.max() - 0.5 * flap  # from the fold
    assert np.abs(x[-1, far, 2] - 1.5 * thickness).max() < 0.6 * thickness
    assert np.ptp(x[-1, far, 0]) > np.ptp(along[far]) - 1e-4  # no wrinkles
