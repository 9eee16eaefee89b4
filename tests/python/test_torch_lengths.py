"""Batches of scenes of different lengths: each has the frames and derivatives that it has alone."""

from __future__ import annotations

import numpy as np
import pytest
import sheetbend as sb
import sheetbend.torch as st
import torch
from torch.func import grad, vmap

SOLVER, TIMES = sb.Solver(h=1 / 200), np.arange(9) / 50
LENGTHS = [9, 2, 5, 1, 9, 4, 7, 3, 6, 8, 2]  # a full pack and part of another
EI = np.geomspace(0.5e-2, 2e-2, len(LENGTHS))
Tensor = torch.Tensor


@pytest.fixture(scope="module")
def simulation() -> st.Simulation:
    scene = sb.Scene("rope")
    rope = sb.add_rope(scene, length=0.6, segments=5, density=0.05, EI=1e-2, bend_damping=0.02)
    scene.pin(rope.particles[:1])
    return st.Simulation(scene, TIMES, SOLVER)


def alone(simulation: st.Simulation, value: Tensor, frames: int) -> Tensor:
    return st.simulate(simulation.scene, TIMES[:frames], SOLVER, {"rope_EI": value})


def test_each_scene_has_the_bits_that_it_has_alone(simulation: st.Simulation) -> None:
    x = simulation({"rope_EI": torch.tensor(EI)}, lengths=LENGTHS)
    for k, frames in enumerate(LENGTHS):
        own = alone(simulation, torch.tensor(EI[k]), frames)
        assert torch.equal(x[k, :frames], own)
        assert torch.equal(x[k, frames:], own[-1:].expand(len(TIMES) - frames, -1, -1))


def test_frames_after_the_last_have_no_derivative(simulation: st.Simulation) -> None:
    weights = torch.from_numpy(np.random.default_rng(0).standard_normal((len(LENGTHS), len(TIMES), 6, 3)))
    seen = torch.arange(len(TIMES)) < torch.tensor(LENGTHS)[:, None]
    each = torch.tensor(EI, requires_grad=True)
    x = simulation({"rope_EI": each}, lengths=torch.tensor(LENGTHS))
    bar = torch.autograd.grad((weights * x).sum(), each)[0]
    for k, frames in enumerate(LENGTHS):
        value = torch.tensor(EI[k], requires_grad=True)
        loss = (weights[k, :frames] * alone(simulation, value, frames)).sum()
        expected = torch.autograd.grad(loss, value)[0] if frames > 1 else torch.tensor(0.0)
        assert bar[k].item() == pytest.approx(expected.item(), rel=1e-12)
    # forward mode agrees
    forward = torch.autograd.forward_ad
    with forward.dual_level():
        dual = forward.make_dual(each.detach(), torch.ones_like(each))
        x_dot = forward.unpack_dual(simulation({"rope_EI": dual}, lengths=LENGTHS)).tangent
    assert x_dot[seen].any()
    assert not x_dot[~seen].any()
    assert (weights * x_dot).sum((1, 2, 3)).numpy() == pytest.approx(bar.numpy(), rel=1e-11)


def test_second_derivatives(simulation: st.Simulation) -> None:
    def slope(values: Tensor) -> Tensor:
        x = simulation({"rope_EI": values}, lengths=LENGTHS)
        return torch.autograd.grad(x.square().sum(), values, create_graph=True)[0]

    each = torch.tensor(EI, requires_grad=True)
    second = torch.autograd.grad(slope(each).sum(), each)[0].numpy()
    step = 1e-4 * EI
    low, high = (slope(torch.tensor(EI + sign * step, requires_grad=True)).detach().numpy() for sign in (-1, 1))
    assert second == pytest.approx((high - low) / (2 * step), rel=1e-5, abs=1e-5 * abs(second).max())


def test_a_batch_of_one_and_two_leading_dimensions(simulation: st.Simulation) -> None:
    one = simulation({"rope_EI": torch.tensor(EI[:1])}, lengths=[4])
    assert torch.equal(one[0, :4], alone(simulation, torch.tensor(EI[0]), 4))
    grid = simulation({"rope_EI": torch.tensor(EI[:6].reshape(2, 3))}, lengths=np.reshape(LENGTHS[:6], (2, 3)))
    flat = simulation({"rope_EI": torch.tensor(EI[:6])}, lengths=LENGTHS[:6])
    assert torch.equal(grid.reshape(flat.shape), flat)


@pytest.mark.parametrize(
    ("lengths", "problem"),
    [([1, 2], "one per scene"), ([1, 2.5, 3], "whole numbers"), ([0, 1, 2], "within"), ([1, 2, 10], "within")],
)
def test_lengths_that_fit_neither_batch_nor_frames(simulation: st.Simulation, lengths: list, problem: str) -> None:
    with pytest.raises(sb.InputError, match=problem):
        simulation({"rope_EI": torch.tensor(EI[:3])}, lengths=lengths)


def test_vmap_is_sent_to_leading_dimensions(simulation: st.Simulation) -> None:
    with pytest.raises(sb.InputError, match="leading dimensions"):
        vmap(grad(lambda v: simulation({"rope_EI": v}, lengths=3).square().sum()))(torch.tensor(EI[:3]))
