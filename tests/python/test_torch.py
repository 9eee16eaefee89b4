"""sheetbend.torch: derivatives under autograd and torch.func, batches, errors, the Module, threads, Ceres beside it.

Bounds: gradcheck and gradgradcheck 1e-8 relative to the largest derivative, in unit-scaled variables with steps of our
own (with torch's default of 1e-6 rounding alone makes 1e-6 of the small derivatives). Reverse against forward mode
1e-12. Batched against one by one: the same bits.
"""

from __future__ import annotations

import importlib.util
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import sheetbend as sb
import sheetbend.torch as st
import torch
from sheetbend.motion.rollouts import Rollouts
from torch.autograd import gradcheck, gradgradcheck
from torch.func import grad, hessian, jacfwd, jacrev, jvp, vjp, vmap

SOLVER = sb.Solver(h=1 / 100)
TIMES = np.array([0.0, 0.05, 0.10])
NAMES = ("rope_EI", "rope_EA", "rope_density", "rope_bend_damping", "rope_drag_linear", "rope_length")
# Difference steps where rounding (falls with the step) and curvature (grows with its square) stay below the bound:
# positions bend the response most, velocities and damping move it least.
STEPS = {
    "position": 3e-6,
    "velocity": 1e-3,
    "mass": 3e-5,
    "compliance": 3e-5,
    "damping": 2e-4,
    "rest": 1e-5,
    "boundary": 1e-4,
    "force": 1e-4,
    "gravity": 1e-4,
    "drag_linear": 1e-3,
}
BOUND = 1e-8
Tensor = torch.Tensor


@pytest.fixture(scope="module")
def scene() -> sb.Scene:
    """5 nodes: the first one driven, a force on the last, every quantity of a rope without clamps."""
    scene = sb.Scene("five nodes")
    rope = sb.add_rope(
        scene,
        length=1.0,
        segments=4,
        density=0.05,
        EA=50.0,
        EI=1e-2,
        bend_damping=0.01,
        stretch_damping=1e-3,
        drag_linear=0.02,
    )
    knots = np.linspace(0.0, 0.2, 5)
    motion = np.stack([0.0 * knots, 0.02 * np.sin(20.0 * knots), 0.01 * np.cos(9.0 * knots)], axis=1)
    scene.drive(rope.particles[:1], knots, motion[:, None])
    scene.add_force(rope.particles[-1:], [[[0.05, 0.1, 0.0]], [[0.0, -0.1, 0.2]]], times=[0.0, 0.1])
    return scene.freeze()


@pytest.fixture(scope="module")
def positions(scene: sb.Scene) -> Callable[[Tensor], Tensor]:
    """Positions by relative changes u (quantities,) of the quantities: unit-scaled, so that one step suits all.

    A change of length acts at once against EA; a tenth of it bends the response as much as the others do.
    """
    start = torch.tensor([scene.quantities[n].value for n in NAMES], dtype=torch.float64)
    share = torch.tensor([0.1 if n == "rope_length" else 1.0 for n in NAMES], dtype=torch.float64)

    def f(u: Tensor) -> Tensor:
        return st.simulate(
            scene, TIMES, SOLVER, values=dict(zip(NAMES, (start * (1.0 + share * u)).unbind(), strict=True))
        )

    return f


@pytest.fixture(scope="module")
def loss(positions: Callable[[Tensor], Tensor]) -> Callable[[Tensor], Tensor]:
    """A smooth loss with curvature of its own, of order one."""
    weights = torch.tensor(np.random.default_rng(1).standard_normal((3, 5, 3)))
    return lambda u: (weights * (10.0 * positions(u)).sin()).sum()


def zero(requires_grad: bool = False) -> Tensor:
    return torch.zeros(len(NAMES), dtype=torch.float64, requires_grad=requires_grad)


def scattered(count: int) -> Tensor:
    return torch.tensor(0.1 * np.random.default_rng(2).standard_normal((count, len(NAMES))))


def array(scene: sb.Scene, name: str) -> Tensor:
    compiled = scene.compiled
    offset, size = compiled.given[name]
    return torch.tensor(compiled.inputs()[offset : offset + size].reshape(compiled.shapes[name]))


def relative(a: Tensor, b: Tensor) -> float:
    return float((a - b).abs().max() / b.abs().max())


# --- values and first derivatives


def test_positions_are_those_of_simulate_to_the_bit(scene: sb.Scene) -> None:
    changed = {"rope_EI": 2e-2, "rope_density": 0.06}
    expected = sb.simulate(scene, TIMES, SOLVER, values=changed).positions
    values = {name: torch.tensor(value, dtype=torch.float64) for name, value in changed.items()}
    result = st.simulate(scene, TIMES, SOLVER, values=values)
    assert result.dtype == torch.float64
    assert result.shape == (3, 5, 3)
    assert np.array_equal(result.numpy(), expected)
    assert np.array_equal(st.simulate(scene, TIMES, SOLVER, values=changed).numpy(), expected)


