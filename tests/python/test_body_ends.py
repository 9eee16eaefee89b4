"""Ropes and rods that end on rigid bodies, and how bodies are drawn."""

from __future__ import annotations

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.pictures.body_lines import body_lines

PLACE = np.array([-0.02, 0.0, 0.0])


def cable(kind: str, segments: int = 8) -> tuple[sb.Scene, sb.Body]:
    """A cable that is clamped at its start, with a plug of 80 g at its end."""
    scene = sb.Scene("plug on a cable")
    given = {"mass": 0.08, "inertia": (2e-5, 3e-5, 4e-5), "center": (0.003, 0.001, -0.002)}
    plug = scene.add_body("plug", at=(0.52, 0.0, 0.0), **given)  # type: ignore[arg-type]
    end = plug.point(PLACE, along=(1.0, 0.0, 0.0))
    size = {"length": 0.5, "segments": segments, "density": 0.05, "EA": 2e3, "EI": 4e-3, "bend_damping": 0.01}
    if kind == "rope":
        sb.add_rope(scene, "cable", **size, clamp_start=(1.0, 0.0, 0.0), grip_end=end)  # type: ignore[arg-type]
        return scene, plug
    start = sb.Grip.fixed((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    more = {"GA": 100.0} if kind == "sections" else {}
    held = plug.point(PLACE) if kind == "ball" else end
    sb.add_rod(scene, "cable", **size, GJ=2e-3, twist_damping=0.01, **more, start=start, end=held)  # type: ignore[arg-type]
    return scene, plug


@pytest.mark.parametrize("kind", ["rope", "rod", "sections", "ball"])
def test_end_rides_on_the_body_in_its_direction_and_frame(kind: str) -> None:
    scene, plug = cable(kind)
    motion = sb.simulate(scene, [0.0, 0.1, 0.2], sb.Solver(h=1e-3))
    rope = scene.ropes["cable"]
    origin, frame = plug.pose(motion)
    assert abs(motion.positions[:, rope.particles[-1]] - origin - frame @ PLACE).max() < 1e-14
    assert origin[-1, 2] < -0.1  # it falls
    if kind == "ball":
        assert rope.end_ghost is None
        return
    stub = motion.nodes[:, rope.end_ghost] - motion.positions[:, rope.particles[-1]]
    assert np.allclose(stub / np.linalg.norm(stub, axis=1, keepdims=True), frame[:, :, 0], atol=1e-10)
    if kind != "rope":
        directors = np.einsum("fab,fa->fb", frame, motion.nodes[:, rope.directors[-1]])  # type: ignore[attr-defined]
        assert np.allclose(directors, directors[0], atol=1e-9)
    if kind == "sections":
        normals = np.einsum("fab,fa->fb", frame, motion.nodes[:, rope.normals[-1]])  # type: ignore[attr-defined]
        assert np.allclose(normals, [1.0, 0.0, 0.0], atol=1e-9)


@pytest.mark.parametrize("kind", ["rope", "rod"])
@pytest.mark.filterwarnings("error")
def test_fine_cable_holds_its_plug(kind: str) -> None:
    """Rows of the plug were left out as redundant from 40 links (rods) and 160 (ropes) on, and rods then diverged."""
    places = []
    for segments in (20, 160):
        scene, plug = cable(kind, segments)
        places.append(plug.pose(sb.simulate(scene, [0.0, 0.1], sb.Solver(h=1e-3)))[0][-1])
    assert np.allclose(places[1], places[0], atol=2e-4)


def test_cable_with_a_plug_has_exact_gradients() -> None:
    scene, _ = cable("rod", 4)
    report = sb.check_gradients(scene, [0.01, 0.02], samples=1)
    assert report.passed, str(report)


def test_stiffness_twist_mass_and_center_of_the_plug_from_one_swing() -> None:
    solver, times = sb.Solver(h=2e-3), np.arange(31) * 0.02
    points = np.array([[0.0, 0.0, 0.0], [0.0, 0.02, 0.0], [0.0, 0.0, 0.02]])

    def places(scene: sb.Scene, plug: sb.Body) -> list[sb.Place]:
        return [*sb.along_rope(scene.ropes["cable"], 5)[1:-1], *sb.on_body(plug, points)]

    scene, plug = cable("rod")
    names = ["cable_EI", "cable_GJ", "plug_mass", "plug_center_x", "plug_center_y", "plug_inertia_1"]
    truth = {name: scene.quantities[name].value for name in names}
    motion = sb.simulate(scene, times, solver)
    origin, frame = plug.pose(motion)
    on_cable = [
        np.einsum("k,fkx->fx", p.weights, motion.positions[:, list(p.particles)]) for p in places(scene, plug)[:3]
    ]
    on_plug = origin[:, None] + np.einsum("fab,kb->fka", frame, points)
    seen = sb.Recording(np.concatenate([np.stack(on_cable, axis=1), on_plug], axis=1), times)
    scene, plug = cable("rod")
    start = {name: value * f for (name, value), f in zip(truth.items(), (1.1, 0.9, 1.1, 0.5, 2.0, 1.2), strict=True)}
    found = sb.fit(
        scene,
        seen,
        [sb.Parameter(name=n, initial=v, log="center" not in n) for n, v in start.items()],
        markers=places(scene, plug),
        solver=solver,
        start_time=0.0,
        sigma=1e-4,
        refine=False,
    )
    for name in names:
        assert found.values[name] == pytest.approx(truth[name], rel=1e-5), name


def test_box_that_is_drawn_is_the_box_that_was_given() -> None:
    scene = sb.Scene("box")
    scene.add_body("box", of=sb.Inertia.box(1.0, (0.1, 0.2, 0.3)).moved((0.01, 0.0, 0.0)), at=(1.0, 2.0, 3.0))
    (lines,) = body_lines(scene, scene.nodes[None]).values()
    assert lines.shape == (1, 13, 2, 3)
    corners = lines[0, :12].reshape(-1, 3)
    assert np.allclose(np.ptp(corners, axis=0), [0.1, 0.2, 0.3], rtol=1e-12)
    assert np.allclose(corners.mean(axis=0), [1.01, 2.0, 3.0], rtol=1e-12)
    assert np.allclose(lines[0, 12], [[1.01, 2.0, 3.0], [1.0, 2.0, 3.0]], rtol=1e-12)
