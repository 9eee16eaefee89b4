"""The course of a fit: one live line in a terminal, one plain line per iteration elsewhere."""

from __future__ import annotations

from types import TracebackType
from typing import Self

from rich.console import Console
from rich.live import Live
from rich.text import Text

from ..minimum.progress import Progress
from ..quantities.parameters import Parameters

SHOWN = 4  # parameters on the line


class Iterations:
    """Called after every iteration; a context, so that the live line ends with it."""

    def __init__(self, console: Console, parameters: Parameters) -> None:
        self.console, self.parameters = console, parameters
        self.live = Live(console=console, auto_refresh=False, transient=True) if console.is_terminal else None

    def __enter__(self) -> Self:
        if self.live is not None:
            self.live.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self.live is not None:
            self.live.stop()

    def __call__(self, progress: Progress) -> None:
        line = self._line(progress)
        if self.live is not None:
            self.live.update(line, refresh=True)
        else:
            self.console.print(line, soft_wrap=True)

    def _line(self, progress: Progress) -> Text:
        if progress.condition is not None:
            over = "" if progress.window is None else f" (over the first {progress.window:.3g} s)"
            return Text(f"at the start: {progress.condition.words}{over}")
        values = self.parameters.to_physical(progress.u)
        shown = self.parameters.free[:SHOWN]
        parts = [f"{name} {values[name]:.4g} {self.parameters[name].unit}".rstrip() for name in shown]
        more = len(self.parameters.free) - len(shown)
        line = Text.assemble(
            "" if progress.window is None else (f"first {progress.window:.3g} s  ", "dim"),
            (_turn(progress), "bold"),
            f"  cost {progress.cost:.6g}  ",
            ("  ".join(parts), "cyan"),
        )
        return line.append(f"  and {more} more", style="dim") if more else line


def _turn(progress: Progress) -> str:
    if progress.start is None:
        return f"iteration {progress.iteration:3d}"
    return f"start {progress.start[0]:3d} of {progress.start[1]}"
