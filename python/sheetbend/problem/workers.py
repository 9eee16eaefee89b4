"""Work that other processes or machines share: any `concurrent.futures.Executor`.

What is shared out is always a function of a module, called with what all its calls have in common and with an item of
its own. The answers come back in the order of the items, and none depends on where or when it was made, so that a
result has the same bits for any number of workers and for none. Only this process writes the journal: evaluations that
a worker makes inside a piece of work of its own are made again by a fit that goes on after a kill.
"""

from __future__ import annotations

import hashlib
import pickle
import threading
import time
import warnings
from collections import OrderedDict
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future
from contextlib import contextmanager
from contextvars import ContextVar
from functools import wraps
from typing import Any, Generic, NamedTuple, ParamSpec, TypeVar

from ..errors import InputError, SheetbendError
from . import digests
from .linear_algebra import one_blas_thread
from .traffic import Traffic

KEPT = 8  # things that calls have in common, in each worker
LITTLE = 64e6  # bytes of a common part, times items: what is sent at once, without asking who has it
MACHINE = ("Python", "processor", "C library", "NumPy", "SciPy")  # which may change the last digits
_current: ContextVar[tuple[Executor, Traffic] | None] = ContextVar("workers", default=None)

S = TypeVar("S")
T = TypeVar("T")
A = TypeVar("A")


@contextmanager
def working_on(executor: Executor | None) -> Iterator[Traffic]:
    """Shares out work inside this context, and counts it; with None nothing is shared out."""
    traffic = Traffic()
    token = _current.set(None if executor is None else (executor, traffic))
    try:
        yield traffic
    finally:
        _current.reset(token)


def current() -> Executor | None:
    """The workers in use here, if any."""
    found = _current.get()
    return None if found is None else found[0]


@contextmanager
def naming_losses() -> Iterator[None]:
    """Passes errors of the work itself on, and tells where an executor lost its workers.

    Raises:
        SheetbendError: it did.
    """
    try:
        yield
    except Exception as error:
        package = type(error).__module__.partition(".")[0]
        if not isinstance(error, BrokenExecutor) and package != "distributed":  # Dask's own, such as KilledWorker
            raise
        told = f"a worker ended before its work was done ({error}); with a journal the fit can go on"
        raise SheetbendError(told) from error


class Answer(NamedTuple):
    """What a worker sends back.

    Attributes:
        packed: the result.
        seconds: of processor time, that it took.
        unlike: what of the worker's software or machine is not that of the client.
    """

    packed: bytes
    seconds: float
    unlike: dict[str, tuple[str, str]]


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
        """Key and content of the common part, with what the bits of results depend on besides."""
        if self._packed is None:
            packed = pickle.dumps((digests.of_software(), self.value), pickle.HIGHEST_PROTOCOL)
            self._packed = hashlib.blake2b(packed, digest_size=16).digest(), packed
        return self._packed

    def map(self, work: Callable[[S, A], T], items: Sequence[A]) -> list[T]:
        """work(value, item) of every item, in their order.

        Raises:
            InputError: a worker has another version of the software.
            What the work raises, of the first item in order that does.
        """
        found = _current.get()
        if found is None:
            return [work(self.value, item) for item in items]
        executor, traffic = found
        key, common = self.packed()
        packed = [pickle.dumps(item, pickle.HIGHEST_PROTOCOL) for item in items]
        # A small common part goes with every item at first. A large one goes with one item, and with twice as many
        # each time that workers which do not have it yet have answered the others.
        carriers = 0 if self._sent else len(items) if len(common) * len(items) <= LITTLE else 1
        left, answers, failed = list(range(len(items))), dict[int, T](), None
        futures: list[tuple[int, Future[Answer | None]]] = []
        self._sent, began = True, time.process_time()
        try:
            while left:
                with naming_losses():
                    for k, i in enumerate(left):
                        part = common if k < carriers else None
                        futures.append((i, executor.submit(_answer, work, key, part, packed[i])))
                        traffic.sent += len(packed[i]) + len(part or b"")
                left = []
                for i, future in futures:
                    try:
                        with naming_losses():
                            answer = future.result()
                    except Exception as error:
                        failed = error  # once the items before it are done
                        break
                    if answer is None:
                        left.append(i)
                        continue
                    _compare(answer.unlike, traffic)
                    traffic.add(len(answer.packed), answer.seconds)
                    answers[i] = pickle.loads(answer.packed)  # which a worker of this client packed
                for _, future in futures:
                    future.cancel()
                carriers, futures = max(1, 2 * carriers), []
            if failed is not None:
                raise failed
            return [answers[i] for i in range(len(items))]
        finally:
            traffic.own += time.process_time() - began
            for _, future in futures:
                future.cancel()


def _compare(unlike: dict[str, tuple[str, str]], traffic: Traffic) -> None:
    """Refuses a worker with other software; warns once of another kind of machine."""
    if not unlike:
        return
    differs = "; ".join(f"{name}: {mine} here, {other} there" for name, (mine, other) in unlike.items())
    if not set(unlike) <= set(MACHINE):
        raise InputError("workers", "have another sheetbend", differs, "install the same version on all machines")
    if not traffic.warned:
        traffic.warned = True
        words = f"workers differ in what decides the last digits of results ({differs}); results may differ in these"
        warnings.warn(words, RuntimeWarning, stacklevel=3)


class _Kept(threading.local):
    """What the calls of one thread of a worker have in common, by key, the last used one last; and how software and
    machine differ from the client's."""

    def __init__(self) -> None:
        self.values: OrderedDict[bytes, tuple[Any, dict[str, tuple[str, str]]]] = OrderedDict()


_kept = _Kept()


@one_blas_thread()
def _answer(work: Callable[[Any, Any], T], key: bytes, common: bytes | None, item: bytes) -> Answer | None:
    """Do a piece of work in a worker; None where the worker does not have the common part."""
    began, values = time.thread_time(), _kept.values
    if key not in values:
        if common is None:
            return None
        software, value = pickle.loads(common)  # which this worker's own client packed
        here = digests.of_software()
        values[key] = value, {name: (text, here[name]) for name, text in software.items() if here[name] != text}
        while len(values) > KEPT:
            values.popitem(last=False)
    values.move_to_end(key)
    value, unlike = values[key]
    packed = pickle.dumps(work(value, pickle.loads(item)), pickle.HIGHEST_PROTOCOL)
    return Answer(packed, time.thread_time() - began, unlike)


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
            raise InputError("executor", "is not an executor", executor, fix)
        with working_on(executor):
            return work(*args, **options)

    return run
