"""Forward mode and second derivatives of batches: one call of the core, and each scene has the bits that it has alone.

Tangents stand against the complex step, too (1e-12 of the largest). Second derivatives stand against differences in
test_torch.py and test_torch_lengths.py.
"""

from __future__ import annotations

import _thread
import threading
import time
from collections.abc import Callable

import numpy as np
import pytest
import sheetbend as sb
import sheetbend.torch as st
import torch
from sheetbend.motion.rollouts import Rollouts
from torch.func import functional_call, grad, hessian, jacfwd, jvp, vmap

TIMES, STEPS = np.arange(5) / 50, [0, 4, 8, 12, 16]
SCENE_OF = [0, 1, 2, 0, 0, 3, 0, 0, 0, 1, 0, 0, 0]  # nine tangents of one scene: a full rollout and one of another
LENGTHS = [5, 2, 5, 1, 5, 4, 3, 3, 5, 5, 2, 5, 5]
Array, Tensor = np.ndarray, torch.Tensor
threads = pytest.mark.parametrize("threads", [1, 2])


def solver(threads: int) -> sb.Solver:
    return sb.Solver(h=1 / 200, threads=threads)


@pytest.fixture(scope="module")
def scene() -> sb.Scene:
    scene = sb.Scene("rope")
    rope = sb.add_rope(scene, length=0.6, segments=5, density=0.05, EI=1e-2, bend_damping=0.02)
    scene.pin(rope.particles[:1])
    return scene.freeze()


@pytest.fixture(scope="module")
def batch(scene: sb.Scene) -> tuple[Array, ...]:
    """Inputs, their directions, cotangents of the states and their tangents; some scenes of it are equal."""
    rng = np.random.default_rng(0)
    inputs = scene.compiled.inputs()
    distinct = inputs * (1.0 + 1e-2 * rng.standard_normal((4, len(inputs))))
    directions = np.maximum(abs(inputs), 1e-3) * rng.standard_normal((len(SCENE_OF), len(inputs)))
    bars = (rng.standard_normal((len(SCENE_OF), len(STEPS), scene.compiled.core.dofs)) for _ in range(2))
    return distinct[SCENE_OF], directions, *bars


def rollouts(scene: sb.Scene, threads: int, lengths: Array | None = None) -> Rollouts:
    s = solver(threads)
    return Rollouts(scene, s.core(scene.compiled), STEPS, False, s, lengths)


@threads
def test_tangents_have_the_bits_of_each_alone(scene: sb.Scene, batch: tuple[Array, ...], threads: int) -> None:
    inputs, directions, *_ = batch
    together, core = rollouts(scene, threads).jvp(inputs, directions), solver(1).core(scene.compiled)
    for k, (own, along) in enumerate(zip(inputs, directions, strict=True)):
        assert np.array_equal(together[k], core.jvp(own, along[None], STEPS, 0.0)[1][0])
        step = core.complex_step(own, along, STEPS, 0.0)
        assert abs(together[k] - step).max() < 1e-12 * abs(step).max()


@threads
def test_second_derivatives_have_the_bits_of_each_alone(
    scene: sb.Scene, batch: tuple[Array, ...], threads: int
) -> None:
    together, alone = rollouts(scene, threads).vjp_dot(*batch), rollouts(scene, 1)
    for k in range(len(SCENE_OF)):
        assert np.array_equal(together[k], alone.vjp_dot(*(array[k : k + 1] for array in batch))[0])
    # Second derivatives are symmetric, and the gradient is linear in the cotangent: both by other entries of the core.
    inputs, directions, bar, bar_dot = batch
    still = np.zeros_like(bar)
    other = np.roll(directions, 1, axis=0)
    crossed = alone.vjp_dot(inputs, other, bar, still)
    straight = alone.vjp_dot(inputs, directions, bar, still)
    np.testing.assert_allclose((straight * other).sum(1), (crossed * directions).sum(1), rtol=1e-9)
    by_bar = alone.vjp(inputs, bar_dot)
    assert abs(together - straight - by_bar).max() < 1e-12 * abs(by_bar).max()


@threads
def test_scenes_of_different_length(scene: sb.Scene, batch: tuple[Array, ...], threads: int) -> None:
    inputs, directions, bar, bar_dot = batch
    ragged = rollouts(scene, threads, np.array(LENGTHS))
    tangents, second = ragged.jvp(inputs, directions), ragged.vjp_dot(*batch)
    core = solver(1).core(scene.compiled)
    for k, frames in enumerate(LENGTHS):
        own = STEPS[:frames]
        assert np.array_equal(tangents[k, :frames], core.jvp(inputs[k], directions[k][None], own, 0.0)[1][0])
        assert not tangents[k, frames:].any()
        bars = bar[k, :frames], bar_dot[k, :frames]
        assert np.array_equal(second[k], core.vjp_dot_batch(inputs[k], directions[k], own, *bars, 0.0)[0])


