"""sheetbend.torch refuses what the rest of the package refuses: negative stiffness, mass and length, by name and by
scene of a batch, and arrays that a scene has no use for."""

from __future__ import annotations

import math

import numpy as np
import pytest
import sheetbend as sb
import sheetbend.torch as st
import torch
from torch.func import grad, vmap

SOLVER = sb.Solver(h=1 / 400)
TIMES = np.array([0.0, 0.01])
NAMES = ("rope_EI", "rope_EA", "rope_density", "rope_length", "rope_bend_damping")
double = torch.float64


@pytest.fixture(scope="module")
def rope() -> sb.Scene:
    """Bending is damped, stretching is not; no drag."""
    return sb.rope(0.5, 5, density=0.05, EA=100.0, EI=1e-3, bend_damping=0.01)


def inputs_of(scene: sb.Scene, array: str) -> torch.Tensor:
    offset, size = scene.compiled.layout[array]
    return torch.tensor(scene.compiled.inputs()[offset : offset + size])


@pytest.mark.parametrize("value", [-1.0, math.nan, math.inf])
@pytest.mark.parametrize("name", NAMES)
def test_values_are_refused_by_name(rope: sb.Scene, name: str, value: float) -> None:
    with pytest.raises(sb.InputError, match=rf"values\.{name}: must be"):
        st.simulate(rope, TIMES, SOLVER, values={name: torch.tensor(value, dtype=double, requires_grad=True)})
    good = rope.quantities[name].value
    batch = torch.tensor([good, value, good], dtype=double)
    with pytest.raises(sb.InputError, match=rf"values\.{name}: .* in scene 1 of the batch"):
        st.simulate(rope, TIMES, SOLVER, values={name: batch})
    with pytest.raises(sb.InputError, match=rf"values\.{name}: .* in scene 1 of the batch"):
        st.equilibrium(rope, values={name: batch})


def test_a_zero_is_refused(rope: sb.Scene) -> None:
    with pytest.raises(
        sb.InputError, match=r"values: make the compliance of constraint 0 .* not finite by rope_length, rope_EI"
    ):
        st.simulate(rope, TIMES, SOLVER, values={"rope_EI": 0.0})


@pytest.mark.parametrize("array", ["mass", "compliance", "damping", "rest"])
@pytest.mark.parametrize("value", [-1e-3, math.nan, math.inf])
def test_arrays_are_refused_by_entry(rope: sb.Scene, array: str, value: float) -> None:
    plain = inputs_of(rope, array)
    bad = torch.stack([plain, plain])
    bad[1, -1 if array == "damping" else 1] = value
    what = "particle 1" if array == "mass" else "constraint"
    with pytest.raises(sb.InputError, match=rf"inputs\.{array}: is .* at .*{what}.* in scene 1 of the batch"):
        st.simulate(rope, TIMES, SOLVER, inputs={array: bad})


def test_arrays_without_effect_are_refused(rope: sb.Scene) -> None:
    drag = torch.full((rope.particle_count,), 0.1, dtype=double)
    for name in ("drag_linear", "drag_quadratic"):
        with pytest.raises(sb.InputError, match=rf"inputs\.{name}: has no effect on this scene.*set_drag"):
            st.simulate(rope, TIMES, SOLVER, inputs={name: drag})
    damping = inputs_of(rope, "damping")
    changed = damping.clone()
    changed[2] = 0.1
    with pytest.raises(sb.InputError, match=r"inputs\.damping: is without effect at constraint 2 .* 'rope_stretch'"):
        st.simulate(rope, TIMES, SOLVER, inputs={"damping": changed})
    st.simulate(rope, TIMES, SOLVER, inputs={"damping": 2 * damping})
    undamped = sb.rope(0.5, 5, density=0.05, EA=100.0)
    with pytest.raises(sb.InputError, match=r"inputs\.damping: has no effect on this scene"):
        st.simulate(undamped, TIMES, SOLVER, inputs={"damping": torch.zeros(5, dtype=double)})


def test_checks_pass_every_transform(rope: sb.Scene) -> None:
    def loss(EI: torch.Tensor) -> torch.Tensor:
        return st.simulate(rope, TIMES, SOLVER, values={"rope_EI": EI}).square().sum()

    good = torch.tensor([1e-3, 2e-3, 3e-3], dtype=double)
    one_by_one = torch.stack([grad(loss)(EI) for EI in good])
    assert torch.allclose(vmap(grad(loss))(good), one_by_one, rtol=1e-12, atol=0)
    assert torch.allclose(torch.func.jacfwd(loss)(good[0]), one_by_one[0], rtol=1e-9, atol=0)
    bad = torch.tensor([1e-3, 2e-3, -3e-3], dtype=double)
    for call in (vmap(loss), vmap(grad(loss))):
        with pytest.raises(sb.InputError, match=r"values\.rope_EI: .* in scene 2 of the batch"):
            call(bad)


def test_the_module_refuses_overrides(rope: sb.Scene) -> None:
    module = st.SceneModule(rope, TIMES, SOLVER, learn=["rope_EI"])
    with pytest.raises(sb.InputError, match=r"values\.rope_density: must be a positive number"):
        module(rope_density=torch.tensor(-0.05, dtype=double))
