"""sheetbend.torch.Stepper: the bits of a rollout, exact reverse and tangents, batches in lanes, copies and workers.

A chain of single substeps is differentiated by another path than a rollout, whose gradients stand against the complex
step elsewhere: the two agree to 1e-11 of the largest. Tangents against differences 1e-6, against the reverse 1e-11.
"""

from __future__ import annotations

import copy
import io
import pickle

import numpy as np
import pytest
import sheetbend as sb
import torch
from sheetbend.torch import State, Stepper, simulate
from torch.func import grad, jacrev, jvp, vmap
from torch.utils.data import DataLoader

COUNT = 40
SOLVER = sb.Solver(h=1 / 200)


def rope(knots: int = 0) -> sb.Scene:
    scene = sb.Scene("rope")
    made = sb.add_rope(scene, length=0.5, segments=6, density=0.05, EI=1e-2, bend_damping=0.02, drag_linear=0.02)
    scene.pin(made.particles[:1])
    tip = made.particles[-1:]
    times = np.arange(max(knots, 1)) / 200
    scene.add_force(tip, np.full((len(times), 1, 3), 0.01) * np.sin(9 * times)[:, None, None], times)
    return scene


def cloth() -> sb.Scene:
    scene = sb.Scene("cloth")
    made = sb.add_cloth(scene, sb.mesh.equilateral(0.2, 0.2, 3), density=0.2, warp=50, weft=40, shear=10, bending=1e-5)
    scene.pin(made.particles[:1])
    return scene


def tossed() -> sb.Scene:
    scene = sb.Scene("toss")
    scene.add_body(of=sb.Inertia.box(1.0, (0.1, 0.2, 0.3)), spin=(0.5, 5.0, 0.3), keep_spin=True)
    return scene


def ball() -> sb.Scene:
    scene = sb.Scene("ball")
    scene.add_particles([[0.0, 0.0, 0.03]], 0.1, [[1.0, 0.0, -1.0]])
    scene.add_contact([0], sb.Plane(name="table"), friction=0.1, restitution=0.7)
    return scene


def landing() -> sb.Scene:
    scene = sb.rope(0.2, 5, density=0.05, EA=200.0, EI=1e-4, start=(0, 0, 0.006))
    scene.add_contact(scene.ropes["rope"], sb.Plane(name="table"), friction=0.3, radius=0.005)
    return scene


CASES = {
    "rope": (rope, SOLVER),
    "rope, bdf1": (rope, sb.Solver(h=1 / 200, integrator="bdf1")),
    "rope, sweeps": (rope, sb.Solver(h=1 / 200, method="gauss_seidel", iterations=5)),
    "cloth": (cloth, sb.Solver(h=1 / 200, method="newton")),
    "body": (tossed, SOLVER),
    "ball": (ball, sb.Solver(h=1 / 240, method="implicit")),
    "landing": (landing, sb.Solver(h=1 / 240, method="implicit")),
}


def chain(stepper: Stepper, count: int, inputs: torch.Tensor | None = None) -> list[State]:
    states = [stepper.start(inputs)]
    for _ in range(count):
        states.append(stepper(states[-1], inputs))
    return states


def alike(found: torch.Tensor, expected: torch.Tensor, bound: float = 1e-11) -> None:
    assert float((found - expected).abs().max()) <= bound * float(expected.abs().max())
    assert float(expected.abs().max()) > 0


