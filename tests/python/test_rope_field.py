"""Stiffness that varies smoothly along a rope or a rod: its modes, and fits of them under a prior."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sheetbend as sb
import tomli_w
from sheetbend.cli.figures import figure_files
from sheetbend.config import load
from sheetbend.experiment.wanted import as_parameters
from sheetbend.objects.stiffness_field import StiffnessField
from sheetbend.problem.problem import FitProblem
from sheetbend.problem.smooth import with_fields
from support import expect_modes_scale

LENGTH, NOISE = 0.4, 5e-4
SOLVER, TIMES = sb.Solver(h=1 / 300), np.arange(31) / 60


def hung(modes: int, segments: int = 20, **more: Any) -> sb.Scene:
    """A rope that is clamped at one end and falls."""
    own = {"density": 0.05, "EI": 1e-3, "bend_damping": 0.02, "drag_linear": 0.02, "clamp_start": (1.0, 0.0, 0.0)}
    return sb.rope(LENGTH, segments, pinned=(), softness_modes=range(1, modes + 1), **(own | more))


def field_of(scene: sb.Scene) -> StiffnessField:
    (rope,) = scene.ropes.values()
    assert rope.field is not None
    return rope.field


def seen(q: np.ndarray, modes: int) -> sb.Experiment:
    """A rope whose EI has the amplitudes q of its first modes, to be explained with others."""
    scene = hung(len(q))
    values = dict(zip(field_of(scene).modes, q, strict=True))
    x = sb.simulate(scene, TIMES, SOLVER, values=values).positions
    x = x + NOISE * np.random.default_rng(0).standard_normal(x.shape)
    places, recording = [sb.on_particle(i) for i in range(21)], sb.Recording(x, TIMES, name="fall")
    return sb.Experiment(scene=hung(modes), recording=recording, markers=places, solver=SOLVER, sigma=NOISE)


def test_modes_scale_the_joints_of_a_rope() -> None:
    scene, q = hung(3), np.array([0.3, -0.2, 0.1])
    field = field_of(scene)
    s = np.concatenate([[0.0], np.arange(1, 20) / 20])  # the clamp and the inner nodes
    assert np.exp(field.shapes @ q) == pytest.approx(np.exp(-np.cos(np.pi * np.outer(s, [1, 2, 3])) @ q))
    assert field.centers[:, 0] == pytest.approx(LENGTH * s)
    expect_modes_scale(scene, field, q, "rope_bend")


def test_the_prior_is_a_field_of_the_given_size_and_length() -> None:
    """In one direction the correlation of Matern's field is (1 + r/l) exp(-r/l), far from the ends."""
    field, size, length = field_of(hung(398, segments=400)), 0.3, 0.02
    sd = field.deviations(size, length)
    covariance = (field.shapes * sd**2) @ field.shapes.T
    assert np.mean(np.diag(covariance)) == pytest.approx(size**2, rel=0.01)
    constant = 0.5 * (sd[0] * (1.0 + length**2 * field.eigenvalues[1])) ** 2  # of the mean stiffness
    r = LENGTH / 400 * np.arange(60)
    found = covariance[200, 200:260] + constant
    assert found / found[0] == pytest.approx((1 + r / length) * np.exp(-r / length), abs=0.01)