def test_inputs_are_those_of_the_compiled_map() -> None:
    clamped = {"clamp_start": (1, 0, 0), "clamp_angles": True, "plane": (0, 1, 0), "set_modes": (0, 1), "pinned": ()}
    scene = sb.rope(1.0, 4, density=0.05, EI=1e-2, **clamped)
    compiled = scene.compiled
    theta = compiled.theta + 0.3
    values = dict(zip(compiled.names, torch.tensor(theta), strict=True))
    assert np.array_equal(st.inputs.InputMap(scene)(values, {}).numpy(), compiled.inputs(theta))


def test_gradient_is_the_adjoint(scene: sb.Scene) -> None:
    core, compiled = SOLVER.core(scene.compiled), scene.compiled
    steps, inputs = [0, 5, 10], compiled.inputs()
    bar = np.random.default_rng(3).standard_normal((3, 15))
    expected = compiled.theta_bar(compiled.theta, core.vjp(inputs, core.record(inputs, steps, 0.0)[1], steps, bar, 0.0))
    values = {n: torch.tensor(scene.quantities[n].value, dtype=torch.float64, requires_grad=True) for n in NAMES}
    (st.simulate(scene, TIMES, SOLVER, values=values).reshape(3, 15) * torch.tensor(bar)).sum().backward()
    assert {n: v.grad.item() for n, v in values.items()} == {n: expected[compiled.names.index(n)] for n in NAMES}


def test_gradcheck_of_quantities(positions: Callable[[Tensor], Tensor]) -> None:
    bound = BOUND * float(jacrev(positions)(zero()).abs().max())
    assert gradcheck(positions, (zero(True),), eps=3e-5, rtol=BOUND, atol=bound, check_forward_ad=True)


@pytest.mark.parametrize(("name", "step"), STEPS.items())
def test_gradcheck_of_arrays(scene: sb.Scene, name: str, step: float) -> None:
    base = array(scene, name)
    size = torch.where(base == 0, base.abs().max() if bool(base.any()) else 1e-2, base.abs())

    def f(u: Tensor) -> Tensor:
        return st.simulate(scene, TIMES, SOLVER, inputs={name: base + size * u})

    u = torch.zeros(base.shape, dtype=torch.float64, requires_grad=True)
    bound = BOUND * float(jacfwd(f)(u.detach()).abs().max())
    assert bound > 0
    assert gradcheck(f, (u,), eps=step, rtol=BOUND, atol=bound, check_forward_ad=True)


def test_quantities_of_a_replaced_array_have_no_say(scene: sb.Scene) -> None:
    mass, density = array(scene, "mass"), torch.tensor(0.05, dtype=torch.float64, requires_grad=True)
    x = st.simulate(scene, TIMES, SOLVER, values={"rope_density": density}, inputs={"mass": mass})
    (gradient,) = torch.autograd.grad(x.sum(), density)
    assert float(gradient) == 0.0


# --- second derivatives


def test_gradgradcheck(positions: Callable[[Tensor], Tensor]) -> None:
    bar = torch.tensor(np.random.default_rng(4).standard_normal((3, 5, 3)), requires_grad=True)
    second = hessian(lambda u: (bar.detach() * positions(u)).sum())(zero())
    bound = BOUND * max(float(second.abs().max()), float(jacrev(positions)(zero()).abs().max()))
    assert gradgradcheck(positions, (zero(True),), (bar,), eps=3e-5, rtol=BOUND, atol=bound, check_fwd_over_rev=True)


def test_hessians_by_every_order_of_modes_agree(loss: Callable[[Tensor], Tensor]) -> None:
    u = scattered(1)[0]
    by_modes = [f(loss)(u) for f in (hessian, lambda f: jacrev(jacrev(f)), lambda f: jacrev(jacfwd(f)))]
    by_modes.append(torch.autograd.functional.hessian(loss, u))
    for other in by_modes[1:]:
        assert relative(other, by_modes[0]) < 1e-12
    steps = 1e-5 * torch.eye(len(u), dtype=torch.float64)
    differences = torch.stack([(grad(loss)(u + d) - grad(loss)(u - d)) / 2e-5 for d in steps])
    assert relative(by_modes[0], differences) < BOUND


def test_derivatives_beyond_raise_by_name(loss: Callable[[Tensor], Tensor]) -> None:
    with pytest.raises(NotImplementedError, match=r"function\.VjpDot: third derivatives"):
        grad(lambda u: hessian(loss)(u).sum())(zero())
    with pytest.raises(NotImplementedError, match=r"function\.Jvp: forward over forward"):
        jacfwd(jacfwd(loss))(zero())


# --- torch.func and batches


def test_jacobians_agree(positions: Callable[[Tensor], Tensor]) -> None:
    u, direction = scattered(2)
    reverse, forward = jacrev(positions)(u), jacfwd(positions)(u)
    assert relative(reverse, forward) < 1e-12
    value, along = jvp(positions, (u,), (direction,))
    assert torch.equal(value, positions(u))
    assert relative(along, forward @ direction) < 1e-12
    bar = torch.tensor(np.random.default_rng(5).standard_normal((3, 5, 3)))
    (back,) = vjp(positions, u)[1](bar)
    assert relative(back, torch.einsum("fpc,fpcq->q", bar, reverse)) < 1e-12