@pytest.mark.parametrize("case", CASES)
def test_substeps_have_the_bits_and_the_gradients_of_a_rollout(case: str) -> None:
    make, solver = CASES[case]
    scene = make()
    stepper = Stepper(scene, solver)
    flat = stepper.inputs().requires_grad_()
    states = chain(stepper, COUNT, flat)
    times = np.arange(COUNT + 1) * solver.h
    expected = sb.simulate(scene, times, solver)
    assert np.array_equal(torch.stack([s.positions for s in states]).detach(), expected.positions)
    assert np.array_equal(torch.stack([s.velocities for s in states]).detach(), expected.velocities)
    assert int(states[-1].substep) == COUNT
    weights = torch.from_numpy(np.random.default_rng(0).standard_normal(expected.positions.shape))
    (found,) = torch.autograd.grad(sum((w * s.positions).sum() for w, s in zip(weights, states, strict=True)), flat)
    inputs = scene.compiled.inputs()
    own = {name: inputs[o : o + n] for name, (o, n) in scene.compiled.given.items()}
    shapes = {"gravity": (3,), "position": (-1, 3), "mass": (-1,), "velocity": (-1, 3)}
    given = {n: torch.from_numpy(own[n].reshape(shape)).requires_grad_() for n, shape in shapes.items()}
    (weights * simulate(scene, times, solver, inputs=given)).sum().backward()
    for name, tensor in given.items():
        offset, size = scene.compiled.given[name]
        if size and (case not in ("ball", "body") or name != "mass"):  # these move alike whatever their mass
            alike(found[offset : offset + size], tensor.grad.reshape(-1))


def test_a_thousand_substeps_have_the_bits_of_one_rollout() -> None:
    solver = sb.Solver(h=1 / 200)
    scene = rope(knots=1001)
    expected = sb.simulate(scene, [0.0, 5.0], solver)
    last = chain(Stepper(scene, solver), 1000)[-1]
    assert np.array_equal(last.positions, expected.positions[-1])
    assert np.array_equal(last.velocities, expected.velocities[-1])


def test_forces_given_for_substeps_are_those_of_knots() -> None:
    solver, count = sb.Solver(h=1 / 200), 30
    scene = rope(knots=count + 1)
    knots = torch.from_numpy(np.array(scene.base_arrays()["force"])).requires_grad_()
    x = simulate(scene, [0.0, count / 200], solver, inputs={"force": knots})[-1]
    (expected,) = torch.autograd.grad(x[-1, 1], knots)
    given = knots.detach().clone().requires_grad_()
    stepper = Stepper(rope(), solver)
    state = stepper.start()
    for k in range(1, count + 1):
        state = stepper(state, force=given[k])
    assert torch.equal(state.positions, x)
    (found,) = torch.autograd.grad(state.positions[-1, 1], given)
    alike(found, expected)


def test_driven_particles_go_where_they_are_put() -> None:
    scene = sb.rope(0.3, 4, density=0.05, EI=1e-3, pinned=())
    scene.drive([0], [0.0, 1.0], np.array([[[0.0, 0.0, 0.0]], [[0.0, 0.0, 0.1]]]))
    stepper = Stepper(scene, sb.Solver(h=1 / 100))
    place = torch.tensor([[0.01, 0.02, 0.03]], dtype=torch.float64, requires_grad=True)
    after = stepper(stepper(stepper.start(), boundary=place), boundary=place)
    assert torch.equal(after.positions[0], place[0])
    step = 1e-6
    (found,) = torch.autograd.grad(after.positions[2, 2], place)
    moved = [
        stepper(stepper(stepper.start(), boundary=p), boundary=p).positions[2, 2].item()
        for p in (place.detach() + s * torch.eye(3, dtype=torch.float64)[2] for s in (step, -step))
    ]
    assert found[0, 2].item() == pytest.approx((moved[0] - moved[1]) / (2 * step), rel=1e-7)


