"""Clouds: points of a cloth that have no names, their files, and their distances from the simulated cloth."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sheetbend as sb
import tomli_w
from commands import run
from sheetbend.config import build, parse
from sheetbend.experiment.wanted import as_parameters
from sheetbend.mesh.places import closest
from sheetbend.problem.problem import FitProblem

Array = np.ndarray
TRUE = {"cloth_warp": 100.0, "cloth_shear": 20.0, "cloth_bending": 5e-5, "cloth_drag_linear": 0.2}
SIGMA, POINTS = 2e-3, 150
TIMES = np.arange(13) / 40
SOLVER = sb.Solver(h=1 / 160, method="newton")


def hammock(scale: float = 1.0, gravity: tuple[float, float, float] = (0.0, 0.0, -9.81)) -> sb.Scene:
    """A sheet between two bars, which it falls from level; its numbers are off by a factor."""
    mesh = sb.mesh.grid(0.3, 0.12, 6, 3, pattern="one_way")
    held = np.flatnonzero((mesh.vertices[:, 0] < 1e-9) | (mesh.vertices[:, 0] > 0.3 - 1e-9))
    values = {name.removeprefix("cloth_"): scale * value for name, value in TRUE.items()}
    return sb.cloth(mesh, density=0.2, pinned=held, membrane_damping=3e-3, gravity=gravity, **values)


def scattered(scene: sb.Scene, states: Array, count: int, seed: int, noise: float = SIGMA) -> list[Array]:
    """Per state (particles, 3), points anywhere on the cloth, off it by noise along every axis."""
    generator = np.random.default_rng(seed)
    (cloth,) = scene.cloths.values()
    found = []
    for x in states:
        corners = x[cloth.particles][cloth.mesh.triangles]
        area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        own = corners[generator.choice(len(corners), count, p=area / area.sum())]
        a, b = np.sort(generator.random((2, count)), axis=0)
        points = np.einsum("kc,kcx->kx", np.stack([a, b - a, 1 - b], axis=1), own)
        found.append(points + noise * generator.standard_normal(points.shape))
    return found


def states() -> tuple[sb.Scene, Array]:
    scene = hammock()
    return scene, sb.simulate(scene, TIMES, SOLVER).positions


def cloud(seed: int = 1, more: list[Array] | None = None) -> sb.Cloud:
    """Of the true motion; each frame sees another part of the cloth, about a fifth less than all."""
    points = scattered(*states(), POINTS, seed)
    generator = np.random.default_rng([seed, 7])
    kept = [x[x[:, 0] > generator.uniform(0.0, 0.1)] for x in points]
    if more is not None:
        kept = [np.concatenate([x, own]) for x, own in zip(kept, more, strict=True)]
    return sb.Cloud.of(kept, TIMES, name="take")


def experiment(scale: float = 1.0, recording: sb.Cloud | None = None, **fields: Any) -> sb.Experiment:
    given = {"solver": SOLVER, "sigma": SIGMA} | fields
    return sb.Experiment(scene=hammock(scale), recording=recording or cloud(), **given)


def problem_of(e: sb.Experiment) -> FitProblem:
    return FitProblem([e], as_parameters(list(TRUE), [e]))


def test_a_cloud_holds_another_number_of_points_in_every_frame(tmp_path: Path) -> None:
    frames = [np.arange(6.0).reshape(2, 3), np.zeros((0, 3)), np.ones((4, 3))]
    made = sb.Cloud.of(frames, [0.0, 0.1, 0.3], name="take", gravity=(0, 0, -9.81), metadata={"camera": "left"})
    assert made.counts.tolist() == [2, 0, 4] and made.positions.shape == (3, 4, 3)
    made.save(tmp_path / "take.npz")
    read = sb.Cloud.load(tmp_path / "take.npz")
    assert read.name == "take" and read.metadata == {"camera": "left"} and read.gravity is not None
    assert [np.array_equal(read.frame(k), x) for k, x in enumerate(frames)] == [True] * 3
    assert np.array_equal(read.times, made.times)
    assert np.array_equal(sb.Cloud.load(tmp_path / "take.npz", "m").positions, made.positions, equal_nan=True)


def test_parts_of_a_cloud() -> None:
    whole = cloud()
    assert np.array_equal(whole.piece(0.1, 0.2).frame(0), whole.frame(4))
    assert np.array_equal(np.concatenate([whole.frame(k) for k in range(13)]), whole.pooled().frame(0))
    thin = whole.thinned(20, seed=3)
    assert set(thin.counts.tolist()) == {20}
    assert all(p in whole.frame(2).tolist() for p in thin.frame(2).tolist())
    assert np.array_equal(thin.positions, whole.thinned(20, seed=3).positions)
    near = whole.closest_among(whole.frame(5))
    assert np.array_equal(near[5][whole.mask[5]], whole.frame(5))


@pytest.mark.parametrize(
    ("arrays", "words"),
    [
        ({"points": np.zeros((3, 2))}, "must be numbers of the shape (all, 3)"),
        ({"points": np.full((3, 3), np.nan)}, "is not finite at point 0"),
        ({"counts": np.array([1.0, 2.0])}, "must be one whole number per frame"),
        ({"counts": np.array([1, 1])}, "do not add up to the 3 points"),
        ({"counts": np.array([4, -1])}, "must be one whole number per frame"),
        ({"times": np.zeros(2)}, "repeats at frame 1"),
        ({"times": np.zeros(3)}, "must have one entry per frame, 2"),
        ({"points": np.zeros((0, 3)), "counts": np.array([0, 0])}, "hold no point"),
    ],
)
def test_files_that_are_no_clouds_are_refused(tmp_path: Path, arrays: dict[str, Array], words: str) -> None:
    sound = {"points": np.zeros((3, 3)), "counts": np.array([1, 2]), "times": np.array([0.0, 0.1])}
    np.savez(tmp_path / "take.npz", **(sound | arrays))
    with pytest.raises(sb.RecordingError) as caught:
        sb.Cloud.load(tmp_path / "take.npz")
    assert words in str(caught.value) and "Fix: " in str(caught.value)


def test_other_files_are_refused(tmp_path: Path) -> None:
    np.savez(tmp_path / "markers.npz", positions=np.zeros((2, 3, 3)), times=np.arange(2.0))
    with pytest.raises(sb.RecordingError, match="lacks points and counts"):
        sb.Cloud.load(tmp_path / "markers.npz")
    with pytest.raises(sb.RecordingError, match="is not a file"):
        sb.Cloud.load(tmp_path / "none.npz")
    with pytest.raises(sb.RecordingError, match="no reader of clouds knows"):
        sb.Cloud.load(tmp_path / "take.csv")


def test_what_follows_markers_is_refused() -> None:
    made = cloud()
    for call in (lambda: made.select([0]), lambda: made.resample(TIMES), made.filled, made.noise):
        with pytest.raises(sb.RecordingError, match="the points of a cloud have no names"):
            call()
    with pytest.raises(sb.RecordingError, match=r"points\[1\]: must have the shape"):
        sb.Cloud.of([np.zeros((2, 3)), np.zeros((2, 2))], [0.0, 0.1])
    with pytest.raises(sb.RecordingError, match=r"points\[0\]: is not finite at point 1"):
        sb.Cloud.of([np.array([[0.0, 0, 0], [0, np.nan, 0]])], [0.0])
    with pytest.raises(sb.RecordingError, match="clamped"):
        sb.Cloud(np.zeros((1, 2, 3)), np.zeros(1), clamped=(0,))


def test_fields_that_need_markers_are_refused() -> None:
    refused: list[dict[str, Any]] = [
        {"markers": [sb.on_particle(0)]},
        {"offsets": {"m0": ("cloth_warp", None, None)}},
        {"axes": "xz"},
        {"radius": 0.1},
        {"driven_sigma": 1e-3},
        {"shooting": "auto"},
    ]
    for fields in refused:
        (name,) = fields
        with pytest.raises(sb.InputError, match=name):
            experiment(**fields)


@pytest.mark.parametrize("runs", [1, 2])
def test_residuals_are_distances_from_the_closest_point(runs: int) -> None:
    """Against a search over all triangles in NumPy, for points that are not over a border."""
    solver = replace(SOLVER, extrapolate=runs)
    e = experiment(solver=solver)
    problem = problem_of(e)
    u = problem.parameters.initial()
    ok, r, _ = problem.evaluate(u, jacobian=False)
    assert ok and len(r) == e.recording.mask.sum() == problem.core.data_rows
    x = sb.simulate(e.scene, TIMES, solver).positions
    (cloth,) = e.scene.cloths.values()
    measured, shown = e.recording.positions, problem.simulate(u)[0]
    row = compared = 0
    for frame, seen in enumerate(e.recording.mask):
        vertices = x[frame][cloth.particles]
        points = measured[frame][seen]
        triangles, weights = closest(vertices, cloth.mesh.triangles, points)
        foot = np.einsum("kc,kcx->kx", weights, vertices[cloth.mesh.triangles[triangles]])
        inside = (weights > 1e-6).all(axis=1)
        own = r[row : row + len(points)]
        row += len(points)
        np.testing.assert_allclose(shown[frame][seen], foot, atol=1e-9)
        distance = np.linalg.norm(points - foot, axis=1)
        np.testing.assert_allclose(np.abs(own)[inside], distance[inside] / SIGMA, atol=1e-7)
        assert (np.abs(own) <= distance / SIGMA + 1e-7).all()
        compared += int(inside.sum())
    assert compared > 0.85 * len(r)


@pytest.mark.parametrize(
    ("loss", "runs"), [("squares", 1), ("soft_l1", 1), ("huber", 1), ("cauchy", 1), ("squares", 2), ("cauchy", 3)]
)
def test_jacobian_is_that_of_differences(loss: str, runs: int) -> None:
    """The closest triangles are found anew at either side of a difference, and held in the derivative."""
    e = experiment(1.2, loss=loss, solver=replace(SOLVER, extrapolate=runs))
    problem = problem_of(e)
    u = problem.parameters.initial()
    ok, _, J = problem.evaluate(u)
    assert ok
    h = 1e-5
    for k in range(len(u)):
        step = h * np.eye(len(u))[k]
        after, before = (problem.evaluate(u + s * step, jacobian=False)[1] for s in (1, -1))
        differences = (after - before) / (2 * h)
        off = np.abs(J[:, k] - differences)
        size = np.abs(J[:, k]).max()
        # A point that changes its triangle between the two sides sees another normal: fewer than one in a hundred.
        assert np.mean(off > 1e-4 * size) < 0.01
        assert np.median(off) < 1e-6 * size


def test_rows_of_a_cauchy_loss() -> None:
    """The square of a row is log(1 + s), s its own square in units of the loss's scale."""
    scale = 1.7
    plain, robust = experiment(1.5), experiment(1.5, loss="cauchy", loss_scale=scale)
    d, r = (p.evaluate(p.parameters.initial(), jacobian=False)[1] for p in map(problem_of, (plain, robust)))
    assert np.abs(d).max() > 3 * scale and np.abs(d).min() < 0.01 * scale
    np.testing.assert_allclose(r, np.sign(d) * scale * np.sqrt(np.log1p((d / scale) ** 2)), rtol=1e-12)


