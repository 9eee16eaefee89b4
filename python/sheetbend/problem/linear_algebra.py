"""One thread of linear algebra while a fit runs.

The matrix products of a fit are small. OpenBLAS starts its threads for many of them all the same, and these wait for
each other in busy loops: on a loaded machine longer than the fit takes. Sums are also split among the threads, so that
their number would change the last digits of results.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

from ..optional import require


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Limits the BLAS libraries of this process to one thread inside the context, or in a function that it decorates.

    Contexts may be nested, and may overlap in several Python threads: the last one that ends restores the numbers of
    threads that the first one found.

    Raises:
        MissingExtraError: SciPy or threadpoolctl is not installed.
    """
    libraries = _libraries()
    # Some libraries have one number of threads for the process, which threadpoolctl lets only one thread change at a
    # time, and others have a number for each Python thread.
    _for_all.enter(libraries)
    try:
        with libraries.limit(limits=1, user_api="blas"):
            yield
    finally:
        _for_all.leave()


@cache
def _libraries() -> Any:
    """The BLAS libraries of NumPy and of SciPy, which is loaded first, since it brings one of its own."""
    require("scipy.linalg", "fit")
    return require("threadpoolctl", "fit").ThreadpoolController()


class _ForAll:
    """The limit of the whole process: a thread sets it when the first context begins, and lifts it after the last."""

    def __init__(self) -> None:
        self._lock, self._open = threading.Lock(), 0
        self._over = threading.Event()
        self._keeper = threading.Thread()

    def enter(self, libraries: Any) -> None:
        with self._lock:
            if not self._open:
                limited, self._over = threading.Event(), threading.Event()
                given = libraries, limited, self._over
                self._keeper = threading.Thread(target=_keep, args=given, name="one BLAS thread", daemon=True)
                self._keeper.start()
                limited.wait()
            self._open += 1

    def leave(self) -> None:
        with self._lock:
            self._open -= 1
            if not self._open:
                self._over.set()
                self._keeper.join()


def _keep(libraries: Any, limited: threading.Event, over: threading.Event) -> None:
    with libraries.limit(limits=1, user_api="blas"):
        limited.set()
        over.wait()


_for_all = _ForAll()
