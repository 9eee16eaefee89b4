"""Identification: twins are recovered, intervals mean what they say, what cannot be known is said, and bias falls with
the substep."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import sheetbend as sb
from pytest import approx
from scipy.integrate import solve_ivp
from sheetbend.experiment.wanted import as_parameters
from sheetbend.problem.problem import FitProblem
from sheetbend.quantities.quantities import term
from sheetbend.report.report import plain
from support import observed_orders

G = 9.81
DOWN = (0.0, 0.0, -1.0)


def seen(
    scene: sb.Scene, times: np.ndarray, solver: sb.Solver, particles: list[int], noise: float = 0.0, seed: int = 0
) -> sb.Recording:
    """What markers on particles show of a scene's motion."""
    positions = sb.simulate(scene, times, solver).positions[:, particles]
    noisy = positions + noise * np.random.default_rng(seed).standard_normal(positions.shape)
    return sb.Recording(positions=noisy, times=times, name="twin")


def shape_of(scene: sb.Scene, particles: list[int]) -> sb.Recording:
    """What markers on particles show of a scene at rest."""
    return sb.Recording(positions=sb.equilibrium(scene).positions[None, particles], times=np.zeros(1), name="twin")


def markers(particles: list[int]) -> list[sb.Place]:
    return [sb.on_particle(i) for i in particles]


# --- twins, free of noise


def stretched_rope() -> tuple[sb.Scene, sb.Recording, dict]:
    scene, at = sb.rope(1.0, 10, density=0.05, EA=10.0, direction=DOWN), list(range(1, 11))
    return scene, shape_of(scene, at), {"markers": markers(at), "static": True}


def bent_strip() -> tuple[sb.Scene, sb.Recording, dict]:
    scene, at = sb.rope(0.5, 20, density=0.03, EI=1e-3, clamp_start=(1, 0, 0)), list(range(1, 21))
    return scene, shape_of(scene, at), {"markers": markers(at), "static": True}


def bouncing_rope() -> tuple[sb.Scene, sb.Recording, dict]:
    scene, at, s = (
        sb.rope(1.0, 5, density=0.05, EA=10.0, direction=DOWN, stretch_damping=0.01),
        [3, 5],
        sb.Solver(h=1 / 480),
    )
    return scene, seen(scene, np.arange(61) / 120, s, at), {"markers": markers(at), "solver": s}


def swaying_strip() -> tuple[sb.Scene, sb.Recording, dict]:
    scene, at, s = (
        sb.rope(0.5, 10, density=0.05, EI=2e-3, clamp_start=(1, 0, 0), bend_damping=0.02),
        [5, 10],
        sb.Solver(h=1 / 480),
    )
    return scene, seen(scene, np.arange(61) / 120, s, at), {"markers": markers(at), "solver": s}


def blown_rope(law: str) -> tuple[sb.Scene, sb.Recording, dict]:
    scene, at, s = sb.rope(1.0, 5, density=0.05, **{f"drag_{law}": 0.02}), [2, 5], sb.Solver(h=1 / 480)
    return scene, seen(scene, np.arange(61) / 60, s, at), {"markers": markers(at), "solver": s}


TWINS = {
    "rope_EA": stretched_rope,
    "rope_EI": bent_strip,
    "rope_density": bent_strip,
    "rope_length": bouncing_rope,
    "rope_stretch_damping": bouncing_rope,
    "rope_bend_damping": swaying_strip,
    "rope_drag_linear": lambda: blown_rope("linear"),
    "rope_drag_quadratic": lambda: blown_rope("quadratic"),
}


@pytest.mark.parametrize("optimizer", ["scipy", "auto"])
@pytest.mark.parametrize("factor", [2.0, 0.5])
@pytest.mark.parametrize("name", TWINS)
def test_twin_is_recovered(name, factor, optimizer):
    scene, recording, fields = TWINS[name]()
    truth = scene.quantities[name].value
    if name == "rope_length":
        factor = 1.0 + 0.1 * math.copysign(1.0, factor - 1.0)  # a rope of twice the length is another experiment
    found = sb.fit(scene, recording, {name: {"initial": factor * truth}}, optimizer=optimizer, refine=False, **fields)
    assert found[name].value == approx(truth, rel=1e-6)
    assert found[name].verdict == "identified"
    assert found.result.converged


def test_two_parameters_of_one_motion():
    scene, recording, fields = swaying_strip()
    start = {"rope_EI": {"initial": 4e-3}, "rope_bend_damping": {"initial": 0.01}}
    found = sb.fit(scene, recording, start, refine=False, **fields)
    assert found["rope_EI"].value == approx(2e-3, rel=1e-6)
    assert found["rope_bend_damping"].value == approx(0.02, rel=1e-6)