def test_a_still_cloud_pools_its_frames() -> None:
    scene = hammock()
    rest = sb.equilibrium(scene).positions
    points = scattered(scene, np.stack([rest, rest, rest]), 60, 4)
    e = sb.Experiment(scene=scene, recording=sb.Cloud.of(points, [0.0, 0.1, 0.2]), static=True, sigma=SIGMA)
    problem = problem_of(e)
    ok, r, J = problem.evaluate(problem.parameters.initial())
    assert ok and r.shape == (180,) and np.abs(J).max() > 0
    assert 0.7 < np.sqrt(np.mean(r**2)) < 1.2


FITTED = ("cloth_warp", "cloth_drag_linear")


def off(fit: sb.Fit) -> float:
    """How far the estimates are from the truth, the most in half-widths."""
    return max(abs(fit[name].value - TRUE[name]) / fit[name].half_width for name in FITTED)


def test_a_fit_to_a_cloud_holds_the_truth() -> None:
    e = experiment(1.3, fit=(0.0, 0.25), held_out=(0.25, 0.3))
    fit = sb.fit(e, parameters=FITTED, refine=False, windows=())
    assert off(fit) < 1.3
    assert fit["cloth_warp"].half_width < 0.05 * TRUE["cloth_warp"]
    (row,) = fit.result.recordings
    assert row.rows == e.fitted().mask.sum()
    # The held-out part is as far off as its noise, which counts across the cloth alone but for points over its border.
    assert row.held_out is not None and 0.9 * SIGMA < row.held_out < 1.3 * SIGMA
    assert row.baseline is not None and row.baseline > 3 * row.held_out
    assert row.motion is None and row.measured_frequency is None
    assert "still: every point is at the closest point of the last fitted frame" in fit.result.baseline
    assert {"cloth_density", "gravity toward x", "size of gravity"} <= {p.name for p in fit.result.premises}
    assert fit["cloth_drag_linear"].in_all is not None  # a per cent of the density, and others
    assert not any("off the fitted motion" in w for w in fit.result.warnings)


