"""Stiffness that varies smoothly over the triangles of a cloth: its modes, and fits of them under a prior."""

from __future__ import annotations

import importlib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sheetbend as sb
import tomli_w
from sheetbend.cli.cloth_figures import stiffness_figures
from sheetbend.cli.figures import figure_files
from sheetbend.config import load
from sheetbend.experiment.wanted import as_parameters
from sheetbend.fitting.reached import Reached
from sheetbend.minimum.search import Search
from sheetbend.objects.stiffness_field import StiffnessField
from sheetbend.problem.problem import FitProblem
from support import expect_modes_scale

behind = importlib.import_module("sheetbend.fitting.fit")  # the package has the function under this name
SIDE, WARP, NOISE = 0.3, 20.0, 3e-4
SOLVER, TIMES = sb.Solver(h=0.01, method="newton"), np.arange(25) / 50
SEEN = range(0, 49, 2)


def hung(modes: int = 0, cells: int = 6, **more: Any) -> sb.Scene:
    """A square cloth that is held at two corners and falls."""
    mesh = sb.mesh.grid(SIDE, SIDE, cells, cells, pattern="one_way")
    given: dict[str, Any] = {"density": 0.2, "warp": WARP, "shear": 8.0, "bending": 1e-4, "membrane_damping": 0.01}
    return sb.cloth(mesh, pinned=[0, cells], stiffness_modes=modes, **(given | more))


def field_of(scene: sb.Scene) -> StiffnessField:
    found = scene.cloths["cloth"].field
    assert found is not None
    return found


def seen(modes: int, q: np.ndarray) -> sb.Experiment:
    """Half of the vertices, with noise, of a cloth whose stiffness has the amplitudes q of its first modes; to be
    explained with fewer modes."""
    scene = hung(len(q))
    x = sb.simulate(scene, TIMES, SOLVER, values=dict(zip(field_of(scene).modes, q, strict=True))).positions[:, SEEN]
    x = x + NOISE * np.random.default_rng(0).standard_normal(x.shape)
    places = [sb.on_particle(i) for i in SEEN]
    recording = sb.Recording(x, TIMES, name="fall")
    return sb.Experiment(scene=hung(modes), recording=recording, markers=places, solver=SOLVER, sigma=NOISE)


def test_modes_of_a_square_are_its_waves() -> None:
    """Of the Laplace operator with free edges: cosines with (a^2 + b^2) pi^2/side^2."""
    field = field_of(hung(2, cells=14))
    assert field.eigenvalues[1:9] / (np.pi / SIDE) ** 2 == pytest.approx([1, 1, 2, 4, 4, 5, 5, 8], rel=0.035)
    assert np.mean(field.shapes**2, axis=0) == pytest.approx([1, 1], rel=0.02)
    waves = np.cos(np.pi * field.centers[:, :2] / SIDE)
    in_them, *_ = np.linalg.lstsq(waves, field.shapes, rcond=None)
    assert waves @ in_them == pytest.approx(field.shapes, abs=0.06)


def test_modes_scale_the_membrane_of_each_triangle() -> None:
    scene = hung(3)
    expect_modes_scale(scene, field_of(scene), np.array([0.3, -0.2, 0.1]), "cloth_membrane")


def test_the_jacobian_is_that_of_differences() -> None:
    e = seen(3, np.array([0.3, -0.2, 0.1]))
    problem = FitProblem([e], as_parameters(["cloth_warp", *field_of(e.scene).modes], [e]))
    u = problem.parameters.initial() + 0.1
    _, _, J = problem.evaluate(u)
    for k in range(4):
        step = 1e-5 * np.eye(4)[k]
        after, before = (problem.evaluate(u + s * step, jacobian=False)[1] for s in (1, -1))
        assert (after - before) / 2e-5 == pytest.approx(J[:, k], abs=1e-4 * np.abs(J[:, k]).max())