@pytest.mark.parametrize("transform", [lambda f: f, grad, hessian, lambda f: jacfwd(grad(f))])
@pytest.mark.parametrize("count", [1, 3, 11])
def test_vmap_is_a_loop(loss: Callable[[Tensor], Tensor], transform: Callable, count: int) -> None:
    f, us = transform(loss), scattered(count)
    mapped, looped = vmap(f)(us), torch.stack([f(u) for u in us])
    # torch's own operations around the rollout (sin, sums) may round otherwise in batches; the rollout below may not.
    assert relative(mapped, looped) < 1e-13


@pytest.mark.parametrize("count", [1, 3, 11])
def test_vmap_of_rollouts_has_the_bits_of_a_loop(positions: Callable[[Tensor], Tensor], count: int) -> None:
    us = scattered(count)
    bars = torch.tensor(np.random.default_rng(6).standard_normal((count, 3, 5, 3)))
    assert torch.equal(vmap(positions)(us), torch.stack([positions(u) for u in us]))
    pull = vmap(lambda u, bar: vjp(positions, u)[1](bar)[0])
    assert torch.equal(
        pull(us, bars), torch.stack([vjp(positions, u)[1](bar)[0] for u, bar in zip(us, bars, strict=True)])
    )


def test_nested_vmap_and_other_dimensions(positions: Callable[[Tensor], Tensor]) -> None:
    us = scattered(6).reshape(2, 3, -1)
    looped = torch.stack([torch.stack([positions(u) for u in row]) for row in us])
    assert torch.equal(vmap(vmap(positions))(us), looped)
    assert torch.equal(vmap(vmap(positions), in_dims=1, out_dims=1)(us), looped)


def test_leading_dimensions_are_a_batch(scene: sb.Scene) -> None:
    EI = torch.tensor([[0.5e-2, 1e-2, 2e-2]], dtype=torch.float64, requires_grad=True)  # (1, 3)
    gravity = torch.tensor(
        [[[0.0, 0.0, -9.81]], [[0.0, 0.0, -1.62]]], dtype=torch.float64, requires_grad=True
    )  # (2, 1, 3)
    x = st.simulate(scene, TIMES, SOLVER, values={"rope_EI": EI}, inputs={"gravity": gravity})
    assert x.shape == (2, 3, 3, 5, 3)
    looped = torch.stack(
        [
            torch.stack([st.simulate(scene, TIMES, SOLVER, {"rope_EI": e}, {"gravity": g[0]}) for e in EI[0]])
            for g in gravity
        ]
    )
    assert torch.equal(x, looped)
    together, apart = (torch.autograd.grad(result.square().sum(), (EI, gravity)) for result in (x, looped))
    for a, b in zip(together, apart, strict=True):
        assert a.shape == b.shape
        assert relative(a, b) < 1e-13


def test_a_batch_is_one_call_of_the_core(scene: sb.Scene) -> None:
    """Values and all derivatives of a batch: no other entry of the core is touched."""
    calls: list[str] = []

    class Recorder:
        def __init__(self, core: object) -> None:
            self.core = core

        def __getattr__(self, name: str) -> object:
            calls.append(name)
            return getattr(self.core, name)

    simulation = st.Simulation(scene, TIMES, SOLVER)
    simulation._core = Recorder(simulation._core)
    us = (1e-2 * (1.0 + scattered(11)[:, 0])).requires_grad_()
    simulation({"rope_EI": us}).square().sum().backward()
    vmap(grad(lambda EI: simulation({"rope_EI": EI}).square().sum()))(us.detach())
    assert calls == ["simulate_batch", "vjp_batch"] * 2
    calls.clear()
    jvp(lambda EI: simulation({"rope_EI": EI}), (us.detach(),), (us.detach(),))
    assert calls == ["simulate_batch", "jvp_batch"]
    calls.clear()
    vmap(hessian(lambda EI: simulation({"rope_EI": EI}).square().sum()))(us.detach())
    assert calls == ["simulate_batch", "jvp_batch", "vjp_batch", "vjp_dot_batch"]
    calls.clear()
    simulation({"rope_EI": us[0]}).square().sum().backward()
    assert calls == ["record", "vjp"]  # the tape is kept for backward


def test_a_tape_serves_its_own_inputs_only(scene: sb.Scene) -> None:
    core, inputs, bar = SOLVER.core(scene.compiled), scene.compiled.inputs()[None], np.ones((1, 3, 15))
    keeping, fresh = (Rollouts(scene, core, [0, 5, 10], keep, SOLVER) for keep in (True, False))
    assert np.array_equal(keeping.value(inputs), fresh.value(inputs))
    assert np.array_equal(keeping.vjp(inputs, bar), fresh.vjp(inputs, bar))
    assert np.array_equal(keeping.vjp(1.1 * inputs, bar), fresh.vjp(1.1 * inputs, bar))


