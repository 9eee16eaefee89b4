"""sheetbend view: a recording, or the motion of a configuration's scene, as a page to look at."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from ..config import load
from ..errors import ConfigError, RecordingError
from ..files.door import reading
from ..files.whole import write_text
from ..look import seen
from ..optional import require
from ..page import Shown, motion_page, of_recording, of_trajectory
from ..recording.cloud import Cloud
from ..recording.recording import Recording
from ..version import __version__
from .folders import made
from .outcome import Json, Outcome, run
from .screen import heading
from .simulate import motion_of, tasks_of
from .spelling import options
from .targets import check_targets


def view(
    file: Annotated[
        Path,
        typer.Argument(
            help="A recording, or a TOML configuration, whose scenes are simulated at their starting values.",
            show_default=False,
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            help="The HTML file to write. Default: out/NAME.html; for a configuration out/NAME_simulated.html.",
            show_default=False,
        ),
    ] = None,
    units: Annotated[
        str | None, typer.Option(help="Length unit of the recording: m, cm, mm, in or ft.", show_default=False)
    ] = None,
    json: Json = False,
) -> None:
    """Write one HTML file that shows a motion in space and opens without a network.

    Example: sheetbend view take.csv --units mm
    """
    run(lambda console: _view(console, file, output, units), json)


def _view(console: Console, file: Path, output: Path | None, units: str | None) -> Outcome:
    require("jinja2", "cli")
    simulated = file.suffix.lower() == ".toml"
    if simulated and units is not None:
        raise ConfigError("--units", "is for recordings", units, "leave it out")
    with reading(file, ConfigError):
        study = load(file) if simulated else None
    if study is None:
        with options(units="--units"):
            recording = Recording.load(file, units)
        name, about = recording.name, recording.summary()
        if (upright := _upright(recording)) is not None:
            recording, axis = upright
            about += f"\n  up        {axis}, a guess. If another axis is, give `gravity` in {file.stem}.json"
    else:
        name, about = study.config.experiment.name, study.config.experiment.about
    page = output if output is not None else Path("out") / f"{name}{'_simulated' if simulated else ''}.html"
    if page.suffix.lower() not in (".html", ".htm"):
        raise ConfigError("--output", "is not an HTML file", str(page), "give a file that ends in .html")
    check_targets("--output", page.parent, [page])
    made("--output", page.parent)
    heading(console, name, "" if study is None else about)
    motions: list[Shown]
    if study is None:
        motions = [of_recording(recording, name)]
    else:
        tasks = tasks_of(study, None, None)
        motions = [of_trajectory(task.scene, motion_of(task), task.name) for task in tasks]
    write_text(page, motion_page(motions, name, about, __version__))
    console.print(f"written to {page}", soft_wrap=True)
    return Outcome({"name": name, "page": str(page), "motions": [m.name for m in motions]})


def _upright(recording: Recording) -> tuple[Recording, str] | None:
    """A recording that does not tell gravity, with gravity along the axis that `sheetbend new` takes as vertical; None
    where it tells, or no guess can be made."""
    if recording.gravity is not None or isinstance(recording, Cloud):
        return None
    try:
        found = seen(recording)
    except RecordingError:
        return None
    return replace(recording, gravity=found.gravity), "xyz"[found.up]
