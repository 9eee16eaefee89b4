"""A rope that starts where markers are measured, and whose length is fitted: its start follows the length."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.config import build, load
from sheetbend.objects.rod_shape import follow_length

Array = np.ndarray
LENGTH, MARKERS = 0.4, 9
KINDS = {"rope": "", "rod": "GJ = 1e-3\ndirector = [0, 1, 0]\n"}


def study(folder: Path, kind: str, held: str = "pinned = [0]", finer: int = 1) -> sb.config.Study:
    """A curve that 1 mm of noise bends, on a table."""
    s = np.linspace(0.0, LENGTH, MARKERS)
    x = np.stack([0.15 * np.sin(s / 0.15), 0.15 * (1 - np.cos(s / 0.15)), 0.0 * s], axis=1)
    x[:, :2] += 1e-3 * np.random.default_rng(0).standard_normal((MARKERS, 2))
    times = np.arange(6) / 50
    names = [f"m{k}" for k in range(MARKERS)]
    sb.Recording(np.tile(x, (len(times), 1, 1)), times, names).save(folder / "still.csv")
    places = "".join(f"m{k} = {s[k]}\n" for k in range(MARKERS))
    (folder / "still.toml").write_text(f"""
[experiment]
name = "still"
[solver]
h = 1e-3
method = "implicit"
[[scene.{kind}]]
name = "rope"
length = {LENGTH}
segments = 30
density = 0.05
EI = 1e-5
points = "recording"
velocity = "recording"
{held}
{KINDS[kind]}
[scene.{kind}.markers]
{places}
[[scene.collider]]
name = "table"
shape = "plane"
point = [0.0, 0.0, -0.005]
[[scene.contact]]
of = "rope"
collider = "table"
friction = 0.5
radius = 0.005
[[recording]]
file = "still.csv"
sigma = 1e-3
""")
    return build(load(folder / "still.toml").config, folder, finer=finer)


def start(scene: sb.Scene, length: float) -> Array:
    compiled = scene.compiled
    first, size = compiled.given["position"]
    at = compiled.inputs(compiled.values({"rope_length": length}))[first : first + size].reshape(-1, 3)
    return at[scene.ropes["rope"].particles]


@pytest.mark.parametrize("finer", [1, 2])
@pytest.mark.parametrize("kind", list(KINDS))
@pytest.mark.parametrize("held", ["pinned = [0]", "pinned = [0, -1]"])
def test_links_have_the_length_that_is_fitted(tmp_path: Path, kind: str, held: str, finer: int) -> None:
    """One that is 1 % wrong would move the free end by 4 mm in the first substep, at 4 m/s."""
    (experiment,) = study(tmp_path, kind, held, finer).experiments
    scene = experiment.scene
    as_given = start(scene, LENGTH)
    assert as_given == pytest.approx(scene.positions[scene.ropes["rope"].particles], abs=1e-15)
    error = {}
    for factor in (0.99, 1.0, 1.01):
        at = start(scene, factor * LENGTH)
        assert np.abs(at - as_given).max() < 0.01 * LENGTH
        links = np.linalg.norm(np.diff(at, axis=0), axis=1) * (len(at) - 1)
        error[factor] = np.abs(links / (factor * LENGTH) - 1).max()
        motion = sb.simulate(scene, [0.0, 0.01], experiment.solver, values={"rope_length": factor * LENGTH})
        assert np.abs(motion.positions[-1, scene.ropes["rope"].particles] - at).max() < 1e-3
        held_nodes = [0, -1] if "-1" in held else [0]
        assert np.array_equal(at[held_nodes], as_given[held_nodes])
    assert max(error.values()) < error[1.0] + 1e-3, error


def arch(sag: float, segments: int = 20) -> tuple[sb.Scene, sb.Rope]:
    t = np.linspace(0.0, 1.0, segments + 1)
    scene = sb.Scene("arch")
    points = np.stack([t, 4 * sag * t * (1 - t), 0 * t], axis=1)
    return scene, sb.add_rope(scene, points=points, segments=segments, density=0.1, EI=1e-3)


@pytest.mark.parametrize(("sag", "follows"), [(0.1, True), (0.01, False)])
def test_a_rope_almost_straight_between_held_ends_keeps_its_start(sag: float, follows: bool) -> None:
    """One that sags by 10 mm on 1 m would move by 160 mm for 1 % of its length, if its sag grew linearly."""
    scene, rope = arch(sag)
    scene.pin(rope.particles[[0, -1]])
    follow_length(scene, rope)
    length = scene.quantities["rope_length"].value
    moved = np.abs(start(scene, 1.01 * length) - start(scene, length)).max()
    assert (moved > 0.01) if follows else moved == 0.0
    assert moved < 0.02


def test_an_end_on_a_body_stays_there() -> None:
    scene, rope = arch(0.1)
    plug = scene.add_body("plug", at=(1.0, 0.0, 0.0), mass=0.1, inertia=(1e-5, 1e-5, 1e-5))
    sb.attach(plug, rope.particles[-1:])
    scene.pin(rope.particles[:1])
    follow_length(scene, rope)
    length = scene.quantities["rope_length"].value
    moved = start(scene, 1.01 * length) - start(scene, length)
    assert np.array_equal(moved[[0, -1]], np.zeros((2, 3))) and np.abs(moved).max() > 0.01
