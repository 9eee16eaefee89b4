"""The journal of evaluations: what it keeps, what it refuses, and that a fit that goes on ends at the same bits."""

from __future__ import annotations

import json
import sqlite3
import subprocess
import sys
import textwrap
import time
from collections.abc import Callable
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sheetbend as sb
from sheetbend import _core
from sheetbend.experiment.wanted import as_parameters
from sheetbend.minimum.by_ceres import has_ceres
from sheetbend.minimum.optimizers import minimize
from sheetbend.minimum.progress import Progress
from sheetbend.minimum.time_step import halved
from sheetbend.problem import digests, journal, journal_values
from sheetbend.problem.journal import Journal
from sheetbend.problem.problem import FitProblem

WANTED = ("rope_EI", "rope_bend_damping")
OPTIMIZERS = ["scipy", *(["ceres"] if has_ceres() else [])]
SOLVER = sb.Solver(h=1 / 200)


def swinging(seed: int = 0, EI: float = 3e-3, name: str = "swing") -> sb.Experiment:
    def scene(EI: float) -> sb.Scene:
        return sb.rope(0.5, 6, density=0.05, EI=EI, bend_damping=0.01, clamp_start=(1, 0, 0))

    times = np.arange(20) / 50
    exact = sb.simulate(scene(1e-3), times, SOLVER).positions
    noise = 1e-3 * np.random.default_rng(seed).standard_normal(exact.shape)
    return sb.Experiment(scene=scene(EI), recording=sb.Recording(exact + noise, times, name=name), solver=SOLVER)


def problem_of(*experiments: sb.Experiment) -> FitProblem:
    return FitProblem(experiments, as_parameters(WANTED, experiments))


# Optimizers choose by time how often to ask.
TIMED = ("seconds", "jacobian_seconds", "evaluations", "jacobians", "judging")


def bits(fit: sb.Fit) -> str:
    data = fit.result.to_dict()
    return json.dumps({key: value for key, value in data.items() if key not in TIMED})


def stop_at(iteration: int) -> Callable[[Progress], None]:
    def observe(progress: Progress) -> None:
        if progress.iteration >= iteration and progress.window is None:
            raise KeyboardInterrupt

    return observe


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "journal.sqlite"


