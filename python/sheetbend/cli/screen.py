"""What commands print: texts as they are, without rich's markup, and nothing that would steer the terminal."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from contextlib import suppress
from typing import IO, Any

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment
from rich.text import Text

from ..files.names import steering

REPORT_WIDTH = 100


class Screen(Console):
    """A console for names and texts that come from files: brackets stay brackets, control characters are spelled out.
    Color comes from `Text` alone."""

    def __init__(self, stderr: bool = False, width: int | None = None) -> None:
        super().__init__(stderr=stderr, width=width, highlight=False, markup=False, emoji=False)

    def print(self, *objects: Any, **options: Any) -> None:
        """Print as rich does. If the stream is full, the command continues, and a message on stderr says so."""
        try:
            super().print(*objects, **options)
        except OSError as error:
            self.quiet = True
            silence(self.file)
            if not self.stderr:
                Screen(stderr=True).print(f"stdout cannot be written: {error.strerror}; continuing without it")

    def on_broken_pipe(self) -> None:
        """Continue if nobody reads the output any more, as in `| head`, so that results are still written."""
        self.quiet = True
        silence(self.file)

    def render_str(self, text: str, **options: Any) -> Text:
        """Render the text with control characters spelled out, so that columns are as wide as what they show."""
        return super().render_str(spelled(text), **options)

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """Render as rich does, with control characters of every segment spelled out."""
        for segment in super().render(renderable, options):
            yield segment if segment.control else segment._replace(text=spelled(segment.text))


def silence(stream: IO[str]) -> None:
    """Discard what is written to a stream from now on, or still waits in it."""
    with suppress(OSError, ValueError):  # no file, as in tests
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, stream.fileno())
        os.close(nowhere)


def heading(console: Console, name: str, about: str, above: str = "") -> None:
    """Print a name in bold, and what there is to say about it."""
    console.print(Text.assemble(above, (name, "bold"), "  ", about), soft_wrap=True)


def listing(console: Console, sentences: Iterable[str]) -> None:
    """Print what is assumed, a line each."""
    for sentence in sentences:
        console.print(f"  {sentence}", soft_wrap=True)


def spelled(text: str) -> str:
    """A text whose control characters, other than the ends of lines, are written as escapes: \\x1b."""
    if not steering(text, "\n\t"):
        return text
    return "".join(repr(c)[1:-1] if steering(c, "\n\t") else c for c in text)


def show(console: Console, rich: Callable[[], RenderableType], plain: Callable[[], str]) -> None:
    """Print in color in a terminal, otherwise plainly. In a narrow terminal lines wrap, and no column is lost."""
    if console.is_terminal:
        Screen(stderr=console.stderr, width=max(console.width, REPORT_WIDTH)).print(rich())
    else:
        console.print("\n" + plain(), soft_wrap=True, end="")
