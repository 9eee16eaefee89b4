"""sheetbend fit that is killed, stopped or short of something: what is kept, resumed, refused and told."""

from __future__ import annotations

import errno
import fcntl
import importlib
import importlib.abc
import json
import os
import shutil
import signal
import subprocess
import sys
import textwrap
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
import sheetbend as sb
from commands import last_line, run
from sheetbend import cli
from sheetbend.cli.stopping import Stopping
from sheetbend.minimum import by_ceres
from sheetbend.minimum.by_ceres import has_ceres
from sheetbend.minimum.progress import Progress
from sheetbend.problem.journal import Journal
from typer.testing import Result

WRITTEN = {
    "fit.json",
    "report.txt",
    "parameters.csv",
    "report.html",
    "fitted.toml",
    "predicted_swing.npz",
    "predicted_swing.json",
}
ROPE = """\
[experiment]
name = "swing"

[solver]
substeps = 4

[[scene.rope]]
name = "rope"
length = 0.6
segments = 6
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

[output]
figures = "none"

[fit]
max_iterations = 50

[parameters.rope_EI]
lower = 1e-5
upper = 1.0

[parameters.rope_bend_damping]
"""
OUT = Path("out/swing")

# Optimizers choose by time how often to ask.
TIMED = ("seconds", "jacobian_seconds", "evaluations", "jacobians", "judging")


def record(seed: int) -> None:
    scene = sb.rope(0.6, 6, density=0.05, EA=1e3, EI=1e-3, bend_damping=0.01)
    motion = sb.simulate(scene, np.arange(31) / 100, sb.Solver(h=1 / 800))
    noise = 1e-4 * np.random.default_rng(seed).standard_normal(motion.positions.shape)
    sb.Recording(positions=motion.positions + noise, times=motion.times, name="swing").save("swing.npz")