def test_a_tensor_changed_between_forward_and_backward_is_noticed(scene: sb.Scene) -> None:
    gravity = array(scene, "gravity").requires_grad_()
    copy = gravity * 1.0
    x = st.simulate(scene, TIMES, SOLVER, inputs={"gravity": copy})
    expected = torch.autograd.grad(x.sum(), gravity, retain_graph=True)
    with torch.no_grad():
        copy.mul_(0.5)  # the flat inputs are a copy of their own: the graph still stands
    assert torch.equal(torch.autograd.grad(x.sum(), gravity)[0], expected[0])


def test_tensors_and_arrays_share_memory() -> None:
    tensor = torch.ones(2, 3, dtype=torch.float64, requires_grad=True)
    assert np.shares_memory(st.function._array(tensor), tensor.detach().numpy())


def test_strided_tensors_are_taken(scene: sb.Scene) -> None:
    position = array(scene, "position")
    strided = position.T.contiguous().T
    assert not strided.is_contiguous()
    expected = st.simulate(scene, TIMES, SOLVER, inputs={"position": position})
    assert torch.equal(st.simulate(scene, TIMES, SOLVER, inputs={"position": strided}), expected)


# --- single precision


def test_float32_in_float32_out() -> None:
    """It was refused, though networks are float32. What is computed is float64; what goes in and out is rounded."""
    scene = small_rope(1e-3)
    EI = torch.tensor([2e-3, 3e-3], dtype=torch.float32, requires_grad=True)
    velocity = torch.zeros(scene.particle_count, 3, dtype=torch.float32, requires_grad=True)
    x = st.simulate(scene, TIMES, SOLVER, {"rope_EI": EI}, {"velocity": velocity})
    assert x.dtype == torch.float32 and x.shape[0] == 2
    wide = st.simulate(scene, TIMES, SOLVER, {"rope_EI": EI.double()}, {"velocity": velocity.double()})
    assert wide.dtype == torch.float64 and torch.equal(x, wide.float())
    found = torch.autograd.grad(x.square().sum(), [EI, velocity])
    exact = torch.autograd.grad(wide.square().sum(), [EI, velocity])
    for one, other in zip(found, exact, strict=True):
        assert one.dtype == torch.float32 and torch.allclose(one, other, rtol=1e-4, atol=1e-5)
    assert st.simulate(scene, TIMES, SOLVER, {"rope_EI": EI}, {"velocity": velocity.double()}).dtype == torch.float64
    assert st.equilibrium(scene, values={"rope_EI": EI.detach()}).positions.dtype == torch.float32
    slope = torch.func.grad(lambda e: st.simulate(scene, TIMES, SOLVER, {"rope_EI": e})[-1, -1, 2])(EI.detach()[0])
    assert slope.dtype == torch.float32


# --- errors

double = torch.float64


@pytest.mark.parametrize(
    ("values", "inputs", "message"),
    [
        (
            {"rope_EI": torch.tensor(1e-2, dtype=torch.float16)},
            {},
            r"values\.rope_EI: is not float64 or float32 .*float16.*Fix: convert it with \.double\(\)",
        ),
        ({"velocity": torch.zeros(5, 3)}, {}, r"values\.velocity: is an input array .*inputs=\{'velocity': \.\.\.\}"),
        (
            {"rope_EI": torch.tensor(1.0, dtype=double, device="meta")},
            {},
            r"values\.rope_EI: is not on the CPU .*meta.*\.cpu\(\)",
        ),
        ({"rope_EI": np.array(1e-2)}, {}, r"values\.rope_EI: is not a tensor .*ndarray"),
        (
            {"rope_ei": torch.tensor(1.0, dtype=double)},
            {},
            r"values\.rope_ei: is not a quantity .*did you mean .rope_EI",
        ),
        ({}, {"masses": torch.ones(5, dtype=double)}, r"inputs\.masses: is not an input array .*did you mean .mass"),
        ({}, {"mass": torch.ones(4, dtype=double)}, r"inputs\.mass: has the wrong shape .*\(4,\).*give \(5,\)"),
        ({}, {"velocity": torch.ones(15, dtype=double)}, r"inputs\.velocity: has the wrong shape .*give \(5, 3\)"),
        ({}, {"gravity": torch.tensor(1.0, dtype=double)}, r"inputs\.gravity: has the wrong shape .*\(\).*give \(3,\)"),
        ({}, {"mass": torch.ones(5, dtype=double).to_sparse()}, r"inputs\.mass: is not dense"),
        (
            {"rope_EI": torch.ones(2, dtype=double), "rope_EA": torch.ones(3, dtype=double)},
            {},
            "batch: dimensions do not broadcast",
        ),
        ({"rope_EI": torch.ones(0, dtype=double)}, {}, "batch: is empty"),
        ({"rope_EI": torch.tensor(torch.nan, dtype=double)}, {}, r"values\.rope_EI: must be a finite number"),
        (
            {"rope_density": torch.tensor([0.05, torch.inf], dtype=double)},
            {},
            r"values\.rope_density: must be a finite number in scene 1 of the batch",
        ),
    ],
)
def test_wrong_tensors_are_named(scene: sb.Scene, values: dict, inputs: dict, message: str) -> None:
    with pytest.raises(sb.InputError, match=message):
        st.simulate(scene, TIMES, SOLVER, values=values, inputs=inputs)