def test_a_cloud_takes_the_estimate_to_the_limit_of_short_substeps() -> None:
    """Points of a motion at an eighth of the fit's substep, at which the warp reads 1.3 % high and the drag 8 % low."""
    scene, solver = hammock(), SOLVER.with_h(SOLVER.h / 2)
    x = sb.simulate(scene, TIMES, solver.with_h(solver.h / 8)).positions
    seen = sb.Cloud.of(scattered(scene, x, POINTS, 2, noise=1e-6), TIMES, name="take")
    wanted = {name: {"initial": 1.1 * TRUE[name]} for name in FITTED}
    e = experiment(recording=seen, sigma=1e-5, solver=solver)
    at_step, in_limit = (
        sb.fit(e, parameters=wanted, refine=refine, windows=(), profiles=False) for refine in (False, "auto")
    )
    for name in FITTED:
        left, was = (abs(fit[name].value - TRUE[name]) for fit in (in_limit, at_step))
        assert left < 0.25 * was, (name, left, was)
        assert in_limit[name].discretization < 0.25 * was
    assert off(in_limit) < 1.0


def test_a_cauchy_loss_puts_up_with_points_of_other_things() -> None:
    """One point in eight belongs to something that hangs below the cloth."""
    generator = np.random.default_rng(3)
    low, high = [0.0, 0.0, -0.12], [0.3, 0.12, -0.04]
    dirty = cloud(more=[generator.uniform(low, high, (20, 3)) for _ in TIMES])
    squares, cauchy = (
        sb.fit(experiment(1.3, dirty, **more), parameters=FITTED, refine=False, windows=(), profiles=False)
        for more in ({}, {"loss": "cauchy", "loss_scale": 2.0})
    )
    assert off(cauchy) < 1.5 and abs(cauchy["cloth_warp"].value / TRUE["cloth_warp"] - 1) < 0.05
    assert abs(squares["cloth_warp"].value / TRUE["cloth_warp"] - 1) > 0.1
    assert any("the points of the cloud lie" in w for w in squares.result.warnings)


