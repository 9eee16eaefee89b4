"""What a fit rests on: the told numbers, what an error in each moves, and intervals that count it."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.doubts.told import told_numbers
from sheetbend.experiment.wanted import as_parameters
from sheetbend.problem.problem import FitProblem
from sheetbend.report.dependence import Dependence, dependences, with_dependences
from sheetbend.report.fit_result import FitResult
from sheetbend.result.estimate import Estimate, Premise
from test_contact_fit import SOLVER as DRAGGING
from test_contact_fit import TIMES as DRAGGED
from test_contact_fit import dragged

H = 1 / 240
SOLVER = sb.Solver(h=H)
TIMES = np.arange(0, 61) / 60
TRUTH = {"density": 0.05, "EI": 1e-3, "bend_damping": 0.02, "drag_linear": 0.02}
FITTED = ["rope_EI", "rope_bend_damping", "rope_drag_linear"]
DEGREE = math.pi / 180


def hanging(gravity=(0.0, 0.0, -9.81), clamp=(1.0, 0.0, 0.0), start=(0.0, 0.0, 0.0), **changed) -> sb.Scene:
    options = {"clamp_start": clamp, "start": start}
    return sb.rope(0.4, 10, gravity=gravity, **(TRUTH | {"EI": 1.3e-3} | changed), **options)


@pytest.fixture(scope="module")
def recording() -> sb.Recording:
    """Of the true rope, 0.2 mm of noise, five markers from 0.1 m on."""
    scene = hanging(EI=TRUTH["EI"])
    seen = sb.simulate(scene, TIMES, SOLVER).positions[:, places(scene)]
    noise = 2e-4 * np.random.default_rng(5).standard_normal(seen.shape)
    return sb.Recording(times=TIMES, positions=seen + noise, markers=tuple("abcde"), name="rope")


@pytest.fixture(scope="module")
def clean() -> sb.Recording:
    """The same with next to no noise: what is left of the residuals bends the comparison with refits."""
    scene = hanging(EI=TRUTH["EI"])
    seen = sb.simulate(scene, TIMES, SOLVER).positions[:, places(scene)]
    seen += 1e-7 * np.random.default_rng(5).standard_normal(seen.shape)
    return sb.Recording(times=TIMES, positions=seen, markers=tuple("abcde"), name="rope")


def places(scene: sb.Scene) -> list[int]:
    return [int(p) for p in scene.ropes["rope"].particles[[2, 4, 6, 8, 10]]]


def experiment(scene: sb.Scene, recording: sb.Recording, shift: float = 0.0) -> sb.Experiment:
    """Markers at the nodes, moved along the rope towards its start by `shift`."""
    rope = scene.ropes["rope"]
    markers = [sb.on_rope(rope, s - shift) for s in rope.arc_length[[2, 4, 6, 8, 10]]]
    return sb.Experiment(scene=scene, recording=recording, markers=markers, solver=SOLVER, sigma=2e-4)


def fit(scene: sb.Scene, recording: sb.Recording, shift: float = 0.0, **options) -> sb.Fit:
    return sb.fit(experiment(scene, recording, shift), parameters=FITTED, profiles=False, refine=False, **options)


@pytest.fixture(scope="module")
def plain(recording: sb.Recording) -> sb.Fit:
    return fit(hanging(), recording)


def premise(found: sb.Fit, name: str):
    (one,) = [p for p in found.result.premises if p.name == name]
    return one


CHANGED = {
    "rope_density": (lambda d: hanging(density=0.05 * (1 + d)), 0.01, "1 %"),
    "rope_length": (lambda d: sb.rope(0.4 * (1 + d), 10, clamp_start=(1, 0, 0), **TRUTH), 0.01, "1 %"),
    "gravity toward x": (lambda d: hanging(gravity=(9.81 * math.sin(d), 0, -9.81 * math.cos(d))), DEGREE, "1 degree"),
    "size of gravity": (lambda d: hanging(gravity=(0, 0, -9.81 * (1 + d))), 0.003, "0.3 %"),
    "clamps along x": (lambda d: hanging(start=(d, 0, 0)), 1e-3, "1 mm"),
    "clamps along z": (lambda d: hanging(start=(0, 0, d)), 1e-3, "1 mm"),
}


@pytest.mark.parametrize("name", CHANGED)
def test_an_error_moves_what_a_refit_moves(clean: sb.Recording, name: str) -> None:
    """A small part of the step, by central differences of whole fits."""
    change, step, words = CHANGED[name]
    found, part = premise(fit(hanging(), clean), name), 0.1
    assert found.words == words
    ends = [fit(change(sign * part * step), clean).values for sign in (1, -1)]
    for parameter in FITTED:
        moved = (ends[0][parameter] - ends[1][parameter]) / (2 * part)
        size = 1e-5 * TRUTH[parameter.removeprefix("rope_")]
        assert found.moved[parameter] == pytest.approx(moved, rel=0.01, abs=size), parameter


def test_what_markers_weigh_moves_what_a_refit_moves(clean: sb.Recording) -> None:
    """Beyond the masses that the model gives them; at most half a percent of what is free, all together."""

    def loaded(mass: float, EI: float = 1.3e-3) -> sb.Scene:
        scene = hanging(EI=EI)
        for k in places(scene):
            scene.add_point_mass(k, mass, f"m{k}")
        return scene

    true = loaded(1e-4, TRUTH["EI"])
    clean = replace(clean, positions=sb.simulate(true, TIMES, SOLVER).positions[:, places(true)])
    found, d = premise(fit(loaded(1e-4), clean), "mass of each marker"), 4e-6
    assert found.off_by == pytest.approx(5e-3 * (0.019 + 5e-4) / 5) and found.words.endswith(" g each")
    ends = [fit(loaded(1e-4 + sign * d), clean).values for sign in (1, -1)]
    for parameter in FITTED:
        moved = (ends[0][parameter] - ends[1][parameter]) / (2 * d) * found.off_by
        assert found.moved[parameter] == pytest.approx(moved, rel=0.01), parameter


def test_turned_clamps_move_what_a_refit_moves(clean: sb.Recording) -> None:
    """The whole scene turns, its start too, about the middle of what is held."""
    base = fit(hanging(), clean)
    found, held = premise(base, "clamps about y"), sorted(hanging().pinned)
    middle = hanging().nodes[held].mean(axis=0)
    ends = []
    for sign in (1, -1):
        d = sign * 0.1 * DEGREE
        way = np.array([math.cos(d), 0, -math.sin(d)])
        start = middle - middle[0] * way
        ends.append(fit(hanging(clamp=way, start=start, points=[start, start + 0.4 * way]), clean).values)
    for parameter in FITTED:
        moved = (ends[0][parameter] - ends[1][parameter]) / 0.2
        assert found.moved[parameter] == pytest.approx(moved, rel=0.01), parameter
    windy = hanging()
    windy.set_wind((0.1, 0.0, 0.0))  # which would have to turn as well
    assert not any(p.name.startswith("clamps about") for p in fit(windy, clean).result.premises)


def test_a_table_that_turns_moves_what_a_refit_moves() -> None:
    """Friction was 32 % off on a table that falls by 1.1 degrees and is told level; the report had no row for that."""
    drawn = dragged(friction=0.3)
    particles = [int(p) for p in drawn.ropes["rope"].particles]
    x = sb.simulate(drawn, DRAGGED, DRAGGING).positions[:, particles]
    x = x + 1e-6 * np.random.default_rng(3).standard_normal(x.shape)
    shown = sb.Recording(positions=x, times=DRAGGED, name="drag")

    def refit(slope: float, **options) -> sb.Fit:
        told = dragged(friction=0.3, slope=slope)
        places = [sb.on_particle(p) for p in particles]
        e = sb.Experiment(scene=told, recording=shown, markers=places, solver=DRAGGING, sigma=2e-4)
        return sb.fit(e, parameters=["table_friction"], profiles=False, refine=False, **options)

    base = refit(0.0, given={"collider_direction": DEGREE})
    found, part = premise(base, "table about x"), 0.05
    assert found.words == "1 degree" and abs(found.moved["table_friction"]) > 0.05
    ends = [refit(-math.tan(sign * part * DEGREE))["table_friction"].value for sign in (1, -1)]
    assert found.moved["table_friction"] == pytest.approx((ends[0] - ends[1]) / (2 * part), rel=0.02)
    assert base["table_friction"].systematic > 1.9 * abs(found.moved["table_friction"])


def test_markers_count_each_by_itself(recording: sb.Recording, plain: sb.Fit) -> None:
    """The root of the sum of squares of what each marker moves when its place alone is off by 1 mm."""
    found = premise(plain, "markers")
    scene, squares = hanging(), dict.fromkeys(FITTED, 0.0)
    rope = scene.ropes["rope"]
    own = experiment(scene, recording)
    for m in range(5):
        ends = []
        for sign in (1, -1):
            s = rope.arc_length[[2, 4, 6, 8, 10]].copy()
            s[m] -= 2e-4 if sign > 0 else 0.0
            moved = replace(own, scene=hanging(), markers=[sb.on_rope(rope, float(at)) for at in s])
            ends.append(sb.fit(moved, parameters=FITTED, profiles=False, refine=False).values)
        for parameter in FITTED:
            squares[parameter] += ((ends[0][parameter] - ends[1][parameter]) / 0.2) ** 2
    for parameter in FITTED:
        assert found.moved[parameter] == pytest.approx(math.sqrt(squares[parameter]), rel=0.05), parameter


def test_a_density_that_is_off_is_named_and_counts(recording: sb.Recording) -> None:
    """Told 10 % too high: EI comes out 10 % too high, and "identified"."""
    wrong = hanging(density=0.055)
    found = fit(wrong, recording)
    estimate = found["rope_EI"]
    assert estimate.verdict == "identified"
    assert estimate.lower > 1.05 * TRUTH["EI"]
    told = premise(found, "rope_density")
    assert (told.words, told.value, told.sd) == ("1 %", 0.055, None)
    assert told.moved["rope_EI"] == pytest.approx(0.01 * estimate.value, rel=1e-3)
    assert "What the result rests on" in found.report()
    assert "rope_density" in found.report()
    assert estimate.words.startswith("known to") and "if the error in rope_density is below 0.02" in estimate.words
    honest = fit(hanging(density=0.055), recording, given={"rope_density": 0.1})["rope_EI"]
    assert honest.lower < TRUTH["EI"] < honest.upper
    assert honest.systematic == pytest.approx(1.96 * 0.1 * estimate.value, rel=1e-3)


def test_an_error_that_shows_is_not_what_an_estimate_rests_on(clean: sb.Recording, plain: sb.Fit) -> None:
    """1 % of the length moves EI by 190 half-widths, 1 % of the density by 40; but the length would be named."""
    length, density = premise(plain, "rope_length"), premise(plain, "rope_density")
    assert length.moved["rope_EI"] > 4 * density.moved["rope_EI"]
    assert dependences(plain.result)["rope_EI"].name == "rope_density"
    assert 0 <= density.leaves < 1e-3 < 100 < length.leaves
    left = math.sqrt(2 * fit(CHANGED["rope_length"][0](1e-3), clean).result.cost)
    assert length.leaves == pytest.approx(10 * left, rel=0.02)


def test_an_estimate_rests_on_what_may_move_it_unseen() -> None:
    """Of a friction that a table 0.25 degrees off moves by 2.7 half-widths and of which the residuals tell nothing."""
    names = {"friction": 0.0072, "EI": 0.0025}
    estimates = tuple(
        Estimate(
            name=name,
            value=50 * half,
            unit="",
            lower=49 * half,
            upper=51 * half,
            half_width=half,
            statistical=half,
            discretization=0.0,
            verdict="identified",
            words="known to 2 %",
        )
        for name, half in names.items()
    )
    table = Premise(
        name="table about x",
        value=None,
        unit="rad",
        off_by=DEGREE,
        words="1 degree",
        moved={"friction": 0.078, "EI": -6e-3},
        leaves=10.0,
    )
    other = {"name": "rope_length", "value": 0.3, "unit": "m", "off_by": 3e-3, "words": "1 %"}
    length = Premise(**other, moved={"friction": 0.01}, leaves=1e4)
    course = {"recordings": (), "optimizer": "", "iterations": 1, "seconds": 1.0, "converged": True}
    whole = FitResult(estimates=estimates, premises=(table, length), cost=380.0, rows=760, **course)
    assert dependences(whole) == {"friction": Dependence("table about x", "0.092 degrees", 0)}

    def told(result: FitResult) -> FitResult:
        return replace(result, estimates=with_dependences(result))

    text = told(whole).report()
    assert "required accuracy: table about x 0.092 degrees. A larger error" in text
    assert "[0.3528, 0.3672]        identified       0.021\n" in text
    assert "or less where residuals show it. Most of it comes from table about x (for friction)" in " ".join(
        text.split()
    )
    assert [e.in_all for e in told(whole).estimates] == pytest.approx(
        [math.hypot(0.0072, 0.078 / 4), math.hypot(0.0025, 6e-3 / 4)], rel=1e-5
    )
    long = tuple(replace(e, name=f"{e.name}_of_the_whole_table_and_its_feet") for e in estimates)
    moved = {f"{name}_of_the_whole_table_and_its_feet": by for name, by in table.moved.items()}
    narrow = told(replace(whole, estimates=long, premises=(replace(table, moved=moved),))).report()
    assert "+/- in all: friction_of_the_whole_table_and_its_feet 0.021, EI_of" in narrow
    assert [e.words for e in with_dependences(whole)] == [
        "known to 2 %, if the error in table about x is below 0.092 degrees",
        "known to 2 %",
    ]
    counted = told(replace(whole, premises=(replace(table, sd=DEGREE), replace(length, moved={}))))
    assert dependences(counted) == {} and [e.in_all for e in counted.estimates] == [0.0072, 0.0025]
    assert "in all" not in counted.report()
    assert dependences(replace(whole, premises=(replace(table, leaves=1e3), length))) == {}
    unseen = replace(whole, premises=(table, replace(length, leaves=0.0)))
    assert dependences(unseen)["friction"] == Dependence("table about x", "0.092 degrees", 1)
    doubtful = told(replace(whole, estimates=tuple(replace(e, verdict="doubtful") for e in estimates)))
    assert (
        dependences(doubtful) == {}
        and "required accuracy" not in doubtful.report()
        and "in all" not in doubtful.report()
    )


def test_the_report_stays_narrow(recording: sb.Recording, plain: sb.Fit) -> None:
    """Columns by parameter where they fit, else what moves most; shared parameters before those of one recording."""
    lines = plain.report().splitlines()
    assert max(map(len, lines)) <= 100
    start = lines.index("What the result rests on")
    assert lines[start + 2].split() == ["given", "value", "if", "off", "by", *FITTED]
    more = {"rope_length": None, "rope_density": {"prior": (0.05, 0.01)}}
    found = sb.fit(experiment(hanging(), recording), parameters=dict.fromkeys(FITTED) | more, profiles=False)
    lines = found.report().splitlines()
    assert max(map(len, lines)) <= 100
    assert lines[lines.index("What the result rests on") + 2].split()[-3:] == ["largest", "shift", "half-widths"]


def test_gravity_that_is_off_is_named_and_counts(recording: sb.Recording) -> None:
    off = (9.81 * math.sin(DEGREE), 0, -9.81 * math.cos(DEGREE))
    found = fit(hanging(gravity=off), recording)
    outside = [p for p in FITTED if not found[p].lower < TRUTH[p.removeprefix("rope_")] < found[p].upper]
    assert "rope_EI" in outside
    assert "gravity toward x" in found.report()
    little = fit(hanging(gravity=(9.81 * math.sin(0.02 * DEGREE), 0, -9.81)), recording)
    EI = little["rope_EI"]
    assert EI.verdict == "identified" and not little.result.warnings  # from 0.05 degrees on it is doubtful
    assert 2 * EI.half_width < abs(EI.value - TRUTH["EI"]) < EI.in_all
    honest = fit(hanging(gravity=off), recording, given={"gravity": DEGREE})
    for p in FITTED:
        assert honest[p].lower < TRUTH[p.removeprefix("rope_")] < honest[p].upper


def test_places_on_a_cloth_count_along_both_directions() -> None:
    mesh = sb.mesh.grid(0.3, 0.3, 4, 4, pattern="one_way")

    def cloth(density: float = 0.1) -> sb.Scene:
        scene = sb.Scene("cloth")
        made = sb.add_cloth(scene, mesh, density=density, warp=40.0, shear=10.0, positions=mesh.vertices[:, [0, 2, 1]])
        scene.pin(made.particles[mesh.sets["top"]])
        return scene

    at = [(0.1, 0.05), (0.2, 0.08), (0.15, 0.16)]
    truth = cloth()
    spots = sb.on_cloth(truth.cloths["cloth"], at)
    run = sb.simulate(truth, TIMES[:21], SOLVER).positions
    seen = np.stack([np.einsum("k,fkx->fx", p.weights, run[:, list(p.particles)]) for p in spots], axis=1)
    seen += 1e-4 * np.random.default_rng(1).standard_normal(seen.shape)
    data = sb.Recording(times=TIMES[:21], positions=seen, markers=("a", "b", "c"), name="cloth")
    wanted = ["cloth_warp", "cloth_shear"]

    def fitted(density: float = 0.1, marker: int = 0, axis: int = 0, by: float = 0.0) -> sb.Fit:
        moved = np.array(at)
        moved[marker, axis] += by
        scene = cloth(density)
        places_ = sb.on_cloth(scene.cloths["cloth"], moved)
        return sb.fit(scene, data, wanted, solver=SOLVER, markers=places_, sigma=1e-4, profiles=False, refine=False)

    plain = fitted()
    squares = dict.fromkeys(wanted, 0.0)
    for marker in range(3):
        for axis in range(2):
            ends = [fitted(marker=marker, axis=axis, by=sign * 1e-4).values for sign in (1, -1)]
            for name in wanted:
                squares[name] += ((ends[0][name] - ends[1][name]) / 0.2) ** 2
    told = premise(plain, "markers")
    for name in wanted:
        assert told.moved[name] == pytest.approx(math.sqrt(squares[name]), rel=0.05), name
        assert premise(plain, "cloth_density").moved[name] == pytest.approx(0.01 * plain.values[name], rel=0.01)


def test_what_is_not_told_is_refused(recording: sb.Recording) -> None:
    for given, message in (
        ({"rope_EI": 0.1}, r"given\.rope_EI: is nothing that this fit takes as given .*rope_density.*markers"),
        ({"rope_density": -0.1}, r"given\.rope_density: must not be negative"),
        ({"gravity": math.nan}, r"given\.gravity: must not be negative"),
    ):
        with pytest.raises(sb.InputError, match=message):
            fit(hanging(), recording, given=given)


def test_what_cannot_be_measured_costs_no_fit(recording: sb.Recording, monkeypatch: pytest.MonkeyPatch) -> None:
    def lost(*_: object) -> None:
        raise sb.DivergenceError(3, 0.1, 2, "rope")

    monkeypatch.setattr("sheetbend.doubts.told._collect", lost)
    found = fit(hanging(), recording, given={"rope_density": 0.1})
    assert found.result.converged
    assert found.result.premises == ()
    assert any("do not count: the rollout diverged" in warning for warning in found.result.warnings)


def test_it_is_kept_in_the_file_and_older_files_load(plain: sb.Fit, tmp_path) -> None:
    plain.save(tmp_path / "fit.json")
    assert FitResult.load(tmp_path / "fit.json").premises == plain.result.premises
    data = json.loads((tmp_path / "fit.json").read_text())
    del data["premises"]
    assert FitResult.from_dict(data).premises == ()


def test_a_configuration_gives_standard_deviations(recording: sb.Recording, tmp_path) -> None:
    from sheetbend.config import build, parse

    recording.save(tmp_path / "rope.npz")
    text = """
    [experiment]
    name = "rope"
    [[scene.rope]]
    length = 0.4
    segments = 10
    density = 0.055
    EI = 1e-3
    bend_damping = 0.02
    drag_linear = 0.02
    clamp_start = [1, 0, 0]
    [[recording]]
    file = "rope.npz"
    sigma = 2e-4
    [parameters.rope_EI]
    [given.rope_density]
    sd = 0.1
    """
    (tmp_path / "rope.toml").write_text(text)
    study = build(parse(tmp_path / "rope.toml"), tmp_path)
    assert study.options["given"] == {"rope_density": 0.1}


def test_losses_frictions_and_poissons_ratio_are_not_known_to_a_percent() -> None:
    """A Poisson's ratio of 0.3 that was told as 0.45 made the E of a swinging bar 10 % too large, "identified" at 12
    half-widths, and "+/- in all" counted 0.01 of it."""

    def words(scene: sb.Scene, free: str, particles: list[int], solver: sb.Solver) -> dict[str, str]:
        times = np.arange(9) / 50
        x = sb.simulate(scene, times, solver).positions[:, particles]
        e = sb.Experiment(
            scene=scene,
            recording=sb.Recording(x, times, name="take"),
            markers=[sb.on_particle(p) for p in particles],
            solver=solver,
            sigma=1e-3,
        )
        problem = FitProblem([e], as_parameters([free], [e]))
        return {one.name: one.step[1] for one in told_numbers(problem, problem.parameters.initial())[0]}

    mesh = sb.mesh.bricks((0.1, 0.02, 0.02), (3, 1, 1))
    numbers = {"density": 1000.0, "E": 1e5, "poisson": 0.45, "damping": 4e-3}
    bar = words(sb.solid(mesh, name="bar", pinned=mesh.sets["x_min"], **numbers), "bar_E", [12], sb.Solver(h=5e-3))
    assert (bar["bar_poisson"], bar["bar_damping"], bar["bar_density"]) == ("0.05", "10 %", "1 %")
    scene = sb.Scene("arm")
    arm = sb.add_arm(scene, "arm", mass=0.4, first_moment=0.08, inertia=0.02, length=0.3, angle=0.9, drag=1e-3)
    scene.set_drag(linear=1e-3)
    swung = words(scene, "arm_inertia", [arm.end], sb.Solver(h=5e-3))
    assert (swung["arm_drag"], swung["unnamed"], swung["arm_mass"]) == ("10 %", "10 %", "1 %")
    drawn = dragged(friction=0.3)
    rope = words(drawn, "rope_EI", [int(p) for p in drawn.ropes["rope"].particles[3:6]], DRAGGING)
    assert (rope["table_friction"], rope["rope_length"]) == ("10 %", "1 %")
