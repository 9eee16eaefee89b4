"""Functions that run as they are in what `torch.compile` compiles."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar

import torch

P = ParamSpec("P")
R = TypeVar("R")


def not_traced(function: Callable[P, R]) -> Callable[P, R]:
    """Keeps `torch.compile` from tracing a function, which calls the core: it would compile each piece of Python on the
    way there, for minutes, and gain nothing. What stands around the call is compiled.

    `torch.compiler.disable` as a decorator would do the same, and import the compiler, a second of processor time, for
    users who compile nothing.
    """

    @functools.wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> R:
        if torch.compiler.is_compiling():
            plain: Any = torch.compiler.disable(function)  # type: ignore[no-untyped-call]
            result: R = plain(*args, **kwargs)
            return result
        return function(*args, **kwargs)

    return call
