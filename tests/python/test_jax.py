"""sheetbend.jax beside torch, one call of the core for a batch, errors."""

from __future__ import annotations

import numpy as np
import pytest
import sheetbend as sb
import sheetbend.torch as st
import torch

jax = pytest.importorskip("jax")
jax.config.update("jax_enable_x64", True)

import jax.numpy as jnp  # noqa: E402
import sheetbend.jax as sj  # noqa: E402
from sheetbend.motion.rollouts import Rollouts  # noqa: E402

TIMES, SOLVER = np.array([0.0, 0.05, 0.1]), sb.Solver(h=1 / 100)
NAMES = ("rope_EI", "rope_density", "rope_length", "rope_bend_damping")


@pytest.fixture(scope="module")
def scene() -> sb.Scene:
    return sb.rope(0.6, 6, density=0.05, EI=1e-3, bend_damping=3e-3, drag_linear=5e-3, clamp_start=(1, 0, 0))


def loss(scene: sb.Scene, values: dict, gravity: object) -> object:
    return (sj.simulate(scene, TIMES, SOLVER, values, {"gravity": gravity}) ** 2).sum()


def test_gradients_have_the_bits_of_torch(scene: sb.Scene) -> None:
    start = {name: scene.quantities[name].value for name in NAMES}
    gravity = np.array([0.1, 0.2, -9.0])
    found = jax.jit(jax.grad(lambda v, g: loss(scene, v, g), argnums=(0, 1)))(start, jnp.asarray(gravity))
    tensors = {name: torch.tensor(v, dtype=torch.float64, requires_grad=True) for name, v in start.items()}
    g = torch.from_numpy(gravity).requires_grad_()
    x = st.simulate(scene, TIMES, SOLVER, tensors, {"gravity": g})
    x.square().sum().backward()
    assert np.array_equal(sj.simulate(scene, TIMES, SOLVER, start, {"gravity": jnp.asarray(gravity)}), x.detach())
    assert np.array_equal(found[1], g.grad)
    assert {name: float(own) for name, own in found[0].items()} == {name: t.grad.item() for name, t in tensors.items()}


def test_a_batch_is_one_call(scene: sb.Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[tuple[str, int]] = []
    for name in ("value", "vjp"):
        own = getattr(Rollouts, name)
        monkeypatch.setattr(
            Rollouts, name, lambda s, x, *a, own=own, name=name: calls.append((name, len(x))) or own(s, x, *a)
        )
    EI = jnp.logspace(-4, -2, 5)
    down = jnp.array([0.0, 0.0, -9.81])
    one = jax.value_and_grad(lambda value: loss(scene, {"rope_EI": value}, down))
    losses, slopes = jax.vmap(one)(EI)
    assert calls == [("value", 5), ("vjp", 5)]
    alone = [one(value) for value in EI]
    assert losses.tolist() == [float(a) for a, _ in alone]
    assert slopes.tolist() == [float(b) for _, b in alone]


def test_numbers_of_32_bits_are_64_inside(scene: sb.Scene) -> None:
    with jax.enable_x64(False):
        x = sj.simulate(scene, TIMES, SOLVER, {"rope_EI": jnp.float32(2e-3)})
        slope = jax.grad(lambda v: (sj.simulate(scene, TIMES, SOLVER, {"rope_EI": v}) ** 2).sum())(jnp.float32(2e-3))
    exact = sb.simulate(scene, TIMES, SOLVER, {"rope_EI": float(np.float32(2e-3))}).positions
    assert x.dtype == slope.dtype == jnp.float32
    assert np.array_equal(x, exact.astype(np.float32))


def test_bad_arguments_are_refused(scene: sb.Scene) -> None:
    with pytest.raises(sb.InputError, match=r"values\.stiffness.*name one of: .*rope_EI"):
        sj.simulate(scene, TIMES, SOLVER, {"stiffness": 1.0})
    with pytest.raises(sb.InputError, match=r"jax\.vmap"):
        sj.simulate(scene, TIMES, SOLVER, {"rope_EI": jnp.ones(3)})
    with pytest.raises(sb.InputError, match=r"inputs\.gravity"):
        sj.simulate(scene, TIMES, SOLVER, inputs={"gravity": jnp.ones(2)})
    with pytest.raises(Exception, match="rope_EI"):
        jax.block_until_ready(sj.simulate(scene, TIMES, SOLVER, {"rope_EI": -1.0}))
