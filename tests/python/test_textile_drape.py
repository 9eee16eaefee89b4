"""The drape test: limits, order and convergence of the drape coefficient, its states, and its derivative (O-19)."""

from dataclasses import replace

import numpy as np
import pytest
import sheetbend as sb
from pytest import approx
from sheetbend import textile
from sheetbend.textile.shadow import RAYS, shadow

WOVEN = sb.Fabric(density=0.2, warp=2000.0, shear=50.0, bending=2e-5)
RINGS = 8


@pytest.fixture(scope="module")
def woven() -> textile.Drape:
    return textile.drape(WOVEN, rings=RINGS, folds=(3, 4, 5, 6, 8))


def followed(state: textile.DrapeState, fabric: sb.Fabric, rings: int = RINGS) -> textile.DrapeState:
    """The state of another fabric or mesh that a state leads to."""
    scene = textile.drape_scene(fabric, rings=rings)
    mesh = state.rest.scene.cloths["cloth"].mesh
    start = state.rest.positions
    if rings != RINGS:
        start = mesh.project(scene.cloths["cloth"].mesh.vertices).positions(start)
    return textile.drape_state(sb.equilibrium(scene, start))


@pytest.mark.slow
def test_states_by_energy(woven):
    energies = [state.energy for state in woven.states]
    assert len(energies) >= 3
    assert energies == sorted(energies)
    assert woven.coefficient == woven.states[0].coefficient
    assert {state.nodes for state in woven.states} >= {4, 5}
    assert all(state.rest.unstable_modes == 0 for state in woven.states)
    assert all(0.3 < state.coefficient.value < 0.8 for state in woven.states)


def test_a_rigid_cloth_covers_all_of_its_ring():
    stiff = textile.drape(replace(WOVEN, bending=2.0), rings=RINGS, folds=(4,))
    assert stiff.coefficient.laboratory == approx(100.0, abs=1e-2)


def test_the_limper_the_smaller_the_shadow(woven):
    state = next(state for state in woven.states if state.nodes == 4)
    seen = [state.coefficient.value]
    for bending in (1e-5, 5e-6, 2e-6, 1e-6):
        state = followed(state, replace(WOVEN, bending=bending))
        seen.append(state.coefficient.value)
    assert seen == sorted(seen, reverse=True)


@pytest.mark.slow
def test_a_limp_cloth_hangs_from_the_plate():
    """Down to what a mesh of 11 rings can show: its held ring reaches 6.4 mm beyond the plates, 8.3 % of the ring."""
    seen = [
        textile.drape(replace(WOVEN, warp=200 * f, shear=5 * f, bending=2e-7 * f), rings=11, folds=(8,))
        for f in (1.0, 0.2)
    ]
    limp, limper = (drape.coefficient.value for drape in seen)
    assert limper < limp < 0.25


def test_shear_holds_the_cloth_up(woven):
    state = next(state for state in woven.states if state.nodes == 4)
    seen = [followed(state, replace(WOVEN, shear=shear)).coefficient.value for shear in (20.0, 50.0, 120.0)]
    assert seen == sorted(seen)


@pytest.mark.slow
def test_the_mesh_moves_the_coefficient_by_less_than_two_percent(woven):
    state = next(state for state in woven.states if state.nodes == 4)
    coarse = followed(state, WOVEN, 11)
    fine = textile.drape_scene(WOVEN, rings=14)
    start = coarse.rest.scene.cloths["cloth"].mesh.project(fine.cloths["cloth"].mesh.vertices)
    finer = textile.drape_state(sb.equilibrium(fine, start.positions(coarse.rest.positions)))
    assert (coarse.nodes, finer.nodes) == (4, 4)
    assert finer.coefficient.value == approx(coarse.coefficient.value, rel=0.02)


@pytest.mark.parametrize("field", ["density", "warp", "weft", "shear", "poisson", "bending", "bending_weft"])
def test_gradient(field):
    fabric = replace(WOVEN, weft=1500.0, bending_weft=1e-5, poisson=0.1)
    state = textile.drape(fabric, rings=7, folds=(5,)).states[0]
    scene, value = state.rest.scene, getattr(fabric, field)
    high, low = (
        textile.drape_state(
            sb.equilibrium(scene, state.rest.positions, {f"cloth_{field}": value * (1.0 + sign * 1e-5)})
        ).coefficient.value
        for sign in (1.0, -1.0)
    )
    assert state.coefficient.gradient[f"cloth_{field}"] == approx((high - low) / (2e-5 * value), rel=1e-4)


