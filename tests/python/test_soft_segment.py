"""A soft segment with a cavity under pressure: one modulus and one scale of the pressure, fitted at three pressures at
rest, predict its tip at others."""

import numpy as np
import sheetbend as sb
from pytest import approx
from sheetbend.quantities.quantities import Term

SIZE, CELLS = (0.1, 0.03, 0.03), (6, 4, 4)
TRUTH = {"segment_E": 2.0e5, "pressure_scale": 1.08}
NOISE = 1e-4


def hollow() -> sb.SolidMesh:
    """A bar without the bricks of a cavity above its middle."""
    box = sb.mesh.bricks(SIZE, CELLS)
    center = box.vertices[box.elements].mean(axis=1) / SIZE
    cavity = (np.abs(center[:, 0] - 0.5) < 0.4) & (np.abs(center[:, 1] - 0.5) < 0.25) & (center[:, 2] > 0.5)
    elements = box.elements[~(cavity & (center[:, 2] < 0.75))]
    used, own = np.unique(elements, return_inverse=True)
    return sb.SolidMesh(box.vertices[used], own.reshape(elements.shape))


def segment(pressure: float) -> sb.Scene:
    """Hanging level from a clamp, with a gauge's pressure [Pa] in its cavity times the quantity `pressure_scale`."""
    mesh = hollow()
    clamp = mesh.within((-1, -1, -1), (1e-9, 1, 1))
    scene = sb.solid(mesh, name="segment", density=1070.0, E=1.8e5, poisson=0.45, pinned=clamp)
    surface, vertices = mesh.surface
    inside = ((surface.vertices > 1e-9) & (surface.vertices < np.array(SIZE) - 1e-9)).all(axis=1)
    wall = surface.triangles[inside[surface.triangles].all(axis=1)][:, ::-1]  # the gas pushes into the material
    particles = scene.solids["segment"].particles[vertices]
    scene.add_pressure(particles[wall], np.zeros(len(wall)))
    scene.add_quantity("pressure_scale", 1.0, "")
    scene.add_terms([Term("pressure", np.arange(len(wall)), pressure, (("pressure_scale", "identity"),))])
    return scene


def markers(scene: sb.Scene) -> tuple[sb.Place, ...]:
    points = [(x, y, z) for x in (0.04, 0.06, 0.08) for y, z in ((0.0, 0.015), (0.015, 0.03))]
    return sb.on_solid(scene.solids["segment"], points)


def seen(pressure: float) -> np.ndarray:
    scene = segment(pressure)
    x = sb.equilibrium(scene, values=TRUTH).positions
    return np.array([np.asarray(p.weights) @ x[list(p.particles)] for p in markers(scene)])


def tip(pressure: float, values: dict[str, float]) -> np.ndarray:
    scene = segment(pressure)
    end = scene.solids["segment"].mesh.nearest([[SIZE[0], 0.015, 0.015]])
    return np.asarray(sb.equilibrium(scene, values=values).positions[scene.solids["segment"].particles[end[0]]])


def test_the_cavity_is_closed_and_pushes_outward() -> None:
    mesh = hollow()
    assert mesh.volumes.sum() == approx(np.prod(SIZE) * (1 - 4 * 2 / 96))
    assert tip(2e4, TRUTH)[2] < tip(0.0, TRUTH)[2]  # the cavity is above the axis, so pressure bends it down


def test_two_numbers_predict_other_pressures() -> None:
    noise = np.random.default_rng(2)
    experiments = []
    for pressure in (0.0, 2e4, 4e4):
        x = np.repeat(seen(pressure)[None], 10, axis=0) + NOISE * noise.standard_normal((10, 6, 3))
        recording = sb.Recording(positions=x, times=np.arange(10) / 100, name=f"at {pressure:g} Pa")
        scene = segment(pressure)
        experiments.append(
            sb.Experiment(recording=recording, scene=scene, markers=markers(scene), static=True, sigma=NOISE)
        )
    found = sb.fit(experiments, parameters=list(TRUTH), refine=False, profiles=False)
    for name, truth in TRUTH.items():
        assert found[name].lower < truth < found[name].upper
        assert found[name].value == approx(truth, rel=0.03)
    fitted = dict(found.values)
    still, fitted_still = tip(0.0, TRUTH), tip(0.0, fitted)
    for pressure in (1e4, 3e4, 5e4):
        moved = tip(pressure, TRUTH) - still
        assert np.linalg.norm(tip(pressure, fitted) - fitted_still - moved) < 0.02 * np.linalg.norm(moved)
