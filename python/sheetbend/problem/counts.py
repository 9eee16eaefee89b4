"""Counts simulations, so that a result can state what it cost."""

from __future__ import annotations

from contextvars import ContextVar

_taken: ContextVar[tuple[int, int]] = ContextVar("taken", default=(0, 0))


def count(evaluations: int, jacobians: int) -> None:
    """Add evaluations of residuals, and how many of these were made with a Jacobian."""
    before = _taken.get()
    _taken.set((before[0] + evaluations, before[1] + jacobians))


def counted() -> tuple[int, int]:
    """Evaluations, and those with a Jacobian, that this thread has made so far; of use as a difference."""
    return _taken.get()
