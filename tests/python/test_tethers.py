"""Long-range attachments: they hold, let go, do nothing where slack, differentiate, and say what they cannot do."""

from __future__ import annotations

import numpy as np
import pytest
import sheetbend as sb
from pytest import approx
from sheetbend.mesh import grid
from support import sensitivity, steps

SOLVER = sb.Solver(h=1 / 60, method="gauss_seidel", iterations=3)


def curtain(tethers: bool = True, warp: float = 4000.0, **given: float) -> tuple[sb.Scene, sb.Cloth]:
    """A stiff sheet, held by its upper row, that swings down from level."""
    mesh = grid(0.4, 0.3, 12, 9)
    held = np.flatnonzero(mesh.material[:, 0] == 0.0)
    scene = sb.Scene("curtain")
    cloth = sb.add_cloth(scene, mesh, density=0.2, warp=warp, shear=0.3 * warp, held=held, drag_linear=0.2)
    scene.pin(cloth.particles[held])
    if tethers:
        sb.add_tethers(scene, cloth, **given)
    return scene, cloth


def farthest(scene: sb.Scene, cloth: sb.Cloth, solver: sb.Solver = SOLVER) -> float:
    """Greatest way below the upper row, m, while it swings."""
    x = sb.simulate(scene, steps(1 / 60, 40), solver).positions[:, cloth.particles]
    return float(np.linalg.norm(x[..., [0, 2]], axis=-1).max())


def test_keep_a_stiff_sheet_from_stretching_in_few_sweeps():
    exact, cloth = curtain(tethers=False)
    loose, tied = farthest(exact, cloth), farthest(*curtain())
    true = farthest(exact, cloth, sb.Solver(h=1 / 240, method="newton"))
    assert true < 0.401
    assert loose > 1.1 * true
    assert tied < 1.001 * true


def test_slack_ones_do_nothing():
    bare, _ = curtain(tethers=False)
    times = steps(1 / 60, 20)
    a = sb.simulate(bare, times, SOLVER).positions
    assert (sb.simulate(curtain(stretch=1.0)[0], times, SOLVER).positions == a).all()
    assert np.abs(sb.simulate(curtain()[0], times, SOLVER).positions - a).max() > 1e-4


@pytest.mark.parametrize("integrator", ["bdf1", "bdf2"])
def test_gradients(integrator):
    solver = sb.Solver(h=1 / 240, method="gauss_seidel", iterations=3, integrator=integrator)
    report = sb.check_gradients(curtain(compliance=1e-4, stretch=2e-3)[0], steps(1 / 60, 6), solver)
    assert report.passed, str(report)


def test_hide_the_stiffness_that_they_replace():
    """Why fits leave them out: the lowest point of a hanging sheet tells less of its warp."""
    times, weights, sizes = steps(1 / 60, 30), np.zeros((31, 130, 3)), []
    solver = sb.Solver(h=1 / 240, method="gauss_seidel", iterations=30)
    for tethers in (False, True):
        scene, cloth = curtain(tethers, warp=20.0)
        low = cloth.particles[np.flatnonzero(cloth.mesh.material[:, 0] == cloth.mesh.material[:, 0].max())]
        weights[-1, low, 2] = 1.0
        forward, backward = sensitivity(scene, times, solver, weights, "cloth_warp")
        assert forward == approx(backward, rel=1e-8)
        sizes.append(abs(backward))
    assert sizes[1] < 0.5 * sizes[0]


def test_energy_of_slack_ones_is_zero():
    scene = sb.Scene("pair")
    scene.add_particles(np.eye(3), 0.1)
    scene.pin([0])
    scene.add_constraints("tether", [[0, 1], [0, 2]], name="reach", rest=[1.0, 2.0], compliance=1e-2)
    taut, slack = sb.elastic_energy(scene)["reach"]
    assert taut == approx((np.sqrt(2) - 1.0) ** 2 / 2e-2)
    assert slack == 0.0


def test_reach_is_the_way_along_the_fabric():
    mesh = grid(0.4, 0.3, 4, 3)
    scene = sb.Scene("sheet")
    cloth = sb.add_cloth(scene, mesh, density=0.2, warp=100.0, shear=30.0)
    assert sb.add_tethers(scene, cloth, anchors=[0], stretch=0.5) == "cloth_tethers"
    group = scene.groups[-1]
    assert (group.particles[:, 0] == 0).all()
    assert sorted(group.particles[:, 1]) == list(range(1, 20))
    straight = np.linalg.norm(mesh.vertices[group.particles[:, 1]] - mesh.vertices[0], axis=1)
    assert (group.rest[:, 0] >= 1.5 * straight - 1e-12).all()
    along = mesh.vertices[group.particles[:, 1], 1] == mesh.vertices[0, 1]
    assert group.rest[along, 0] == approx(1.5 * straight[along])


@pytest.mark.parametrize("method", ["direct", "implicit", "newton", "newton_cg"])
def test_direct_blocks_refuse_them(method):
    scene, _ = curtain(compliance=1e-6)
    with pytest.raises(ValueError, match=r"cloth_tethers may go slack.*Fix: use gauss_seidel"):
        sb.simulate(scene, [0.0, 0.1], sb.Solver(h=1 / 240, method=method))
    with pytest.raises(ValueError, match=r"equilibrium: group cloth_tethers may go slack"):
        sb.equilibrium(scene)


def test_bad_input():
    scene = sb.Scene("sheet")
    cloth = sb.add_cloth(scene, grid(0.4, 0.3, 4, 3), density=0.2, warp=100.0, shear=30.0)
    with pytest.raises(sb.SceneError, match="pin or drive vertices first"):
        sb.add_tethers(scene, cloth)
    with pytest.raises(sb.SceneError, match="stretch: must not be negative"):
        sb.add_tethers(scene, cloth, [0], stretch=-0.1)
