"""Kept volumes at rest: the balloon of O-35, the given pressure that finds the same shape, a skin that a given pressure
would burst, two volumes that share a wall, far starts, and gradients through torch."""

from __future__ import annotations

import numpy as np
import pytest
import sheetbend as sb
from balloons import POISSON, PRESSURE, RADIUS, SHEAR, STRETCH, YOUNG, held, skin
from pytest import approx
from sheetbend.mesh import icosphere
from sheetbend.scene.volume import enclosed_volume
from support import observed_orders, static_sensitivity, twice

Array = np.ndarray
HOLD = [0, 5, 11]


def full_volume(subdivisions: int) -> float:
    """Of the balloon at its stretch, m^3."""
    mesh = icosphere(STRETCH * RADIUS, subdivisions)
    return enclosed_volume(mesh.triangles, mesh.vertices)


def balloon(subdivisions: int, rest: float, compliance: float = 0.0, stretch: float = 1.0) -> sb.Scene:
    scene, triangles = skin(subdivisions, stretch)
    scene.add_volume(triangles, rest=rest, compliance=compliance)
    return held(scene, HOLD)


def volume_gradient(triangles: Array, x: Array) -> Array:
    """dV/dx (particles, 3)."""
    out = np.zeros_like(x)
    a, b, c = np.moveaxis(x[triangles], 1, 0)
    for corner, area in zip(triangles.T, (np.cross(b, c), np.cross(c, a), np.cross(a, b)), strict=True):
        np.add.at(out, corner, area / 6.0)
    return out


def test_balloon_has_its_pressure_at_rest():
    """O-35: p = 2 sigma/R, with the square of the triangles' edges; dp/dY = p/Y; and dp/dV."""
    errors = []
    for subdivisions in (1, 2, 3):
        rest = sb.equilibrium(balloon(subdivisions, full_volume(subdivisions)))
        assert rest.unstable_modes == 0
        errors.append(rest.pressures["cloth"] / PRESSURE - 1.0)
    assert errors[2] < 5e-3
    assert observed_orders(errors) == approx(2.0, abs=0.05)
    p = rest.pressures["cloth"]
    by = {}
    for name in ("cloth_warp", "cloth_shear", "cloth_volume"):
        forward, by[name] = static_sensitivity(rest, name, pressures={"cloth": 1.0})
        assert forward == approx(by[name], rel=1e-8)
    assert YOUNG * by["cloth_warp"] + SHEAR * by["cloth_shear"] == approx(p, rel=1e-6)
    law = PRESSURE / (3 * full_volume(3)) * (STRETCH**2 + 1) / (STRETCH**2 - 1)
    assert by["cloth_volume"] == approx(law, rel=1e-2)


def test_a_given_pressure_finds_the_same_shape():
    """What differs is what is given: the same shape, and dp/dV = 1/(dV/dp)."""
    scene, triangles = skin(2, 1.1)
    scene.add_pressure(triangles, PRESSURE)
    given = sb.equilibrium(held(scene, HOLD))
    inside = enclosed_volume(triangles, given.positions)
    kept = sb.equilibrium(balloon(2, inside, stretch=1.1))
    assert kept.pressures["cloth"] == approx(PRESSURE, rel=1e-12)
    apart = [np.linalg.norm(x[:162, None] - x[:162], axis=2) for x in (kept.positions, given.positions)]
    assert apart[0] == approx(apart[1], rel=1e-10)  # where the whole is held says the soft hold
    dV_dp = given.gradient(volume_gradient(triangles, given.positions))["cloth_pressure"]
    assert kept.gradient(pressures_bar={"cloth": 1.0})["cloth_volume"] == approx(1.0 / dV_dp, rel=1e-10)


