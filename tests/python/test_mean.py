"""Particles at the weighted mean of others: what hangs on a face, and a face that is held in its mean."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
from pytest import approx
from sheetbend.quantities.quantities import Term

METHODS = ("newton", "newton_cg", "direct", "implicit")


def beam(cells: tuple[int, int, int] = (4, 2, 2), **more: object) -> tuple[sb.Scene, sb.Solid, np.ndarray]:
    mesh = sb.mesh.bricks((0.08, 0.03, 0.03), cells)
    scene = sb.Scene("beam", gravity=(0.0, 0.0, -9.81))
    made = sb.add_solid(scene, mesh, "beam", density=1000.0, E=2e5, poisson=0.4, damping=5e-3, **more)  # type: ignore[arg-type]
    return scene, made, mesh.sets["x_max"]


@pytest.mark.parametrize("method", METHODS)
def test_a_weight_on_the_mean_of_a_face_moves_with_it(method: str) -> None:
    """It starts there for any values, and the gradient is exact; another mean is one of its particles."""
    scene, made, face = beam(held=())
    pinned = made.particles[made.mesh.sets["x_min"]]
    scene.pin(pinned)
    scene.add_quantity("lift", 0.0, "m", positive=False, scale=0.01)
    every = np.setdiff1d(made.particles, pinned)
    scene.add_terms([Term("position", 3 * every + 2, scene.nodes[every, 0], (("lift", "sin"),))])
    areas = made.mesh.areas(face)
    tip = sb.add_mean(scene, made.particles[face], areas, name="tip")
    whole = sb.add_mean(scene, [tip, *pinned[:2].tolist()], [6.0, 1.0, 1.0], name="whole")
    scene.add_point_mass(tip, 0.05, "hung")
    values = {"lift": 0.02, "hung_mass": 0.04}
    solver = sb.Solver(h=2.5e-3, method=method)
    motion = sb.simulate(scene, np.arange(5) / 100, solver, values)
    x = motion.positions
    mean = np.einsum("v,fvx->fx", areas / areas.sum(), x[:, made.particles[face]])
    assert x[:, tip] == approx(mean, abs=1e-9)
    assert x[0, tip] == approx(mean[0], abs=1e-15)
    assert x[:, whole] == approx(0.75 * mean + 0.125 * x[:, pinned[:2]].sum(axis=1), abs=1e-9)
    if method in ("newton", "implicit"):
        report = sb.check_gradients(scene, [0.005, 0.01], solver, samples=1, values=values)
        assert report.passed, str(report)


def test_a_bar_between_means_is_in_plain_tension() -> None:
    """Both faces may narrow, so that the stress is uniform: s = 1.1 under the stress of the closed form."""
    side, stress = 0.03, 10813.948  # m; Pa for E 1e5 Pa, Poisson's ratio 0.3 (docs/solids.md)
    mesh = sb.mesh.bricks((side, side, 0.06), (2, 3, 4))
    scene = sb.Scene("bar", gravity=(0.0, 0.0, 0.0))
    made = sb.add_solid(scene, mesh, "bar", density=1000.0, E=1e5, poisson=0.3)
    top, bottom = (
        sb.add_mean(scene, made.particles[mesh.sets[s]], mesh.areas(mesh.sets[s]), name=s) for s in ("z_max", "z_min")
    )
    scene.pin([top])
    scene.add_force([bottom], [0.0, 0.0, -stress * side**2])
    corner = int(made.particles[mesh.nearest([[0.0, 0.0, 0.06]])[0]])
    far = scene.add_hidden(scene.nodes[[corner]] + [0.0, 10.0, 0.0], 1.0, pinned=True)
    scene.add_constraints("distance", [[corner, int(far[0])]], name="no_turn", rest=10.0)  # about the bar
    rest = sb.equilibrium(scene)
    x = rest.positions[made.particles]
    assert np.ptp(rest.positions[[top, bottom], 2]) == approx(1.1 * 0.06, rel=1e-7)
    lengths = np.array(
        [np.linalg.norm(x[b] - x[a]) for a, b in zip(mesh.sets["z_min"], mesh.sets["z_max"], strict=True)]
    )
    assert lengths == approx(1.1 * 0.06, rel=1e-6)  # no part of a face moves ahead of its mean


def test_a_face_keeps_its_direction_on_a_body_and_may_narrow() -> None:
    """Its particles stay in a plane of the body, its mean and those of two halves keep place and turn: the stretch of
    the closed form. Means of its quarters that are attached keep it from narrowing."""
    side, stress = 0.03, 10813.948  # m, Pa, as above

    def stretch(quarters: bool) -> float:
        mesh = sb.mesh.bricks((side, side, 0.06), (2, 2, 4))
        scene = sb.Scene("bar", gravity=(0.0, 0.0, 0.0))
        made = sb.add_solid(scene, mesh, "bar", density=1000.0, E=1e5, poisson=0.3)
        face, low = mesh.sets["z_max"], mesh.sets["z_min"]
        own, x, areas = made.particles[face], mesh.vertices[face], mesh.areas(face)
        clamp = scene.add_body("clamp", of=sb.Inertia.box(1.0, (0.03, 0.03, 0.01)), at=(0.0, 0.0, 0.06), pinned=True)

        def mean(name: str, part: np.ndarray) -> int:
            return sb.add_mean(scene, own[part], areas[part], name=name)

        if quarters:
            sides = [(x[:, d] < 0.02, x[:, d] > 0.01) for d in (0, 1)]
            sb.attach(clamp, [mean(f"part_{i}{j}", sides[0][i] & sides[1][j]) for i in (0, 1) for j in (0, 1)])
        else:
            middle = mean("middle", np.full(len(own), True))
            halves = [mean("left", x[:, 0] < 0.01), mean("right", x[:, 0] > 0.02)]
            for name, axis, held in (("x", 0, [middle]), ("y", 1, halves), ("z", 2, own)):
                anchors = scene.add_particles(scene.nodes[held] - np.eye(3)[axis], 1e-6)
                sb.attach(clamp, anchors, name=f"{name}_anchors")
                pairs = np.column_stack([held, anchors])
                scene.add_constraints("distance", pairs, name=f"{name}_links", rest=np.ones(len(held)))
        ends = mesh.areas(low)
        scene.add_force(made.particles[low], np.outer(ends, [0.0, 0.0, -stress]))
        z = sb.equilibrium(scene).positions[made.particles, 2]
        return float((areas @ z[face] / areas.sum() - ends @ z[low] / ends.sum()) / 0.06)

    assert stretch(quarters=False) == approx(1.1, rel=1e-5)
    assert stretch(quarters=True) < 1.0995


def test_a_pinned_mean_of_what_is_stiff_leaves_no_row_out() -> None:
    """`direct` leaves out rows of loops of bodies more readily; a pinned mean and the ground that it is on are none."""
    mesh = sb.mesh.bricks((0.3, 0.02, 0.02), (4, 1, 1))
    scene = sb.Scene("beam")
    made = sb.add_solid(scene, mesh, "beam", density=1000.0, E=1e12, poisson=0.3)
    scene.pin(made.particles[mesh.sets["x_min"]])
    scene.pin([sb.add_mean(scene, made.particles[mesh.sets["x_max"]])])
    with warnings.catch_warnings():
        warnings.simplefilter("error", sb.RedundantConstraintsWarning)
        sb.simulate(scene, [0.0, 0.01], sb.Solver(h=1e-3))


def test_a_mean_is_kept_in_a_file(tmp_path: Path) -> None:
    scene, made, face = beam(held=())
    scene.pin(made.particles[made.mesh.sets["x_min"]])
    tip = sb.add_mean(scene, made.particles[face])
    sb.save_scene(scene, tmp_path / "a.scene")
    solver, times = sb.Solver(h=5e-3, method="newton"), [0.0, 0.02]
    one, two = (sb.simulate(s, times, solver).positions for s in (scene, sb.load_scene(tmp_path / "a.scene")))
    assert np.array_equal(one, two) and one[0, tip] == approx(one[0, made.particles[face]].mean(axis=0), abs=1e-15)
    with pytest.raises(sb.InputError, match="leaves means of particles"):
        sb.simulate(sb.load_scene(tmp_path / "a.scene"), times, sb.Solver(h=5e-3, method="gauss_seidel"))


def test_what_is_no_mean_is_refused() -> None:
    scene, made, face = beam(held=())
    own = made.particles[face]
    nodes = len(scene.nodes)
    for particles, given, match in (
        (own[:2], {}, "three or more"),
        ([own[0], own[0], own[1]], {}, "list each particle once"),
        (own, {"name": "beam_strain"}, "is taken by another group"),
        (own, {"weights": np.zeros(len(own))}, "weights: must be positive"),
        (own, {"weights": [1.0]}, "weights"),
        (own, {"mass": 0.0}, "mass: must be positive"),
    ):
        with pytest.raises(sb.SceneError, match=match):
            sb.add_mean(scene, particles, **given)
    assert len(scene.nodes) == nodes and not scene.means
    sb.add_mean(scene, own)
    with pytest.raises(sb.InputError, match=r"solver\.method: leaves means of particles millimeters away"):
        sb.simulate(scene, [0.0, 0.01], sb.Solver(h=1e-3, method="gauss_seidel"))
    with pytest.raises(sb.MeshError, match="no face of the surface"):
        made.mesh.areas(face[:3])
    assert made.mesh.areas(face).sum() == approx(9e-4, rel=1e-12)
