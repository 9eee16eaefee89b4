"""What an experiment would tell before it is made: against fits to noisy data, and where a known mass ends a gauge."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
from commands import last_line, run
from sheetbend.errors import InputError
from sheetbend.experiment.wanted import as_parameters
from sheetbend.fitting.variants import _support, changes
from test_shooting import swing

TIMES = np.arange(40) / 50
SOLVER = sb.Solver(h=1 / 200)
TRUE = {"rope_EI": 2e-3, "rope_bend_damping": 0.02}
WANTED = {name: {"initial": value} for name, value in TRUE.items()}


def rope(mass: float = 0.0) -> sb.Scene:
    scene = sb.rope(0.5, 8, density=0.05, EI=2e-3, bend_damping=0.02, clamp_start=(1, 0, 0))
    if mass:
        (made,) = scene.ropes.values()
        scene.add_point_mass(int(made.particles[-1]), mass, "weight")
    return scene


def planned(mass: float = 0.0, name: str = "plan") -> sb.Experiment:
    """Four markers; where the recording has them is nonsense."""
    positions = np.zeros((len(TIMES), 4, 3))
    scene = rope(mass)
    (made,) = scene.ropes.values()
    places = [sb.on_rope(made, s) for s in (0.15, 0.25, 0.35, 0.5)]
    recording = sb.Recording(positions, TIMES, name=name)
    return sb.Experiment(scene=scene, recording=recording, markers=places, solver=SOLVER, sigma=1e-3)


def errors(rng: np.random.Generator, shape: tuple[int, ...], alike: float) -> np.ndarray:
    found = rng.standard_normal(shape)
    for k in range(1, len(found)):
        found[k] = alike * found[k - 1] + np.sqrt(1.0 - alike**2) * found[k]
    return found


@pytest.mark.parametrize("alike", [0.0, 0.7])
@pytest.mark.slow
def test_intervals_are_those_that_fits_to_noisy_data_print(alike: float) -> None:
    e = planned()
    plan = sb.identify(e, parameters=WANTED, noise=5e-4, autocorrelation=alike, suggest=False)
    motion = sb.simulate(rope(), TIMES, SOLVER).positions
    x = np.stack([np.einsum("k,fkj->fj", p.weights, motion[:, list(p.particles)]) for p in e.places], axis=1)
    rng, printed = np.random.default_rng(5), []
    for _ in range(20):
        seen = sb.Recording(x + 5e-4 * errors(rng, x.shape, alike), TIMES, name="plan")
        made = replace(e, recording=seen)
        found = sb.fit(made, parameters=WANTED, refine=False, beginnings=False, windows=())
        printed.append([found[name].half_width for name in TRUE])
        assert all(found[name].verdict in (plan[name].verdict, "doubtful") for name in TRUE)
    for name, widths in zip(TRUE, np.array(printed).T, strict=True):
        assert plan[name].half_width == pytest.approx(np.median(widths), rel=0.25 if alike else 0.1)
        assert plan[name].value == pytest.approx(TRUE[name])
        if not alike:
            assert (np.abs(widths / plan[name].half_width - 1.0) < 0.25).sum() >= 16


def test_a_known_mass_turns_a_gauge_into_what_is_identified() -> None:
    """Of a rope alone motion tells EI over density, and no mass."""
    wanted = {**WANTED, "rope_density": {"initial": 0.05}}
    heavier = [planned(), planned(0.03, "heavy")]
    plan = sb.identify(planned(), parameters=wanted, instead={"a known mass of 30 g": heavier})
    assert plan.rank == 2 and "the ratio" in plan.gauges[0]
    assert {plan[name].verdict for name in ("rope_EI", "rope_density")} == {"not identifiable"}
    assert plan["rope_bend_damping"].verdict == "identified"
    changes = {variant.name: variant for variant in plan.variants}
    known = changes["a known mass of 30 g"]
    assert set(known.verdicts.values()) == {"identified"}
    assert changes["rope_density measured to 1 %"].verdicts["rope_EI"] == "identified"
    assert changes["a force sensor at the support"].verdicts["rope_density"] == "identified"
    for name in ("one more marker, in the widest gap", "the same recordings once more"):
        assert changes[name].verdicts["rope_EI"] == "not identifiable"
    alone = sb.identify(heavier, parameters=wanted, suggest=False)
    for name in wanted:
        assert alone[name].half_width == pytest.approx(known.half_widths[name], rel=0.2)
    assert "What changes of the plan would give" in plan.report()
    assert json.loads(json.dumps(plan.to_dict(), allow_nan=False))["rank"] == 2


def test_twice_the_recordings_leave_a_root_of_it() -> None:
    plan = sb.identify(planned(), parameters=WANTED)
    again = next(v for v in plan.variants if v.name == "the same recordings once more")
    for name in TRUE:
        assert again.half_widths[name] == pytest.approx(plan[name].half_width / np.sqrt(2.0), rel=0.1)


def test_a_sensor_at_a_hinge_of_a_body_reads_its_weight() -> None:
    """A body's nodes are hidden, and the place about which torques count was taken from beside all arrays. What has
    slid in a hinge with friction is a pinned node too, and no place."""
    scene = sb.Scene("bar")
    body = scene.add_body("bar", mass=0.4, inertia=[4e-3] * 3, center=(0.0, 0.0, -0.2))
    sb.hinge(None, body, at=(0.0, 0.0, 0.0), axis=(0.0, -1.0, 0.0), friction=0.01, slip_angle=1e-3)
    held = _support(scene)
    assert held and set(held) < set(scene.held) and set(held) <= set(scene.body_nodes.ravel().tolist())
    read = sb.simulate_forces(scene, np.arange(1, 20) / 50, held, sb.Solver(h=1 / 200))
    assert read.forces == pytest.approx(np.tile([0.0, 0.0, 0.4 * 9.81], (19, 1)), abs=1e-6)


def test_a_motion_that_is_shot_gets_no_sensor() -> None:
    e = swing(shooting=0.5)
    names = [
        name for name, _, _ in changes([e], as_parameters(["arm_inertia"], [e]), as_parameters(["arm_inertia"], [e]))
    ]
    assert names == ["the same recordings once more", "arm_inertia measured to 1 %"]


def test_changes_for_many_parameters_are_columns() -> None:
    plan = sb.identify(planned(), parameters=["rope_EI", "rope_bend_damping"])
    many = replace(plan, estimates=tuple(replace(e, name=f"{e.name}_{k}") for k in range(5) for e in plan.estimates))
    variants = [
        replace(v, half_widths={e.name: 1.0 for e in many.estimates}, verdicts={e.name: "" for e in many.estimates})
        for v in plan.variants
    ]
    text = replace(many, variants=tuple(variants)).report()
    told = text.partition("What changes of the plan would give")[2]
    assert "  parameter " in told and "1: one more marker, in the widest gap" in told
    assert max(map(len, told.splitlines())) <= 100 and "  change " in plan.report()


def test_noise_scales_intervals_and_weak_combinations_are_named() -> None:
    few = {"rope_EI": {"initial": 2e-3}, "rope_length": {"initial": 0.5}, "rope_density": {"prior": (0.05, 0.5)}}
    quiet, loud = (sb.identify(planned(), parameters=few, noise=n, suggest=False) for n in (1e-4, 1e-3))
    assert loud["rope_length"].half_width == pytest.approx(10 * quiet["rope_length"].half_width, rel=0.01)
    assert "rope_EI" in loud.weakest and "rope_density" in loud.weakest and "together" in loud.weakest
    assert "through its prior" in loud["rope_density"].words


@pytest.mark.parametrize(("field", "given"), [("noise", {"noise": 0.0}), ("autocorrelation", {"autocorrelation": 1.0})])
def test_nonsense_is_refused(field: str, given: dict[str, float]) -> None:
    with pytest.raises(InputError, match=field):
        sb.identify(planned(), parameters=WANTED, **given)


PLAN = """
[experiment]
name = "plan"

[solver]
substeps = 4
h = 0.005

[[scene.rope]]
name = "rope"
length = 0.5
segments = 8
density = 0.05
EI = 2e-3
bend_damping = 0.02
clamp_start = [1, 0, 0]
pinned = [0]

[parameters.rope_EI]
[parameters.rope_density]
"""


def test_the_command_needs_no_recording(tmp_path: Path) -> None:
    config = tmp_path / "plan.toml"
    config.write_text(PLAN.replace("substeps = 4\n", ""), encoding="utf-8")
    done = run(
        "identify",
        config,
        "--noise",
        "0.0005",
        "--duration",
        "0.8",
        "--rate",
        "50",
        "--output",
        tmp_path / "o",
        "--json",
    )
    told = last_line(done)
    assert done.exit_code == 3 and told["rank"] == 1 and told["files"] == ["plan.json"]
    assert json.loads((tmp_path / "o/plan.json").read_text())["gauges"] == told["gauges"] != []
    (mass,) = (v for v in told["variants"] if "known mass of 25 g" in v["name"])
    assert set(mass["verdicts"].values()) == {"identified"}
    assert last_line(run("identify", config, "--rate", "-1", "--json"))["error"]["field"] == "--rate"
