"""Stiffness that varies smoothly over the clusters of a solid: its modes, its prior, and fits of both."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sheetbend as sb
import tomli_w
from sheetbend.config import load
from sheetbend.config.values import with_values, write
from sheetbend.experiment.wanted import as_parameters
from sheetbend.objects.stiffness_field import StiffnessField, modes_of
from sheetbend.problem.problem import FitProblem
from sheetbend.problem.smooth import with_fields

MESH = sb.mesh.bricks((0.1, 0.02, 0.02), (10, 2, 2))
CLUSTERS = sb.cluster_boxes(MESH, 0.02)
SOLVER = sb.Solver(h=5e-3, method="implicit")
TIMES = np.arange(30) / 100
TOP = [i for i, (x, y, z) in enumerate(MESH.vertices) if y < 1e-9 and z > 0.019 and x > 0 and round(1e3 * x) % 20 == 0]
NOISE = 2e-5


def toy(modes: int = 0, E: Any = 1e5) -> sb.Scene:
    """A bar that is clamped at one end."""
    pinned = MESH.sets["x_min"]
    more = {"clusters": CLUSTERS, "stiffness_modes": modes, "damping": 5e-3, "pinned": pinned}
    return sb.solid(MESH, name="toy", density=300, E=E, **more)


def field_of(scene: sb.Scene) -> StiffnessField:
    found = scene.solids["toy"].field
    assert found is not None
    return found


def seen(E: np.ndarray, seed: int = 0) -> sb.Recording:
    """Markers along the top of the bar that falls, with noise."""
    x = sb.simulate(toy(E=E), TIMES, SOLVER).positions[:, TOP]
    return sb.Recording(x + NOISE * np.random.default_rng(seed).standard_normal(x.shape), TIMES, name="fall")


def experiment(recording: sb.Recording, modes: int = 6) -> sb.Experiment:
    places = [sb.on_particle(i) for i in TOP]
    return sb.Experiment(scene=toy(modes), recording=recording, markers=places, solver=SOLVER, sigma=NOISE)


def test_modes_of_a_chain_are_cosines() -> None:
    """A path graph of n points a length d apart has the eigenvalues 2 (1 - cos(pi k/n))/d^2, times its weight."""
    n, d = 12, 0.01
    centers = np.column_stack([d * np.arange(n), np.zeros(n), np.zeros(n)])
    links = np.column_stack([np.arange(n - 1), np.arange(1, n)])
    values, shapes = modes_of(centers, links)
    k = np.arange(n)
    assert values == pytest.approx(n / (n - 1) * 2 * (1 - np.cos(np.pi * k / n)) / d**2, rel=1e-9, abs=1e-6)
    waves = np.cos(np.pi * np.outer(np.arange(n) + 0.5, k) / n)
    waves *= np.sqrt(n) / np.linalg.norm(waves, axis=0)
    assert np.abs(np.sum(waves * shapes, axis=0)) / n == pytest.approx(np.ones(n))


def test_the_prior_is_a_field_of_the_given_size_and_length() -> None:
    """In one direction the correlation of Matern's field is (1 + r/l) exp(-r/l), far from the ends."""
    n, d, length, size = 400, 0.01, 0.1, 0.3
    centers = np.column_stack([d * np.arange(n), np.zeros(n), np.zeros(n)])
    values, shapes = modes_of(centers, np.column_stack([np.arange(n - 1), np.arange(1, n)]))
    modes = tuple(f"m_{k}" for k in range(1, n))
    field = StiffnessField("E", modes, values, shapes[:, 1:], centers, np.zeros((len(centers), 0)))
    sd = field.deviations(size, length)
    covariance = (field.shapes * sd**2) @ field.shapes.T
    assert np.mean(np.diag(covariance)) == pytest.approx(size**2)
    covariance += sd[0] ** 2 * (1.0 + length**2 * values[1]) ** 2  # of the constant, which is the mean stiffness
    r = d * np.arange(40)
    found = covariance[200, 200:240] / covariance[200, 200]
    assert found == pytest.approx((1 + r / length) * np.exp(-r / length), abs=0.01)


def test_modes_scale_the_stiffness_of_each_cluster() -> None:
    scene = toy(3)
    field = field_of(scene)
    q = dict(zip(field.modes, (0.3, -0.2, 0.1), strict=True))
    E = 1e5 * np.exp(field.shapes @ np.array(list(q.values())))
    e = experiment(seen(np.full(len(CLUSTERS), 1e5)), 3)
    problem = FitProblem([e], as_parameters({name: {"initial": v} for name, v in q.items()}, [e]))
    u = problem.parameters.initial()
    direct = sb.simulate(toy(E=E), TIMES, SOLVER).positions[:, TOP]
    assert problem.simulate(u)[0] == pytest.approx(direct, abs=1e-12)
    _, _, J = problem.evaluate(u)
    for k in range(3):
        step = 1e-5 * np.eye(3)[k]
        after, before = (problem.evaluate(u + s * step, jacobian=False)[1] for s in (1, -1))
        assert (after - before) / 2e-5 == pytest.approx(J[:, k], rel=1e-4, abs=1e-5 * np.abs(J[:, k]).max())


