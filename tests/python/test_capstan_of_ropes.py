"""A rope that is drawn over another, taut one: the capstan law, where both are ropes."""

from __future__ import annotations

import numpy as np
import pytest
import sheetbend as sb

POST, ROPE, LOAD = 0.02, 4e-4, 1.0  # radii [m], N
EA = 1e4  # N, of the rope
TIMES = [0.0, 0.16]  # s: at the end all of it slides, and has done so for long
SOLVER = sb.Solver(h=1e-3, method="implicit", integrator="bdf1")


def over_a_taut_rope(links: int, friction: float) -> sb.Scene:
    """A weightless rope half around a taut one. One end is loaded with 1 N, the other one is drawn at 5 cm/s.

    Middle lines touch at the sum of both radii. So links lie on that circle with their middles, and `links` of them
    span half a turn.
    """
    turn = np.pi / links
    reach = POST + ROPE
    link = 2 * reach * np.tan(turn / 2)
    angles = np.pi - turn * np.arange(links + 1)
    arc = reach / np.cos(turn / 2) * np.column_stack([np.cos(angles), 0 * angles, np.sin(angles)])
    down = np.arange(1, links * 6 // 16 + 1)[:, None] * np.array([0.0, 0.0, -link])
    points = np.vstack([arc[0] + down[::-1], arc, arc[-1] + down])
    scene = sb.Scene("capstan of ropes", gravity=(0, 0, 0))
    post = sb.add_rope(
        scene, "post", start=(0, -0.15, 0), direction=(0, 1, 0), length=0.3, segments=3, density=0.5, EA=1e5, EI=1e-2,
        drag_linear=300.0,
    )  # fmt: skip
    scene.pin(post.particles[[0, -1]])
    count = len(points) - 1
    rope = sb.add_rope(scene, "rope", points=points, length=count * link, segments=count, density=0.05, EA=EA, EI=1e-9)
    scene.add_self_contact(post, rope, radius=[POST, ROPE], friction=friction)
    scene.add_force(rope.particles[:1], [[[0.0, 0.0, -LOAD]]])
    path = scene.positions[rope.particles[-1]] - np.outer([0.0, 1e-3, 8e-3], (0.0, 0.0, 1.0))
    scene.drive(rope.particles[-1:], [0.0, 0.02, 0.16], path[:, None], "linear")
    return scene


def tangent_links(links: int, friction: float) -> float:
    """The ratio of tensions where rigid links slide on a circle that each touches in its middle.

    Where two links meet at the angle 2 a, tension grows by (1 + r)/(1 - r) with r (1 + m r + tan(a)^2) = m,
    m = friction tan(a): the balance of both tensions with half of the force of each of the two contacts.
    """
    tangent = np.tan(np.pi / (2 * links))
    m, b = friction * tangent, 1 + tangent**2
    r = (np.sqrt(b * b + 4 * m * m) - b) / (2 * m)
    return float(((1 + r) / (1 - r)) ** links)


@pytest.mark.parametrize("links", [16, 32])
@pytest.mark.parametrize("friction", [0.15, 0.3, 0.5])
def test_a_rope_over_a_taut_rope_has_the_tensions_of_the_capstan(links: int, friction: float):
    motion = sb.simulate(over_a_taut_rope(links, friction), TIMES, SOLVER)
    first, last = -motion.forces["rope_stretch"][-1, [0, -1], 0]
    assert first == pytest.approx(LOAD, rel=1e-4)
    assert last / first == pytest.approx(tangent_links(links, friction), rel=3e-4)
    assert last / first == pytest.approx(np.exp(np.pi * friction), rel=friction * np.pi * (np.pi / (2 * links)) ** 2)


def test_its_derivative_with_respect_to_friction_is_that_of_the_capstan():
    links, friction = 32, 0.3
    scene = over_a_taut_rope(links, friction)
    rope = scene.ropes["rope"]
    run = sb.rollout(scene, TIMES, SOLVER)
    seed = np.zeros_like(run.positions)
    before, hand = rope.particles[-2:]
    along = run.positions[-1, hand] - run.positions[-1, before]
    seed[-1, hand] = EA / rope.length * (len(rope.particles) - 1) * along / np.linalg.norm(along)
    seed[-1, before] = -seed[-1, hand]
    d = 1e-6
    wanted = (tangent_links(links, friction + d) - tangent_links(links, friction - d)) / (2 * d)
    assert run.gradient(seed).quantities["self_friction"] == pytest.approx(LOAD * wanted, rel=1e-3)
