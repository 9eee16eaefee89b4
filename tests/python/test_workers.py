"""Work that is shared out: the same bits for any number of workers, and what a fit says where one dies."""

from __future__ import annotations

import json
import os
import pickle
import signal
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.errors import InputError
from sheetbend.experiment.wanted import as_parameters
from sheetbend.problem.problem import FitProblem
from sheetbend.problem.workers import Common, working_on
from test_journal import TIMED, swinging

PRIVATE: dict[str, Any] = {"rope_EI": {}, "rope_bend_damping": {"private": True, "prior": (0.01, 0.5)}}
GIVEN: dict[str, Any] = {
    "parameters": PRIVATE,
    "starts": 4,
    "leave_one_out": True,
    "refine": False,
    "beginnings": False,
    "profiles": False,
    "optimizer": "scipy",
}


def several(count: int = 3) -> list[sb.Experiment]:
    return [swinging(seed=k, name=f"swing {k}") for k in range(count)]


def bits(fit: sb.Fit) -> str:
    data = fit.result.to_dict()
    return json.dumps({key: value for key, value in data.items() if key not in (*TIMED, "seconds")})


class Backwards(Executor):
    """Does its work where it is, all of it packed and unpacked on the way, the last item first."""

    def __init__(self) -> None:
        self.ahead: list[tuple[Future[Any], Any, Any]] = []
        self.bytes: list[int] = []
        self.work: set[str] = set()

    def submit(self, work: Any, /, *args: Any, **options: Any) -> Future[Any]:
        future: Future[Any] = _Lazy(self)
        packed = pickle.dumps((work, args))
        self.bytes.append(len(packed))
        self.work.add(args[0].__name__)
        self.ahead.append((future, packed, None))
        return future

    def run(self) -> None:
        while self.ahead:
            future, packed, _ = self.ahead.pop()
            work, args = pickle.loads(packed)
            future.set_result(pickle.loads(pickle.dumps(work(*args))))


class _Lazy(Future[Any]):
    def __init__(self, executor: Backwards) -> None:
        super().__init__()
        self.executor = executor

    def result(self, timeout: float | None = None) -> Any:
        self.executor.run()
        return super().result(timeout)


def test_an_evaluation_that_is_shared_out_has_the_bits_of_one_here() -> None:
    experiments = several(5)
    alone = FitProblem(experiments, as_parameters(PRIVATE, experiments))
    u = alone.parameters.initial() + 0.01
    ok, r, J = alone.evaluate(u)
    executor = Backwards()
    with working_on(executor):
        shared = FitProblem(experiments, as_parameters(PRIVATE, experiments))
        for jacobian in (True, False, True):
            found = shared.evaluate(u, jacobian)
            assert found[0] is ok is True and found[1].tobytes() == r.tobytes()
            assert found[2].tobytes() == (J.tobytes() if jacobian else b"")
            shared._last = None
    assert max(executor.bytes[5:]) < 2000 < max(executor.bytes[:5])  # what is common travels once


def test_a_motion_that_diverges_at_a_worker_is_told() -> None:
    experiments = several(2)
    with working_on(Backwards()):
        shared = FitProblem(experiments, as_parameters({"rope_EI": {}}, experiments))
        assert not shared.evaluate(np.array([800.0]), jacobian=False)[0] and shared.failure


@pytest.mark.parametrize("workers", [1, 3])
def test_a_fit_has_the_same_bits_for_any_number_of_workers(workers: int) -> None:
    alone = sb.fit(several(), **GIVEN)
    with ThreadPoolExecutor(workers) as executor:
        assert bits(sb.fit(several(), **GIVEN, executor=executor)) == bits(alone)
    assert bits(sb.fit(several(), **GIVEN, executor=Backwards())) == bits(alone)


def test_profiles_that_are_shared_out_have_the_same_bits() -> None:
    given = {**GIVEN, "leave_one_out": False, "starts": (), "profiles": True}
    alone, executor = sb.fit(several(2), **given), Backwards()
    shared = sb.fit(several(2), **given, executor=executor)
    assert bits(shared) == bits(alone)
    assert [p.name for p in shared.result.profiles] == [e.name for e in shared.result.estimates]
    assert "_profiled" in executor.work


def test_only_the_client_writes_the_journal(tmp_path: Path) -> None:
    path = tmp_path / "journal.sqlite"
    given = {**GIVEN, "leave_one_out": False, "starts": ()}
    found = sb.fit(several(), **given, executor=Backwards(), journal=path)
    assert bits(found) == bits(sb.fit(several(), **given)) and not path.exists()


def test_no_executor_is_refused() -> None:
    with pytest.raises(InputError, match="executor"):
        sb.fit(swinging(), parameters=["rope_EI"], executor=2)


def _doubled(common: int, item: int) -> int:
    return common * item


def _killed(common: int, item: int) -> int:
    os.kill(os.getpid(), signal.SIGKILL)
    return 0


def test_processes_answer_in_order_and_one_that_dies_is_an_error() -> None:
    with ProcessPoolExecutor(1, get_context("spawn")) as executor, working_on(executor):
        assert Common(2).map(_doubled, [3, 1, 2]) == [6, 2, 4]
        with pytest.raises(sb.SheetbendError, match="a worker ended"):
            Common(2).map(_killed, [1])


def _counted(common: bytes, item: int) -> int:
    if item < 0:
        raise ValueError(item)
    return len(common) + item


def test_a_large_common_part_is_not_sent_with_every_item() -> None:
    large, executor = bytes(10_000_000), Backwards()
    with working_on(executor):
        common = Common(large)
        assert common.map(_counted, range(40)) == [len(large) + k for k in range(40)]
        assert sum(size > len(large) for size in executor.bytes) <= 3
        assert common.map(_counted, [1, 2]) == [len(large) + 1, len(large) + 2]
    with ThreadPoolExecutor(2) as threads, working_on(threads), pytest.raises(ValueError, match="-1"):
        Common(large).map(_counted, [3, -1, *range(9), -2])


def test_workers_that_come_later_get_the_common_part() -> None:
    """Each thread is a worker of its own; those of a second executor have nothing yet."""
    large = bytes(3_000_000)
    common = Common(large)
    for threads in (1, 4):
        with ThreadPoolExecutor(threads) as executor, working_on(executor):
            assert common.map(_counted, range(60)) == [len(large) + k for k in range(60)]