@pytest.mark.parametrize("case", ["rope", "ball"])
def test_tangents_are_those_of_the_reverse_and_of_differences(case: str) -> None:
    make, solver = CASES[case]
    stepper = Stepper(make(), solver)
    state, flat = chain(stepper, 13 if case == "ball" else 5)[-1], stepper.inputs()
    rng = np.random.default_rng(1)

    def after(numbers: torch.Tensor, inputs: torch.Tensor) -> torch.Tensor:
        return stepper(State(numbers), inputs).numbers

    along = [torch.from_numpy(rng.standard_normal(len(t))) * t.abs().clamp(min=1e-2) for t in (state.numbers, flat)]
    along[0][-2:] = 0
    value, tangent = jvp(after, (state.numbers, flat), tuple(along))
    assert torch.equal(value, after(state.numbers, flat))
    step = 1e-6
    plus, minus = (after(state.numbers + s * along[0], flat + s * along[1]) for s in (step, -step))
    alike(tangent, (plus - minus) / (2 * step), 1e-6)
    weights = torch.from_numpy(rng.standard_normal(len(value)))
    weights[-2:] = 0
    bars = grad(lambda n, i: weights @ after(n, i), argnums=(0, 1))(state.numbers, flat)
    expected = sum(float(bar @ dot) for bar, dot in zip(bars, along, strict=True))
    assert float(weights @ tangent) == pytest.approx(expected, rel=1e-11)


@pytest.mark.parametrize("case", ["rope", "ball"])
def test_a_batch_has_the_bits_of_each_alone_whatever_substeps_they_are_at(case: str) -> None:
    make, solver = CASES[case]
    stepper = Stepper(make(), solver)
    states = chain(stepper, 14)
    batch = State.stack([states[k] for k in (0, 3, 3, 7, 13, 12, 0, 1, 2, 3, 3, 3, 3, 3, 3, 3, 3, 3)])
    pull = torch.linspace(0.5, 1.0, len(batch), dtype=torch.float64)[:, None] * torch.tensor([0.0, 0.0, -9.81])
    numbers, pull = batch.numbers.clone().requires_grad_(), pull.double().requires_grad_()
    after = stepper(State(numbers), gravity=pull)
    bars = torch.autograd.grad(after.velocities.square().sum(), (numbers, pull))
    for k in range(len(batch)):
        own, g = numbers[k].detach().requires_grad_(), pull[k].detach().requires_grad_()
        alone = stepper(State(own), gravity=g)
        assert torch.equal(alone.numbers, after.numbers[k])
        for one, every in zip(torch.autograd.grad(alone.velocities.square().sum(), (own, g)), bars, strict=True):
            assert torch.equal(one, every[k])


def test_transforms_of_torch_func() -> None:
    stepper = Stepper(rope(), SOLVER)
    states = State.stack(chain(stepper, 3))

    def height(state: State, pull: torch.Tensor) -> torch.Tensor:
        return stepper(state, gravity=pull).positions[:, 2]

    pull = torch.tensor([0.0, 0.1, -9.81], dtype=torch.float64)
    rows = vmap(jacrev(height, argnums=1), in_dims=(0, None))(states, pull)
    for k in range(len(states)):
        one = torch.autograd.functional.jacobian(lambda g, k=k: height(states[k], g), pull)
        alike(rows[k], one, 1e-14)
    with pytest.raises(NotImplementedError, match="second derivatives"):
        torch.func.hessian(lambda g: height(states[0], g).sum())(pull)


def test_masses_may_change_between_substeps() -> None:
    """What a rollout computes once, and keeps, follows the inputs of each substep."""
    scene = sb.rope(0.5, 6, density=0.05, EI=1e-2, pinned=(0,))
    stepper = Stepper(scene, sb.Solver(h=1 / 200))
    light, heavy = (stepper.inputs({"rope_density": v}) for v in (0.05, 0.5))
    state = chain(stepper, 4, light)[-1]
    fresh = Stepper(scene, sb.Solver(h=1 / 200))
    assert torch.equal(stepper(state, heavy).numbers, fresh(state, heavy).numbers)
    assert not torch.equal(stepper(state, heavy).numbers, stepper(state, light).numbers)


