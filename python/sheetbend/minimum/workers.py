"""Work that other processes or machines share: any `concurrent.futures.Executor`.

What is shared out is always a function of a module, called with what all its calls have in common and with an item of
its own. The answers come back in the order of the items, and none depends on where or when it was made, so that a
result has the same bits for any number of workers and for none. Only this process writes the journal: evaluations that
a worker makes inside a piece of work of its own are made again by a fit that goes on after a kill.
"""

from __future__ import annotations

import hashlib
import os
import pickle
import signal
import threading
from collections import OrderedDict
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future
from contextlib import ExitStack, contextmanager
from contextvars import ContextVar
from functools import wraps
from typing import Any, Generic, ParamSpec, TypeVar

from ..errors import InputError, SheetbendError

KEPT = 8  # things that calls have in common, in each worker
_current: ContextVar[Executor | None] = ContextVar("workers", default=None)

S = TypeVar("S")
T = TypeVar("T")
A = TypeVar("A")


@contextmanager
def working_on(executor: Executor | None) -> Iterator[None]:
    """Shares out work inside this context; with None nothing is."""
    token = _current.set(executor)
    try:
        yield
    finally:
        _current.reset(token)


def current() -> Executor | None:
    """The workers in use here, if any."""
    return _current.get()


class Common(Generic[S]):
    """What many calls have in common: packed once, and sent to a worker that does not have it yet.

    Attributes:
        value: itself; it must survive pickling.
    """

    def __init__(self, value: S) -> None:
        self.value = value
        self._packed: tuple[bytes, bytes] | None = None
        self._sent = False

    def packed(self) -> tuple[bytes, bytes]:
        """Its key and its content."""
        if self._packed is None:
            content = pickle.dumps(self.value, pickle.HIGHEST_PROTOCOL)
            self._packed = hashlib.blake2b(content, digest_size=16).digest(), content
        return self._packed

    def map(self, work: Callable[[S, A], T], items: Sequence[A]) -> list[T]:
        """work(value, item) of every item, in their order.

        Raises:
            What the work raises, of the first item in order that does.
        """
        executor = current()
        if executor is None:
            return [work(self.value, item) for item in items]
        key, content = self.packed()
        sent, self._sent = self._sent, True
        futures: list[Future[tuple[T] | None]] = []
        try:
            futures += [executor.submit(_answer, work, key, None if sent else content, item) for item in items]
            answers = []
            for item, future in zip(items, futures, strict=True):
                answer = future.result()
                if answer is None:  # a worker that came later, or has kept other things since
                    answer = executor.submit(_answer, work, key, content, item).result()
                assert answer is not None
                answers.append(answer[0])
            return answers
        except BrokenExecutor as error:
            words = f"a worker ended before its work was done ({error}); with a journal the fit can go on from here"
            raise SheetbendError(words) from error
        finally:
            for future in futures:
                future.cancel()


class _Kept(threading.local):
    """In each thread of a worker: what calls have in common, by key, the last used one last."""

    def __init__(self) -> None:
        self.values: OrderedDict[bytes, Any] = OrderedDict()


_kept = _Kept()


def _answer(work: Callable[[Any, Any], T], key: bytes, content: bytes | None, item: Any) -> tuple[T] | None:
    """In a worker: a tuple with the answer; None where it does not have the common part."""
    values = _kept.values
    if key not in values:
        if content is None:
            return None
        values[key] = pickle.loads(content)  # which this worker's own client packed
        while len(values) > KEPT:
            values.popitem(last=False)
    values.move_to_end(key)
    return (work(values[key], item),)


@contextmanager
def processes(count: int) -> Iterator[Executor | None]:
    """That many processes of this machine, each with one thread of linear algebra; None for one or none."""
    if count < 2:
        yield None
        return
    import multiprocessing  # here, since importing sheetbend is to stay light
    from concurrent.futures import ProcessPoolExecutor

    with ExitStack() as undone:
        for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
            undone.callback(_set, name, os.environ.get(name))
            os.environ[name] = "1"
        pool = ProcessPoolExecutor(count, multiprocessing.get_context("spawn"), _ignore_interrupts)
        try:
            yield pool
        finally:
            pool.shutdown(cancel_futures=True)


def _set(name: str, value: str | None) -> None:
    if value is None:
        os.environ.pop(name, None)
    else:
        os.environ[name] = value


def _ignore_interrupts() -> None:
    """Ctrl-C reaches all processes; this one's client decides what comes of it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


P = ParamSpec("P")
R = TypeVar("R")


def shared_out(work: Callable[P, R]) -> Callable[P, R]:
    """Gives a function's argument `executor`, a `concurrent.futures.Executor` or None, its meaning: it does the work
    that the function shares out."""

    @wraps(work)
    def run(*args: P.args, **options: P.kwargs) -> R:
        executor = options.get("executor")
        if executor is None:
            return work(*args, **options)
        if not isinstance(executor, Executor):
            fix = "give a concurrent.futures.Executor, such as ProcessPoolExecutor(2)"
            raise InputError("executor", "is no executor", executor, fix)
        with working_on(executor):
            return work(*args, **options)

    return run