@pytest.mark.parametrize("sigma", [1e-3, 1e-4])
def test_what_a_model_misses_stands_above_the_table(sigma):
    """Another clamp than the one that was there leaves residuals of two millimeters."""
    scene = sb.rope(0.5, 20, density=0.03, EI=1e-3, clamp_start=(1, 0, 0.1))
    _, recording, fields = bent_strip()
    found = sb.fit(scene, recording, {"rope_EI": {"initial": 2e-3}}, sigma=sigma, **fields)
    assert found.result.converged
    off = 0.5 * np.mean((found.comparisons[0].simulated - recording.positions) ** 2) / sigma**2
    assert found.result.misfit.reduced_chi_square == approx(2 * off * 60 / 59)
    assert found.result.misfit.model_error == approx(sigma * math.sqrt(2 * off - 1))
    report = found.report()
    assert report.index("model error beyond sigma: 1.") < report.index("Parameters")


# --- noise


@pytest.mark.slow
def test_intervals_mean_what_they_say(intervals_alone):
    """Over seeds: the estimates scatter as sigma^2 (J'J)^-1 says, and 95 % intervals hold the truth 92 to 98 times of
    100."""
    sigma, seeds, s = 2e-3, 400, sb.Solver(h=1 / 60)
    scene = sb.Scene("spring")
    scene.add_particles([[0, 0, 0], [0, 0, -1.0]], 0.2, velocity=[[0, 0, 0], [0, 0, 1.0]])
    scene.add_constraints("distance", [[0, 1]], name="spring", compliance=0.05, damping=0.3)
    scene.pin([0])
    truth = {"spring_compliance": 0.05, "spring_damping": 0.3}
    times = np.arange(91) / 60
    clean = sb.simulate(scene, times, s).positions[:, [1]]

    def experiment(positions):
        recording = sb.Recording(positions=positions, times=times, name="twin")
        return sb.Experiment(scene=scene, recording=recording, markers=markers([1]), solver=s, sigma=sigma, axes="z")

    wanted = as_parameters(list(truth), [experiment(clean)])
    _, _, J = FitProblem([experiment(clean)], wanted).evaluate(wanted.initial())
    precision = J.T @ J  # internal coordinates: logarithms; residuals are in units of sigma
    rng = np.random.default_rng(1)
    scatter, covered = np.zeros((2, 2)), np.zeros(2)
    for seed in range(seeds):
        drawn = experiment(clean + sigma * rng.standard_normal(clean.shape))
        found = sb.fit(drawn, parameters=list(truth), refine=False)
        if seed == 0:
            intervals_alone()
            alone = sb.fit(drawn, parameters=list(truth), refine=False)
            assert [(e.value, e.lower, e.upper) for e in alone.result.estimates] == [
                (e.value, e.lower, e.upper) for e in found.result.estimates
            ]
        error = np.array([math.log(found[name].value / truth[name]) for name in truth])
        scatter += np.outer(error, error) / seeds
        covered += [found[name].lower <= truth[name] <= found[name].upper for name in truth]
    assert np.trace(precision @ scatter) / 2 == approx(1.0, abs=0.1)
    assert (covered / seeds).min() >= 0.92 and (covered / seeds).max() <= 0.98


# --- what cannot be known


def test_mass_of_a_swinging_chain_is_unknown():
    scene, s, at = sb.rope(1.0, 5, density=0.05), sb.Solver(h=1 / 240), [2, 5]
    recording = seen(scene, np.arange(31) / 60, s, at, noise=1e-4)
    found = sb.fit(scene, recording, ["rope_density", "rope_length"], markers=markers(at), solver=s)
    assert found["rope_density"].verdict == "not identifiable"
    assert "moves no residual" in found["rope_density"].words
    assert found["rope_length"].verdict == "identified"


def test_mass_scale_is_a_gauge():
    """m -> c m with compliance -> compliance/c moves nothing: motion tells EA/density, and the report says so."""
    scene, s, at = sb.rope(1.0, 5, density=0.05, EA=10.0), sb.Solver(h=1 / 240), [2, 5]
    recording = seen(scene, np.arange(31) / 60, s, at, noise=1e-4)
    found = sb.fit(scene, recording, {"rope_density": {}, "rope_EA": {"initial": 15.0}}, markers=markers(at), solver=s)
    for name in ("rope_density", "rope_EA"):
        assert found[name].verdict == "not identifiable"
        assert found[name].lower is None and found[name].upper is None
    (gauge,) = found.result.gauges
    assert "rope_density" in gauge and "rope_EA" in gauge
    assert found["rope_EA"].value / found["rope_density"].value == approx(10.0 / 0.05, rel=0.01)
    # Fixing the mass settles it.
    known = sb.fit(scene, recording, ["rope_EA"], markers=markers(at), solver=s)
    assert known["rope_EA"].verdict == "identified"