def test_a_number_of_rings_that_misses_the_plates_is_refused():
    with pytest.raises(sb.MeshError, match="rings"):
        textile.drape_scene(WOVEN, rings=10)


# --- on plates that it touches


@pytest.mark.parametrize("cover", [True, False])
def test_a_cloth_that_touches_its_plates(cover):
    held = textile.drape(WOVEN, rings=RINGS, folds=(4,)).states[0]
    state = textile.drape(WOVEN, rings=RINGS, folds=(4,), friction=0.3, cover=cover).states[0]
    cloth = state.rest.scene.cloths["cloth"]
    over = state.rest.positions[cloth.particles[cloth.mesh.sets["support"]]]
    off = 100.0 * (held.coefficient.value - state.coefficient.value)
    assert (state.nodes, state.rest.unstable_modes) == (held.nodes, 0)
    assert over[:, 2].min() > -1e-6  # nothing goes into the plate
    if cover:
        assert over[:, 2].max() < 1e-6
        assert 0.0 < off < 0.3
    else:
        assert 3e-4 < over[:, 2].max() < 3e-3  # it lifts off beside the edge
        assert 0.3 < off < 2.0


@pytest.mark.parametrize("cover", [True, False])
@pytest.mark.parametrize("name", ["cloth_bending", "plate_friction"])
def test_gradient_on_plates(name, cover):
    fabric = replace(WOVEN, weft=1500.0, bending_weft=1e-5)
    start = textile.drape(fabric, rings=7, folds=(5,)).states[0].rest.positions
    scene = textile.drape_scene(fabric, rings=7, friction=0.3, cover=cover)

    def coefficient(**values):
        return textile.drape_state(sb.equilibrium(scene, start, values)).coefficient

    value, step = {"cloth_bending": (fabric.bending, 1e-5), "plate_friction": (0.3, 1e-3)}[name]
    high, low = (coefficient(**{name: value * (1.0 + sign * step)}).value for sign in (1.0, -1.0))
    assert coefficient().gradient[name] == approx((high - low) / (2.0 * step * value), rel=1e-3)


def test_plates_that_cannot_be_are_refused():
    with pytest.raises(sb.InputError, match="friction"):
        textile.drape_scene(WOVEN, rings=RINGS, friction=0.0)
    with pytest.raises(sb.InputError, match="cover"):
        textile.drape(WOVEN, rings=RINGS, folds=(4,), cover=False)


# --- the shadow


def test_shadow_of_a_wavy_star():
    angle = 2 * np.pi * np.arange(400) / 400
    radius = 1.0 + 0.2 * np.cos(5 * angle)
    rim = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), 0 * angle])
    border = np.arange(400)
    seen = shadow(rim, np.column_stack([border, np.roll(border, -1)]), border)
    assert seen.area == approx(np.pi * (1 + 0.02), rel=2e-4)
    assert seen.nodes == 5
    assert seen.hidden == 0.0
    assert len(seen.radius) == RAYS
    step = 1e-6 * np.random.default_rng(1).normal(size=rim.shape)
    edges = np.column_stack([border, np.roll(border, -1)])
    difference = (shadow(rim + step, edges, border).area - shadow(rim - step, edges, border).area) / 2.0
    assert (seen.area_bar * step).sum() == approx(difference, rel=1e-4)


def test_an_overhang_is_told():
    x = np.array([[1, -1], [2, -1], [2, 1], [1.5, 1], [1.5, 0.5], [1.2, 0.5], [1.2, 1], [-1, 1], [-1, -1]], dtype=float)
    rim = np.arange(len(x))
    seen = shadow(np.column_stack([x, 0 * x[:, 0]]), np.column_stack([rim, np.roll(rim, -1)]), rim)
    assert 0.0 < seen.hidden < 0.2
