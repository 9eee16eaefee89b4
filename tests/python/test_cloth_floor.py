"""What Gauss-Seidel sweeps hide of a cloth's stiffness, and that a fit is told."""

import numpy as np
import pytest
import sheetbend as sb
from pytest import approx
from sheetbend.doubts.floors import solver_floors
from sheetbend.experiment.wanted import as_parameters

G, SIZE, DENSITY, SWEEPS = 9.81, 0.3, 0.2, 10


def hanging(cells: int) -> sb.Scene:
    """An all but rigid sheet that hangs from its top edge."""
    mesh = sb.mesh.grid(SIZE, SIZE, cells, cells, pattern="one_way")
    scene = sb.Scene("hanging", gravity=(0, 0, -G))
    top = mesh.sets["left"]
    down = mesh.vertices[:, [1, 2, 0]] * [1, 1, -1]
    cloth = sb.add_cloth(scene, mesh, density=DENSITY, warp=1e6, shear=5e5, held=top, positions=down, drag_linear=0.5)
    scene.pin(cloth.particles[top])
    return scene


@pytest.mark.parametrize("cells", [8, 12])
def test_sweeps_hide_what_the_floor_says(cells):
    scene, solver = hanging(cells), sb.Solver(h=1 / 240, integrator="bdf1", method="gauss_seidel", iterations=SWEEPS)
    cloth = scene.cloths["cloth"]
    low = cloth.particles[cloth.mesh.sets["right"]]
    place = sb.on_particle(int(low[0]))
    run = sb.simulate(scene, [0.0, 3.0], solver)
    sunk = -(run.positions[-1, low, 2] + SIZE).mean()
    seen = DENSITY * G * SIZE**2 / (2.0 * sunk)  # stiffness that this sag would have

    recording = sb.Recording(np.zeros((2, 1, 3)), np.array([0.0, 0.1]), ("m",))
    experiment = sb.Experiment(scene=scene, recording=recording, markers={"m": place}, solver=solver)
    floor = solver_floors([experiment], as_parameters(["cloth_warp"], [experiment]))["cloth_warp"]
    assert floor.value == approx(seen, rel=0.6)
    assert floor.value < seen < 1e6
    assert floor.ceiling
