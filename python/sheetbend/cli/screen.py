"""Reports on the screen."""

from __future__ import annotations

from collections.abc import Callable

from rich.console import Console, RenderableType

REPORT_WIDTH = 100


def show(console: Console, rich: Callable[[], RenderableType], plain: Callable[[], str]) -> None:
    """In color in a terminal; where that is narrow its lines wrap, but no column is lost."""
    if console.is_terminal:
        Console(stderr=console.stderr, highlight=False, width=max(console.width, REPORT_WIDTH)).print(rich())
    else:
        console.print("\n" + plain(), markup=False, soft_wrap=True, end="")