def test_times_off_the_grid_and_divergence(scene: sb.Scene) -> None:
    with pytest.raises(sb.InputError, match="times: do not lie on the grid"):
        st.simulate(scene, [0.0, 0.013], SOLVER)
    with pytest.raises(sb.DivergenceError, match="particle"):
        st.simulate(scene, TIMES, SOLVER, inputs={"velocity": torch.full((5, 3), 1e200, dtype=double)})


# --- equilibrium


@pytest.fixture(scope="module")
def hanging() -> sb.Scene:
    ends = {"clamp_start": (1, 0, 0), "clamp_angles": True, "plane": (0, 1, 0), "set_modes": (1,)}
    return sb.rope(1.0, 6, density=0.05, EA=200.0, EI=2e-2, pinned=(), **ends)


def test_equilibrium_is_differentiable_once(hanging: sb.Scene) -> None:
    names = ("rope_EI", "rope_EA", "rope_density", "rope_start_angle", "rope_set_1")
    start = torch.tensor([hanging.quantities[n].value for n in names], dtype=double)
    size = torch.where(start == 0, 0.1, start)

    def f(u: Tensor) -> Tensor:
        rest = st.equilibrium(hanging, values=dict(zip(names, (start + size * u).unbind(), strict=True)))
        return torch.cat([rest.positions.ravel(), *(force.ravel() for force in rest.forces.values())])

    u = torch.zeros(len(names), dtype=double, requires_grad=True)
    expected = sb.equilibrium(hanging)
    assert np.abs(f(u.detach())[: expected.positions.size].numpy() - expected.positions.ravel()).max() < 1e-12
    reverse, forward = jacrev(f)(u.detach()), jacfwd(f)(u.detach())
    assert relative(reverse, forward) < 1e-9
    bound = 1e-7 * float(forward.abs().max())
    assert gradcheck(f, (u,), eps=3e-5, rtol=1e-7, atol=bound, check_forward_ad=True)
    us = 0.1 * torch.tensor(np.random.default_rng(7).standard_normal((3, len(names))))
    assert relative(vmap(f)(us), torch.stack([f(v) for v in us])) < 1e-13
    with pytest.raises(NotImplementedError, match="equilibrium: second derivatives"):
        hessian(lambda v: f(v).square().sum())(u.detach())


def test_equilibrium_forces_have_their_shapes(hanging: sb.Scene) -> None:
    rest = st.equilibrium(hanging, values={"rope_EI": torch.tensor([1e-2, 2e-2], dtype=double)})
    assert rest.positions.shape == (2, hanging.particle_count, 3)
    expected = sb.equilibrium(hanging, values={"rope_EI": 1e-2})
    for name, force in expected.forces.items():
        assert np.abs(rest.forces[name][0].numpy() - force).max() < 1e-9
        assert rest.forces[name].shape == (2, *force.shape)
    with pytest.raises(sb.SceneError, match="start: has the wrong shape"):
        st.equilibrium(hanging, start=np.zeros((2, 3)))


@pytest.mark.parametrize("threads", [1, 2, 3])
def test_a_batch_of_equilibria_has_the_bits_of_each(hanging: sb.Scene, threads: int) -> None:
    EI = torch.tensor([2e-2, 5e-3, 1e-2, 2e-2, 4e-2], dtype=double)  # one of them twice

    def rest(values: Tensor) -> tuple[Tensor, Tensor]:
        found = st.equilibrium(hanging, values={"rope_EI": values}, threads=threads)
        return found.positions, torch.cat([force.flatten(values.dim()) for force in found.forces.values()], -1)

    def all_of(values: Tensor) -> tuple[Tensor, ...]:
        (x, forces), pull = vjp(rest, values)
        x_dot, forces_dot = jvp(rest, (values,), (values,))[1]
        return x, forces, *pull((x, torch.ones_like(forces))), x_dot, forces_dot

    together = all_of(EI)
    for k, value in enumerate(EI):
        *exact, bar, x_dot, forces_dot = all_of(value)
        assert all(torch.equal(a[k], b) for a, b in zip(together, exact, strict=False))
        assert relative(together[2][k], bar) < 1e-14
        assert torch.equal(together[3][k], x_dot)
        assert torch.equal(together[4][k], forces_dot)


# --- the Module


def small_rope(EI: float) -> sb.Scene:
    return sb.rope(0.5, 8, density=0.05, EA=1e3, EI=EI, bend_damping=0.02, clamp_start=(1, 0, 0), pinned=())


