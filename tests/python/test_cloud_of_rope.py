"""Clouds of ropes: points around a rope that have no names, and their offsets from the simulated rope."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sheetbend as sb
import tomli_w
from commands import run
from sheetbend.doubts.told import told_numbers
from sheetbend.experiment.wanted import as_parameters
from sheetbend.problem.problem import FitProblem

Array = np.ndarray
TRUE = {"rope_EI": 1e-3, "rope_drag_linear": 5e-3}
SIGMA, POINTS = 2e-3, 60
TIMES = np.arange(19) / 60
SOLVER = sb.Solver(h=1 / 480)


def rope(scale: float = 1.0, segments: int = 20, length: float = 0.5) -> sb.Scene:
    """A rope that is clamped level and falls; its numbers are off by a factor."""
    values = {name.removeprefix("rope_"): scale * value for name, value in TRUE.items()}
    return sb.rope(length, segments, density=0.05, bend_damping=3e-3, clamp_start=(1, 0, 0), **values)


def scattered(states: Array, count: int, seed: int, noise: float = SIGMA) -> list[Array]:
    """Per state (particles, 3), points anywhere along the rope, off it by noise along every axis."""
    generator = np.random.default_rng(seed)
    found = []
    for x in states:
        at = generator.uniform(0, len(x) - 1, count)
        first = np.minimum(at.astype(int), len(x) - 2)
        share = (at - first)[:, None]
        found.append((1 - share) * x[first] + share * x[first + 1] + noise * generator.standard_normal((count, 3)))
    return found


def cloud(seed: int = 1) -> sb.Cloud:
    """Of the true motion; each frame sees another part of the rope."""
    points = scattered(sb.simulate(rope(), TIMES, SOLVER).positions, POINTS, seed)
    generator = np.random.default_rng([seed, 7])
    return sb.Cloud.of([x[x[:, 0] > generator.uniform(0.0, 0.1)] for x in points], TIMES, name="take")


def experiment(scale: float = 1.0, recording: sb.Cloud | None = None, **fields: Any) -> sb.Experiment:
    given = {"solver": SOLVER, "sigma": SIGMA} | fields
    return sb.Experiment(scene=rope(scale), recording=recording or cloud(), **given)


def problem_of(e: sb.Experiment) -> FitProblem:
    return FitProblem([e], as_parameters(list(TRUE), [e]))


@pytest.mark.parametrize("runs", [1, 2])
def test_residuals_are_offsets_from_the_closest_link(runs: int) -> None:
    """Against a search over all links in NumPy: two rows per point, whose squares sum to that of the distance."""
    solver = replace(SOLVER, extrapolate=runs)
    e = experiment(solver=solver)
    problem = problem_of(e)
    u = problem.parameters.initial()
    ok, r, _ = problem.evaluate(u, jacobian=False)
    assert ok and len(r) == 2 * e.recording.mask.sum() == problem.core.data_rows
    x = sb.simulate(e.scene, TIMES, solver).positions
    shown = problem.simulate(u)[0]
    row = compared = 0
    for frame, seen in enumerate(e.recording.mask):
        points, a, along = e.recording.positions[frame][seen], x[frame][:-1], np.diff(x[frame], axis=0)
        share = np.clip(np.einsum("plx,lx->pl", points[:, None] - a, along) / (along**2).sum(axis=1), 0, 1)
        foot = a + share[..., None] * along
        link = np.linalg.norm(points[:, None] - foot, axis=2).argmin(axis=1)
        foot = foot[np.arange(len(points)), link]
        np.testing.assert_allclose(shown[frame][seen], foot, atol=1e-9)
        own = np.linalg.norm(r[row : row + 2 * len(points)].reshape(-1, 2), axis=1)
        row += 2 * len(points)
        distance = np.linalg.norm(points - foot, axis=1) / SIGMA
        within = (share[np.arange(len(points)), link] % 1) > 0
        np.testing.assert_allclose(own[within], distance[within], atol=1e-7)
        assert (own <= distance + 1e-7).all()
        compared += int(within.sum())
    assert compared > 0.8 * len(r) / 2


@pytest.mark.parametrize(("loss", "runs"), [("squares", 1), ("cauchy", 1), ("squares", 2), ("huber", 3)])
def test_jacobian_is_that_of_differences(loss: str, runs: int) -> None:
    """The closest links are found anew at either side of a difference, and held in the derivative."""
    problem = problem_of(experiment(1.2, loss=loss, solver=replace(SOLVER, extrapolate=runs)))
    u = problem.parameters.initial()
    ok, _, J = problem.evaluate(u)
    assert ok
    h = 1e-5
    for k in range(len(u)):
        step = h * np.eye(len(u))[k]
        after, before = (problem.evaluate(u + s * step, jacobian=False)[1] for s in (1, -1))
        off = np.abs(J[:, k] - (after - before) / (2 * h))
        size = np.abs(J[:, k]).max()
        assert np.mean(off > 1e-4 * size) < 0.01
        assert np.median(off) < 1e-6 * size


def test_a_fit_to_a_cloud_of_a_rope_holds_the_truth() -> None:
    """Four draws, eight numbers; the residuals are noise of size one, of which each point has two."""
    off = []  # in half-widths
    for seed in range(4):
        e = experiment(1.4, cloud(seed), fit=(0.0, 0.25), held_out=(0.25, 0.3))
        fit = sb.fit(e, parameters=list(TRUE), refine=False, windows=(), profiles=False)
        off += [abs(fit[name].value - value) / fit[name].half_width for name, value in TRUE.items()]
        assert fit["rope_EI"].verdict == "identified" and fit["rope_EI"].half_width < 0.02 * TRUE["rope_EI"]
        (row,) = fit.result.recordings
        assert row.rows == 2 * e.fitted().mask.sum()
        assert fit.result.misfit is not None and 0.9 < fit.result.misfit.reduced_chi_square < 1.1
        assert row.baseline is not None and row.held_out is not None and row.baseline > 5 * row.held_out
    assert max(off) < 1.6 and np.mean(np.array(off) < 1) >= 0.75


def test_a_rope_at_rest_pools_its_frames() -> None:
    """A clamped rod that bends under its weight."""
    scene = sb.rope(0.3, 20, density=0.05, EI=5e-3, clamp_start=(1, 0, 0))
    rest = sb.equilibrium(scene).positions
    points = scattered(np.stack([rest] * 3), 60, 4)
    e = sb.Experiment(scene=scene, recording=sb.Cloud.of(points, [0.0, 0.1, 0.2]), static=True, sigma=SIGMA)
    problem = FitProblem([e], as_parameters(["rope_EI"], [e]))
    ok, r, J = problem.evaluate(problem.parameters.initial())
    assert ok and r.shape == (360,) and np.abs(J).max() > 0
    assert 0.8 < np.sqrt(np.mean(r**2)) < 1.2


def test_points_on_the_side_of_a_camera_move_to_the_axis() -> None:
    """A camera sees the half of a thick rope that faces it, as wide as the rope."""
    generator = np.random.default_rng(2)
    across = generator.uniform(-4e-3, 4e-3, 4000)
    surface = np.stack([generator.uniform(0, 0.5, 4000), across, np.sqrt(4e-3**2 - across**2)], axis=1)
    seen = sb.Cloud.of([surface], [0.0], name="half")
    moved = seen.to_axis(camera=(0.25, 0.0, 100.0), radius=4e-3)
    assert moved.name == "half" and np.abs(moved.frame(0).mean(axis=0)[1:]).max() < 1e-4
    assert np.abs(seen.frame(0).mean(axis=0)[2]) > 3e-3
    for fields in ({"radius": 0.0}, {"radius": np.nan}, {"camera": (0.0, 0.0)}, {"camera": (0.0, 0.0, np.inf)}):
        with pytest.raises(sb.RecordingError, match="Fix: "):
            seen.to_axis(**({"camera": (0.0, 0.0, 1.0), "radius": 4e-3} | fields))


def test_scenes_without_cloth_and_rope_are_refused() -> None:
    scene = sb.Scene("body")
    scene.add_body("box", of=sb.Inertia.box(0.4, (0.1, 0.1, 0.1)))
    with pytest.raises(sb.InputError, match="is a cloud, and the scene has no cloth and no rope"):
        sb.Experiment(scene=scene, recording=cloud(), solver=SOLVER)


def test_the_command_line_fits_a_cloud_of_a_rope(tmp_path: Path) -> None:
    cloud().save(tmp_path / "take.npz")
    values = {name.removeprefix("rope_"): 1.4 * value for name, value in TRUE.items()}
    start = {"length": 0.5, "segments": 20, "density": 0.05, "bend_damping": 3e-3, "clamp_start": [1, 0, 0]}
    config = {
        "experiment": {"name": "seen"},
        "solver": {"h": SOLVER.h},
        "scene": {"rope": [{**start, "name": "rope", "pinned": [0], **values}]},
        "recording": [{"file": "take.npz", "cloud": "take.npz", "sigma": SIGMA, "fit": [0.0, 0.25]}],
        "parameters": {name: {} for name in TRUE},
        "fit": {"windows": [], "halve_step": False, "double_segments": False, "profiles": False},
    }
    path = tmp_path / "seen.toml"
    path.write_text(tomli_w.dumps(config))
    done = run("fit", path, "--output", tmp_path / "out")
    assert done.exit_code == 0, done.output
    assert "identified" in done.output
    assert {"fit.json", "report.html", "estimates.png"} <= {p.name for p in (tmp_path / "out").iterdir()}


def test_errors_of_given_numbers_move_the_residuals_of_a_cloud() -> None:
    """Against differences, which search the closest links anew. With a cloud nothing was told of given numbers."""
    problem = problem_of(experiment(1.2))
    u = problem.parameters.initial()
    told = {one.label: one.column for one in told_numbers(problem, u)[0]}
    assert {"rope_length", "rope_density", "gravity toward x", "size of gravity", "draft along z"} <= told.keys()
    assert not {"frame rate", "recording delay", "clamps along x"} & told.keys()

    def residuals(by: float) -> Array:
        scene = rope(1.2)
        e = replace(experiment(1.2), scene=scene)
        scene.quantities["rope_density"] = replace(scene.quantities["rope_density"], value=0.05 * math.exp(by))
        return problem_of(e).evaluate(u, jacobian=False)[1]

    difference = (residuals(1e-4) - residuals(-1e-4)) / 2e-4
    off = np.abs(difference - told["rope_density"])
    assert np.quantile(off, 0.99) < 1e-3 * np.abs(difference).max()  # but where the closest link changes
    assert np.abs(difference).max() > 1.0


def test_a_cloud_beside_its_rope_is_fitted_and_says_what_the_fit_rests_on() -> None:
    """Points on one side of a rope that is 8 mm thick: the fit ended in a raw ValueError, since what is left of the
    motion beyond noise was to be explained by places of markers, which a cloud has not."""
    points = [x + np.array([0.0, 0.004, 0.0]) for x in scattered(sb.simulate(rope(), TIMES, SOLVER).positions, 60, 1)]
    seen = sb.Cloud.of(points, TIMES, name="take")
    found = sb.fit(experiment(1.2, seen), parameters=list(TRUE), profiles=False).result
    assert found.misfit is not None and found.misfit.reduced_chi_square > 3.0
    for name, truth in TRUE.items():
        assert found[name].lower < truth < found[name].upper
    moved = {p.name: p.moved["rope_EI"] / found["rope_EI"].value for p in found.premises}
    assert moved["rope_density"] == pytest.approx(0.01, rel=0.05)  # a heavier rope is a stiffer one
    e = replace(experiment(1.2, seen), scene=rope(1.2, length=0.501))
    longer = sb.fit(e, parameters=list(TRUE), profiles=False)
    ratio = longer["rope_EI"].value / found["rope_EI"].value - 1
    assert 0.2 * moved["rope_length"] == pytest.approx(ratio, rel=0.1)  # of a percent
