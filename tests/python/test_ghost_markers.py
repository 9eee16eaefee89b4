"""Positions of every particle of a clamped rope, given as a recording without places."""

from __future__ import annotations

import numpy as np
import pytest
import sheetbend as sb


def every_particle(segments: int = 12) -> tuple[sb.Scene, sb.Recording]:
    scene = sb.rope(0.6, segments, density=0.05, EI=1e-3, clamp_start=(1, 0, 0))
    moved = sb.simulate(scene, np.arange(11) / 50, sb.Solver(h=1 / 400))
    return scene, sb.Recording(moved.positions, np.arange(11) / 50)


def test_positions_of_every_particle_are_on_the_particles() -> None:
    scene, recording = every_particle()
    (rope,) = scene.ropes.values()
    assert recording.positions.shape[1] == len(rope.particles) + 1  # the clamp's ghost comes last
    e = sb.Experiment(scene=scene, recording=recording, solver=sb.Solver(h=1 / 400))
    assert [p.particles for p in e.places if p is not None] == [(k,) for k in range(scene.particle_count)]
    assert rope.start_ghost not in e.compared and 0 not in e.compared
    found = sb.fit(e, parameters={"rope_EI": {"initial": 2e-3}}, refine=False, beginnings=False, profiles=False)
    assert found["rope_EI"].value == pytest.approx(1e-3, rel=1e-4)


def test_as_many_markers_along_the_rope_stay_along_the_rope() -> None:
    scene, recording = every_particle()
    places = np.linspace(0.0, 0.6, scene.particle_count)
    along = np.stack([places, 0 * places, 0 * places], axis=1) + 1e-3 * recording.times[:, None, None]
    e = sb.Experiment(scene=scene, recording=sb.Recording(along, recording.times))
    last = e.places[-1]
    (rope,) = scene.ropes.values()
    assert last is not None and rope.start_ghost not in last.particles
