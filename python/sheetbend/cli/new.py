"""sheetbend new: a configuration for a recording that nobody has described yet."""

from __future__ import annotations

import os
from dataclasses import replace
from enum import StrEnum
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from ..config import GrippedConfig, build, parse_any, scene_alone
from ..errors import ConfigError, RecordingError, SheetbendError
from ..files.names import flaw
from ..files.whole import write_text
from ..look import garment
from ..look.draft import Draft, draft
from ..look.robot import Poses
from ..look.seen import seen
from ..look.take import Measured, Take
from ..recording.io import told_unit
from ..recording.recording import Recording
from ..recording.relabeled import shuffled
from ..recording.unit_doubt import LONGEST, unit_doubt, unit_words
from .folders import made
from .gripped import load_ropes
from .info import warn_of_units
from .outcome import Json, Outcome, run
from .screen import heading, listing
from .spelling import options
from .targets import check_targets

CLOUD = (
    "write a configuration by hand: what holds the cloth or the rope from a recording of markers or a robot's poses in "
    "`file` and [[scene.tool]], and the points as `cloud` in [[recording]] (docs/clouds.md)"
)
ELSEWHERE = {
    "counts": ("a point cloud", CLOUD),
    "quaternions": (
        "poses",
        "write a script, as experiments/tosses and experiments/elbow have one (docs/bodies.md); or make markers of the "
        "poses of one motion with sb.Recording.from_poses. Poses of a tool that holds a cloth go with --poses",
    ),
    "positions_px": ("pixels", "scale them to m, and save them with sb.Recording.save (docs/recordings.md)"),
    "force": ("forces", "write a file for `sheetbend textile` or `sheetbend fabric` (docs/tutorials/textile.md)"),
}
"""By an array of an archive what it holds beside markers, and where that is taken."""


class Up(StrEnum):
    """Directions along the axes of a recording."""

    X = "x"
    Y = "y"
    Z = "z"
    MINUS_X = "-x"
    MINUS_Y = "-y"
    MINUS_Z = "-z"


def new(
    files: Annotated[
        list[Path],
        typer.Argument(
            help="One recording, several recordings of the same rope or cloth, or a mesh of a garment (OBJ, PLY, STL).",
            show_default=False,
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            help="The configuration file to write. Default: NAME.toml in the working directory.",
            show_default=False,
        ),
    ] = None,
    density: Annotated[
        float | None,
        typer.Option(help="Measured density in kg/m (rope, beam) or kg/m^2 (cloth).", show_default=False),
    ] = None,
    length: Annotated[
        float | None, typer.Option(help="Measured length of the rope or beam in m.", show_default=False)
    ] = None,
    weight: Annotated[
        float | None,
        typer.Option(
            help="Mass in kg that hangs at the free end of a rope or cable; 0 if that end is free and carries none.",
            show_default=False,
        ),
    ] = None,
    at: Annotated[
        float | None,
        typer.Option(
            help="Distance in m from the clamp of a beam to the only marker or laser spot on it.", show_default=False
        ),
    ] = None,
    margin: Annotated[
        float | None,
        typer.Option(help="Distance in m from the outer markers of a cloth to its edge.", show_default=False),
    ] = None,
    units: Annotated[
        str | None, typer.Option(help="Length unit of the files: m, cm, mm, in or ft.", show_default=False)
    ] = None,
    up: Annotated[
        Up | None,
        typer.Option(
            help="Axis of the recording or mesh that points up, if the guess or the file is wrong.",
            show_default=False,
        ),
    ] = None,
    markers: Annotated[
        str | None,
        typer.Option(
            help='Look at these markers alone, such as "m0,m1,m2" or "rope_*", where a recording shows several things.',
            show_default=False,
        ),
    ] = None,
    poses: Annotated[
        Path | None,
        typer.Option(
            help="CSV file with the poses of the robot's tool that holds a cloth: time,x,y,z,qx,qy,qz,qw.",
            show_default=False,
        ),
    ] = None,
    json: Json = False,
) -> None:
    """Look at a recording and write a configuration for `sheetbend fit`.

    Comments in the configuration explain what the recording shows and what it cannot show. For the mesh of a garment,
    the command writes a scene for `sheetbend simulate`.

    Example: sheetbend new take.csv --density 0.05
    """
    measured = Measured(density, length, weight=weight, at=at, margin=margin)
    run(lambda console: _new(console, files, output, measured, units, up, markers, poses), json)


