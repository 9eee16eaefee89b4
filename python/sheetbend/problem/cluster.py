"""Workers for the command line: processes of this machine, or those of a Dask scheduler."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING

from ..errors import ConfigError
from ..optional import require

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

RETRIES = 3  # of a task that failed, such as by memory
TIMEOUT = 30.0  # s, to reach a scheduler, or until it has written its file


@contextmanager
def workers(count: int, address: str | None) -> Iterator[Executor | None]:
    """The workers of a scheduler where an address is given, otherwise `count` processes of this machine.

    Raises:
        ConfigError: both are given, or the scheduler cannot be reached.
        MissingExtraError: Dask is not installed.
    """
    if address is None:
        with processes(count) as executor:
            yield executor
        return
    if count > 1:
        raise ConfigError("--workers", "does not go with --dask, whose scheduler has workers", count, "leave one out")
    with dask(address) as executor:
        yield executor


@contextmanager
def dask(address: str) -> Iterator[Executor]:
    """The workers of a Dask scheduler, which gives the work of a lost one to another.

    Args:
        address: of the scheduler, such as tcp://10.0.0.1:8786, or the file (.json) that it writes.

    Raises:
        ConfigError: there is no scheduler at the address.
        MissingExtraError: Dask is not installed.
    """
    distributed = require("distributed", "cluster")
    file = address if address.endswith(".json") else None
    until = time.monotonic() + TIMEOUT
    while file is not None and not os.path.exists(file):  # Dask waits for it without an end
        if time.monotonic() > until:
            fix = "start the scheduler: dask scheduler --scheduler-file FILE"
            raise ConfigError("--dask", "names no file of a scheduler", address, fix)
        time.sleep(0.05)
    try:
        client = distributed.Client(None if file else address, scheduler_file=file, timeout=TIMEOUT)
    except (OSError, ValueError) as error:
        fix = "start one with `dask scheduler`, and give the address that it prints, such as tcp://10.0.0.1:8786"
        raise ConfigError("--dask", f"reaches no scheduler ({error})", address, fix) from error
    with client:
        # Not pure: whether a worker still has what tasks share decides what it answers.
        yield client.get_executor(retries=RETRIES, pure=False)


@contextmanager
def processes(count: int) -> Iterator[Executor | None]:
    """`count` processes of this machine, each with one thread of linear algebra; None for a count of one or none.

    They end with the context or with this process, however that ends, also in the middle of their work.
    """
    if count < 2:
        yield None
        return
    import multiprocessing  # here, since importing sheetbend is to stay light
    from concurrent.futures import ProcessPoolExecutor

    with ExitStack() as undone:
        for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
            undone.callback(_set, name, os.environ.get(name))
            os.environ[name] = "1"
        spawning = multiprocessing.get_context("spawn")
        workers_end, own_end = spawning.Pipe(duplex=False)  # this process alone holds its own end
        pool = ProcessPoolExecutor(count, spawning, _work_for, (workers_end,))
        try:
            yield pool
        finally:
            with _undisturbed():
                own_end.close()
                pool.shutdown(cancel_futures=True)


def _set(name: str, value: str | None) -> None:
    if value is None:
        os.environ.pop(name, None)
    else:
        os.environ[name] = value


@contextmanager
def _undisturbed() -> Iterator[None]:
    """Ignores Ctrl-C and SIGTERM; a pool that is interrupted while it shuts down never ends."""
    if threading.current_thread() is not threading.main_thread():  # which no signal interrupts
        yield
        return
    before = {number: signal.signal(number, signal.SIG_IGN) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _work_for(client: Connection) -> None:
    """Begins a worker. Ctrl-C reaches all processes, and the client decides what comes of it; when the client's end of
    the pipe closes, the worker ends at once."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    def end() -> None:
        client.poll(None)
        os._exit(1)

    threading.Thread(target=end, daemon=True).start()
