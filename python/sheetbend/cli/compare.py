"""sheetbend compare: fits of the same recordings side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.console import Console

from ..errors import ConfigError
from ..files.whole import write_text
from ..optional import MissingExtraError, require
from ..pictures import plotting
from ..pictures.drawing import ACCENT, GRAY, INK, WARM, clean, key, panels_in
from ..report.tables import plain_section
from ..statistics.paired import Paired, paired
from .compare_report import compare_dict, compare_sections
from .folders import made
from .outcome import Json, Outcome, run
from .targets import check_targets
from .written_fits import Written, in_common, read_written

FILES = ("compare.txt", "compare.png")
_TONES = (GRAY, ACCENT, WARM, INK)


def compare(
    fits: Annotated[
        list[Path],
        typer.Argument(help="Output folders of `sheetbend fit`. The others are compared with the first."),
    ],
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="Folder for compare.txt and compare.png. Default: nothing is written."),
    ] = None,
    json: Json = False,
) -> None:
    """Compare fits: which predicts held-out data better, with an interval, and what differs between them.

    Example: sheetbend compare out/plain out/with_drag
    """
    run(lambda console: _compare(console, fits, output), json)


def _compare(console: Console, paths: list[Path], output: Path | None) -> Outcome:
    if len(paths) < 2:
        fix = "name two or more folders of `sheetbend fit`"
        raise ConfigError("arguments", "are too few to compare", [str(p) for p in paths], fix)
    fits = [read_written(path, name) for path, name in zip(paths, _names(paths), strict=True)]
    pairs = {other.name: _paired(fits[0], other) for other in fits[1:]}
    text = "\n\n".join("\n".join(plain_section(s)) for s in compare_sections(fits, pairs)) + "\n"
    written: list[str] = []
    if output is not None:
        check_targets("--output", output, [output / name for name in FILES])
        made("--output", output)
        write_text(output / "compare.txt", text)
        written = ["compare.txt", *_drawn(console, fits, output / "compare.png")]
    console.print("\n" + text, soft_wrap=True, end="")
    if output is not None:
        console.print(f"\nwritten to {output}: {', '.join(written)}", soft_wrap=True)
    return Outcome({"files": written, **compare_dict(fits, pairs)})


def _names(paths: Sequence[Path]) -> list[str]:
    """The folders' own names, longer where these are the same."""
    folders = [(p.parent if p.is_file() else p).resolve() for p in paths]
    if len(set(folders)) < len(folders):
        raise ConfigError("arguments", "name a fit twice", [str(p) for p in paths], "name each once")
    for parts in range(1, max(len(f.parts) for f in folders) + 1):
        short = ["/".join(f.parts[-parts:]) for f in folders]
        if len(set(short)) == len(short):
            break
    return short


def _paired(first: Written, other: Written) -> Paired | None:
    common = [in_common(first.held_out[n], other.held_out[n]) for n in first.held_out if n in other.held_out]
    series = [(a, b) for found in common if found is not None for _, a, b in [found]]
    return paired(series) if series else None


def _drawn(console: Console, fits: Sequence[Written], path: Path) -> list[str]:
    """Error of each fit over the held-out time, a panel for each recording that all hold out."""
    names = [n for n in fits[0].held_out if all(n in f.held_out for f in fits)]
    if not names:
        return []
    try:
        require("matplotlib.figure", "plot")
    except MissingExtraError as error:
        console.print(f"no figure will be drawn: {error}", markup=False, soft_wrap=True)
        return []
    panels, whole = panels_in(None, len(names), (7.2, 0.7 + 1.9 * len(names)), " ")
    for panel, name in zip(panels, names, strict=True):
        clean(panel)
        for fit, tone in zip(fits, _tones(fits), strict=True):
            found = in_common(fits[0].held_out[name], fit.held_out[name])
            if found is not None:
                panel.plot(found[0], 1e3 * np.sqrt(found[2]), color=tone, linewidth=1.3)
        panel.set_title(name, fontsize=9, color=INK, loc="left", pad=4)
        panel.set_ylabel("error [mm]")
        panel.set_ylim(bottom=0)
        panel.margins(x=0)
    panels[-1].set_xlabel("time [s]")
    tones: Mapping[str, str] = dict(zip((f.name for f in fits), _tones(fits), strict=True))
    key(whole, list(tones.items()))
    plotting.save(panels[0], path)
    return [path.name]


def _tones(fits: Sequence[Written]) -> list[str]:
    return [_TONES[k % len(_TONES)] for k in range(len(fits))]