def test_the_clock_of_a_cloud_is_found() -> None:
    late = cloud().shifted(-0.02)  # stamped 0.02 s late
    scene = hammock()
    scene.add_quantity("clock", 0.0, "s", positive=False, scale=0.01)
    e = sb.Experiment(
        scene=scene, recording=late, solver=SOLVER, sigma=SIGMA, time_offset="clock", fit=(0.04, 0.32), start_time=0.0
    )
    fit = sb.fit(e, parameters=["clock"], refine=False, windows=(), profiles=False)
    assert abs(fit["clock"].value + 0.02) < fit["clock"].half_width < 0.003


def test_a_cauchy_loss_is_for_clouds() -> None:
    scene, x = states()
    places = [sb.on_particle(10)]
    with pytest.raises(sb.InputError, match="loss: is unknown"):
        sb.Experiment(scene=scene, recording=sb.Recording(x[:, 10:11], TIMES), markers=places, loss="cauchy")


def written(folder: Path, **keys: Any) -> Path:
    """A configuration of the hammock between bars that two markers move, seen as a cloud."""
    grips = np.zeros((len(TIMES), 2, 3))
    grips[:, 1, 0] = 0.3
    sb.Recording(grips, TIMES, markers=("left", "right")).save(folder / "grips.npz")
    cloud().save(folder / "take.npz")
    recording = {"file": "grips.npz", "cloud": "take.npz", "sigma": SIGMA, "name": "take"} | keys
    mesh = {"kind": "grid", "width": 0.3, "height": 0.12, "nx": 6, "ny": 3}
    values = {name.removeprefix("cloth_"): 1.3 * value for name, value in TRUE.items()}
    grip = [{"set": side, "markers": [side]} for side in ("left", "right")]
    cloth = {"density": 0.2, "membrane_damping": 3e-3, "mesh": mesh, "grip": grip, **values}
    config = {
        "experiment": {"name": "hammock"},
        "solver": {"method": "newton", "h": SOLVER.h},
        "scene": {"cloth": [cloth]},
        "recording": [recording],
        "parameters": {"cloth_warp": {}, "cloth_drag_linear": {}},
        "fit": {"windows": [], "halve_step": False, "double_segments": False, "profiles": False},
    }
    path = folder / "hammock.toml"
    path.write_text(tomli_w.dumps(config))
    return path


