"""What users hold goes through pickle and deepcopy, before and after use, and works on as before."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import sheetbend as sb
from balloons import skin
from test_memory import net

TIMES = np.arange(0, 6) * 1e-2
SOLVER = sb.Solver(h=1e-2)

duplicate = pytest.mark.parametrize(
    "duplicate",
    [copy.deepcopy, *(lambda a, p=p: pickle.loads(pickle.dumps(a, p)) for p in (2, pickle.HIGHEST_PROTOCOL))],
    ids=["deepcopy", "pickle 2", "pickle"],
)
Duplicate = Callable[[Any], Any]


def rope() -> sb.Scene:
    return sb.rope(0.3, 6, density=0.05, EI=1e-3, bend_damping=3e-3, drag_linear=5e-3, clamp_start=(1, 0, 0))


def rod() -> sb.Scene:
    scene = sb.rod(0.3, 6, density=0.05, EI=1e-3, GJ=1e-3, GA=50.0, yield_curvature=1.0, yield_share=0.5)
    scene.pin([0])
    return scene


def cloth() -> sb.Scene:
    mesh = sb.mesh.equilateral(0.3, 0.3, 3)
    scene = sb.Scene("towel")
    held = mesh.sets["corners"][2:]
    made = sb.add_cloth(scene, mesh, density=0.2, warp=60, weft=40, shear=4, poisson=0.2, bending=3e-5)
    scene.pin(made.particles[held])
    scene.add_air(mesh.triangles, 0.6, 0.1, wind=[(1, 0, 0), (0, 1, 0)], times=[0.0, 0.1])
    return scene


def balloon() -> sb.Scene:
    scene, triangles = skin(1, 1.1)
    scene.add_volume(triangles, compliance=1e-6)
    return scene


SCENES = [rope, rod, cloth, net, balloon]


@duplicate
@pytest.mark.parametrize("make", SCENES)
@pytest.mark.parametrize("used", [False, True])
def test_scenes(make: Callable[[], sb.Scene], used: bool, duplicate: Duplicate) -> None:
    scene = make()
    if used:
        sb.simulate(scene, TIMES, SOLVER)
    other = duplicate(scene)
    assert other is not scene and other.quantities == scene.quantities
    one, two = (sb.rollout(s, TIMES, SOLVER) for s in (scene, other))
    assert np.array_equal(one.positions, two.positions)
    assert one.gradient(one.positions).quantities == two.gradient(two.positions).quantities


@duplicate
def test_copies_are_apart(duplicate: Duplicate) -> None:
    scene = rope()
    other = duplicate(scene)
    scene.freeze()
    other.add_point_mass(3, 0.1, "weight")
    assert "weight_mass" not in scene.quantities and not other.frozen


@duplicate
def test_solvers_and_compiled_scenes_of_the_core(duplicate: Duplicate) -> None:
    compiled = cloth().compiled
    other = duplicate(compiled)
    assert other.layout == compiled.layout and np.array_equal(other.inputs(), compiled.inputs())
    for method in ("direct", "newton", "newton_cg", "implicit", "gauss_seidel"):
        solver = sb.Solver(h=1e-2, method=method, integrator="bdf1").core(compiled)
        again = duplicate(solver)
        assert again.blocks == solver.blocks and again.colors == solver.colors
        assert np.array_equal(*(s.states(compiled.inputs(), [0, 3], 0.0) for s in (solver, again)))


@duplicate
def test_trajectories_recordings_and_equilibria(duplicate: Duplicate) -> None:
    scene = rope()
    motion = sb.simulate(scene, TIMES, SOLVER)
    assert np.array_equal(duplicate(motion).positions, motion.positions)
    recording = sb.Recording(motion.positions, TIMES)
    assert np.array_equal(duplicate(recording).positions, recording.positions)
    rest = sb.equilibrium(scene)
    other = duplicate(rest)
    assert np.array_equal(other.positions, rest.positions)
    assert other.gradient(rest.positions) == rest.gradient(rest.positions)


@duplicate
def test_experiments_and_fits(duplicate: Duplicate) -> None:
    truth = rope()
    motion = sb.simulate(truth, TIMES, SOLVER, values={"rope_EI": 1.2e-3})
    recording = sb.Recording(motion.positions, TIMES)
    places = [sb.on_particle(k) for k in range(7)]
    experiment = sb.Experiment(scene=truth, recording=recording, markers=places, solver=SOLVER)
    found = sb.fit(experiment, parameters=["rope_EI"], profiles=False)
    other = duplicate(experiment)
    assert sb.fit(other, parameters=["rope_EI"], profiles=False).values == found.values
    again = duplicate(found)
    assert again.report() == found.report() and again["rope_EI"] == found["rope_EI"]
    assert np.array_equal(again.comparisons[0].simulated, found.comparisons[0].simulated)


@duplicate
def test_modules(duplicate: Duplicate) -> None:
    torch = pytest.importorskip("torch")
    import sheetbend.torch as st

    module = st.SceneModule(rope(), TIMES, SOLVER, learn=["rope_EI"])
    module().sum().backward()
    other = duplicate(module)
    assert torch.equal(other(), module())
    other.zero_grad()
    other().sum().backward()
    assert torch.equal(other.rope_EI.grad, module.rope_EI.grad)