def _new(
    console: Console,
    files: list[Path],
    output: Path | None,
    measured: Measured,
    units: str | None,
    up: Up | None,
    markers: str | None,
    poses: Path | None,
) -> Outcome:
    _check_measured(measured)
    if files[0].suffix.lower() in garment.FILES:
        _check_mesh(files, measured, markers, poses)
        name = _name(files[0].stem)
        target = _target(output, name)
        with options(unit="--units"):
            found = garment.draft_of_mesh(files[0], _seen_from(target, files[0]), name, measured, units, up)
        return _written(console, target, name, found, "the mesh", f"sheetbend simulate {target} --mesh gltf")
    with options(units="--units"):
        recordings = [_read(file, units) for file in files]
    if markers is not None:
        recordings = [(_chosen(recording, markers), unit, words) for recording, unit, words in recordings]
    name = _name(recordings[0][0].name)
    target = _target(output, name)
    if poses is not None:
        if len(files) > 1:
            raise ConfigError("--poses", "go with one recording", len(files), "make a configuration for each")
        with options(poses="--poses"):
            measured = replace(measured, poses=Poses.read(poses, _seen_from(target, poses)))
    takes = [
        Take(seen(recording, up), _seen_from(target, file), unit, words)
        for file, (recording, unit, words) in zip(files, recordings, strict=True)
    ]
    return _written(console, target, name, _drafted(takes, name, measured), "the recording", f"sheetbend fit {target}")


def _check_measured(measured: Measured) -> None:
    for option, given, fix in (
        ("--density", measured.density, "give kg/m of a rope, kg/m^2 of a cloth"),
        ("--length", measured.length, "give m"),
        ("--at", measured.at, "give m from the clamp"),
    ):
        if given is not None and not 0 < given < float("inf"):
            raise ConfigError(option, "must be positive", given, fix)
    for option, given, fix in (("--weight", measured.weight, "give kg"), ("--margin", measured.margin, "give m")):
        if given is not None and not 0 <= given < float("inf"):
            raise ConfigError(option, "must be zero or more", given, fix)


def _target(output: Path | None, name: str) -> Path:
    """The configuration to write, which is not there yet."""
    target = output if output is not None else Path(f"{name}.toml")
    if target.suffix.lower() != ".toml":
        raise ConfigError("--output", "is not a configuration", str(target), "give a file that ends in .toml")
    check_targets("--output", target.parent, [target])
    if target.exists():
        raise ConfigError("--output", "is there already", str(target), "name another file with --output")
    return target


def _seen_from(target: Path, file: Path) -> str:
    """What the configuration calls a file: its path from there."""
    return Path(os.path.relpath(file, target.parent)).as_posix()


def _drafted(takes: list[Take], name: str, measured: Measured) -> Draft:
    """The draft; errors about what was measured name the options that gave it."""
    try:
        return draft(takes, name, measured)
    except RecordingError as error:
        if error.field in ("length", "poses", "weight", "margin", "at"):
            raise ConfigError(f"--{error.field}", error.problem, error.got, error.fix) from error
        raise


def _written(console: Console, target: Path, name: str, found: Draft, source: str, following: str) -> Outcome:
    """Write a draft, and show what it says; `following` is the command to give next."""
    made("--output", target.parent)
    write_text(target, found.text)
    heading(console, name, f"looks like {found.kind}")
    console.print("seen:")
    listing(console, found.seen)
    console.print(f"not known from {source}:")
    listing(console, found.unknown)
    try:
        data = _built(console, target)
    except SheetbendError:
        console.print(f"written to {target}, but it does not run as it is:", soft_wrap=True)
        raise
    console.print(f"written to {target}; next: {following}", soft_wrap=True)
    return Outcome({"name": name, "config": str(target)} | _said(found) | data)