def test_a_configuration_names_a_cloud(tmp_path: Path) -> None:
    path = written(tmp_path, fit=[0.0, 0.25], held_out=[0.25, 0.3])
    study = build(parse(path), tmp_path)
    (e,) = study.experiments
    assert e.is_cloud and e.name == "take" and len(e.fitted().times) == 10
    assert np.array_equal(e.recording.times, TIMES)
    assert e.scene.boundary.following
    fit = sb.fit(study.experiments, parameters=study.parameters, **study.options)
    assert off(fit) < 1.5


def test_the_command_line_fits_a_cloud(tmp_path: Path) -> None:
    path = written(tmp_path, fit=[0.0, 0.25], held_out=[0.25, 0.3], loss="cauchy")
    done = run("fit", path, "--output", tmp_path / "out")
    assert done.exit_code == 0, done.output
    (again,) = build(parse(tmp_path / "out" / "fitted.toml"), tmp_path / "out").experiments
    assert np.array_equal(again.recording.positions, cloud().positions, equal_nan=True)
    names = {p.name for p in (tmp_path / "out").iterdir()}
    assert {"fit.json", "report.html", "take_cloth.png", "estimates.png"} <= names
    assert not {"take_markers.png", "take_residuals.png", "motions.png"} & names


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"cloud": "none.npz"}, "recording[0].cloud: does not exist"),
        ({"cloud": "grips.npz"}, "lacks points and counts"),
        ({"file": "take.npz"}, "follows markers, and the points of a cloud have no names"),
        ({"axes": "xz"}, "recording[0].axes: is of markers"),
        ({"frames": [30, 40]}, "must hold at least one frame"),
    ],
)
def test_configurations_of_clouds_that_are_refused(tmp_path: Path, keys: dict[str, Any], words: str) -> None:
    path = written(tmp_path, **keys)
    with pytest.raises(sb.ConfigError) as caught:
        build(parse(path), tmp_path)
    assert words in str(caught.value)