def test_the_gradient_with_respect_to_modes_is_that_of_the_jacobian() -> None:
    e, q = seen(3, np.array([0.3, -0.2, 0.1])), np.array([0.2, 0.1, -0.1])
    modes = field_of(e.scene).modes
    problem = FitProblem([e], as_parameters([*modes], [e]))
    _, r, J = problem.evaluate(q)
    rollout = sb.rollout(e.scene, TIMES, SOLVER, values=dict(zip(modes, q, strict=True)))
    bar = np.zeros_like(rollout.positions)
    bar[:, [SEEN[k] for k in e.compared]] = r.reshape(len(TIMES), -1, 3) / NOISE
    gradient = rollout.gradient(bar).quantities
    assert [gradient[mode] for mode in modes] == pytest.approx(J.T @ r, rel=1e-9)


def test_intervals_of_triangles_count_the_modes_that_are_not_fitted() -> None:
    whole = field_of(hung(48))
    q = whole.deviations(0.3, 0.1) * np.random.default_rng(2).standard_normal(48)
    lnE = np.log(WARP) + whole.shapes @ q
    few = {"refine": False, "profiles": False, "beginnings": False, "windows": ()}
    fit = sb.fit(seen(8, q), parameters=["cloth_warp"], smooth={"cloth_stiffness": sb.Smooth(0.3, 0.1)}, **few)
    (found,) = fit.result.fields
    off = np.abs(np.log(found.stiffness) - lnE)
    assert (off < found.half_widths).sum() >= 65  # of 72, 90 %
    finer = field_of(hung(8)).left_out(0.3, 0.1)
    assert (np.array(found.half_widths) > 1.95 * np.sqrt(finer)).all() and finer.min() > 0.0
    assert 0.0 < min(found.left) < max(found.left) <= 1.0
    (panel,) = stiffness_figures(fit).values()
    drawn = [np.asarray(axes.collections[0].get_array()) for axes in panel.figure.axes[:3]]
    mean = np.exp(np.mean(np.log(found.stiffness)))
    assert (1 + drawn[0] / 1e2) * mean == pytest.approx(np.array(found.stiffness))
    assert drawn[2] == pytest.approx(1e2 * np.array(found.left))
    assert (found.unit, found.place) == ("N/m", "triangle") and "triangles are known from the data" in fit.report()


def test_what_makes_no_field_is_refused() -> None:
    for modes, words in (
        (49, "are more than the mesh has .*give at most 48"),
        (-1, "must be a whole number"),
        (True, "must be a whole number"),
    ):
        with pytest.raises(sb.SceneError, match=f"cloth.stiffness_modes: {words}"):
            hung(modes)
    with pytest.raises(sb.SceneError, match=r"cloth.stiffness_modes: are for cloths of up to 4000 triangles"):
        hung(2, cells=45)


def test_a_configuration_fits_a_field_on_its_mesh_alone(tmp_path: Path) -> None:
    e = seen(2, np.array([0.3, 0.1]))
    e.recording.save(tmp_path / "fall.npz")
    x = e.scene.cloths["cloth"].mesh.vertices
    mesh = {"kind": "grid", "width": SIDE, "height": SIDE, "nx": 6, "ny": 6, "pattern": "one_way"}
    numbers = {"density": 0.2, "warp": WARP, "shear": 8.0, "bending": 1e-4, "membrane_damping": 0.01}
    corners = {"name": "held", "points": [x[0].tolist(), x[6].tolist()]}
    cloth = numbers | {"name": "cloth", "mesh": mesh, "set": [corners], "pinned": ["held"], "stiffness_modes": 2}
    cloth["markers"] = {f"m{k}": x[i, :2].tolist() for k, i in enumerate(SEEN)}
    config = {
        "experiment": {"name": "hung"},
        "solver": {"method": "newton", "h": 0.01},
        "scene": {"cloth": [cloth]},
        "recording": [{"file": "fall.npz", "sigma": NOISE}],
        "parameters": {"cloth_warp": {}},
        "smooth": {"cloth_stiffness": {"length": 0.1}},
    }
    (tmp_path / "hung.toml").write_text(tomli_w.dumps(config))
    study = load(tmp_path / "hung.toml")
    assert study.options["refine"].finer is None
    assert "cloth_stiffness.png" in figure_files(study.experiments, study.config)
    problem = FitProblem(study.experiments, as_parameters(["cloth_stiffness_1"], study.experiments))
    plain = FitProblem([e], as_parameters(["cloth_stiffness_1"], [e]))
    assert problem.simulate(np.array([0.3]))[0] == pytest.approx(plain.simulate(np.array([0.3]))[0], abs=1e-9)
    (tmp_path / "hung.toml").write_text(tomli_w.dumps(config | {"fit": {"double_segments": True}}))
    with pytest.raises(sb.ConfigError, match=r"fit.double_segments: does not go with stiffness_modes"):
        load(tmp_path / "hung.toml").options  # noqa: B018


