"""The scenes that compare contact with another simulator, at sizes that a test can afford. No time is asserted."""

from __future__ import annotations

from dataclasses import replace

import contact_beside
import numpy as np
import pytest
from contact_scenes import Springs, changed, cloth_on_sphere, loop, rope_on_plane


def test_a_rope_that_slides_ends_where_an_explicit_loop_with_the_same_law_ends():
    s = rope_on_plane()
    end = contact_beside.ends(s, "implicit", 2.5e-4)
    assert contact_beside.distances(end, loop(s, 5e-5))[0] < 1e-4
    assert contact_beside.distances(contact_beside.ends(s, "implicit", 5e-4), end)[0] < 3e-4
    moved = end - s.start
    assert moved[:, 1].min() > 0.05 and moved[:, 1].max() < 1.5 * s.seconds  # all were slowed down


CLOTH = replace(cloth_on_sphere(5), seconds=0.02)


@pytest.mark.parametrize(
    ("s", "method"),
    [(replace(rope_on_plane(), seconds=0.1), "implicit"), (CLOTH, "implicit"), (CLOTH, "gauss_seidel")],
)
def test_gradients_are_those_of_differences(s: Springs, method: str):
    (row,) = contact_beside.ours(s, method, [1e-3])
    assert row.gradient.keys() == contact_beside.STEPS.keys()
    for name, value in row.gradient.items():
        assert value == pytest.approx(row.differences[name], rel=1e-5, abs=1e-9), name
        assert abs(value) > 1e-7, name


@pytest.mark.parametrize("method", contact_beside.SOLVERS)
def test_the_cloth_lies_on_the_sphere(method: str):
    s = cloth_on_sphere(5)
    x = contact_beside.ends(s, method, 1e-3)
    assert np.linalg.norm(x, axis=1).min() > s.sphere - 2e-3
    assert x[12, 2] == pytest.approx(s.sphere, abs=5e-3)
    assert x[0, 2] < s.sphere - 0.05


def test_what_is_compared_is_what_is_exported(tmp_path):
    s = cloth_on_sphere(4)
    s.export(tmp_path / "problem.npz")
    with np.load(tmp_path / "problem.npz") as saved:
        assert np.array_equal(saved["seed"], s.seed) and saved["gravity"].tolist() == [0.0, 0.0, -9.81]
        assert float(saved["contact_damping"]) == s.contact_damping
    assert changed(s, "friction", 0.1).friction == pytest.approx(1.1 * s.friction)
    assert np.array_equal(changed(s, "start", 0.1).start, s.start + 0.1 * s.direction)
