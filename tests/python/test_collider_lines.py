"""Outlines of colliders in movies and pages: on the shapes' surfaces, moving with them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.page.shown import of_trajectory
from sheetbend.pictures.collider_lines import collider_lines
from sheetbend.pictures.drawing import GRAY
from sheetbend.pictures.movie import Motion, save_movie

TIMES = np.array([0.0, 0.1])
SOLVER = sb.Solver(h=2e-3, method="implicit", integrator="bdf1")


def scene() -> sb.Scene:
    made = sb.rope(0.3, 6, density=0.05, EA=200.0, EI=1e-4, start=(0, 0, 0.2), pinned=(0,))
    rope = made.ropes["rope"]
    bar = sb.Capsule(start=(0.1, -0.1, 0.05), end=(0.1, 0.1, 0.05), radius=0.02, name="bar")
    for shape in (
        sb.Plane(normal=(0, 0.1, 1), name="table"),
        sb.Sphere(center=(0, 0, 0.05), radius=0.04, name="ball"),
        bar.moving(TIMES, [[0, 0, 0], [0, 0, 0.03]], [[0, 0, 0], [0, 0, np.pi / 2]]),
        sb.Cylinder(start=(0.2, 0, 0.02), end=(0.2, 0, 0.05), radius=0.03, edge_radius=0.004, name="plate"),
        sb.Box(center=(0.3, 0, 0.03), size=(0.06, 0.04, 0.02), edge_radius=0.005, name="box"),
    ):
        made.add_contact(rope, shape, friction=0.3, radius=0.002)
    return made


def test_outlines_lie_on_the_shapes_and_move_with_them() -> None:
    made = scene()
    motion = sb.simulate(made, TIMES, SOLVER)
    lines = collider_lines(made, motion.times, motion.positions)
    assert list(lines) == ["table", "ball", "bar", "plate", "box"]
    assert lines["table"] @ [0, 0.1, 1] == pytest.approx(0.0, abs=1e-12)
    assert np.ptp(lines["table"][..., 0]) >= 0.25  # as wide as the rope, and no wider for the carried forces
    assert np.abs(lines["table"]).max() < 0.6
    assert np.linalg.norm(lines["ball"] - [0, 0, 0.05], axis=-1) == pytest.approx(0.04)
    assert lines["bar"][0, ..., 1].max() == pytest.approx(0.12)  # with its cap
    assert lines["bar"][1, ..., 0].max() == pytest.approx(0.22)  # turned by a quarter, about its middle
    assert lines["bar"][1, ..., 2].mean() == pytest.approx(0.08)
    assert np.linalg.norm(lines["plate"][..., :2] - [0.2, 0], axis=-1) == pytest.approx(0.03)
    assert set(lines["plate"][..., 2].ravel().round(9)) == {0.02, 0.05}
    assert np.ptp(lines["box"][0].reshape(-1, 3), axis=0) == pytest.approx([0.06, 0.04, 0.02])
    assert lines["box"].shape == (2, 12, 2, 3)
    assert set(of_trajectory(made, motion).ticks) == set(lines)


def test_a_movie_draws_colliders_in_gray(tmp_path: Path) -> None:
    image = pytest.importorskip("PIL.Image")
    made = scene()
    motion = sb.simulate(made, TIMES, SOLVER)
    save_movie(Motion(made, motion.times, motion.positions), tmp_path / "with.gif")
    bare = sb.rope(0.3, 6, density=0.05, EA=200.0, EI=1e-4, start=(0, 0, 0.2), pinned=(0,))
    save_movie(Motion(bare, motion.times, motion.positions), tmp_path / "without.gif")
    gray = np.array([int(GRAY[k : k + 2], 16) for k in (1, 3, 5)])

    def pixels(path: Path) -> int:
        picture = np.array(image.open(path).convert("RGB")).astype(int)
        return int((np.abs(picture - gray).max(axis=2) < 40).sum())

    assert pixels(tmp_path / "with.gif") > 2 * pixels(tmp_path / "without.gif")