FRAMES = np.arange(31) / 100
FINE = sb.Solver(h=1 / 200)


def test_module_names_its_parameters_and_keeps_them_positive() -> None:
    ends = {"clamp_start": (1, 0, 0), "clamp_angles": True, "plane": (0, 1, 0)}
    scene = sb.rope(0.5, 4, density=0.05, EI=1e-3, pinned=(), **ends)
    module = st.SceneModule(scene, FRAMES, FINE, learn=["rope_EI", "rope_start_angle"])
    assert list(module.state_dict()) == ["rope_EI", "rope_start_angle"]
    assert float(module.state_dict()["rope_EI"]) == np.log(1e-3)
    assert module.values()["rope_EI"].item() == pytest.approx(1e-3, rel=1e-15)
    assert module.values()["rope_start_angle"].item() == 0.0
    assert "rope_EI=0.001 N m^2" in repr(module)
    with torch.no_grad():
        module.rope_EI -= 20.0
    assert module.values()["rope_EI"].item() > 0.0
    other = st.SceneModule(scene, FRAMES, FINE, learn=["rope_EI", "rope_start_angle"])
    other.load_state_dict(module.state_dict())
    assert torch.equal(other.rope_EI, module.rope_EI)
    assert module.float()().dtype == torch.float32


@pytest.mark.parametrize("learn", [[], "rope_EI", ["EI"]])
def test_module_refuses_other_names(learn: object) -> None:
    with pytest.raises(sb.InputError, match=r"learn: .*rope_EI"):
        st.SceneModule(small_rope(1e-3), FRAMES, FINE, learn=learn)


def test_module_takes_batches_of_overrides() -> None:
    module = st.SceneModule(small_rope(1e-3), FRAMES, FINE, learn=["rope_EI"])
    density = torch.tensor([0.03, 0.05, 0.07], dtype=double)
    batch = module(rope_density=density)
    assert batch.shape == (3, 31, module._simulation.scene.particle_count, 3)
    assert torch.equal(batch, torch.stack([module(rope_density=d) for d in density]))
    batch.sum().backward()
    assert module.rope_EI.grad is not None
    assert torch.equal(module(rope_EI=1e-3, inputs={"gravity": torch.zeros(3, dtype=double)})[-1], module()[0])


def test_module_as_an_ensemble() -> None:
    """torch.func.functional_call puts stacked parameters in, vmap maps over them."""
    module = st.SceneModule(small_rope(1e-3), FRAMES, FINE, learn=["rope_EI"])
    stacked = {"rope_EI": torch.tensor([0.5e-3, 1e-3, 2e-3], dtype=double).log()}
    mapped = vmap(lambda parameters: torch.func.functional_call(module, parameters))(stacked)
    assert torch.equal(mapped, module(rope_EI=stacked["rope_EI"].exp()))


def train(
    module: st.SceneModule, target: Tensor, optimizer: torch.optim.Optimizer, steps: int, decay: float = 1.0
) -> None:
    def cost() -> Tensor:
        optimizer.zero_grad()
        value = 1e4 * (module() - target).square().mean()
        value.backward()
        return value

    schedule = torch.optim.lr_scheduler.ExponentialLR(optimizer, decay)
    for _ in range(steps):
        optimizer.step(cost)
        schedule.step()


def test_training_recovers_the_stiffness_of_a_twin() -> None:
    target = torch.tensor(sb.simulate(small_rope(4e-3), FRAMES, FINE).positions)
    module = st.SceneModule(small_rope(1e-3), FRAMES, FINE, learn=["rope_EI"])
    train(module, target, torch.optim.Adam(module.parameters(), lr=0.2), steps=120, decay=0.96)
    assert module.values()["rope_EI"].item() == pytest.approx(4e-3, rel=1e-3)


def test_training_recovers_stiffness_and_damping_together() -> None:
    """They share a curved valley, which a quasi-Newton method follows."""
    target = torch.tensor(sb.simulate(small_rope(4e-3), FRAMES, FINE).positions)
    module = st.SceneModule(small_rope(1e-3), FRAMES, FINE, learn=["rope_EI", "rope_bend_damping"])
    with torch.no_grad():
        module.rope_bend_damping += np.log(2.0)
    options = {"line_search_fn": "strong_wolfe", "tolerance_grad": 1e-14, "tolerance_change": 1e-16}
    train(module, target, torch.optim.LBFGS(module.parameters(), max_iter=60, **options), steps=1)
    assert module.values()["rope_EI"].item() == pytest.approx(4e-3, rel=1e-6)
    assert module.values()["rope_bend_damping"].item() == pytest.approx(0.02, rel=1e-6)


# --- threads and company