def test_size_and_length_are_sought_again_where_the_first_minimum_is_left(monkeypatch: pytest.MonkeyPatch) -> None:
    """Once, from the lower minimum, and not through windows."""
    e = seen(6, 0.2 * np.random.default_rng(1).standard_normal(6))
    given: dict[str, Any] = {"smooth": {"cloth_stiffness": sb.Smooth()}, "refine": False, "profiles": False}
    plain = sb.fit(e, parameters=["cloth_warp"], **given)
    likely, reach, told, windows = behind.with_likely_priors, behind.reach, list[Any](), list[Any]()

    def leaving(search: Search, problem: FitProblem, beginnings: bool, stopped: bool) -> Reached:
        windows.append(search.windows)
        found = reach(search, problem, beginnings, stopped)
        return replace(found, ends=(found.ends[0], *found.ends))

    def seeking(*given: Any) -> Any:
        told.append(given)
        return likely(*given)

    monkeypatch.setattr(behind, "reach", leaving)
    monkeypatch.setattr(behind, "with_likely_priors", seeking)
    again = sb.fit(e, parameters=["cloth_warp"], **given)
    assert windows == ["auto", ()] and [given[2] for given in told] == ["auto", ()]
    start = told[1][0].expanded
    assert start["cloth_warp"].initial == pytest.approx(plain["cloth_warp"].value, rel=1e-3)
    assert again["cloth_warp"].value == pytest.approx(plain["cloth_warp"].value, rel=0.02)


def long_fall() -> tuple[sb.Recording, np.ndarray]:
    """A sheet of 392 triangles that folds, all vertices with noise of 1 mm, and its ln E from a prior of size 0.3 and
    length 0.1 m."""
    scene, rng = hung(224, 14), np.random.default_rng(0)
    field = field_of(scene)
    q = field.deviations(0.3, 0.1) * rng.standard_normal(224)
    x = sb.simulate(scene, TIMES, SOLVER, values=dict(zip(field.modes, q, strict=True))).positions
    return sb.Recording(x + 1e-3 * rng.standard_normal(x.shape), TIMES, name="fall"), np.log(WARP) + field.shapes @ q


@pytest.mark.slow
@pytest.mark.parametrize("way", [{"beginnings": False}, {"windows": ()}])
def test_a_long_motion_ends_in_the_right_minimum(way: dict[str, Any]) -> None:
    """A search on the whole motion alone ends 350 higher, where 281 intervals of 392 contain the truth; residuals there
    are 2 % larger, and white. Windows avoid that minimum. The beginning of the motion, fitted by itself, leaves it."""
    recording, lnE = long_fall()
    fit = sb.fit(
        hung(60, 14),
        recording,
        ["cloth_warp"],
        markers=[sb.on_particle(i) for i in range(225)],
        solver=SOLVER,
        sigma=1e-3,
        smooth={"cloth_stiffness": sb.Smooth(0.3, 0.1)},
        refine=False,
        profiles=False,
        **way,
    )
    (found,) = fit.result.fields
    assert (np.abs(np.log(found.stiffness) - lnE) < found.half_widths).sum() >= 0.93 * len(lnE)
    assert fit.result.cost < 8330.0 and fit["cloth_warp"].verdict == "identified"