@threads
def test_transforms_are_a_loop(scene: sb.Scene, threads: int) -> None:
    """Through arrays, which torch cuts and joins without rounding: the same bits."""
    rng = np.random.default_rng(1)
    velocities, along, weights = (torch.tensor(rng.standard_normal((9, 6, 3))) for _ in range(3))
    weights = torch.stack([weights[0]] * len(TIMES))

    def positions(velocity: Tensor) -> Tensor:
        return st.simulate(scene, TIMES, solver(threads), inputs={"velocity": velocity})

    def loss(velocity: Tensor) -> Tensor:
        return (weights * positions(velocity).square()).sum()

    def tangent(velocity: Tensor, direction: Tensor) -> Tensor:
        return jvp(positions, (velocity,), (direction,))[1]

    def second(velocity: Tensor, direction: Tensor) -> Tensor:
        return jvp(grad(loss), (velocity,), (direction,))[1]

    for f in (tangent, second):
        looped = torch.stack([f(u, v) for u, v in zip(velocities, along, strict=True)])
        assert torch.equal(vmap(f)(velocities, along), looped)
    assert torch.equal(tangent(velocities, along), vmap(tangent)(velocities, along))
    for transform in (jacfwd(positions), hessian(loss)):
        looped = torch.stack([transform(u) for u in velocities[:2]])
        assert torch.equal(vmap(transform)(velocities[:2]), looped)


@threads
def test_a_module_in_forward_mode(scene: sb.Scene, threads: int) -> None:
    module = st.SceneModule(scene, TIMES, solver(threads), learn=["rope_EI", "rope_bend_damping"])
    densities = torch.linspace(0.04, 0.06, 3, dtype=torch.float64)
    stored = {name: p.detach() for name, p in module.named_parameters()}
    one = {name: torch.ones_like(p) for name, p in stored.items()}

    def moved(density: Tensor) -> tuple[Tensor, Tensor]:
        return jvp(lambda p: functional_call(module, p, kwargs={"rope_density": density}), (stored,), (one,))

    positions, tangents = moved(densities)
    for k, density in enumerate(densities):
        alone = moved(density)
        assert torch.equal(positions[k], alone[0])
        assert (tangents[k] - alone[1]).abs().max() < 1e-13 * alone[1].abs().max()


@threads
def test_one_scene_that_diverges_is_told(scene: sb.Scene, batch: tuple[Array, ...], threads: int) -> None:
    inputs = batch[0].copy()
    offset, size = scene.compiled.layout["velocity"]
    inputs[7, offset : offset + size] = 1e200
    both: list[Callable[[], Array]] = [
        lambda: rollouts(scene, threads).jvp(inputs, batch[1]),
        lambda: rollouts(scene, threads).vjp_dot(inputs, *batch[1:]),
        lambda: rollouts(scene, threads).value(inputs),
    ]
    told = []
    for derivative in both:
        with pytest.raises(sb.DivergenceError, match="rope") as caught:
            derivative()
        told.append((caught.value.substep, caught.value.particle))
    assert told == [told[-1]] * 3


@pytest.mark.parametrize("entry", ["jvp_batch", "vjp_dot_batch"])
def test_wrong_sizes_are_named(scene: sb.Scene, batch: tuple[Array, ...], entry: str) -> None:
    core = solver(1).core(scene.compiled)
    inputs, directions, *bars = batch
    rest = [] if entry == "jvp_batch" else bars

    def call(directions: Array, rest: list[Array], lengths: list[int]) -> None:
        getattr(core, entry)(inputs, directions, STEPS, *rest, 0.0, lengths=lengths)

    with pytest.raises(ValueError, match="inputs_dot: got"):
        call(directions[:-1], rest, [])
    for k, name in enumerate(["x_bar", "x_bar_dot"][: len(rest)]):
        with pytest.raises(ValueError, match=f"{name}: got"):
            call(directions, [bar[: len(bar) - (j == k)] for j, bar in enumerate(rest)], [])
    for lengths in ([5], [0] * len(inputs), [6] * len(inputs)):
        with pytest.raises(ValueError, match="lengths: got"):
            call(directions, rest, lengths)


@threads
@pytest.mark.parametrize("entry", ["jvp", "vjp_dot"])
def test_ctrl_c_stops_a_batch(scene: sb.Scene, batch: tuple[Array, ...], entry: str, threads: int) -> None:
    """It would take minutes: 1,300 scenes of 16,000 substeps."""
    many = [np.concatenate([array] * 100) for array in batch[: 2 if entry == "jvp" else 4]]
    many[0] *= 1.0 + 1e-9 * np.arange(len(many[0]))[:, None]  # no two of them share a rollout
    core = solver(threads).core(scene.compiled)
    timer = threading.Timer(0.3, _thread.interrupt_main)
    timer.start()
    begin = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        getattr(core, f"{entry}_batch")(many[0], many[1], [1000 * step for step in STEPS], *many[2:], 0.0)
    assert time.monotonic() - begin < 20.0