class TestEvaluations:
    def test_are_read_with_their_bits(self, path: Path) -> None:
        rng = np.random.default_rng(0)
        points = [problem_of(swinging()).parameters.initial() + 0.1 * rng.standard_normal(2) for _ in range(3)]
        expected = [problem_of(swinging()).core.evaluate(u) for u in points]
        with Journal(path) as kept:
            problem = problem_of(swinging())
            for u in points:
                problem.evaluate(u)
            assert (kept.made, kept.read) == (3, 0)
        with Journal(path) as kept:
            problem = problem_of(swinging())
            for u, (_, r, J) in zip(points, expected, strict=True):
                found = problem.evaluate(u)
                assert found[0] and found[1].tobytes() == r.tobytes() and found[2].tobytes() == J.tobytes()
                ok, alone, none = problem.evaluate(u, jacobian=False)  # what a value with a Jacobian holds too
                assert ok and alone.tobytes() == r.tobytes() and none.shape == (0, 2)
            assert (kept.made, kept.read, len(kept)) == (0, 6, 3)

    def test_a_jacobian_is_added_to_residuals(self, path: Path) -> None:
        for made in (2, 0):
            with Journal(path) as kept:
                problem = problem_of(swinging())
                u = problem.parameters.initial()
                problem.evaluate(u, jacobian=False)
                J = problem.evaluate(u)[2]
                assert (kept.made, len(kept)) == (made, 1)
                assert np.array_equal(J, problem.core.evaluate(u)[2])

    def test_a_jacobian_that_is_too_large_is_made_again(self, path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(journal, "LARGEST_JACOBIAN", 100)
        for _ in range(2):
            with Journal(path) as kept:
                problem = problem_of(swinging())
                u = problem.parameters.initial()
                assert np.array_equal(problem.evaluate(u)[2], problem.core.evaluate(u)[2])
                problem.evaluate(u, jacobian=False)
                assert (kept.made, kept.read) == (1, 1)

    @pytest.mark.parametrize("room", [0, 2000], ids=["nothing", "little"])
    def test_a_journal_does_not_grow_beyond_its_room(
        self, room: int, path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(journal, "ROOM", room)
        with Journal(path):
            problem = problem_of(swinging())
            for k in range(8):
                problem.evaluate(problem.parameters.initial() + 0.01 * k)
        sizes = "coalesce(sum(length(residuals) + coalesce(length(jacobian), 0)), 0)"
        with sqlite3.connect(path) as opened:
            size = opened.execute(f"SELECT {sizes} FROM evaluation").fetchone()[0]
        assert size <= 2 * room and (size > 0) == (room > 0)

    def test_only_what_is_not_zero_of_a_jacobian_is_kept(self) -> None:
        J = np.zeros((40, 30))
        J[3:7, 2:4], J[9, 9], J[10, 10] = np.pi, -0.0, np.nan
        packed = journal_values.pack(J)
        assert len(packed) == 40 * 30 / 8 + 8 * 10
        assert journal_values.unpack(packed, 40, 30).tobytes() == J.tobytes()

    def test_one_that_fails_is_made_again(self, path: Path) -> None:
        for _ in range(2):
            with Journal(path) as kept:
                problem = problem_of(swinging())
                u = problem.parameters.to_internal({"rope_EI": 1e-3, "rope_bend_damping": 1e300})
                u[0] = 600.0
                assert not problem.evaluate(u)[0]
                assert (kept.made, len(kept)) == (1, 0)

    @pytest.mark.parametrize("column", ["residuals", "jacobian"])
    def test_a_damaged_value_is_made_again(self, column: str, path: Path) -> None:
        """One bit of a number: SQLite does not see it, and the fit went on with it."""
        for turn, made in enumerate((1, 1, 0)):
            with Journal(path) as kept:
                problem = problem_of(swinging())
                u = problem.parameters.initial()
                _, r, J = problem.evaluate(u)
                assert kept.made == made and not kept.trouble
                assert r.tobytes() + J.tobytes() == b"".join(a.tobytes() for a in problem.core.evaluate(u)[1:])
            if turn == 0:
                with closing(sqlite3.connect(path, isolation_level=None)) as opened:
                    (value,) = opened.execute(f"SELECT {column} FROM evaluation").fetchone()
                    damaged = value[:30] + bytes([value[30] ^ 1]) + value[31:]
                    opened.execute(f"UPDATE evaluation SET {column} = ?", (damaged,))

    def test_other_problems_have_other_keys(self, path: Path) -> None:
        with Journal(path) as kept:
            u = problem_of(swinging()).parameters.initial()
            e = swinging()
            others = [
                e,
                swinging(seed=1),
                replace(e, sigma=2e-3),
                replace(e, solver=sb.Solver(h=1 / 400)),
                replace(e, fit=(0.0, 0.2)),
                replace(e, loss="huber"),
                swinging(EI=4e-3),  # not the value that is fitted, but where theta starts
            ]
            for number, other in enumerate(others, start=1):
                problem_of(other).evaluate(u)
                assert (kept.made, kept.read) == (number, 0)
            problem_of(swinging()).evaluate(u)
            assert (kept.made, kept.read) == (len(others), 1)

    def test_threads_share_evaluations(self, path: Path) -> None:
        experiments = [swinging(0, name="a"), swinging(1, name="b")]
        with Journal(path) as kept:
            for threads in (1, 2):
                problem = FitProblem(experiments, as_parameters(WANTED, experiments), threads=threads)
                problem.evaluate(problem.parameters.initial())
            assert (kept.made, kept.read) == (1, 1)

    @pytest.mark.parametrize("method", ["direct", "gauss_seidel", "newton", "newton_cg", "implicit"])
    def test_residuals_have_the_same_bits_with_and_without_a_jacobian(self, method: str) -> None:
        """On which it rests that a measured time may decide what an optimizer asks for, and that a value with a
        Jacobian serves for residuals."""
        mesh = sb.mesh.equilateral(0.3, 0.3, 4)
        scene = sb.Scene("towel")
        corners = mesh.sets["corners"][2:]
        cloth = sb.add_cloth(scene, mesh, density=0.2, warp=600, weft=400, shear=40, bending=3e-5, held=corners)
        scene.pin(cloth.particles[corners])
        times = np.arange(8) / 60
        solver = sb.Solver(h=1 / 240, method=method)
        exact = sb.simulate(scene, times, sb.Solver(h=1 / 240, method="newton")).positions
        places = [sb.on_particle(i) for i in range(exact.shape[1])]
        for static in (False, True):
            e = sb.Experiment(
                scene=scene, recording=sb.Recording(exact, times), markers=places, solver=solver, static=static
            )
            problem = FitProblem([e], as_parameters(["cloth_warp", "cloth_shear"], [e]))
            for step in (0.0, 0.1):
                u = problem.parameters.initial() + step
                (ok, r, _), (both, s, _) = problem.core.evaluate(u, False), problem.core.evaluate(u, True)
                assert ok and both and r.tobytes() == s.tobytes()


class TestFits:
    @pytest.mark.parametrize("optimizer", OPTIMIZERS)
    @pytest.mark.parametrize("options", [{"windows": [0.2]}, {"refine": sb.Refinement()}], ids=["windows", "refit"])
    def test_goes_on_where_it_was_stopped_and_ends_at_the_same_bits(
        self, optimizer: str, options: dict[str, Any], path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        given = {"parameters": WANTED, "optimizer": optimizer, **options}
        whole = sb.fit(swinging(), **given)
        stopped = sb.fit(swinging(), **given, journal=path, progress=stop_at(3))
        assert stopped.interrupted and path.exists()
        opened: list[Journal] = []

        class Noted(Journal):
            def __enter__(self) -> Noted:
                opened.append(self)
                return super().__enter__()

        monkeypatch.setattr(journal, "Journal", Noted)
        resumed = sb.fit(swinging(), **given, journal=path)
        assert bits(resumed) == bits(whole)
        assert opened[0].read > 3 and not path.exists()

    @pytest.mark.parametrize("optimizer", OPTIMIZERS)
    def test_a_finished_path_is_walked_without_one_evaluation(self, optimizer: str, path: Path) -> None:
        """Also where the optimizer chose by time to make Jacobians along."""
        ends = []
        for made in (True, False):
            with Journal(path) as kept:
                problem = problem_of(swinging())
                end, _ = minimize(problem, problem.parameters.initial(), optimizer)
                ends.append((end.u.tobytes(), end.cost, end.iterations, end.evaluations))
                assert (kept.made > 0) == made
        assert ends[0] == ends[1]

    def test_private_parameters_too(self, path: Path) -> None:
        e = swinging()
        fit = sb.fit(e, parameters={"rope_EI": {"private": True}}, journal=path)
        assert fit.values == sb.fit(swinging(), parameters={"rope_EI": {"private": True}}).values

    @pytest.mark.skipif(not has_ceres(), reason="built without Ceres")
    def test_what_an_evaluation_raises_passes_through_ceres(self) -> None:
        from sheetbend import _ceres

        def raises(u: np.ndarray, jacobian: bool) -> Any:
            raise ZeroDivisionError("from Python")

        with pytest.raises(ZeroDivisionError, match="from Python"):
            _ceres.minimize(
                evaluation=_core.evaluation_of(3, 2, raises),
                u=[0.0, 0.0],
                lower=[-np.inf] * 2,
                upper=[np.inf] * 2,
                max_iterations=5,
                tolerance=1e-9,
                observe=lambda *_: True,
                longest_step=[np.inf] * 2,
                held=[],
            )


def shaken() -> sb.Experiment:
    """A rope that hangs from a hand, whose recorded motion is noisy and corrected."""
    times = np.arange(16) / 50
    hand = 0.02 * np.minimum(times / 0.1, 1.0)[:, None] * np.sin(10 * times[:, None] + np.array([0.0, 0.3, 0.6]))

    def scene(motion: np.ndarray, EI: float) -> sb.Scene:
        made = sb.Scene("rope")
        rope = sb.add_rope(
            made, "rope", points=[[0, 0, 0], [0, 0, -0.4]], segments=4, density=0.05, EI=EI, bend_damping=0.02
        )
        made.follow(rope.particles[:1], times, motion[:, None], ["hand"])
        return made

    exact = sb.simulate(scene(hand, 2e-3), times, SOLVER).positions[:, [2, 4]]
    positions = np.concatenate([hand[:, None], exact], axis=1)
    positions += 3e-4 * np.random.default_rng(0).standard_normal(positions.shape)
    return sb.Experiment(
        scene=scene(positions[:, 0], 3e-3),
        recording=sb.Recording(positions, times, markers=("hand", "a", "b")),
        markers=[None, sb.on_particle(2), sb.on_particle(4)],
        solver=SOLVER,
        sigma=3e-4,
        driven_sigma=3e-4,
    )


class TestCorrections:
    """Their evaluations depend on where the last one ended."""

    def test_a_restored_state_goes_on_to_the_same_bits(self) -> None:
        problem, other, untouched = problem_of(shaken()), problem_of(shaken()), problem_of(shaken())
        u = problem.parameters.initial()
        problem.core.evaluate(u, True)
        problem.core.evaluate(u + 0.1, False)
        problem.core.relinearize()
        other.core.restore(problem.core.state())
        for step in (0.15, 0.3):
            (_, r, J), (_, s, K) = (p.core.evaluate(u + step, True) for p in (problem, other))
            assert r.tobytes() == s.tobytes() and J.tobytes() == K.tobytes()
            assert problem.core.absorbed(0) == other.core.absorbed(0)
            assert problem.core.state().tobytes() == other.core.state().tobytes()
        _, r, _ = untouched.core.evaluate(u + 0.3, True)
        assert r.tobytes() != s.tobytes()  # else this shows nothing

    def test_a_problem_that_follows_another_goes_on_to_the_same_bits(self, path: Path) -> None:
        """Its corrections are guided by the response of the other one, which no state holds."""

        def ends(points: tuple[float, ...]) -> list[bytes]:
            problem = problem_of(shaken())
            u = problem.parameters.initial()
            problem.evaluate(u)
            other = problem.of(halved(problem.experiments)).follow(problem)
            return [other.evaluate(u + step, jacobian=False)[1].tobytes() for step in points]

        whole = ends((0.0, 0.05, 0.1))
        with Journal(path):
            ends((0.0,))
        with Journal(path) as journal:
            assert ends((0.0, 0.05, 0.1)) == whole
            assert journal.read == 2 and journal.made == 2

    @pytest.mark.parametrize("optimizer", OPTIMIZERS)
    def test_a_fit_goes_on_to_the_same_bits(self, optimizer: str, path: Path) -> None:
        given = {"parameters": WANTED, "optimizer": optimizer, "profiles": False}
        whole = sb.fit(shaken(), **given)
        assert sb.fit(shaken(), **given, journal=path, progress=stop_at(2)).interrupted
        assert bits(sb.fit(shaken(), **given, journal=path)) == bits(whole)


class TestRefusals:
    def begun(self, path: Path) -> None:
        with Journal(path, {"[fit]": "abc"}):
            problem = problem_of(swinging())
            problem.evaluate(problem.parameters.initial())

    def test_another_recording(self, path: Path) -> None:
        self.begun(path)
        with Journal(path, {"[fit]": "abc"}), pytest.raises(sb.InputError, match="experiment 'swing'"):
            problem_of(swinging(seed=1)).evaluate(np.zeros(2))

    def test_other_parameters(self, path: Path) -> None:
        self.begun(path)
        e = swinging()
        problem = FitProblem([e], as_parameters(["rope_EI"], [e]))
        with Journal(path, {"[fit]": "abc"}):
            other = FitProblem([e], as_parameters(["rope_EI"], [e]))
            with pytest.raises(sb.InputError, match="different are parameters"):
                other.evaluate(problem.parameters.initial())

    def test_another_configuration(self, path: Path) -> None:
        self.begun(path)
        with pytest.raises(sb.InputError, match=r"different are \[fit\] \(abc then, abd now\)"):
            Journal(path, {"[fit]": "abd"})
        Journal(path, {"[fit]": "abc"}).close()  # which was not changed by that

    @pytest.mark.parametrize("label", ["sheetbend", "compiled _core", "processor", "C library", "NumPy"])
    def test_another_version_or_machine(self, label: str, path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self.begun(path)
        software = digests.of_software()
        monkeypatch.setattr(digests, "of_software", lambda: software | {label: "other"})
        with pytest.raises(sb.InputError, match=f"{label} .* then, other now"):
            Journal(path, {"[fit]": "abc"})

    def test_what_is_no_journal(self, path: Path) -> None:
        path.write_text("notes " * 1000)
        with pytest.raises(sb.InputError, match="cannot be used"):
            Journal(path)
        assert path.read_text() == "notes " * 1000

    def test_a_damaged_list_of_tables(self, path: Path) -> None:
        """What SQLite says of it is no text: a UnicodeDecodeError."""
        Journal(path).close()
        path.write_bytes(path.read_bytes().replace(b"TABLE about", b"T\xffBLE about"))
        with pytest.raises(sb.InputError, match="cannot be used"):
            Journal(path)

    def test_what_has_other_tables(self, path: Path) -> None:
        """A view without an end took all of the time that there is."""
        Journal(path).close()
        endless = "WITH RECURSIVE n(k) AS (SELECT 1 UNION ALL SELECT k + 1 FROM n)"
        with closing(sqlite3.connect(path)) as opened:
            view = f"{endless} SELECT k AS key, k AS jacobian FROM n"
            opened.executescript(f"DROP TABLE evaluation; CREATE VIEW evaluation AS {view}")
        with pytest.raises(sb.InputError, match="cannot be used: it has other tables than a journal"):
            Journal(path)

    def test_a_journal_in_use(self, path: Path) -> None:
        code = f"from sheetbend.problem.journal import Journal; Journal({str(path)!r})"
        with Journal(path):
            done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
        assert "InputError" in done.stderr and "locked" in done.stderr
        assert subprocess.run([sys.executable, "-c", code], capture_output=True).returncode == 0

    def test_a_folder_that_is_not_there(self, tmp_path: Path) -> None:
        with pytest.raises(sb.InputError, match="journal"):
            sb.fit(swinging(), parameters=WANTED, journal=tmp_path / "no" / "journal.sqlite")
        with pytest.raises(sb.InputError, match="is not a path"):
            sb.fit(swinging(), parameters=WANTED, journal=3)  # type: ignore[arg-type]


class TestTrouble:
    def test_a_full_disk_costs_the_journal_and_not_the_fit(self, tmp_path: Path) -> None:
        """A limit on the size of files stands for the disk."""
        limit = 120_000
        code = textwrap.dedent(
            f"""
            import resource, sys, time
            sys.path.insert(0, {str(Path(__file__).parent)!r})
            from test_journal import Journal, problem_of, swinging
            resource.setrlimit(resource.RLIMIT_FSIZE, ({limit}, {limit}))
            said = []
            with Journal("journal.sqlite", say=said.append) as kept:
                problem = problem_of(swinging())
                u = problem.parameters.initial()
                for k in range(60):
                    assert problem.evaluate(u + 1e-3 * k)[0]
                    time.sleep(0.02)
            assert kept.made == 60 and len(said) == 1 and said == [kept.trouble], said
            print(said[0])
            """
        )
        done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        assert "continues without it" in done.stdout
        with Journal(tmp_path / "journal.sqlite") as kept:  # what was committed before is whole
            problem = problem_of(swinging())
            problem.evaluate(problem.parameters.initial())
            assert len(kept) >= 1 and kept.read == 1

    def test_a_disk_that_is_nearly_full_is_left_to_the_results(
        self, path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        with Journal(path):
            problem = problem_of(swinging())
            u = problem.parameters.initial()
            problem.evaluate(u)
        monkeypatch.setattr(journal, "RESERVE", 1e18)
        said: list[str] = []
        with Journal(path, say=said.append) as kept:
            problem = problem_of(swinging())
            for step in (0.0, 0.1, 0.2):
                problem.evaluate(u + step)
            assert (kept.read, kept.made, len(kept)) == (1, 2, 1)
        assert len(said) == 1 and "are left on its disk" in said[0]

    def test_is_a_warning_in_python(self, path: Path) -> None:
        with Journal(path) as kept:
            kept._db.execute("DROP TABLE evaluation")
            problem = problem_of(swinging())
            with pytest.warns(RuntimeWarning, match="no longer used"):
                assert problem.evaluate(problem.parameters.initial())[0]
            assert problem.evaluate(problem.parameters.initial() + 0.1)[0]


def test_what_writing_costs_is_limited(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    keep = Journal._keep

    def slowly(self: Journal, *arguments: Any) -> None:
        began = time.thread_time()
        while time.thread_time() < began + 0.02:
            pass
        keep(self, *arguments)

    monkeypatch.setattr(Journal, "_keep", slowly)
    with Journal(path) as kept:
        problem = problem_of(swinging())
        for k in range(50):
            problem.evaluate(problem.parameters.initial() + 1e-3 * k)
        assert 3 <= len(kept) < 10  # three within the grace


def test_no_more_than_ten_commits_a_second(path: Path) -> None:
    commits = []
    with Journal(path) as kept:
        kept._db.set_trace_callback(lambda text: commits.append(text) if text == "COMMIT" else None)
        problem, began = problem_of(swinging()), time.monotonic()
        for k in range(300):
            problem.evaluate(problem.parameters.initial() + 1e-3 * k, jacobian=False)
        seconds = time.monotonic() - began
        kept._db.set_trace_callback(None)
        assert kept.made == 300
    assert len(commits) <= 1 + 10 * seconds
