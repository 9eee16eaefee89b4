"""Fits on the workers of a Dask scheduler: the bits of a fit in this process, also where a worker is killed."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sheetbend as sb
from commands import run
from sheetbend.errors import ConfigError, InputError
from sheetbend.problem import digests, workers
from sheetbend.problem.cluster import dask
from sheetbend.problem.cluster import workers as workers_of
from sheetbend.problem.traffic import Traffic
from sheetbend.problem.workers import Common, working_on
from sheetbend.report.parameter_table import TABLE
from test_collect import ROPE
from test_journal import swinging
from test_workers import GIVEN, Backwards, bits, several

distributed = pytest.importorskip("distributed")
dask_config = pytest.importorskip("dask").config

SLOW = 0.02  # s of processor time, of a task
SMALL: dict[str, Any] = {**GIVEN, "parameters": {"rope_EI": {}}, "starts": 2, "leave_one_out": False}


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    """Three workers, threads of this process that are talked to over TCP."""
    quiet = {"distributed.worker.profile.enabled": False}  # samples stacks every 10 ms
    with (
        dask_config.set(quiet),
        distributed.LocalCluster(
            n_workers=3,
            threads_per_worker=1,
            processes=False,
            protocol="tcp",
            host="127.0.0.1",
            dashboard_address=":0",
            worker_dashboard_address=None,
        ) as cluster,
    ):
        yield cluster


@pytest.fixture
def client(cluster: Any) -> Iterator[Any]:
    with distributed.Client(cluster) as client:
        client.wait_for_workers(3)
        yield client


@pytest.fixture(scope="module")
def alone() -> str:
    return bits(sb.fit(several(2), **SMALL))


def _product(common: int, item: int) -> int:
    return common * item


@pytest.mark.parametrize("count", [1, 3])
def test_the_bits_do_not_depend_on_the_workers(client: Any, alone: str, count: int) -> None:
    chosen = sorted(client.scheduler_info(n_workers=-1)["workers"])[:count]
    executor = client.get_executor(workers=chosen, retries=3, pure=False)
    assert bits(sb.fit(several(2), **SMALL, executor=executor)) == alone


def test_a_fit_goes_on_where_workers_are_killed(client: Any, alone: str) -> None:
    """Three that are processes of their own, one after the other as soon as it has work; what it had goes to others."""
    stays = next(iter(client.scheduler_info(n_workers=-1)["workers"]))
    command = [sys.executable, "-m", "dask", "worker", client.scheduler.address, "--no-nanny", "--nthreads", "1"]
    processes = {
        name: subprocess.Popen([*command, "--name", name, "--no-dashboard"], stderr=subprocess.DEVNULL)
        for name in ("own 1", "own 2", "own 3")
    }
    done, killed = threading.Event(), list[str]()
    try:
        client.wait_for_workers(6)
        workers = client.scheduler_info(n_workers=-1)["workers"]
        own = {address: told["name"] for address, told in workers.items() if told["name"] in processes}
        executor = client.get_executor(workers=[stays, *own], retries=3, pure=False)

        def kill() -> None:
            for address, name in own.items():
                while not client.processing([address])[address]:
                    if done.wait(0.005):
                        return
                processes[name].send_signal(signal.SIGKILL)
                processes[name].wait()
                killed.append(address)

        killer = threading.Thread(target=kill)
        killer.start()
        found = [bits(sb.fit(several(2), **SMALL, executor=executor))]
        while killer.is_alive() and len(found) < 5:  # until each had a task when it was asked
            found.append(bits(sb.fit(several(2), **SMALL, executor=executor)))
        done.set()
        killer.join()
    finally:
        done.set()
        for process in processes.values():
            process.kill()
            process.wait()
    assert len(killed) == 3 and found == [alone] * len(found)
    assert not set(killed) & set(client.scheduler_info(n_workers=-1)["workers"])


def test_workers_of_another_version_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    here = digests.of_software()

    def map_(**changed: str) -> list[int]:
        workers._kept.values.clear()
        common = Common(2)
        common.packed()
        monkeypatch.setattr(digests, "of_software", lambda: here | changed)
        with working_on(Backwards()):
            found = common.map(_product, [1, 2])
        monkeypatch.setattr(digests, "of_software", lambda: here)
        return found

    with pytest.warns(RuntimeWarning, match=r"last digits.*processor") as told:
        assert map_(processor="another") == [2, 4]
    assert len(told) == 1
    with pytest.raises(InputError, match=r"another sheetbend.*9\.9"):
        map_(sheetbend="9.9")
    workers._kept.values.clear()


def test_traffic_is_counted(client: Any) -> None:
    with working_on(client.get_executor(pure=False)) as traffic:
        assert Common(np.arange(1000)).map(_sum, list(range(8))) == [499500 + 1000 * k for k in range(8)]
    assert traffic.tasks == 8 and traffic.working >= 8 * SLOW
    assert 8 * 8000 < traffic.sent < 8 * 10000 and 0 < traffic.received < 8 * 200
    assert traffic.own > 0


def _sum(common: Any, item: int) -> int:
    until = time.thread_time() + SLOW
    while time.thread_time() < until:
        pass
    return int(np.sum(common + item))


def test_traffic_in_words() -> None:
    traffic = Traffic(tasks=10, sent=15_000, received=2_500_000, working=20.0, own=0.05)
    assert str(traffic) == (
        "10 tasks were shared out: per task 2 s of a worker, 1.5 kB sent, 250 kB received, 5 ms of this process, which "
        "can feed about 400 workers"
    )
    assert str(Traffic()) == "no tasks were shared out"


def test_no_scheduler_and_two_kinds_of_workers_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sheetbend.problem.cluster.TIMEOUT", 0.5)
    with pytest.raises(ConfigError, match="--dask: reaches no scheduler"), dask("tcp://127.0.0.1:9"):
        pass
    with pytest.raises(ConfigError, match="names no file of a scheduler"), dask("nowhere.json"):
        pass
    with pytest.raises(ConfigError, match="--workers: does not go with --dask"), workers_of(2, "tcp://127.0.0.1:9"):
        pass


def test_specimens_are_fitted_as_in_one_process(cluster: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for k in range(2):
        swinging(seed=k).recording.save(tmp_path / f"rope_{k}.npz")
        (tmp_path / f"rope_{k}.toml").write_text(ROPE.format(name=f"rope_{k}"), encoding="utf-8")
    monkeypatch.chdir(tmp_path)  # relative paths mean this one's
    assert run("fit", "rope_*.toml", "--output", "alone").exit_code != 2
    assert run("fit", "rope_*.toml", "--output", "shared", "--dask", cluster.scheduler_address).exit_code != 2
    for k in range(2):
        table = Path(f"rope_{k}") / TABLE
        assert (Path("shared") / table).read_bytes() == (Path("alone") / table).read_bytes()
