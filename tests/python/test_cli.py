"""The command line: what it writes, prints and exits with."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
from commands import last_line, run
from sheetbend import cli
from sheetbend.cli.app import app
from sheetbend.motion.gradient_report import GradientReport, GradientRow
from typer.testing import CliRunner

ROPE = """\
[experiment]
name = "swing"
about = "A synthetic rope."

[solver]
substeps = 4

[[scene.rope]]
name = "rope"
length = 0.6
segments = {segments}
density = 0.05
EA = 1e3
EI = 2e-3
bend_damping = 0.02
pinned = [0]

[[recording]]
file = "swing.npz"
fit = [0.0, 0.2]
held_out = [0.2, 0.31]
sigma = 1e-4

[fit]
halve_step = false
double_segments = false

[output]
figures = "none"

[parameters.rope_EI]
lower = 1e-5
upper = 1.0

[parameters.rope_bend_damping]
"""


def recorded(folder: Path, segments: int) -> Path:
    """A recording of a rope, and the configuration that fits it."""
    scene = sb.rope(0.6, segments, density=0.05, EA=1e3, EI=1e-3, bend_damping=0.01)
    motion = sb.simulate(scene, np.arange(31) / 100, sb.Solver(h=1 / 800))
    noise = 1e-4 * np.random.default_rng(1).standard_normal(motion.positions.shape)
    sb.Recording(positions=motion.positions + noise, times=motion.times, name="swing").save(folder / "swing.npz")
    path = folder / "my.toml"
    path.write_text(ROPE.format(segments=segments))
    return path


@pytest.fixture
def config(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return recorded(tmp_path, 6)


def edited(config: Path, old: str, new: str) -> Path:
    text = config.read_text()
    assert text.count(old) == 1
    config.write_text(text.replace(old, new))
    return config


class TestFit:
    def test_fit_json_finds_the_truth_and_beats_the_baseline(self, config: Path) -> None:
        found = last_line(run("fit", config, "--json"))
        assert found["exit_code"] == 0 and found["converged"]
        for name, truth, unit in (("rope_EI", 1e-3, "N m^2"), ("rope_bend_damping", 1e-2, "s")):
            p = found["parameters"][name]
            low, high = p["interval"]
            assert low < p["value"] < high and p["unit"] == unit and p["verdict"] == "identified"
            # A 95 % interval may miss the truth; twice as wide it does not, for this seed.
            assert abs(p["value"] - truth) < high - low
        assert found["held_out"]["swing"] < 0.05 * found["baseline"]["swing"]
        assert found["seconds"] > 0

    def test_what_it_writes(self, config: Path) -> None:
        edited(config, 'figures = "none"', 'figures = "svg"')
        result = run("fit", config, "--output", "there")
        assert result.exit_code == 0, result.output
        names = {p.name for p in Path("there").iterdir()}
        assert names == {
            "fit.json",
            "report.txt",
            "parameters.csv",
            "report.html",
            "fitted.toml",
            "predicted_swing.npz",
            "predicted_swing.json",
            "swing_markers.svg",
            "swing_residuals.svg",
            "estimates.svg",
        }
        saved = sb.FitResult.load("there/fit.json")
        assert saved["rope_EI"].value == pytest.approx(1e-3, rel=0.05)
        assert "rope_EI" in result.stdout and "identified" in result.stdout and "iteration" in result.stdout

    def test_static_shapes_are_drawn_from_end_to_end(self, config: Path) -> None:
        edited(config, "held_out = [0.2, 0.31]", "static = true")
        edited(config, "[parameters.rope_bend_damping]", "")
        edited(config, 'figures = "none"', 'figures = "png"')
        result = run("fit", config)
        assert result.exit_code in (0, 3, 4), result.output
        assert (Path("out") / "swing" / "shapes.png").stat().st_size > 5000

    def test_a_fitted_configuration_and_from_start_at_the_end(self, config: Path) -> None:
        first = last_line(run("fit", config, "--json"))
        again = last_line(run("fit", "out/swing/fitted.toml", "--json", "--output", "again"))
        resumed = last_line(run("fit", config, "--json", "--from", "out/swing/fit.json", "--output", "resumed"))
        assert first["iterations"] >= 3
        for other in (again, resumed):
            assert other["iterations"] <= 1
            assert other["cost"] == pytest.approx(first["cost"], rel=1e-9)

    def test_a_simulation_of_a_fitted_configuration_is_what_the_fit_predicts(self, config: Path) -> None:
        """On the mesh of the configuration, which values at the limit of fine meshes do not explain."""
        recorded(Path(), 24)
        whole = sb.Recording.load("swing.npz")
        whole.select(whole.markers[::4]).save("swing.npz")
        edited(config, "segments = 24", "segments = 6")
        edited(config, "double_segments = false", "double_segments = true\nlinear_refits = true")
        arcs = "\n".join(f"{marker} = {k / 40}" for k, marker in enumerate(whole.markers) if k % 4 == 0)
        edited(config, "pinned = [0]\n", f"pinned = [0]\n[scene.rope.markers]\n{arcs}\n")
        found = last_line(run("fit", config, "--json"))
        starts = tomllib.loads(Path("out/swing/fitted.toml").read_text())["parameters"]
        assert abs(starts["rope_EI"]["initial"] / found["parameters"]["rope_EI"]["value"] - 1.0) > 1e-3
        assert run("simulate", "out/swing/fitted.toml", "--output", "simulated").exit_code == 0
        fitted, simulated = (
            sb.Recording.load(f"{folder}/predicted_swing.npz").positions for folder in ("out/swing", "simulated")
        )
        assert np.abs(simulated[: len(fitted)] - fitted).max() < 1e-9

    def test_private_parameters_start_from_a_fit_too(self, config: Path) -> None:
        edited(config, "[parameters.rope_bend_damping]", "[parameters.rope_bend_damping]\nprivate = true")
        first = last_line(run("fit", config, "--json"))
        assert "rope_bend_damping[swing]" in first["parameters"]
        resumed = last_line(run("fit", config, "--json", "--from", "out/swing/fit.json", "--output", "resumed"))
        assert resumed["iterations"] <= 1

    def test_nothing_identifiable_exits_3(self, config: Path) -> None:
        # Only the product of density and gravity pulls on an inextensible rope without bending, and motion does not
        # show it either.
        edited(config, "EA = 1e3\nEI = 2e-3\nbend_damping = 0.02\n", "")
        edited(
            config,
            "[parameters.rope_EI]\nlower = 1e-5\nupper = 1.0\n\n[parameters.rope_bend_damping]\n",
            "[parameters.rope_density]\n",
        )
        found = last_line(run("fit", config, "--json"))
        assert found["parameters"]["rope_density"]["verdict"] == "not identifiable"
        assert found["exit_code"] == 3

    def test_strict_exits_3_when_one_is_not_identifiable(self, config: Path) -> None:
        config.write_text(
            config.read_text()
            + '\n[scene.quantities.idle]\nvalue = 1.0\nunit = "m"\nscale = 1.0\n\n[parameters.idle]\n'
        )
        found = last_line(run("fit", config, "--json"))
        assert found["parameters"]["idle"]["verdict"] == "not identifiable" and found["exit_code"] == 0
        assert last_line(run("fit", config, "--json", "--strict"))["exit_code"] == 3
        edited(config, "[fit]", "[fit]\nstrict = true")
        assert last_line(run("fit", config, "--json"))["exit_code"] == 3

    def test_too_few_iterations_exit_4(self, config: Path) -> None:
        edited(config, "[fit]", "[fit]\nmax_iterations = 1")
        found = last_line(run("fit", config, "--json"))
        assert not found["converged"] and found["exit_code"] == 4

    def test_a_start_that_diverges_exits_4(self, config: Path) -> None:
        edited(config, "EI = 2e-3", "EI = 1e300")
        result = run("fit", config, "--json")
        assert result.exit_code in (2, 4)
        assert last_line(result)["error"]["message"]

    def test_refinement_enters_the_intervals(self, config: Path) -> None:
        edited(config, "halve_step = false\ndouble_segments = false", "halve_step = true\ndouble_segments = true")
        found = last_line(run("fit", config, "--json"))
        assert found["parameters"]["rope_EI"]["discretization"] > 0

    def test_time_step_and_mesh_count_unless_they_are_switched_off(self, config: Path) -> None:
        found = run("fit", config)
        assert "time step not counted" in found.stdout and "mesh not counted" in found.stdout
        off = last_line(run("fit", config, "--json"))
        assert off["not_counted"] == ["time step not counted", "mesh not counted"]
        edited(config, "[fit]\nhalve_step = false\ndouble_segments = false\n", "")
        found = last_line(run("fit", config, "--json"))
        assert found["not_counted"] == []
        assert [made["name"] for made in found["refits"]] == ["time step", "finer mesh"]
        made = tomllib.loads(Path(found["output"], "fitted.toml").read_text())["parameters"]
        for name, (parameter, moved) in {n: (made[n], found["refits"][1]["moved"][n]) for n in made}.items():
            assert parameter["finer"] == pytest.approx(parameter["initial"] + moved, rel=1e-12) and moved != 0, name
        rope = found["parameters"]["rope_EI"]
        assert rope["half_width"] > 2 * off["parameters"]["rope_EI"]["half_width"]
        # The recording is of the fit's own mesh: its estimate stays.
        assert rope["moved"] == 0 and any("double_segments = false" in warning for warning in found["warnings"])
        assert rope["interval"][0] < 1e-3 < rope["interval"][1]

    def test_ctrl_c_reports_the_best_so_far(self, tmp_path: Path) -> None:
        recorded(tmp_path, 100)
        edited(tmp_path / "my.toml", "substeps = 4", "substeps = 30")
        command = [sys.executable, "-m", "sheetbend", "fit", "my.toml", "--json"]
        with subprocess.Popen(
            command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=dict(os.environ)
        ) as process:
            assert process.stderr is not None and process.stdout is not None
            for line in process.stderr:
                if line.startswith("iteration"):
                    process.send_signal(signal.SIGINT)
                    break
            stopped = time.perf_counter()
            rest = process.stderr.read()
            found = json.loads(process.stdout.read().splitlines()[-1])
            # One evaluation more and the report take less than a second here; a profile or the rest of the fit takes
            # minutes.
            assert time.perf_counter() - stopped < 20.0
        assert process.returncode == 130, rest
        assert found["interrupted"] and not found["converged"]
        assert "best point so far" in rest
        assert sb.FitResult.load(tmp_path / "out" / "swing" / "fit.json").interrupted


class TestCheck:
    def test_passes(self, config: Path) -> None:
        found = last_line(run("check", config, "--json"))
        assert found["growth"]["swing"]["until"] is None
        assert found["passed"] and found["exit_code"] == 0
        gradients = found["gradients"]["swing"]["gradients"]
        assert gradients["rope_EI"]["complex_step"] < 1e-8 and gradients["rope_EI"]["passed"]
        columns = found["jacobians"]["swing"]["parameters"]
        assert set(columns) == {"rope_EI", "rope_bend_damping"} and all(c["passed"] for c in columns.values())

    @pytest.mark.parametrize("ends", ["pinned = [0]", "clamp_start = [1.0, 0.0, 0.0]"], ids=["straight", "bent"])
    def test_equilibria_are_checked_through_their_residuals(self, config: Path, ends: str) -> None:
        edited(config, "held_out = [0.2, 0.31]", "static = true")
        edited(config, "pinned = [0]", ends)  # hanging straight, no shape depends on EI; clamped level, all of it does
        edited(config, "[parameters.rope_bend_damping]", "")
        found = last_line(run("check", config, "--json"))
        assert found["exit_code"] == 0 and not found["gradients"]
        assert found["jacobians"]["swing"]["parameters"]["rope_EI"]["passed"]

    def test_a_scene_without_recordings(self, config: Path) -> None:
        text = config.read_text()
        config.write_text(text[: text.index("[[recording]]")])
        assert last_line(run("check", config, "--json"))["exit_code"] == 0

    def test_a_wrong_gradient_exits_5(self, config: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        from sheetbend.cli import check

        def wrong(scene: sb.Scene, *_: object, **__: object) -> GradientReport:
            return GradientReport(scene.name, 1, (GradientRow("rope_EI", 1, 1.0, 1e-3, 1e-3, False),), 0.0)

        monkeypatch.setattr(check, "check_gradients", wrong)
        result = run("check", config)
        assert result.exit_code == 5 and "<- fails" in result.stdout

    @pytest.mark.parametrize("static", [False, True])
    @pytest.mark.parametrize(
        "wrong", [lambda J: 1.001 * J, np.zeros_like, lambda J: J + 1.0], ids=["scaled", "zero", "moved"]
    )
    def test_a_wrong_jacobian_exits_5(
        self, config: Path, monkeypatch: pytest.MonkeyPatch, wrong: Callable, static: bool
    ) -> None:
        from sheetbend.problem.problem import FitProblem

        exact = FitProblem.evaluate
        if static:  # bent by its own weight, so that its shape depends on EI
            edited(config, "held_out = [0.2, 0.31]", "static = true")
            edited(config, "pinned = [0]", "clamp_start = [1.0, 0.0, 0.0]")
            edited(config, "[parameters.rope_bend_damping]", "")

        def mistaken(self: FitProblem, u: np.ndarray, jacobian: bool = True) -> tuple[bool, np.ndarray, np.ndarray]:
            ok, r, J = exact(self, u, jacobian)
            return ok, r, wrong(J)

        monkeypatch.setattr(FitProblem, "evaluate", mistaken)
        found = last_line(run("check", config, "--json"))
        assert found["exit_code"] == 5 and not found["jacobians"]["swing"]["parameters"]["rope_EI"]["passed"]


class TestSimulate:
    def test_motion(self, config: Path) -> None:
        found = last_line(run("simulate", config, "--json", "--output", "sim"))["simulated"]["swing"]
        with np.load(found["npz"]) as saved:
            assert saved["positions"].shape == (31, 7, 3) == saved["velocities"].shape
            np.testing.assert_allclose(saved["times"], np.arange(31) / 100, atol=1e-12)
            assert saved["force_rope_stretch"].shape == (31, 6, 1)
        assert found["frames"] == 31 and found["particles"] == 7
        marker = sb.Recording.load("sim/predicted_swing.npz").positions
        finer = last_line(run("simulate", config, "--json", "--output", "fine", "--finer"))["simulated"]["swing"]
        off = np.abs(sb.Recording.load("fine/predicted_swing.npz").positions - marker)
        assert finer["particles"] == 13 and 0.0 < off.max() < 0.05  # other links, the same markers
        fine = sb.Recording.load("fine/predicted_swing.npz").positions
        edited(config, "[parameters.rope_EI]\n", "[parameters.rope_EI]\nfiner = 1e-3\n")
        run("simulate", config, "--output", "same")
        assert np.array_equal(sb.Recording.load("same/predicted_swing.npz").positions, marker)
        run("simulate", config, "--output", "soft", "--finer")
        assert np.abs(sb.Recording.load("soft/predicted_swing.npz").positions - fine).max() > 1e-3

    def test_equilibrium(self, config: Path) -> None:
        edited(config, "held_out = [0.2, 0.31]", "static = true")
        found = last_line(run("simulate", config, "--json"))["simulated"]["swing"]
        with np.load(found["npz"]) as saved:
            assert saved["positions"].shape == (1, 7, 3)
            # The top link bears the weight of what hangs below it, in whatever direction.
            assert np.abs(saved["force_rope_stretch"]).max() == pytest.approx(0.05 * 0.6 * 9.81, rel=0.1)

    def test_motion_from_equilibrium_stays(self, config: Path) -> None:
        edited(config, "sigma = 1e-4", 'sigma = 1e-4\nstart = "equilibrium"')
        found = last_line(run("simulate", config, "--json"))["simulated"]["swing"]
        assert found["largest_displacement"] < 1e-6

    def test_without_a_recording(self, config: Path) -> None:
        text = config.read_text()
        config.write_text(text[: text.index("[[recording]]")].replace("substeps = 4", "h = 0.002"))
        found = last_line(run("simulate", config, "--json", "--duration", "0.1"))["simulated"]["swing"]
        assert found["frames"] == 11 and found["duration"] == pytest.approx(0.1)
        finer = last_line(run("simulate", config, "--json", "--duration", "0.1", "--finer"))["simulated"]["swing"]
        assert (found["particles"], finer["particles"]) == (7, 13)

    @pytest.mark.parametrize(
        ("options", "field"),
        [(("--duration", "-1"), "--duration"), (("--recording", "other"), "--recording")],
        ids=["duration", "recording"],
    )
    def test_bad_options(self, config: Path, options: tuple[str, str], field: str) -> None:
        assert last_line(run("simulate", config, "--json", *options))["error"]["field"] == field


class TestInfo:
    def test_installation(self) -> None:
        found = last_line(run("info", "--json"))
        assert found["sheetbend"] == sb.__version__ and isinstance(found["ceres"], bool)
        assert found["constraints"]["distance"] == 2 and set(found["constraints"]) == set(sb.KINDS)
        kernels = found["kernels"]
        assert kernels["used"] in kernels["compiled"] and kernels["compiled"][-1] == "portable"

    def test_configuration(self, config: Path) -> None:
        found = last_line(run("info", config, "--json"))["config"]
        (scene,) = found["scenes"]
        assert (
            scene["particles"] == 7
            and scene["dofs"] == 18
            and scene["constraints"] == {"rope_stretch": 6, "rope_bend": 5}
        )
        assert found["parameters"] == ["rope_EI", "rope_bend_damping"] and found["quantities"]["rope_length"] == 0.6
        assert found["growth"]["swing"]["largest"] >= 1.0 and found["growth"]["swing"]["until"] is None

    def test_recording(self, config: Path) -> None:
        x = np.full((4, 2, 3), np.nan)
        x[:, 0], x[1:, 1] = [0.1, 0.2, 0.3], [0.4, 0.5, 0.6]
        recording = sb.Recording(x, np.arange(4) / 100, ("grip[0]", "tip"), ("grip[0]",), gravity=(0, -9.81, 0))
        recording.save(config.parent / "take.csv")
        shown = run("info", config.parent / "take.csv")
        assert shown.exit_code == 0 and "4 frames, 2 markers" in shown.output and "grip[0]" in shown.output
        assert "constraints" not in shown.output  # what is installed is shown without a file alone
        assert "25.0%" in shown.output
        found = last_line(run("info", config.parent / "take.csv", "--json"))["recording"]
        assert found["markers"] == {"grip[0]": [0.1, 0.2, 0.3], "tip": [0.4, 0.5, 0.6]}
        assert found["clamped"] == ["grip[0]"] and found["gravity"] == [0, -9.81, 0] and found["frames"] == 4


class TestBadInput:
    @pytest.mark.parametrize("command", ["fit", "check", "simulate", "info"])
    def test_every_command_names_the_key_and_exits_2(self, config: Path, command: str) -> None:
        edited(config, "segments = 6", "segmnts = 6")
        result = run(command, config, "--json")
        found = last_line(result)
        assert result.exit_code == 2 and found["error"]["field"] == "scene.rope[0].segmnts"
        assert "did you mean 'segments'" in found["error"]["fix"]
        assert "scene.rope[0].segmnts" in result.stderr

    def test_missing_file(self) -> None:
        result = run("fit", "nowhere.toml")
        assert result.exit_code == 2 and "nowhere.toml" in result.stderr and result.stdout == ""

    @pytest.mark.parametrize(
        ("cut", "field"),
        [("[[recording]]", "recording"), ("[parameters.rope_EI]", "parameters")],
        ids=["recording", "parameters"],
    )
    def test_nothing_to_fit(self, config: Path, cut: str, field: str) -> None:
        text = config.read_text()
        config.write_text(text[: text.index(cut)])
        assert last_line(run("fit", config, "--json"))["error"]["field"] == field

    def test_all_recordings_only_predicted(self, config: Path) -> None:
        edited(config, "sigma = 1e-4", 'sigma = 1e-4\npredict = "window"')
        assert last_line(run("fit", config, "--json"))["error"]["field"] == "recording[0].predict"

    def test_unknown_start(self, config: Path) -> None:
        edited(config, "[fit]", "[fit]\nstarts = [{ rope_EA = 1.0 }]")
        assert last_line(run("fit", config, "--json"))["error"]["field"] == "fit.starts[0].rope_EA"

    def test_from_what_is_no_fit(self, config: Path) -> None:
        assert last_line(run("fit", config, "--json", "--from", "no.json"))["error"]["field"] == "--from"
        for content in (b"{}", b"[]", b"no json", b"\x80\x81"):
            Path("bad.json").write_bytes(content)
            assert run("fit", config, "--from", "bad.json").exit_code == 2

    @pytest.mark.parametrize("command", ["fit", "simulate"])
    @pytest.mark.parametrize("folder", ["my.toml", "my.toml/below"])
    def test_output_that_takes_no_files(self, config: Path, command: str, folder: str) -> None:
        error = last_line(run(command, config, "--json", "--output", folder))["error"]
        assert error["field"] == "--output" and error["got"] == repr(folder)

    def test_a_plan_that_cannot_be_written_costs_no_work(self, config: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        from sheetbend.cli import identify

        def work(*_: object, **__: object) -> None:
            raise AssertionError("it planned")

        monkeypatch.setattr(identify, "run_identify", work)
        error = last_line(run("identify", config, "--json", "--output", "swing.npz"))["error"]
        assert error["field"] == "--output" and error["problem"] == "is a file"

    @pytest.mark.parametrize("command", ["fit", "simulate"])
    def test_a_movie_that_cannot_be_written_costs_no_work(self, config: Path, command: str) -> None:
        error = last_line(run(command, config, "--json", "--movie", "my.toml/swing.gif"))["error"]
        assert error["field"] == "--movie" and not Path("out").exists()

    @pytest.mark.parametrize("command", ["fit", "simulate"])
    def test_help_tells_where_results_go(self, command: str) -> None:
        assert "out/NAME" in run(command, "--help").stdout

    def test_unknown_option(self, config: Path) -> None:
        assert run("fit", config, "--fast").exit_code == 2


class TestInstallation:
    @pytest.mark.parametrize("package", cli.NEEDS)
    def test_missing_packages_are_one_clear_sentence(
        self, package: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
    ) -> None:
        monkeypatch.setitem(sys.modules, package, None)
        with pytest.raises(SystemExit) as ended:
            cli.main()
        assert ended.value.code == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert package in line and "pip install 'sheetbend[cli]'" in line

    def test_module_runs_and_stays_light(self) -> None:
        heavy = "('torch', 'scipy', 'matplotlib')"
        code = f"import sys; from sheetbend.cli.app import app; print([m for m in {heavy} if m in sys.modules])"
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
        assert done.stdout.strip() == "[]"
        version = subprocess.run(
            [sys.executable, "-m", "sheetbend", "--version"], capture_output=True, text=True, check=True
        )
        assert version.stdout.strip() == f"sheetbend {sb.__version__}"


def test_bench_says_where_it_went() -> None:
    found = run("bench", "W2", "--threads", 2, "--json")
    assert found.exit_code == 2
    assert "python experiments/bench/measure.py W2 --threads 2" in last_line(found)["error"]["fix"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["new", "take.csv", "--density", "50g/m"], "--density: must be a number (got '50g/m'). Fix: write the number"),
        (["new", "take.csv", "--density", "0,05"], "Fix: write 0.05, with a point as decimal mark."),
        (["new", "take.csv", "--length=abc"], "--length: must be a number (got 'abc'). Fix: give a number."),
        (["fit", "my.toml", "--workers", "two"], "--workers: must be a whole number (got 'two')"),
        (["identify", "my.toml", "--noise", "1mm"], "without its unit"),
    ],
)
def test_numbers_of_options_say_what_they_got(arguments: list[str], words: str) -> None:
    """Only that a text could not be parsed was said, without the text."""
    done = CliRunner().invoke(app, arguments)
    shown = " ".join(re.sub(r"[\u2500-\u257f]", " ", done.output).split())
    assert done.exit_code == 2 and words in shown, done.output


def test_numbers_of_options_are_read_as_before() -> None:
    done = CliRunner().invoke(app, ["new", "none.csv", "--density", "-1e-3"])
    assert "--density: must be positive" in done.output
    assert "is not a file" in CliRunner().invoke(app, ["new", "none.csv", "--density=.5"]).output
