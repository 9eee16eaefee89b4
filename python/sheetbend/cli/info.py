"""sheetbend info: what is installed, and what a configuration holds."""

from __future__ import annotations

import importlib.metadata
import platform
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console
from rich.table import Table

from .. import _core
from ..config import GrippedConfig, Study, build, parse_any, scene_alone
from ..doubts.implausible import other_than_meant
from ..errors import ConfigError
from ..experiment.experiment import Experiment
from ..experiment.wanted import as_parameters
from ..files.door import reading
from ..gripped.plausible import doubts, gravities
from ..minimum.by_ceres import ceres_trouble, has_ceres
from ..minimum.growth import in_words, over_fit
from ..quantities.kinds import KINDS
from ..recording.io import FORMATS
from ..recording.recording import Recording
from ..recording.unit_doubt import extent, unit_doubt
from ..scene.scene import Scene
from ..version import __version__
from .gripped import RopeData, load_ropes
from .outcome import Json, Outcome, run
from .screen import heading, listing

PACKAGES = ("numpy", "scipy", "torch", "matplotlib", "pydantic", "rich", "typer")
_MARKERS = 60  # shown of a recording


def info(
    config: Annotated[
        Path | None,
        typer.Argument(
            help="A recording (a file, or a folder of meshes), or a TOML configuration (docs/configuration.md).",
            show_default=False,
        ),
    ] = None,
    json: Json = False,
) -> None:
    """Show what a recording or a configuration contains, or which versions are installed.

    For a recording: what it holds, its noise, and where each marker is first seen. For a configuration: its scenes,
    quantities and parameters. Without a file: the versions, and what this build contains.

    Example: sheetbend info experiments/twin/data/twin.npz
    """
    run(lambda console: _info(console, config), json)


def _without_ceres() -> str:
    trouble = ceres_trouble()
    return f"Ceres does not load: {trouble}" if trouble else "Ceres was not built: install libceres-dev and reinstall"


def _info(console: Console, path: Path | None) -> Outcome:
    data: dict[str, Any] = {"sheetbend": __version__, "python": platform.python_version(), "packages": _packages()}
    data["kernels"] = {"used": _core.instruction_set(), "compiled": _core.compiled_instruction_sets()}
    data |= {"ceres": has_ceres(), "constraints": {name: kind["arity"] for name, kind in KINDS.items()}}
    if path is None:
        _show_installation(console, data)
    elif path.suffix.lower() in FORMATS or path.is_dir():
        data["recording"] = _recording(console, Recording.load(path))
    else:
        data["config"] = _config(console, path)
    return Outcome(data)


def _show_installation(console: Console, data: dict[str, Any]) -> None:
    heading(console, f"sheetbend {__version__}", f"Python {data['python']}, {platform.machine()}")
    console.print(
        "  optimizers   ",
        "ceres, scipy" if has_ceres() else f"scipy ({_without_ceres()})",
    )
    console.print("  kernels      ", f"{data['kernels']['used']} (compiled: {', '.join(data['kernels']['compiled'])})")
    console.print(
        "  constraints  ", ", ".join(f"{name} ({arity})" for name, arity in data["constraints"].items()), soft_wrap=True
    )
    console.print(
        "  packages     ",
        ", ".join(f"{name} {version or 'missing'}" for name, version in data["packages"].items()),
        soft_wrap=True,
    )


def warn_of_units(console: Console, study: Study) -> None:
    """Print a warning for every number that is likely to be in another unit."""
    if study.experiments:
        fitted = as_parameters(study.parameters, study.experiments) if study.parameters else None
        listing(console, (f"warning: {words}" for words in other_than_meant(study.experiments, fitted)))


