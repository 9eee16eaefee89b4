"""Positions of every particle of a clamped rope, given as a recording without places; exports of earlier versions also
hold the stubs of its clamps."""

from __future__ import annotations

import numpy as np
import pytest
import sheetbend as sb

TIMES = np.arange(11) / 50


def clamped(segments: int = 12, **more: object) -> tuple[sb.Scene, sb.Trajectory]:
    scene = sb.rope(0.6, segments, density=0.05, EI=1e-3, clamp_start=(1, 0, 0), **more)  # type: ignore[arg-type]
    return scene, sb.simulate(scene, TIMES, sb.Solver(h=1 / 400))


def test_exports_of_earlier_versions_are_on_the_nodes() -> None:
    scene, motion = clamped()
    (rope,) = scene.ropes.values()
    e = sb.Experiment(scene=scene, recording=sb.Recording(motion.nodes, TIMES), solver=sb.Solver(h=1 / 400))
    assert [p.particles for p in e.places if p is not None] == [*((k,) for k in range(13)), (rope.start_ghost,)]
    assert 13 not in e.compared and 0 not in e.compared
    found = sb.fit(e, parameters={"rope_EI": {"initial": 2e-3}}, refine=False, beginnings=False, profiles=False)
    assert found["rope_EI"].value == pytest.approx(1e-3, rel=1e-4)


def test_both_clamps_are_found_in_the_order_of_earlier_versions() -> None:
    scene, motion = clamped(clamp_end=(1, 0, 0))
    (rope,) = scene.ropes.values()
    ends = motion.nodes[:, [rope.start_ghost, rope.end_ghost]]
    e = sb.Experiment(scene=scene, recording=sb.Recording(np.concatenate([motion.positions, ends], axis=1), TIMES))
    assert [p.particles[0] for p in e.places if p is not None] == [*range(13), rope.start_ghost, rope.end_ghost]


def test_positions_of_every_particle_are_on_the_particles() -> None:
    scene, motion = clamped()
    e = sb.Experiment(scene=scene, recording=sb.Recording(motion.positions, TIMES))
    assert e.compared == tuple(range(1, 13))
    for k, place in enumerate(e.places):
        assert place is not None
        assert np.dot(place.weights, motion.positions[5, list(place.particles)]) == pytest.approx(
            motion.positions[5, k], abs=1e-15
        )


def test_as_many_markers_along_the_rope_stay_along_the_rope() -> None:
    scene, _ = clamped()
    places = np.linspace(0.0, 0.6, scene.node_count)
    along = np.stack([places, 0 * places, 0 * places], axis=1) + 1e-3 * TIMES[:, None, None]
    e = sb.Experiment(scene=scene, recording=sb.Recording(along, TIMES))
    last = e.places[-1]
    (rope,) = scene.ropes.values()
    assert last is not None and rope.start_ghost not in last.particles