def _chosen(recording: Recording, markers: str) -> Recording:
    """The markers whose names match a list of names and patterns, in the recording's order."""
    patterns = [pattern.strip() for pattern in markers.split(",")]
    for pattern in patterns:
        if not any(fnmatchcase(name, pattern) for name in recording.markers):
            fix = f"name some of: {', '.join(recording.markers)}; * stands for any characters"
            raise ConfigError("--markers", f"names no marker of {recording.name}", pattern, fix)
    return recording.select([name for name in recording.markers if any(fnmatchcase(name, p) for p in patterns)])


def _check_mesh(files: list[Path], measured: Measured, markers: str | None, poses: Path | None) -> None:
    """A garment comes in one file, has no length, and nothing moves it."""
    if poses is not None:
        raise ConfigError("--poses", "go with a recording, and the first file is a mesh", str(poses), "leave them out")
    if len(files) > 1:
        raise ConfigError("FILES", "are several, and the first is a mesh", [str(f) for f in files], "give one mesh")
    for option, given, problem, fix in (
        ("--length", measured.length, "is of a rope or a beam", "leave it out"),
        ("--weight", measured.weight, "is of a rope", "leave it out"),
        ("--at", measured.at, "is of a beam", "leave it out"),
        ("--margin", measured.margin, "is of the markers on a cloth", "leave it out"),
        ("--markers", markers, "are of a recording", "leave them out"),
    ):
        if given is not None:
            raise ConfigError(option, problem, given, fix)


def _built(console: Console, target: Path) -> dict[str, Any]:
    """Build what the configuration describes, and show what it assumes."""
    config = parse_any(target)
    if isinstance(config, GrippedConfig):
        ropes = load_ropes(config, target.parent)
        listing(console, (note for rope in ropes for note in rope.train.notes))
        return {"parameters": []}
    if not config.recording:
        scene_alone(config, target.parent)
        return {"parameters": []}
    study = build(config, target.parent)
    if study.assumptions:
        console.print("how it is held:")
        listing(console, study.assumptions)
    warn_of_units(console, study)
    return {"parameters": list(study.parameters)}


def _said(found: Draft) -> dict[str, Any]:
    return {"kind": found.kind, "seen": list(found.seen), "unknown": list(found.unknown)}


def _name(recording: str) -> str:
    """A name for the experiment, from that of its first recording."""
    if flaw(recording) is not None or not recording[:1].isascii() or not recording[:1].isalpha():
        recording = f"take_{recording}"
    return "".join(c if c.isascii() and (c.isalnum() or c in "_.-") else "_" for c in recording)


def _read(file: Path, units: str | None) -> tuple[Recording, str | None, str]:
    """A recording in m, the unit that the configuration must name (the one that is given, or the likely one), and a
    sentence about it."""
    try:
        recording = Recording.load(file, units)
    except RecordingError as error:
        for array, (holds, fix) in ELSEWHERE.items():
            if isinstance(error.got, list) and array in error.got:
                raise RecordingError(error.field, f"holds {holds}, and no markers over time", error.got, fix) from error
        raise
    if shuffled(recording.positions):
        fix = f"save them with sb.Cloud.of(points, times).save('cloud.npz'), and {CLOUD}"
        raise RecordingError(str(file), "holds points that are in another order in every frame", "a cloud", fix)
    if units is not None:
        return recording.mended(), units, f"lengths are taken as {units}"
    doubt = unit_doubt(recording)
    if doubt is not None:
        recording = Recording.load(file, doubt)
        why = f"because nothing that is recorded like this is larger than {LONGEST:g} m"
        return recording.mended(), doubt, unit_words(recording, doubt, why)
    why = "because the file does not say its unit"
    return recording.mended(), None, "" if told_unit(file) is not None else unit_words(recording, "m", why)
