"""Ctrl-C stops a command wherever it comes; SIGTERM, which batch systems send before they kill, stops it alike."""

from __future__ import annotations

import signal
import sys
import threading
from types import FrameType, TracebackType
from typing import TYPE_CHECKING, Any, Self

if TYPE_CHECKING:
    from sys import UnraisableHookArgs

_AGAIN = 0.01  # s, until an interrupt that was lost comes again: long enough to leave the code that lost it


class Stopping:
    """Turns SIGTERM into KeyboardInterrupt inside its context, and knows whether one came.

    An interrupt that Python drops inside its context comes again. Python handles signals between any two steps of the
    main thread. Where that thread is in a destructor or in the callback of a weak reference, the exception has nowhere
    to go: Python prints "Exception ignored in" and goes on as if nobody had pressed Ctrl-C.
    """

    def __init__(self) -> None:
        self.terminated = False
        self._before: Any = None
        self._ignored = sys.unraisablehook

    def __enter__(self) -> Self:
        if threading.current_thread() is threading.main_thread():  # only there may handlers be set
            self._before = signal.signal(signal.SIGTERM, self._stop)
            self._ignored, sys.unraisablehook = sys.unraisablehook, self._unraised
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._before is not None:
            signal.signal(signal.SIGTERM, self._before)
            sys.unraisablehook = self._ignored

    def _stop(self, number: int, frame: FrameType | None) -> None:
        self.terminated = True
        raise KeyboardInterrupt

    def _unraised(self, what: UnraisableHookArgs) -> None:
        main = threading.main_thread().ident
        if what.exc_type is KeyboardInterrupt and main is not None:
            again = threading.Timer(_AGAIN, signal.pthread_kill, (main, signal.SIGINT))
            again.daemon = True
            again.start()
        else:
            self._ignored(what)
