"""The processes of `--workers` end with what uses them, however that ends."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

CLIENT = """
import os, time
from sheetbend.problem.cluster import processes

def work(seconds):
    time.sleep(seconds)
    return os.getpid()

if __name__ == "__main__":
    with processes(2) as pool:
        print(*{f.result() for f in [pool.submit(work, 0.3) for _ in range(4)]}, flush=True)
        pool.submit(work, 600.0).result()
"""


@pytest.mark.parametrize("sent", [[signal.SIGINT, signal.SIGINT], [signal.SIGKILL]])
def test_workers_end_with_their_client(tmp_path: Path, sent: list[signal.Signals]) -> None:
    """Ctrl-C twice, as an impatient user presses it, once left the client waiting without an end; SIGKILL left its
    workers."""
    program = tmp_path / "client.py"
    program.write_text(CLIENT, encoding="utf-8")
    command = [sys.executable, str(program)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as client:
        assert client.stdout is not None
        workers = [int(pid) for pid in client.stdout.readline().split()]
        for number in sent:
            client.send_signal(number)
            time.sleep(0.05)
        assert client.wait(timeout=60.0) < 0
    assert workers
    until = time.monotonic() + 60.0
    while any(_runs(pid) for pid in workers):
        assert time.monotonic() < until
        time.sleep(0.05)


def _runs(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False
