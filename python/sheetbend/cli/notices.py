"""Warnings and log records of the library as lines on the screen, each once, without a file name and a line of code."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

_OURS = "sheetbend"


@contextmanager
def noticed(say: Callable[[str], None]) -> Iterator[None]:
    """Give what the library warns of, and what it logs as a warning or worse, to `say`.

    Warnings of other packages, about how they are called, are left to the developers' tests. A program that configured
    the logger "sheetbend" keeps its handlers.
    """
    told: set[str] = set()

    def once(text: str) -> None:
        if text not in told:
            told.add(text)
            say(text)

    def show(message: Warning | str, category: type[Warning], *_: Any, **__: Any) -> None:
        if not issubclass(category, DeprecationWarning | PendingDeprecationWarning | ImportWarning):
            once(str(message))

    handler = _Said(once)
    logger = logging.getLogger(_OURS)
    logger.addHandler(handler)
    try:
        with warnings.catch_warnings():
            warnings.showwarning = show
            yield
    finally:
        logger.removeHandler(handler)


class _Said(logging.Handler):
    def __init__(self, say: Callable[[str], None]) -> None:
        super().__init__(logging.WARNING)
        self._say = say

    def emit(self, record: logging.LogRecord) -> None:
        self._say(record.getMessage())