def test_the_interpreter_is_free_during_rollouts() -> None:
    scene, times = sb.rope(1.0, 50, density=0.05, EA=1e4, EI=1e-3, pinned=[0]), np.arange(0, 12_001, 1000) / 600
    solver, EI = sb.Solver(h=1 / 600), torch.tensor(1e-3, dtype=double, requires_grad=True)
    done: list[Tensor] = []

    def work() -> None:
        x = st.simulate(scene, times, solver, values={"rope_EI": EI})
        done.append(torch.autograd.grad(x.square().sum(), EI)[0])

    thread = threading.Thread(target=work)
    thread.start()
    ticks = 0
    while thread.is_alive():
        time.sleep(1e-3)
        ticks += 1
    assert len(done) == 1
    assert ticks > 20  # 0.3 s of work; a held interpreter lock would leave one or two


def test_threads_get_equal_results(positions: Callable[[Tensor], Tensor]) -> None:
    us = scattered(4)
    expected = [(positions(u), jacrev(positions)(u)) for u in us]
    results: dict[int, tuple[Tensor, Tensor]] = {}

    def work(k: int) -> None:
        results[k] = positions(us[k]), jacrev(positions)(us[k])

    threads = [threading.Thread(target=work, args=(k,)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for k in range(4):
        assert torch.equal(results[k][0], expected[k][0])
        assert torch.equal(results[k][1], expected[k][1])


def test_backward_in_another_thread(loss: Callable[[Tensor], Tensor]) -> None:
    u = zero(True)
    value = loss(u)
    thread = threading.Thread(target=value.backward)
    thread.start()
    thread.join()
    assert torch.equal(u.grad, grad(loss)(zero()))


def run(script: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=300, check=False)


def test_sheetbend_does_not_import_torch() -> None:
    assert run("import sys, sheetbend; assert 'torch' not in sys.modules").returncode == 0
    assert run("import sys, sheetbend.torch; assert 'torch' in sys.modules").returncode == 0


FIT = """
import numpy as np, sheetbend as sb
def fit():
    rope = lambda EI: sb.rope(0.5, 6, density=0.05, EA=1e3, EI=EI, pinned=[0])
    times, solver = np.arange(31) / 100, sb.Solver(h=1 / 200)
    noise = 1e-5 * np.random.default_rng(0).standard_normal((31, 6, 3))
    x = sb.simulate(rope(2e-3), times, solver).positions[:, 1:] + noise
    recording = sb.Recording(positions=x, times=times, name="twin")
    places = [sb.on_particle(i) for i in range(1, 7)]
    found = sb.fit(rope(1e-3), recording, ["rope_EI"], markers=places, solver=solver, sigma=1e-5, optimizer="ceres")
    assert abs(found.values["rope_EI"] / 2e-3 - 1) < 1e-2, found.values
def backward():
    import torch, sheetbend.torch as st
    torch.set_num_threads(2)
    a = torch.randn(600, 600, dtype=torch.float64, requires_grad=True)
    (a @ a).relu().exp().mean().log().backward()
    EI = torch.tensor(1e-3, dtype=torch.float64, requires_grad=True)
    scene = sb.rope(0.5, 6, density=0.05, EA=1e3, EI=1e-3, pinned=[0])
    st.simulate(scene, np.arange(31) / 100, sb.Solver(h=1 / 200), {"rope_EI": EI}).square().sum().backward()
    assert torch.isfinite(EI.grad) and EI.grad != 0 and torch.isfinite(a.grad).all()
"""


@pytest.mark.slow
@pytest.mark.skipif(importlib.util.find_spec("sheetbend._ceres") is None, reason="built without Ceres")
@pytest.mark.parametrize("order", ["backward(); fit(); backward()", "fit(); backward(); fit()"])
def test_torch_and_ceres_share_a_process(order: str) -> None:
    done = run(f"{FIT}\n{order}\nprint('both')")
    assert done.stdout.strip() == "both", done.stderr


@pytest.fixture(scope="module")
def sheet() -> sb.Scene:
    mesh = sb.mesh.grid(0.2, 0.2, 2, 2, "one_way")
    scene = sb.Scene("sheet")
    fabric = {"warp": 20.0, "weft": 12.0, "shear": 5.0, "poisson": 0.3, "bending": 1e-3}
    damped = {"membrane_damping": 0.01, "drag_linear": 0.2}
    cloth = sb.add_cloth(scene, mesh, density=0.2, held=mesh.sets["corners"][2:], **fabric, **damped)
    scene.pin(cloth.particles[mesh.sets["corners"][2:]])
    return scene


class TestCloth:
    """A sheet of 9 vertices with membrane, bending, damping and drag: quantities by both modes, and in batches."""

    NAMES = ("cloth_density", "cloth_warp", "cloth_weft", "cloth_shear", "cloth_poisson", "cloth_bending")

    def test_quantities(self, sheet: sb.Scene) -> None:
        start = torch.tensor([sheet.quantities[name].value for name in self.NAMES], dtype=torch.float64)
        weights = torch.linspace(-1.0, 1.0, 3 * sheet.particle_count * len(TIMES), dtype=torch.float64)

        def response(scaled: Tensor) -> Tensor:
            values = dict(zip(self.NAMES, scaled * start, strict=True))
            return st.simulate(sheet, TIMES, SOLVER, values).reshape(-1) @ weights

        one = torch.ones(len(self.NAMES), dtype=torch.float64)
        assert gradcheck(response, one.clone().requires_grad_(), eps=1e-5, atol=1e-8, rtol=0.0)
        assert gradgradcheck(response, one.clone().requires_grad_(), eps=1e-4, atol=1e-7, rtol=0.0)
        np.testing.assert_allclose(jacrev(response)(one), jacfwd(response)(one), rtol=0, atol=1e-12)

    def test_module_with_a_batch(self, sheet: sb.Scene) -> None:
        module = st.SceneModule(sheet, TIMES, SOLVER, learn=["cloth_warp", "cloth_poisson"])
        shear = torch.tensor([4.0, 5.0, 6.0], dtype=torch.float64)
        together = module(cloth_shear=shear)
        assert together.shape == (3, len(TIMES), sheet.particle_count, 3)
        assert all(torch.equal(together[k], module(cloth_shear=shear[k])) for k in range(3))
        (together[:, -1, :, 2] ** 2).sum().backward()
        parts = []
        for k in range(3):
            alone = st.SceneModule(sheet, TIMES, SOLVER, learn=["cloth_warp", "cloth_poisson"])
            (alone(cloth_shear=shear[k])[-1, :, 2] ** 2).sum().backward()
            parts.append([p.grad for p in alone.parameters()])
        for p, *each in zip(module.parameters(), *parts, strict=True):
            torch.testing.assert_close(p.grad, sum(each), rtol=1e-12, atol=0.0)


# --- forces at supports


def test_forces_at_a_support_have_the_gradients_of_differences(scene):
    rope = scene.ropes["rope"]
    names = ("rope_EI", "rope_density", "rope_length")
    at = [int(rope.particles[0])]

    def read(*values: Tensor) -> Tensor:
        return st.forces(scene, [0.04, 0.06], at, SOLVER, dict(zip(names, values, strict=True)), arm=(0.1, 0.0, 0.0))

    start = [torch.tensor(scene.quantities[name].value, dtype=torch.float64, requires_grad=True) for name in names]
    found = read(*start)
    single = [v.detach().float().requires_grad_() for v in start]
    rounded = read(*single)
    rounded.sum().backward()
    assert rounded.dtype == torch.float32 and torch.allclose(rounded.double(), found, rtol=1e-3, atol=1e-6)
    assert all(v.grad is not None and v.grad.dtype == torch.float32 and v.grad != 0.0 for v in single)
    plain = sb.simulate_forces(scene, [0.04, 0.06], at, SOLVER, arm=(0.1, 0.0, 0.0))
    assert torch.equal(found.detach(), torch.from_numpy(np.hstack([plain.forces, plain.torques])))
    weights = torch.linspace(-1.0, 1.0, 12, dtype=torch.float64).reshape(2, 6)
    (weights * found).sum().backward()
    for k, value in enumerate(start):
        step = 1e-3 * float(value.detach())
        moved = []
        for by in (2, 1, -1, -2):
            at_k = [v.detach() + by * step * (i == k) for i, v in enumerate(start)]
            moved.append(float((weights * read(*at_k)).sum()))
        slope = (8 * (moved[1] - moved[2]) - (moved[0] - moved[3])) / (12 * step)
        assert float(value.grad) == pytest.approx(slope, rel=1e-8)


class Compiled:
    """What torch.compile hands over, piece by piece; each runs as it is."""

    def __init__(self) -> None:
        self.pieces: list[str] = []

    def __call__(self, module: torch.fx.GraphModule, _: list[torch.Tensor]) -> Callable[..., Any]:
        self.pieces.append(module.code)
        return module.forward


def test_compiled_functions_call_simulations_as_they_are() -> None:
    scene = sb.rope(0.5, 4, density=0.05, EI=1e-3, clamp_start=(1, 0, 0))
    scene.add_force([4], np.zeros((1, 1, 3)))
    stepper = st.Stepper(scene, SOLVER)

    def loss(log_EI: torch.Tensor) -> torch.Tensor:
        values = {"rope_EI": log_EI.exp()}
        x = st.simulate(scene, [0.05], SOLVER, values).square().sum()
        rest = st.equilibrium(scene, values=values).positions.cos().sum()
        inputs = stepper.inputs(values)
        state = stepper.start(inputs)
        for _ in range(2):
            state = stepper(state, inputs, force=-0.1 * state.velocities[4:])
        return x + rest + state.positions.square().sum()

    found = []
    pieces = Compiled()
    for function in (loss, torch.compile(loss, backend=pieces)):
        log_EI = torch.tensor(-7.0, dtype=torch.float64, requires_grad=True)
        value = function(log_EI)
        value.backward()
        found.append((value.item(), log_EI.grad.item()))
    assert found[0] == found[1]
    code = "".join(pieces.pieces)
    assert len(pieces.pieces) <= 8 and all(f".{name}(" in code for name in ("exp", "square", "cos"))
