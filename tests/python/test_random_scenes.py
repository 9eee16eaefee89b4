"""Scenes that hypothesis draws: chains, trees and loops with every constraint, driven, damped and loaded. What holds
for all of them."""

from __future__ import annotations

import numpy as np
import sheetbend as sb
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from pytest import approx
from support import inputs_dot

unhurried = settings(deadline=None, max_examples=30)
FRAMES = [0, 3, 8]


@st.composite
def scenes(draw: st.DrawFn) -> sb.Scene:
    count, seed = draw(st.integers(3, 9)), draw(st.integers(0, 2**16))
    rng = np.random.default_rng(seed)
    scene = sb.Scene("drawn", gravity=rng.uniform(-10, 10, 3))
    parents = [draw(st.integers(max(0, k - 2), k - 1)) for k in range(1, count)]
    x = np.zeros((count, 3))
    for k, parent in enumerate(parents, start=1):
        step = rng.standard_normal(3)
        x[k] = x[parent] + 0.1 * step / np.linalg.norm(step)
    scene.add_particles(x, rng.uniform(0.01, 0.1, count), velocity=rng.uniform(-1, 1, (count, 3)))
    links = [(parent, k) for k, parent in enumerate(parents, start=1)]
    if draw(st.booleans()) and (0, count - 1) not in links:
        links.append((0, count - 1))  # closes a loop
    each = rng.uniform(1e-5, 1e-3, len(links))
    scene.add_constraints("distance", links, name="links", compliance=each, damping=draw(st.sampled_from([None, 0.1])))
    grandparents = [(parents[parents[k - 1] - 1], parents[k - 1], k) for k in range(2, count) if parents[k - 1] > 0]
    joints = [g for g in grandparents if _open(x, g)]
    kind = draw(st.sampled_from(["none", "bend", "planar_bend", "hinge"]))
    if joints and kind == "hinge":
        scene.add_constraints("hinge", joints, name="joints", viscosity=1e-4, normal=(0, 1, 0))
    elif joints and kind != "none":
        normal = (0, 1, 0) if kind == "planar_bend" else None
        scene.add_constraints(
            kind, joints, name="joints", compliance=50.0, damping=draw(st.sampled_from([None, 1e-4])), normal=normal
        )
    held = draw(st.sampled_from(["pinned", "driven", "free"]))
    if held == "pinned":
        scene.pin([0])
    elif held == "driven":
        knots = x[:1] + 0.01 * rng.standard_normal((4, 1, 3))
        scene.drive([0], [0.0, 0.01, 0.02, 0.05], knots)
    if draw(st.booleans()):
        scene.add_force([count - 1], 0.1 * rng.standard_normal((2, 1, 3)), times=[0.0, 0.03])
    if draw(st.booleans()):
        scene.set_drag(linear=0.01, quadratic=0.02)
    return scene


def _open(x: np.ndarray, joint: tuple[int, int, int]) -> bool:
    """Whether two links do not nearly fold back on each other, where curvature has no bound."""
    first, second = x[joint[1]] - x[joint[0]], x[joint[2]] - x[joint[1]]
    return bool(first @ second > -0.5 * np.linalg.norm(first) * np.linalg.norm(second))


solvers = st.builds(
    sb.Solver,
    h=st.sampled_from([1 / 400, 1 / 1000]),
    integrator=st.sampled_from(["bdf1", "bdf2"]),
    method=st.sampled_from(["direct", "gauss_seidel"]),
    iterations=st.integers(1, 4),
)


@unhurried
@given(scenes(), solvers, st.integers(0, 99))
def test_adjoint_and_tangents_are_transposes(scene, solver, seed):
    """<w, J v> = <J' w, v> over all inputs at once."""
    compiled, core = scene.compiled, solver.core(scene.compiled)
    rng, inputs = np.random.default_rng(seed), compiled.inputs()
    v = rng.standard_normal(len(inputs)) * np.maximum(np.abs(inputs), 1e-3 * (inputs != 0.0))
    out, x_dot = core.jvp(inputs, v[None], FRAMES, 0.0)
    assume(np.isfinite(out).all())
    w = rng.standard_normal((len(FRAMES), 3 * scene.node_count))
    bar = core.vjp(inputs, core.record(inputs, FRAMES, 0.0)[1], FRAMES, w, 0.0)
    forward, reverse = float((x_dot[0].reshape(w.shape) * w).sum()), float(bar @ v)
    size = float(np.abs(x_dot[0].reshape(w.shape) * w).sum() + np.abs(bar * v).sum())
    assert forward == approx(reverse, abs=1e-11 * size)


@unhurried
@given(scenes(), solvers)
def test_bits_do_not_depend_on_threads_or_tape(scene, solver):
    core, inputs = solver.core(scene.compiled), scene.compiled.inputs()
    alone = core.simulate(inputs, FRAMES, 0.0)["positions"]
    again = sb.Solver(
        h=solver.h, integrator=solver.integrator, method=solver.method, iterations=solver.iterations, threads=3, grain=1
    )
    assert np.array_equal(alone, again.core(scene.compiled).simulate(inputs, FRAMES, 0.0)["positions"])
    zero = inputs_dot(scene, {"gravity": np.zeros(3)})
    assert np.array_equal(alone.ravel(), np.ravel(core.jvp(inputs, zero[None], FRAMES, 0.0)[0]))


@unhurried
@given(scenes(), solvers, st.tuples(*[st.floats(-5, 5)] * 3))
def test_a_moved_scene_moves_alike(scene, solver, shift):
    inputs, layout = scene.compiled.inputs(), scene.compiled.layout
    moved = inputs.copy()
    for name in ("position", "boundary"):
        offset, size = layout[name]
        moved[offset : offset + size] += np.tile(shift, size // 3)
    core = solver.core(scene.compiled)
    here, there = (core.simulate(i, FRAMES, 0.0)["positions"].reshape(-1, 3) for i in (inputs, moved))
    assert there - shift == approx(here, abs=1e-9)


@unhurried
@given(st.data())
def test_a_wrong_number_anywhere_is_refused_by_name(data):
    """One entry of one argument that is not finite, or negative where it must not be."""
    bad = data.draw(st.sampled_from([np.nan, np.inf, -np.inf]))
    field = data.draw(
        st.sampled_from(["positions", "mass", "velocity", "compliance", "damping", "rest", "gravity", "forces"])
    )
    count = data.draw(st.integers(2, 6))

    def numbers(name: str, shape: tuple[int, ...]) -> np.ndarray:
        values = np.random.default_rng(0).uniform(0.1, 1.0, shape)
        if name == field:
            values[np.unravel_index(data.draw(st.integers(0, values.size - 1)), shape)] = bad
        return values

    try:
        scene = sb.Scene("drawn", gravity=numbers("gravity", (3,)))
        scene.add_particles(
            numbers("positions", (count, 3)), numbers("mass", (count,)), velocity=numbers("velocity", (count, 3))
        )
        links = [(k, k + 1) for k in range(count - 1)]
        each = {name: numbers(name, (count - 1,)) for name in ("compliance", "damping", "rest")}
        scene.add_constraints("distance", links, name="links", **each)
        scene.add_force([0], numbers("forces", (1, 1, 3)))
        refused = None
    except sb.SceneError as error:
        refused = error
    assert refused is not None and field in refused.field and "Fix: " in str(refused)