def test_numbers_of_32_bits_are_64_inside() -> None:
    make, solver = CASES["rope"]
    scene = make()
    stepper, double = Stepper(scene, solver, dtype=torch.float32), Stepper(scene, solver)
    force = torch.tensor([[0.1, 0.0, 0.0]], dtype=torch.float32, requires_grad=True)
    state, exact = stepper.start(), double.start()
    for _ in range(5):
        state, exact = stepper(state, force=force), double(exact, force=force.detach().double())
    assert state.positions.dtype == state.velocities.dtype == torch.float32
    assert torch.equal(state.numbers, exact.numbers)
    state.positions.sum().backward()
    assert force.grad.dtype == torch.float32 and float(force.grad.abs().max()) > 0


class Motions(torch.utils.data.Dataset):
    def __init__(self, stepper: Stepper) -> None:
        self.stepper = stepper

    def __len__(self) -> int:
        return 4

    def __getitem__(self, k: int) -> State:
        return chain(self.stepper, k)[-1]


def test_copies_files_and_workers() -> None:
    make, solver = CASES["rope"]
    stepper = Stepper(make(), solver)
    state = chain(stepper, 4)[-1]
    expected = stepper(state).numbers
    for again in (copy.deepcopy(stepper), pickle.loads(pickle.dumps(stepper))):
        assert torch.equal(again(copy.deepcopy(state)).numbers, expected)
    file = io.BytesIO()
    torch.save(state, file)
    file.seek(0)
    assert torch.equal(stepper(torch.load(file)).numbers, expected)
    with pytest.raises(sb.InputError, match="do not make a batch"):
        State.stack([])
    (batch,) = DataLoader(Motions(stepper), batch_size=4, num_workers=1)
    assert f"{batch}" == f"State(batch=(4,), particles={stepper.scene.particle_count}, dtype=torch.float64)"
    assert torch.equal(batch.numbers, torch.stack([s.numbers for s in chain(stepper, 3)]))


def test_bad_arguments_are_refused() -> None:
    stepper = Stepper(rope(), SOLVER)
    state = stepper.start()
    with pytest.raises(sb.InputError, match="push"):
        stepper(state, push=torch.zeros(3))
    with pytest.raises(sb.InputError, match="right shape"):
        stepper(state, force=torch.zeros(2, 3))
    with pytest.raises(sb.InputError, match="is not a State"):
        stepper(state.positions)
    with pytest.raises(sb.InputError, match="position"):
        stepper(state, position=state.positions)
    with pytest.raises(sb.InputError, match="another scene"):
        stepper(State(torch.zeros(7, dtype=torch.float64)))
    with pytest.raises(sb.InputError, match=r"Stepper\.inputs"):
        stepper(state, torch.zeros(3, dtype=torch.float64))
    with pytest.raises(sb.InputError, match="mass"):
        stepper(state, mass=torch.full((stepper.scene.particle_count,), -1.0, dtype=torch.float64))
    with pytest.raises(sb.InputError, match="floating"):
        Stepper(stepper.scene, dtype=torch.int32)
    with pytest.raises(sb.DivergenceError):
        stepper(State(torch.full_like(state.numbers, 1e200)))


def test_an_array_that_the_scene_lacks_is_refused_with_what_gives_it_one() -> None:
    scene = sb.rope(0.5, 10, density=0.05, EI=1e-3, pinned=(0,))
    stepper = Stepper(scene, sb.Solver(h=1 / 200))
    state = stepper.start()
    with pytest.raises(sb.InputError, match=r"force: cannot be given .*call scene\.add_force\(part"):
        stepper(state, force=torch.zeros(11, 3))
    with pytest.raises(sb.InputError, match=r"inputs\.force: is not an input array .*call scene\.add_force"):
        simulate(scene, [0.1], sb.Solver(h=1 / 200), inputs={"force": torch.zeros(1, 11, 3)})
    with pytest.raises(sb.InputError, match=r"forces: cannot be given .*give some of: mass"):
        stepper(state, forces=torch.zeros(11, 3))
