"""sheetbend new: a configuration for a recording that nobody has described yet."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from ..config import build, parse
from ..files.door import reading
from ..errors import ConfigError
from ..look.draft import Take, draft
from ..look.seen import seen, unit_doubt
from ..files.names import flaw
from ..recording.recording import Recording
from ..files.whole import write_text
from .folders import made
from .outcome import Outcome, run
from .screen import heading, listing
from .targets import check_targets


def new(
    files: Annotated[
        list[Path],
        typer.Argument(help="A recording, or several of the same rope or cloth.", show_default=False),
    ],
    output: Annotated[
        Path | None,
        typer.Option(help="The configuration; NAME.toml in the working directory when left out.", show_default=False),
    ] = None,
    density: Annotated[
        float | None,
        typer.Option(help="As weighed: kg/m of a rope, kg/m^2 of a cloth.", show_default=False),
    ] = None,
    units: Annotated[
        str | None, typer.Option(help="Length unit of the files: m, cm or mm.", show_default=False)
    ] = None,
    json: Annotated[
        bool, typer.Option("--json", help="One JSON object on stdout; everything else goes to stderr.")
    ] = False,
) -> None:
    """Look at a recording and write a configuration that `sheetbend fit` runs, with comments on what is seen in it and
    what cannot be known.

    Example: sheetbend new take.csv --density 0.05
    """
    run(lambda console: _new(console, files, output, density, units), json)


def _new(console: Console, files: list[Path], output: Path | None, density: float | None, units: str | None) -> Outcome:
    if density is not None and not 0 < density < float("inf"):
        raise ConfigError("--density", "must be positive", density, "give kg/m of a rope, kg/m^2 of a cloth")
    recordings = [_read(file, units) for file in files]
    name = recordings[0][0].name
    if flaw(name) is not None or not name[:1].isascii() or not name[:1].isalpha():
        name = f"take_{name}"
    name = "".join(c if c.isascii() and (c.isalnum() or c in "_.-") else "_" for c in name)
    target = output if output is not None else Path(f"{name}.toml")
    if target.suffix.lower() != ".toml":
        raise ConfigError("--output", "is no configuration", str(target), "give a file that ends in .toml")
    check_targets("--output", target.parent, [target])
    if target.exists():
        raise ConfigError("--output", "is there already", str(target), "name another file with --output")
    made("--output", target.parent)
    takes = [
        Take(seen(recording), Path(os.path.relpath(file, target.parent)).as_posix(), unit)
        for file, (recording, unit) in zip(files, recordings, strict=True)
    ]
    found = draft(takes, name, density)
    write_text(target, found.text)
    with reading(target, ConfigError):
        study = build(parse(target), target.parent)
    heading(console, name, f"looks like {found.kind}")
    console.print("seen:")
    listing(console, found.seen)
    console.print("not known from the recording:")
    listing(console, found.unknown)
    console.print("how it is held:" if study.assumptions else "", end="\n" if study.assumptions else "")
    listing(console, study.assumptions)
    console.print(f"written to {target}; next: sheetbend fit {target}", soft_wrap=True)
    return Outcome(
        {
            "name": name,
            "config": str(target),
            "kind": found.kind,
            "seen": list(found.seen),
            "unknown": list(found.unknown),
            "parameters": list(study.parameters),
        }
    )


def _read(file: Path, units: str | None) -> tuple[Recording, str | None]:
    """A recording in m, and the unit that the configuration must name: the one that is given, or one told by doubt."""
    recording = Recording.load(file, units)
    doubt = None if units is not None else unit_doubt(recording)
    return (recording, units) if doubt is None else (Recording.load(file, doubt), doubt)