def test_a_gas_gives_way():
    """p = (rest - V)/compliance. With P' = dp/dV of the skin: dp/drest = P'/(1 + compliance P'), dp/dcompliance = -p
    times that."""
    compliance = 3e-6
    rest = 1.3 * full_volume(1)
    gas = sb.equilibrium(balloon(1, rest, compliance))
    p = gas.pressures["cloth"]
    inside = enclosed_volume(gas.scene.volumes.triangles["cloth"], gas.positions)
    assert p == approx((rest - inside) / compliance, rel=1e-9)
    assert 0.1 < (rest - inside) / inside < 0.3
    water = sb.equilibrium(balloon(1, inside))
    assert water.pressures["cloth"] == approx(p, rel=1e-9)
    slope = water.gradient(pressures_bar={"cloth": 1.0})["cloth_volume"]
    expected = slope / (1.0 + compliance * slope)
    for name, law in (("cloth_volume", expected), ("cloth_volume_compliance", -p * expected)):
        assert static_sensitivity(gas, name, pressures={"cloth": 1.0}) == approx(twice(law), rel=1e-7)


def film(rest: float | None = None, pressure: float | None = None) -> tuple[sb.Scene, Array]:
    """A sphere of springs that pull to no length at all, with energy k/2 x.L x; and its triangles."""
    mesh = icosphere(RADIUS, 1)
    scene = sb.Scene("film", gravity=(0, 0, 0))
    scene.add_particles(mesh.vertices, 0.01)
    edges = np.unique(np.sort(mesh.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)
    scene.add_constraints("distance", edges, compliance=0.1, rest=1e-12, name="net")
    if rest is not None:
        scene.add_volume(mesh.triangles, rest=rest, name="film")
    if pressure is not None:
        scene.add_pressure(mesh.triangles, pressure, name="film")
    return held(scene, HOLD), mesh.triangles


def test_a_film_whose_pressure_falls():
    """By degrees of homogeneity 3 p V = 2 E, so p goes as V^(-1/3): a given pressure has no stable shape there, a
    volume has one."""
    inside = full_volume(1)
    scene, _ = film(rest=inside)
    kept = sb.equilibrium(scene)
    p = kept.pressures["film"]
    assert kept.unstable_modes == 0
    assert 3 * p * inside == approx(2 * kept.energy, rel=1e-7)
    by = kept.gradient(pressures_bar={"film": 1.0})
    assert by["film_volume"] == approx(-p / (3 * inside), rel=1e-6)
    assert by["net_compliance"] == approx(-p / 0.1, rel=1e-6)
    scene, triangles = film(pressure=p)
    given = sb.equilibrium(scene, start=kept.positions, stable=False)
    assert given.unstable_modes == 1
    assert enclosed_volume(triangles, given.positions) == approx(inside, rel=1e-6)


def chambers(above: float = 1.5e-4, below: float = 1.1e-4) -> sb.Scene:
    """Two tetrahedra of springs with a wall between them, each of which keeps a volume."""
    x = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.3, 0.3, 1.0], [0.3, 0.3, -0.5]]) * 0.1
    scene = sb.Scene("chambers", gravity=(0, 0, 0))
    scene.add_particles(x, 0.01)
    edges = [[1, 2], [2, 0], [2, 3], [0, 4], [1, 4], [2, 4]]
    scene.add_constraints("distance", edges, compliance=1e-3, name="edges")
    for name, rest, triangles in (
        ("above", above, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]),
        ("below", below, [[0, 1, 2], [1, 0, 4], [2, 1, 4], [0, 2, 4]]),
    ):
        scene.add_volume(triangles, rest=rest, name=name)
    scene.pin([0, 1, 3])
    return scene


def test_two_chambers_answer_each_other_alike():
    """The pressures are the derivatives of one energy by the volumes, so dp_above/dV_below = dp_below/dV_above; each is
    a difference of rests."""
    rest = sb.equilibrium(chambers())
    for name in ("above", "below"):
        inside = enclosed_volume(rest.scene.volumes.triangles[name], rest.positions)
        assert inside == approx(rest.scene.quantities[f"{name}_volume"].value, rel=1e-12)
    above = rest.gradient(pressures_bar={"above": 1.0})
    below = rest.gradient(pressures_bar={"below": 1.0})
    assert above["below_volume"] == approx(below["above_volume"], rel=1e-9)
    step = 1e-8
    more, less = (sb.equilibrium(chambers(below=1.1e-4 + s)) for s in (step, -step))
    for by, name in ((above, "above"), (below, "below")):
        difference = (more.pressures[name] - less.pressures[name]) / (2 * step)
        assert by["below_volume"] == approx(difference, rel=1e-5)
    slope = (more.energy - less.energy) / (2 * step)
    assert rest.pressures["below"] == approx(slope, rel=1e-6)