def test_a_smooth_field_is_found_with_the_size_of_its_prior() -> None:
    field = field_of(toy(6))
    rng = np.random.default_rng(3)
    lnE = field.shapes @ (field.deviations(0.4, 0.05) * rng.standard_normal(6))
    e = experiment(seen(1e5 * np.exp(lnE)))
    alone = {"refine": False, "profiles": False, "beginnings": False, "windows": ()}
    fit = sb.fit(e, parameters=["toy_E"], smooth={"toy_stiffness": sb.Smooth()}, **alone)
    (found,) = fit.result.fields
    off = np.log(found.stiffness) - np.log(1e5) - lnE
    assert (np.abs(off) < found.half_widths).sum() >= len(CLUSTERS) - 1
    assert np.sqrt(np.mean(off**2)) < 0.3 * np.std(lnE)
    assert found.size_lower is not None and found.size_lower < np.std(lnE)
    assert found.size_upper is None or found.size_upper > np.std(lnE)
    assert found.left[0] < 0.1 and found.left[0] < np.median(found.left)  # the clamped end bends most
    assert max(found.left) <= 1.0 + 1e-9
    assert "Stiffness fields" in fit.report() and "clusters are known from the data" in fit.report()
    assert sb.FitResult.from_dict(fit.result.to_dict()).fields == fit.result.fields
    stiff = sb.fit(e, parameters=["toy_E"], smooth={"toy_stiffness": sb.Smooth(size=1e-3, length=0.05)}, **alone)
    (given,) = stiff.result.fields
    assert (given.size, given.length, given.size_lower, given.length_upper) == (1e-3, 0.05, None, None)
    assert np.ptp(np.log(given.stiffness)) < 0.02 and stiff.result.cost > 1.3 * fit.result.cost
    assert "given" in stiff.report()


def test_a_plan_counts_the_field() -> None:
    """A stiffness that may vary leaves its mean less certain, and the modes are predicted under their prior."""
    e = experiment(seen(np.full(len(CLUSTERS), 1e5)))
    plain = sb.identify(e, parameters=["toy_E"], suggest=False)
    plan = sb.identify(e, parameters=["toy_E"], smooth={"toy_stiffness": sb.Smooth(size=0.3)}, suggest=False)
    found = {estimate.name: estimate for estimate in plan.estimates}
    assert set(found) == {"toy_E", *(f"toy_stiffness_{k}" for k in range(1, 7))}
    assert found["toy_E"].half_width > 1.5 * plain.estimates[0].half_width
    assert all(0.0 < found[f"toy_stiffness_{k}"].half_width < 2.5 * 0.3 for k in range(1, 7))


def test_what_fits_no_field_is_refused() -> None:
    e = experiment(seen(np.full(len(CLUSTERS), 1e5)), 3)
    wanted = as_parameters(["toy_E"], [e])
    with pytest.raises(sb.InputError, match=r"smooth.rope: names no field .*toy_stiffness"):
        with_fields(wanted, [e], {"rope": sb.Smooth()})
    with pytest.raises(sb.InputError, match=r"smooth.length: must be positive"):
        with_fields(wanted, [e], {"toy_stiffness": sb.Smooth(length=-1.0)})
    with pytest.raises(sb.InputError, match=r"has modes that are parameters already.*toy_stiffness_2"):
        with_fields(as_parameters(["toy_E", "toy_stiffness_2"], [e]), [e], {"toy_stiffness": sb.Smooth()})
    for more, words in (
        ({"stiffness_modes": 20}, "are more than the clusters have .*give at most 8"),
        ({"stiffness_modes": -1}, "must be a whole number"),
        ({"stiffness_modes": 2, "E": np.full(len(CLUSTERS), 1e5)}, "need one E"),
        ({"stiffness_modes": 2, "clusters": None, "poisson": 0.3}, "need clusters"),
    ):
        given: dict[str, Any] = {"density": 300, "E": 1e5, "clusters": CLUSTERS, "pinned": MESH.sets["x_min"]} | more
        with pytest.raises(sb.SceneError, match=f"solid.stiffness_modes: {words}"):
            sb.solid(MESH, **given)


def test_a_configuration_fits_a_field(tmp_path: Path) -> None:
    field = field_of(toy(2))
    seen(1e5 * np.exp(field.shapes @ np.array([0.3, 0.1]))).save(tmp_path / "fall.npz")
    box = {"name": "toy", "size": [0.1, 0.02, 0.02], "cells": [10, 2, 2], "density": 300.0, "E": 1e5}
    more = {"clusters": 0.02, "stiffness_modes": 2, "damping": 5e-3, "pinned": ["x_min"]}
    markers = [{"marker": f"m{k}", "solid": "toy", "place": MESH.vertices[i].tolist()} for k, i in enumerate(TOP)]
    config = {
        "experiment": {"name": "toy"},
        "solver": {"method": "implicit", "h": 5e-3},
        "scene": {"solid": [box | more]},
        "marker": markers,
        "recording": [{"file": "fall.npz", "sigma": NOISE}],
        "parameters": {"toy_E": {}},
        "smooth": {"toy_stiffness": {"length": 0.05}},
        "fit": {"windows": [], "halve_step": False, "double_segments": False, "profiles": False},
    }
    (tmp_path / "toy.toml").write_text(tomli_w.dumps(config))
    study = load(tmp_path / "toy.toml")
    assert study.options["smooth"] == {"toy_stiffness": sb.Smooth(None, 0.05)}
    fit = sb.fit(study.experiments, parameters=study.parameters, beginnings=False, **study.options)
    assert fit["toy_stiffness_1"].value == pytest.approx(0.3, abs=0.05)
    assert fit.result.fields[0].length == 0.05
    write(with_values(study.config, fit.values), tmp_path / "fitted.toml", tmp_path)
    again = load(tmp_path / "fitted.toml").experiments[0].scene
    assert again.quantities["toy_stiffness_1"].value == pytest.approx(fit["toy_stiffness_1"].value)
    (tmp_path / "toy.toml").write_text(tomli_w.dumps(config | {"smooth": {"bear_stiffness": {}}}))
    with pytest.raises(sb.ConfigError, match=r"smooth.bear_stiffness: names no field of the scenes"):
        load(tmp_path / "toy.toml")