def test_a_rope_and_a_rod_have_the_same_modes() -> None:
    way = sb.Grip.fixed((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    own = {"density": 0.05, "EI": 1e-3, "softness_modes": (1, 2)}
    stiff = sb.rod(LENGTH, 20, GJ=1e-3, start=way, points=[[0, 0, 0], [LENGTH, 0, 0]], **own)
    rod, rope = field_of(stiff), field_of(hung(2))
    assert rod.shapes == pytest.approx(rope.shapes) and rod.eigenvalues == pytest.approx(rope.eigenvalues)
    values = {"softness_1": 0.3, "softness_2": -0.2}
    x = [
        sb.simulate(scene, TIMES, SOLVER, values={f"{name}_{k}": v for k, v in values.items()}).positions
        for name, scene in (("rod", stiff), ("rope", hung(2, bend_damping=None, drag_linear=None)))
    ]
    assert np.abs(x[0] - x[1]).max() < 0.02 * np.ptp(x[1])
    some = sb.rod(LENGTH, 20, GJ=1e-3, density=0.05, EI=1e-3, start=way, softness_modes=(0, 2))
    assert some.ropes["rod"].field is None


def test_the_jacobian_is_that_of_differences() -> None:
    e = seen(np.array([0.3, -0.2, 0.1]), 3)
    problem = FitProblem([e], as_parameters(["rope_EI", *field_of(e.scene).modes], [e]))
    u = problem.parameters.initial() + 0.1
    _, _, J = problem.evaluate(u)
    for k in range(4):
        step = 1e-5 * np.eye(4)[k]
        after, before = (problem.evaluate(u + s * step, jacobian=False)[1] for s in (1, -1))
        assert (after - before) / 2e-5 == pytest.approx(J[:, k], abs=1e-5 * np.abs(J[:, k]).max())


def test_a_field_along_a_rope_is_found() -> None:
    whole = field_of(hung(19))
    q = whole.deviations(0.3, 0.1) * np.random.default_rng(5).standard_normal(19)
    lnE = np.log(1e-3) + whole.shapes @ q
    few = {"refine": False, "profiles": False, "beginnings": False}
    e = seen(q, 12)
    fit = sb.fit(e, parameters=["rope_EI", "rope_bend_damping"], smooth={"rope_softness": sb.Smooth()}, **few)
    (found,) = fit.result.fields
    off = np.abs(np.log(found.stiffness) - lnE)
    assert (off < found.half_widths).sum() >= 18  # of 20
    assert np.mean(off) < 0.5 * np.std(lnE) and (found.unit, found.place) == ("N m^2", "joint")
    assert found.size_lower is not None and found.size_lower < 0.3
    assert found.size_upper is None or found.size_upper > 0.3
    assert "Stiffness of the joints: rope_softness" in fit.report()
    panel = sb.plot.along(found)
    assert panel.lines[0].get_ydata() == pytest.approx(np.array(found.stiffness))
    uniform = sb.fit(e, parameters=["rope_EI", "rope_bend_damping"], **few)
    assert uniform.result.misfit is not None and fit.result.misfit is not None
    assert uniform.result.misfit.reduced_chi_square > 1.2 > fit.result.misfit.reduced_chi_square


def test_what_makes_no_field_is_refused() -> None:
    for modes, more, words in (
        (20, {}, r"rope.softness_modes: are more than the joints tell apart.*at most 19"),
        (2, {"EI": None, "bend_damping": None}, r"rope.softness_modes: need EI"),
    ):
        with pytest.raises(sb.SceneError, match=words):
            hung(modes, **more)
    with pytest.raises(sb.SceneError, match=r"rope.softness_modes: must be whole numbers"):
        sb.rope(LENGTH, 20, density=0.05, EI=1e-3, softness_modes=(1, 1))
    with pytest.raises(sb.SceneError, match=r"rope.softness_modes: need EI"):
        sb.rope(LENGTH, 20, density=0.05, softness_modes=3)  # type: ignore[arg-type]
    e = seen(np.zeros(1), 0)
    with pytest.raises(sb.InputError, match=r"smooth.rope_softness: names no field.*softness_modes from 1 on"):
        with_fields(as_parameters(["rope_EI"], [e]), [e], {"rope_softness": sb.Smooth()})


def test_a_configuration_fits_a_field(tmp_path: Path) -> None:
    seen(np.array([0.3, 0.1]), 2).recording.save(tmp_path / "fall.npz")
    rope = {"name": "rope", "length": LENGTH, "segments": 20, "density": 0.05, "EI": 1e-3, "bend_damping": 0.02}
    rope |= {"drag_linear": 0.02, "clamp_start": [1.0, 0.0, 0.0], "softness_modes": [1, 2]}
    config: dict[str, Any] = {
        "experiment": {"name": "uneven"},
        "solver": {"h": 1 / 300},
        "scene": {"rope": [rope]},
        "marker": [{"marker": f"m{k}", "particle": f"rope:{k}"} for k in range(21)],
        "recording": [{"file": "fall.npz", "sigma": NOISE}],
        "parameters": {"rope_EI": {}},
        "smooth": {"rope_softness": {"length": 0.1}},
        "fit": {"windows": [], "halve_step": False, "double_segments": False, "profiles": False},
    }
    (tmp_path / "uneven.toml").write_text(tomli_w.dumps(config))
    study = load(tmp_path / "uneven.toml")
    assert "rope_softness.png" in figure_files(study.experiments, study.config)
    fit = sb.fit(study.experiments, parameters=study.parameters, beginnings=False, **study.options)
    assert fit["rope_softness_1"].value == pytest.approx(0.3, abs=0.05)
    assert fit.result.fields[0].length == 0.1
    finer = load(tmp_path / "uneven.toml", finer=2).experiments[0].scene.ropes["rope"]
    assert finer.field is not None and finer.field.shapes[::2] == pytest.approx(field_of(hung(2)).shapes)