def test_statics_tell_stiffness_over_density_only():
    scene, recording, fields = bent_strip()
    start = {"rope_EI": {"initial": 1.5e-3}, "rope_density": {"initial": 0.04}}
    found = sb.fit(scene, recording, start, **fields)
    assert found["rope_EI"].verdict == found["rope_density"].verdict == "not identifiable"
    (gauge,) = found.result.gauges
    assert "rope_EI" in gauge and "rope_density" in gauge
    assert found["rope_EI"].value / found["rope_density"].value == approx(1e-3 / 0.03, rel=1e-6)


def test_gauss_seidel_hides_the_stiffness():
    """A rope of EA = 1e4 N fitted with one sweep: its stiffness is above what the sweeps' own compliance lets
    through."""
    at = [5, 10, 15, 20]
    scene = sb.rope(1.0, 20, density=0.05, EA=1e4)
    recording = seen(scene, np.arange(31) / 60, sb.Solver(h=1 / 600), at, noise=1e-3)
    rough = sb.Solver(h=1 / 600, integrator="bdf1", method="gauss_seidel", iterations=1)
    found = sb.fit(scene, recording, {"rope_EA": {"lower": 1.0, "upper": 1e6}}, markers=markers(at), solver=rough)
    assert found["rope_EA"].verdict == "at its floor"
    assert "sweep" in found["rope_EA"].words
    beside = replace(found["rope_EA"], name="rope_density", verdict="identified", words="known to 1 %")
    both = replace(found.result, estimates=(*found.result.estimates, beside), refits=())
    assert "rope_density: doubtful too" in plain(both)
    assert "doubtful" not in plain(found.result)

    soft = sb.rope(1.0, 20, density=0.05, EA=5.0)
    recording = seen(soft, np.arange(31) / 60, sb.Solver(h=1 / 600), at, noise=1e-3)
    found = sb.fit(soft, recording, ["rope_EA"], markers=markers(at), solver=sb.Solver(h=1 / 600))
    assert found["rope_EA"].verdict == "identified"


def test_bdf1_makes_damping_of_its_own():
    h = 1 / 120
    scene = sb.rope(1.0, 5, density=0.05, EA=10.0, direction=DOWN, stretch_damping=1e-5)
    recording = seen(scene, np.arange(31) / 60, sb.Solver(h=h / 16), [5])
    found = sb.fit(
        scene,
        recording,
        {"rope_stretch_damping": {"lower": 1e-7}},
        markers=markers([5]),
        solver=sb.Solver(h=h, integrator="bdf1"),
    )
    assert found["rope_stretch_damping"].verdict == "at its floor"


# --- bias against the substep


def pendulum_recording() -> sb.Recording:
    """A pendulum of 1 m released at 30 degrees, by DOP853."""
    times = np.arange(1, 121) / 60
    run = solve_ivp(
        lambda _, y: [y[1], -G * math.sin(y[0])],
        (0.0, 2.0),
        [math.pi / 6, 0.0],
        "DOP853",
        times,
        rtol=1e-12,
        atol=1e-13,
    )
    q = run.y[0]
    return sb.Recording(
        positions=np.stack([np.sin(q), 0 * q, -np.cos(q)], axis=1)[:, None], times=times, name="pendulum"
    )


def pendulum_with_free_length() -> sb.Scene:
    """Its length is 1 m plus the quantity `excess`, and the start lies on its circle."""
    start = np.array([math.sin(math.pi / 6), 0.0, -math.cos(math.pi / 6)])
    scene = sb.Scene("pendulum")
    scene.add_particles([[0, 0, 0], start], 1.0)
    scene.add_constraints("distance", [[0, 1]], name="arm", rest=1.0)
    scene.pin([0])
    scene.add_quantity("excess", 0.0, "m", positive=False, scale=1.0)
    scene.add_terms([term("rest", 0, 1.0, excess="identity")])
    scene.add_terms([term("position", 3 + k, float(start[k]), excess="identity") for k in (0, 2)])
    return scene


@pytest.mark.parametrize(("integrator", "order", "per_frame"), [("bdf1", 1, (16, 32, 64)), ("bdf2", 2, (2, 4, 8))])
def test_bias_falls_with_the_substep(integrator, order, per_frame):
    recording, bias = pendulum_recording(), []
    for count in per_frame:
        s = sb.Solver(h=1 / 60 / count, integrator=integrator)
        found = sb.fit(
            pendulum_with_free_length(),
            recording,
            {"excess": {"initial": 0.05}},
            markers=markers([1]),
            solver=s,
            start_time=0.0,
            axes="xz",
            refine=False,
        )
        bias.append(found["excess"].value)
    assert abs(bias[-1]) < 2e-3
    assert observed_orders(bias) == approx(order, abs=0.1)