def _packages() -> dict[str, str | None]:
    """Versions without importing anything."""
    found: dict[str, str | None] = {}
    for name in PACKAGES:
        try:
            found[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            found[name] = None
    return found


def _recording(console: Console, recording: Recording) -> dict[str, Any]:
    """Print a recording's size, noise and boundary, and every marker with the place where it is first seen."""
    first = recording.mask.argmax(axis=0)
    at = recording.positions[first, np.arange(len(first))]
    console.print(recording.summary(), soft_wrap=True)
    doubt = unit_doubt(recording)
    if doubt is not None:
        said = (
            f"the markers are {extent(recording):.4g} m apart: write units = {doubt} in a configuration, or in the JSON"
        )
        console.print(said, soft_wrap=True)
    table = Table("marker", "first seen [s]", "x [m]", "y [m]", "z [m]", "lost", box=None, pad_edge=False)
    lost = 1.0 - recording.mask.mean(axis=0)
    for k, marker in enumerate(recording.markers[:_MARKERS]):
        place = (f"{x:.4g}" for x in at[k])
        table.add_row(marker, f"{recording.times[first[k]]:.4g}", *place, f"{lost[k]:.1%}")
    console.print(table)
    if len(recording.markers) > _MARKERS:
        console.print(f"and {len(recording.markers) - _MARKERS} more")
    return {
        "name": recording.name,
        "frames": len(recording.times),
        "times": recording.times[[0, -1]].tolist(),
        "markers": {marker: x.tolist() for marker, x in zip(recording.markers, at, strict=True)},
        "clamped": [recording.markers[k] for k in recording.clamped],
        "gravity": None if recording.gravity is None else recording.gravity.tolist(),
    }


def _config(console: Console, path: Path) -> dict[str, Any]:
    config = parse_any(path)
    if isinstance(config, GrippedConfig):
        with reading(path, ConfigError):
            ropes = load_ropes(config, path.parent)
        return _ropes(console, config, ropes)
    with reading(path, ConfigError):
        study = build(config, path.parent)
        first = study.experiments[0].scene if study.experiments else scene_alone(config, path.parent)[0]
    heading(console, config.experiment.name, config.experiment.about)
    scenes = [_recorded(e) for e in study.experiments] or [_counts(first)]
    for scene in scenes:
        console.print("  " + ", ".join(f"{name} {_text(value)}" for name, value in scene.items()), soft_wrap=True)
    listing(console, study.assumptions)
    warn_of_units(console, study)
    grown = [over_fit(e) for e in study.experiments if not e.static and e.predict is None]
    for g in grown:
        console.print(f"  {in_words(g)}", markup=False, soft_wrap=True)
    table = Table("quantity", "value", "unit", "parameter", box=None, pad_edge=False, padding=(0, 2, 0, 0))
    for name, q in first.quantities.items():
        table.add_row(name, f"{q.value:.6g}", q.unit, _role(study.parameters.get(name)))
    console.print(table)
    return {
        "name": config.experiment.name,
        "scenes": scenes,
        "assumptions": list(study.assumptions),
        "quantities": {n: q.value for n, q in first.quantities.items()},
        "parameters": list(study.parameters),
        "growth": {g.name: g.to_dict() for g in grown},
    }


def _ropes(console: Console, config: GrippedConfig, ropes: list[RopeData]) -> dict[str, Any]:
    """Ropes between grips: what was recorded, and what is to be fitted."""
    heading(console, config.experiment.name, config.experiment.about)
    told: dict[str, dict[str, Any]] = {}
    doubtful = {r.section.name: doubts(r.train, r.section.gravity or gravities(r.train)[-1]) for r in ropes}
    for rope in ropes:
        motions = rope.train
        told[rope.section.name] = {
            "train": len(rope.train),
            "eval": len(rope.unseen),
            "seconds": float(sum(m.recording.times[-1] - m.recording.times[0] for m in motions)),
            "free markers": len(motions[0].free),
            "length": float(np.mean([m.length for m in motions])),
            "density": rope.section.density,
            "rungs": rope.section.rungs,
            "notes": [*rope.train.notes, *rope.unseen.notes],
        }
    table = Table("rope", "train", "eval", "to fit", "free markers", "length", "density", "rungs", box=None)
    for name, row in told.items():
        units = {"seconds": "s", "length": "m", "density": "kg/m"}
        shown = {"density": "not weighed"} if row["density"] is None else {}
        cells = [
            shown.get(key) or f"{_text(value)} {units.get(key, '')}".rstrip()
            for key, value in row.items()
            if key not in ("rungs", "notes")
        ]
        table.add_row(name, *cells, ", ".join(row["rungs"]))
    console.print(table)
    for name, row in told.items():
        for note in row["notes"]:
            console.print(f"  {name}: {note}", markup=False, soft_wrap=True)
    for name, sentences in doubtful.items():
        told[name]["doubts"] = list(sentences)
        for sentence in sentences:
            console.print(f"  {name} is doubtful: {sentence}", soft_wrap=True)
    return {"name": config.experiment.name, "ropes": told}


def _recorded(e: Experiment) -> dict[str, Any]:
    shown = {"recording": e.name, "frames": len(e.recording.times), "markers": len(e.compared)}
    return shown | ({"static": True} if e.static else {"h": e.solver.h}) | _counts(e.scene)


def _counts(scene: Scene) -> dict[str, Any]:
    groups = {g.name: len(g.particles) for g in scene.groups}
    return {"particles": scene.particle_count, "dofs": 3 * len(scene.free_nodes), "constraints": groups}


def _role(fields: Any) -> str:
    if fields is None:
        return ""
    if fields.get("fixed"):
        return "fixed"
    if "tied_to" in fields:
        return f"tied to {fields['tied_to']}"
    return "fitted, one per recording" if fields.get("private") else "fitted"


def _text(value: Any) -> str:
    if isinstance(value, dict):
        return "(" + ", ".join(f"{name} {count}" for name, count in value.items()) + ")"
    return f"{value:g}" if isinstance(value, float) else str(value)
