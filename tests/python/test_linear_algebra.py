"""Fits use one thread of linear algebra, and leave the user's number of threads as it was."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from typing import Any

import pytest
import scipy.linalg  # noqa: F401  brings a BLAS library of its own
import sheetbend as sb
from sheetbend import optional
from sheetbend.errors import InputError
from sheetbend.gripped import fit_rope
from sheetbend.objects.fabric import Fabric
from sheetbend.problem import linear_algebra
from sheetbend.problem.linear_algebra import one_blas_thread
from sheetbend.problem.problem import FitProblem
from sheetbend.problem.workers import Common, working_on
from sheetbend.textile import Curve, FabricTests, fit_fabric, fit_pull, fit_tests
from test_journal import swinging
from test_workers import Backwards
from threadpoolctl import threadpool_info, threadpool_limits

HERE = 2  # threads that the user chose
FITTED: dict[str, Any] = {"parameters": ["rope_EI"], "refine": False, "beginnings": False, "profiles": False}


def blas_threads() -> set[int]:
    return {library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"}


@pytest.fixture(autouse=True)
def _two_threads() -> Iterator[None]:
    with threadpool_limits(HERE, "blas"):
        assert blas_threads() == {HERE}
        yield


@pytest.fixture
def seen(monkeypatch: pytest.MonkeyPatch) -> list[set[int]]:
    """The numbers of threads when a problem checks its start."""
    found: list[set[int]] = []
    problem = FitProblem
    evaluated: Callable[..., Any] = problem.check_start

    def watched(self: Any) -> Any:
        found.append(blas_threads())
        return evaluated(self)

    monkeypatch.setattr(problem, "check_start", watched)
    return found


def test_a_fit_uses_one_thread_and_restores_the_number(seen: list[set[int]]) -> None:
    sb.fit(swinging(), **FITTED)
    assert seen and all(threads == {1} for threads in seen)
    assert blas_threads() == {HERE}


def test_a_plan_uses_one_thread_and_restores_the_number(seen: list[set[int]]) -> None:
    sb.identify(swinging(), parameters=["rope_EI"], suggest=False)
    assert seen and all(threads == {1} for threads in seen)
    assert blas_threads() == {HERE}


@pytest.mark.parametrize("error", [InputError("rope_EI", "is wrong", 1, "change it"), KeyboardInterrupt()])
def test_a_fit_that_fails_restores_the_number(monkeypatch: pytest.MonkeyPatch, error: BaseException) -> None:
    def failing(self: Any) -> None:
        assert blas_threads() == {1}
        raise error

    monkeypatch.setattr(sb.problem.problem.FitProblem, "check_start", failing)
    with pytest.raises(type(error)):
        sb.fit(swinging(), **FITTED)
    assert blas_threads() == {HERE}


def _threads(common: None, item: int) -> set[int]:
    return blas_threads()


class Looked(Exception):
    pass


class Watched:
    """An argument that tells the numbers of threads of the function that looks at it."""

    def __getattr__(self, name: str) -> Any:
        raise Looked(blas_threads())

    def __iter__(self) -> Iterator[Any]:
        raise Looked(blas_threads())


class WatchedList(Watched, list[Any]):
    """The same as a list of one thing."""

    def __init__(self) -> None:
        self.append(None)


class WatchedCurve(Watched, Curve):
    """The same as a curve that has no numbers."""

    def __init__(self) -> None:
        pass


class WatchedTests(Watched, FabricTests):
    """The same as tests of a fabric that were not done."""

    def __init__(self) -> None:
        pass


OTHERS: dict[str, Callable[[], Any]] = {
    "fit_many": lambda: sb.fit_many(Watched(), ["rope_EI"]),
    "fit_rope": lambda: fit_rope(WatchedList(), density=0.1, gravity=(0.0, 0.0, -9.81)),
    "fit_pull": lambda: fit_pull([WatchedCurve()]),
    "fit_fabric": lambda: fit_fabric(
        WatchedList(), Fabric(density=0.1, warp=100.0, shear=10.0, bending=1e-5), ["warp"]
    ),
    "fit_tests": lambda: fit_tests(WatchedTests()),
}


@pytest.mark.parametrize("name", OTHERS)
def test_other_fits_use_one_thread(name: str) -> None:
    with pytest.raises(Looked) as found:
        OTHERS[name]()
    assert found.value.args == ({1},)
    assert blas_threads() == {HERE}


def test_workers_use_one_thread() -> None:
    with working_on(Backwards()):
        assert Common(None).map(_threads, [1, 2]) == [{1}, {1}]
    assert blas_threads() == {HERE}


@pytest.mark.parametrize("package", ["scipy", "threadpoolctl"])
def test_a_missing_package_is_named_with_its_extra(package: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(module: str, extra: str) -> Any:
        if module.partition(".")[0] == package:
            raise optional.MissingExtraError(package, extra)
        return optional.require(module, extra)

    linear_algebra._libraries.cache_clear()
    monkeypatch.setattr(linear_algebra, "require", missing)
    with pytest.raises(optional.MissingExtraError, match=rf"needs {package}.*'sheetbend\[fit\]'"), one_blas_thread():
        pass
    assert blas_threads() == {HERE}


SHOWN = """
import threading
import numpy
from sheetbend.problem.linear_algebra import one_blas_thread
from threadpoolctl import threadpool_info

def show():
    print(*sorted({library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"}))

"""
SEVERAL = """
inside, leave = threading.Event(), threading.Event()

def first():
    with one_blas_thread():
        inside.set()
        assert leave.wait(60)
    gone.set()
    assert end.wait(60)  # a thread of a pool goes on

gone, end = threading.Event(), threading.Event()
other = threading.Thread(target=first)
other.start()
assert inside.wait(60)
show()
with one_blas_thread():
    leave.set()
    assert gone.wait(60)
    show()
show()
with one_blas_thread():
    show()
show()
end.set()
"""
LOADED_INSIDE = """
show()
with one_blas_thread():
    import scipy.linalg
    show()
show()
"""


@pytest.mark.parametrize(("code", "threads"), [(LOADED_INSIDE, "2 1 2"), (SEVERAL, "1 1 2 1 2")])
def test_another_process(code: str, threads: str) -> None:
    """One that nobody has limited: where SciPy is not loaded before the fit, and where fits in two threads overlap, of
    which the one that began first ends first."""
    two = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), str(HERE))
    command = [sys.executable, "-c", SHOWN + code]
    told = subprocess.run(command, capture_output=True, text=True, check=True, env={**os.environ, **two}, timeout=240)
    assert told.stdout.split() == threads.split()