@pytest.fixture
def config(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    record(1)
    Path("my.toml").write_text(ROPE)
    return Path("my.toml")


def results() -> dict[str, Any]:
    found = json.loads((OUT / "fit.json").read_text())
    return {key: value for key, value in found.items() if key not in TIMED}


def stopped(config: Path, monkeypatch: pytest.MonkeyPatch, error: BaseException, at: int = 3) -> Result:
    """A fit into which an iteration raises."""
    from sheetbend.cli.progress import Iterations

    def raises(self: Iterations, progress: Progress) -> None:
        if progress.iteration >= at:
            raise error

    with monkeypatch.context() as patch:
        patch.setattr(Iterations, "__call__", raises)
        return run("fit", config, "--json")


class TestResume:
    def test_after_a_kill_the_result_is_that_of_an_uninterrupted_fit(self, config: Path) -> None:
        assert run("fit", config, "--output", "whole").exit_code == 0
        command = [sys.executable, "-m", "sheetbend", "fit", "my.toml"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            assert process.stdout is not None
            for line in process.stdout:
                if line.startswith("iteration   4"):
                    process.kill()
        assert process.returncode == -signal.SIGKILL
        names = {p.name for p in OUT.iterdir()}
        assert names <= {"journal.sqlite", "journal.sqlite-wal", ".running"} and "journal.sqlite" in names
        resumed = run("fit", config, "--resume")
        assert resumed.exit_code == 0, resumed.output
        assert "continues with" in resumed.stdout and " 0 evaluations" not in resumed.stdout
        whole = json.loads(Path("whole/fit.json").read_text())
        assert results() == {key: value for key, value in whole.items() if key not in TIMED}
        assert {p.name for p in OUT.iterdir()} == WRITTEN

    def test_after_ctrl_c_it_goes_on_to_the_end(self, config: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        result = stopped(config, monkeypatch, KeyboardInterrupt())
        assert last_line(result)["interrupted"] and result.exit_code == 130
        assert "--resume continues from here" in result.stderr and (OUT / "journal.sqlite").exists()
        found = last_line(run("fit", config, "--json", "--resume"))
        assert found["converged"] and not found["interrupted"] and found["exit_code"] == 0
        assert not (OUT / "journal.sqlite").exists()

    def test_ctrl_c_before_there_is_a_result_keeps_the_journal(
        self, config: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        def stops(*args: object, **options: object) -> None:
            raise KeyboardInterrupt

        monkeypatch.setattr("sheetbend.cli.fit.run_fit", stops)
        result = run("fit", config)
        assert result.exit_code == 130 and "--resume continues from here" in result.stdout
        assert (OUT / "journal.sqlite").exists() and not (OUT / "fit.json").exists()

    @pytest.mark.parametrize(
        ("old", "new", "named"),
        [
            ("max_iterations = 50", "max_iterations = 60", "[fit]"),
            ("segments = 6", "segments = 7", "[scene]"),
            ("lower = 1e-5", "lower = 1e-6", "[parameters]"),
        ],
    )
    def test_another_configuration_is_refused(
        self, old: str, new: str, named: str, config: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        stopped(config, monkeypatch, KeyboardInterrupt())
        config.write_text(ROPE.replace(old, new))
        error = last_line(run("fit", config, "--json", "--resume"))["error"]
        assert error["field"] == "--resume" and f"different are {named}" in error["problem"]
        assert (OUT / "journal.sqlite").exists()  # the mistake costs nothing
        config.write_text(ROPE)
        assert run("fit", config, "--resume").exit_code == 0

    def test_another_recording_is_refused(self, config: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        stopped(config, monkeypatch, KeyboardInterrupt())
        record(2)
        error = last_line(run("fit", config, "--json", "--resume"))["error"]
        assert error["field"] == "--resume" and "recording 0 'swing'" in error["problem"]

    def test_what_is_drawn_and_threads_may_change(self, config: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        stopped(config, monkeypatch, KeyboardInterrupt())
        config.write_text(ROPE.replace('"none"', '"svg"').replace("[fit]", "[fit]\nthreads = 2"))
        result = run("fit", config, "--resume")
        assert result.exit_code == 0 and "continues with" in result.stdout

    def test_without_a_journal_it_begins(self, config: Path) -> None:
        result = run("fit", config, "--resume")
        assert result.exit_code == 0 and "nothing to resume in out/swing" in result.stdout

    def test_without_the_option_it_begins_anew_and_says_so(self, config: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        stopped(config, monkeypatch, KeyboardInterrupt())
        config.write_text(ROPE.replace("segments = 6", "segments = 7"))
        result = run("fit", config)
        assert result.exit_code == 0 and "starts anew: the unfinished run" in result.stdout

    def test_the_old_spelling_names_the_new_one(self, config: Path) -> None:
        assert run("fit", config).exit_code == 0
        error = last_line(run("fit", config, "--json", "--resume", "out/swing/fit.json"))["error"]
        assert error["field"] == "--resume" and "--from fit.json" in error["fix"]

    def test_a_journal_that_cannot_be_used_costs_no_fit(self, config: Path) -> None:
        (OUT / "journal.sqlite").mkdir(parents=True)
        found = run("fit", config, "--resume")
        assert found.exit_code == 2 and "cannot go on" in found.output
        found = run("fit", config)
        assert found.exit_code == 2 and "cannot be removed" in found.output
        (OUT / "journal.sqlite").rmdir()
        assert run("fit", config).exit_code == 0


class TestStopping:
    def test_sigterm_reports_the_best_so_far_and_exits_143(self, config: Path) -> None:
        config.write_text(ROPE.replace("segments = 6", "segments = 80").replace("substeps = 4", "substeps = 20"))
        command = [sys.executable, "-m", "sheetbend", "fit", "my.toml", "--json"]
        pipe = subprocess.PIPE
        with subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True) as process:
            assert process.stderr is not None and process.stdout is not None
            for line in process.stderr:
                if line.startswith("iteration"):
                    process.send_signal(signal.SIGTERM)
                    break
            rest = process.stderr.read()
            found = json.loads(process.stdout.read().splitlines()[-1])
        assert process.returncode == found["exit_code"] == 143, rest
        assert found["interrupted"] and sb.FitResult.load(OUT / "fit.json").interrupted
        assert (OUT / "journal.sqlite").exists() and not (OUT / ".running").exists()

    def test_what_stood_before_comes_back(self, config: Path) -> None:
        before = signal.getsignal(signal.SIGTERM), sys.unraisablehook
        run("fit", config)
        assert (signal.getsignal(signal.SIGTERM), sys.unraisablehook) == before

    @pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
    def test_an_interrupt_that_comes_in_a_destructor_is_not_lost(self, number: signal.Signals) -> None:
        class Last:
            def __del__(self) -> None:
                signal.raise_signal(number)
                gone.append("the destructor went on")

        def work(stopping: Stopping) -> None:
            last = Last()
            with stopping:
                del last
                gone.append("Python went on")
                time.sleep(60)

        gone: list[str] = []
        stopping = Stopping()
        with pytest.raises(KeyboardInterrupt):
            work(stopping)
        assert gone == ["Python went on"] and stopping.terminated == (number == signal.SIGTERM)

    def test_other_exceptions_of_a_destructor_go_where_they_went(self, monkeypatch: pytest.MonkeyPatch) -> None:
        class Last:
            def __del__(self) -> None:
                raise ValueError("in a destructor")

        seen: list[object] = []
        monkeypatch.setattr(sys, "unraisablehook", lambda what: seen.append(what.exc_value))
        last = Last()
        with Stopping():
            del last
        assert [str(error) for error in seen] == ["in a destructor"]


class TestFolder:
    def test_a_second_run_is_refused(self, config: Path) -> None:
        OUT.mkdir(parents=True)
        with (OUT / ".running").open("w") as held:
            fcntl.flock(held, fcntl.LOCK_EX)
            error = last_line(run("fit", config, "--json"))["error"]
            assert error["field"] == "--output" and "another run" in error["problem"]
            assert run("fit", config, "--output", "elsewhere").exit_code == 0
        assert run("fit", config).exit_code == 0  # a lock ends with its process, whatever it leaves behind
        assert not (OUT / ".running").exists()

    def test_no_room_is_found_before_the_work(self, config: Path) -> None:
        """A limit on the size of files stands for the disk."""
        code = """
        import resource
        from sheetbend.cli.app import app
        resource.setrlimit(resource.RLIMIT_FSIZE, (1_000_000, 1_000_000))
        app(["fit", "my.toml", "--json"])
        """
        done = subprocess.run([sys.executable, "-c", textwrap.dedent(code)], capture_output=True, text=True)
        error = json.loads(done.stdout)["error"]
        assert done.returncode == 2 and error["field"] == "--output" and "room for 4 MB" in error["fix"]
        assert "iteration" not in done.stderr

    def test_a_disk_that_fills_up_keeps_the_earlier_result_and_the_work(
        self, config: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        assert run("fit", config).exit_code == 0
        earlier, whole = (OUT / "fit.json").read_bytes(), results()

        def full(source: Path, target: Path) -> None:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

        with monkeypatch.context() as patch:
            patch.setattr(os, "replace", full)
            error = last_line(run("fit", config, "--json"))["error"]
        assert error["field"] == "out/swing/fit.json"
        assert "No space left on device; the earlier file is kept" in error["problem"]
        assert (OUT / "fit.json").read_bytes() == earlier and (OUT / "journal.sqlite").exists()
        evaluated: list[bool] = []
        evaluate = Journal._keep

        def counted(self: Any, *arguments: Any) -> None:
            evaluated.append(True)
            evaluate(self, *arguments)

        monkeypatch.setattr(Journal, "_keep", counted)
        assert run("fit", config, "--resume").exit_code == 0
        assert not evaluated and results() == whole  # all of the work was read

    def test_a_folder_that_is_removed_meanwhile_is_made_again(
        self, config: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """All of the fit was lost: "cannot be written: No such file or directory"."""
        fit = cli.fit.run_fit

        def removing(*arguments: Any, **options: Any) -> sb.Fit:
            shutil.rmtree(OUT)
            return fit(*arguments, **options)

        monkeypatch.setattr(cli.fit, "run_fit", removing)
        result = run("fit", config)
        assert result.exit_code == 0, result.output
        assert f"{OUT} was removed while the fit ran, and is made again" in result.output
        assert {p.name for p in OUT.iterdir()} == WRITTEN


class Broken(importlib.abc.MetaPathFinder):
    """Refuses to load a module, with the error of a shared library that is not there."""

    def __init__(self, name: str, error: ImportError) -> None:
        self.name, self.error = name, error

    def find_spec(self, name: str, path: Sequence[str] | None, target: ModuleType | None = None) -> None:
        if name == self.name:
            raise self.error


class TestMissing:
    @pytest.fixture
    def broken_ceres(self, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
        if not has_ceres():
            pytest.skip("built without Ceres")
        error = ImportError("libceres.so.3: cannot open shared object file")
        monkeypatch.delitem(sys.modules, "sheetbend._ceres", raising=False)
        monkeypatch.delattr(sb, "_ceres", raising=False)
        import_module = importlib.import_module

        def refused(name: str, package: str | None = None) -> ModuleType:
            if name == "sheetbend._ceres":
                raise error
            return import_module(name, package)

        monkeypatch.setattr(importlib, "import_module", refused)
        by_ceres.ceres_trouble.cache_clear()
        yield
        by_ceres.ceres_trouble.cache_clear()

    @pytest.mark.usefixtures("broken_ceres")
    def test_a_ceres_that_does_not_load_is_stood_in_for(self, config: Path) -> None:
        found = last_line(run("fit", config, "--json"))
        assert found["exit_code"] == 0 and found["optimizer"] == "scipy"
        assert any("SciPy stands in for Ceres" in w and "libceres.so.3" in w for w in found["warnings"])

    @pytest.mark.usefixtures("broken_ceres")
    def test_and_refused_where_it_is_asked_for(self, config: Path) -> None:
        config.write_text(ROPE.replace("[fit]", '[fit]\noptimizer = "ceres"'))
        found = last_line(run("fit", config, "--json"))
        assert found["exit_code"] == 2 and "libceres.so.3" in found["error"]["problem"]

    def test_without_matplotlib_there_are_no_figures_and_it_says_so_first(
        self, config: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        config.write_text(ROPE.replace('figures = "none"', 'figures = "png"'))
        for name in [n for n in sys.modules if n.partition(".")[0] == "matplotlib"]:
            monkeypatch.delitem(sys.modules, name)
        monkeypatch.setattr(sys, "meta_path", [Broken("matplotlib", missing("matplotlib")), *sys.meta_path])
        result = run("fit", config)
        assert result.exit_code == 0, result.output
        words = result.stdout.index("no figures will be drawn: this needs matplotlib")
        assert words < result.stdout.index("iteration")
        assert {p.name for p in OUT.iterdir()} == WRITTEN

    def test_without_scipy_nothing_is_evaluated(self, config: Path) -> None:
        code = """
        import sys
        for name in ("scipy", "scipy.special"):
            sys.modules[name] = None
        from sheetbend.cli.app import app
        app(["fit", "my.toml", "--json"])
        """
        done = subprocess.run([sys.executable, "-c", textwrap.dedent(code)], capture_output=True, text=True)
        assert done.returncode == 2 and "pip install 'sheetbend[fit]'" in done.stdout, done.stderr
        assert "iteration" not in done.stderr


def missing(name: str) -> ModuleNotFoundError:
    return ModuleNotFoundError(f"No module named {name!r}", name=name)
