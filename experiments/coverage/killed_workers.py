"""A fit on two Dask workers, of which one is killed by SIGKILL every few seconds, against the bits of a local fit.

    python experiments/coverage/killed_workers.py   # needs the extra [cluster]

Ropes in one model, four starts, profiles and leave-one-out. A killed worker is replaced at once; only one that
has a task is killed.
"""

from __future__ import annotations

import argparse
import json
import signal
import subprocess
import sys
import threading
import time
from dataclasses import replace
from typing import Any

import dask
import sheetbend as sb
from cases import LINKS, ROPE, rope, seen, white
from distributed import Client, LocalCluster

GIVEN: dict[str, Any] = {"starts": 4, "leave_one_out": True, "refine": False}
FAILURES = 1000  # workers that may die with the same task
TIMED = ("seconds", "jacobian_seconds", "evaluations", "jacobians", "judging")


def ropes(count: int) -> list[sb.Experiment]:
    clean, e = seen(rope(LINKS)), rope(LINKS, share=1.3)
    return [
        replace(e, name=f"rope {k}", recording=replace(e.recording, positions=clean + white(clean.shape, k)))
        for k in range(count)
    ]


def bits(found: sb.Fit) -> str:
    """All numbers of a result but those of its time."""
    data = found.result.to_dict()
    return json.dumps({key: value for key, value in data.items() if key not in TIMED})


class Workers:
    """Two processes, of which one that works is killed now and then and replaced."""

    def __init__(self, client: Client) -> None:
        self.client, self.killed, self._started = client, 0, 0
        self._processes: dict[str, subprocess.Popen[bytes]] = {}
        for _ in range(2):
            self.start()

    def start(self) -> None:
        name, self._started = f"own {self._started}", self._started + 1
        options = ["--no-nanny", "--nthreads", "1", "--no-dashboard", "--name", name]
        command = [sys.executable, "-m", "dask", "worker", self.client.scheduler.address, *options]
        self._processes[name] = subprocess.Popen(command, stderr=subprocess.DEVNULL)

    def kill_one_that_works(self) -> None:
        known = self.client.scheduler_info(n_workers=-1)["workers"]
        for address, tasks in sorted(self.client.processing().items()):
            if tasks and address in known:
                process = self._processes.pop(known[address]["name"])
                process.send_signal(signal.SIGKILL)
                process.wait()
                self.killed += 1
                self.start()
                return

    def kill_now_and_then(self, every: float, done: threading.Event) -> None:
        while not done.wait(every):
            self.kill_one_that_works()

    def end(self) -> None:
        for process in self._processes.values():
            process.kill()
            process.wait()


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--ropes", type=int, default=24)
    parser.add_argument("--every", type=float, default=3.0, help="s between two kills")
    given = parser.parse_args()
    began, used = time.monotonic(), time.process_time()
    alone = sb.fit(ropes(given.ropes), parameters=list(ROPE), **GIVEN)
    print(f"alone: {time.process_time() - used:.0f} s of the processor, {time.monotonic() - began:.0f} s", flush=True)
    options = {"distributed.scheduler.allowed-failures": FAILURES, "distributed.worker.profile.enabled": False}
    with (
        dask.config.set(options),
        LocalCluster(n_workers=0, dashboard_address=":0") as cluster,
        Client(cluster) as client,
    ):
        workers, done = Workers(client), threading.Event()
        killer = threading.Thread(target=workers.kill_now_and_then, args=(given.every, done))
        client.wait_for_workers(2)
        began = time.monotonic()
        killer.start()
        try:
            executor = client.get_executor(retries=3, pure=False)
            shared = sb.fit(ropes(given.ropes), parameters=list(ROPE), **GIVEN, executor=executor)
        finally:
            done.set()
            killer.join()
            workers.end()
    same = bits(shared) == bits(alone)
    print(f"with two workers: {time.monotonic() - began:.0f} s, {workers.killed} killed; the same bits: {same}")
    return 0 if same and workers.killed >= 3 else 1


if __name__ == "__main__":
    sys.exit(main())