@pytest.mark.parametrize("share", [0.5, 8.0, 60.0])
def test_a_far_start(share):
    """From the skin at its own size to half of it, which dents it, and to 60 times as much."""
    rest = sb.equilibrium(balloon(1, share * full_volume(1) / STRETCH**3))
    inside = enclosed_volume(rest.scene.volumes.triangles["cloth"], rest.positions)
    assert inside == approx(share * full_volume(1) / STRETCH**3, rel=1e-9)
    assert rest.unstable_modes == 0
    if share > 1.0:
        stretch = share ** (1 / 3)
        law = YOUNG * (stretch**2 - 1) / ((1 - POISSON) * stretch * RADIUS)
        assert rest.pressures["cloth"] == approx(law, rel=8e-2)  # of 42 vertices


def test_supports_carry_a_hanging_ball():
    """The pressure on held vertices is part of what their supports feel: their sum is the weight of what is free."""
    mesh = icosphere(RADIUS, 1)
    scene = sb.Scene("ball")
    cloth = sb.add_cloth(scene, mesh, density=0.3, warp=50.0, shear=20.0, poisson=0.2)
    top = np.argsort(mesh.vertices[:, 2])[-2:]
    scene.pin(cloth.particles[top])
    scene.add_volume(cloth.particles[mesh.triangles], rest=1.2 * enclosed_volume(mesh.triangles, mesh.vertices))
    rest = sb.equilibrium(scene)
    first, count = scene.compiled.layout["mass"]
    weight = 9.81 * scene.compiled.inputs()[first : first + count][scene.free].sum()
    assert rest.pressures["cloth"] > 10.0
    assert sb.support_forces(rest).sum(axis=0) == approx([0.0, 0.0, weight], abs=1e-9)


def test_torch_differentiates_a_batch():
    torch = pytest.importorskip("torch")
    st = pytest.importorskip("sheetbend.torch")
    scene = chambers()
    double = torch.float64

    def found(above, compliance):
        rest = st.equilibrium(scene, values={"above_volume": above, "edges_compliance": compliance})
        return rest.positions, rest.pressures["above"], rest.pressures["below"]

    above = torch.tensor([1.5e-4, 1.4e-4], dtype=double)
    compliance = torch.tensor([1e-3, 2e-3], dtype=double)
    x, p, _ = found(above, compliance)
    assert x.shape == (2, 5, 3)
    for values, pressure in zip(zip(above.tolist(), compliance.tolist(), strict=True), p.tolist(), strict=True):
        one = sb.equilibrium(scene, values=dict(zip(("above_volume", "edges_compliance"), values, strict=True)))
        assert one.pressures["above"] == pressure

    def scaled(u, v):
        x, p, q = found(1.5e-4 * u, 1e-3 * v)
        return x, 1e-3 * p, 1e-3 * q

    ones = [torch.ones(2, dtype=double, requires_grad=True) for _ in range(2)]
    assert torch.autograd.gradcheck(scaled, ones, eps=1e-5, atol=1e-7, rtol=1e-6)


def test_bad_input():
    rest = sb.equilibrium(chambers())
    with pytest.raises(sb.SceneError, match=r"pressures_bar\.top.*is not a volume.*above.*below"):
        rest.gradient(pressures_bar={"top": 1.0})
    with pytest.raises(sb.SceneError, match=r"pressures_bar\.above"):
        rest.gradient(pressures_bar={"above": [1.0, 2.0]})
