"""sheetbend fit of ropes between two grips: the recipe, rope by rope."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from rich.console import Console

from ..config import GrippedConfig, GrippedRopeSection
from ..errors import ConfigError, RecordingError, SceneError, SheetbendError
from ..files.whole import write_text
from ..gripped import WITHOUT_TWIST, GrippedMotion, RopeFit, RopeReport, Rung, Screened, evaluate, fit_rope, screened
from ..gripped.ladder import AND, BESIDE, CLOCK, MARKERS, REST, ROLLS, SHIFTS, TILTS, TWIST, VARYING, YIELD
from ..gripped.model import NAME
from ..gripped.report import overview
from ..objects.chain import unit_vector
from ..recording.io.folder import read_recordings, units_told
from ..recording.recording import Recording
from ..recording.recording_checks import marker_indices
from ..report.parameter_table import TABLE, parameter_table
from ..report.tables import plain_section
from .figures import figures_form
from .gripped_figure import write_figure
from .outcome import Code, Outcome, code_of
from .pages import PAGE, page_possible, write_rope_page
from .screen import heading, show

RUNGS: dict[str, Rung] = {
    "twist": TWIST,
    "tilts": TILTS,
    "rest": REST,
    "varying": VARYING,
    "yield": YIELD,
    "rolls": ROLLS,
    "clock": CLOCK,
    "beside": BESIDE,
    "shifts": SHIFTS,
    "markers": MARKERS,
}


@dataclass(frozen=True)
class RopeData:
    """A rope's section with its recordings, smoothed."""

    section: GrippedRopeSection
    train: Screened
    unseen: Screened


def load_ropes(config: GrippedConfig, folder: Path) -> list[RopeData]:
    """All recordings, checked.

    Raises:
        ConfigError: a folder or a recording in it cannot be used; it names the key.
    """
    ropes = []
    for i, section in enumerate(config.gripped_rope):
        where = f"gripped_rope[{i}]"
        train = _load(section, where, "train", folder / section.train)
        unseen = Screened(()) if section.eval is None else _load(section, where, "eval", folder / section.eval)
        ropes.append(RopeData(section, train, replace(unseen, notes=(*unseen.notes, *_fitted_too(train, unseen)))))
    return ropes


def _fitted_too(train: Screened, unseen: Screened) -> list[str]:
    """Warn of recordings in `unseen` that are fitted too."""
    fitted = {m.recording.positions.tobytes(): m.recording.name for m in train}
    return [
        f"{m.recording.name} of eval has the same positions as {name} of train: its error is not that of an unseen "
        "recording"
        for m in unseen
        if (name := fitted.get(m.recording.positions.tobytes())) is not None
    ]


def _load(section: GrippedRopeSection, where: str, part: str, folder: Path) -> Screened:
    refused: dict[str, RecordingError] = {}
    try:
        found = read_recordings(folder, section.pattern, section.units, refused)
        found = _reordered(found, section.reorder, f"{where}.reorder", part)
        if section.clamped is not None:
            found = [replace(r, clamped=marker_indices("clamped", section.clamped, r.markers)) for r in found]
        told = section.units is not None or units_told(folder, section.pattern, refused)
        motions = screened(found, section.smoothing, not told)
    except RecordingError as error:
        which = "" if error.field in ("folder", str(folder)) else f"{error.field} "
        raise ConfigError(f"{where}.{part}", f"{which}{error.problem}", error.got, error.fix) from error
    if section.nominal is not None:
        _check_nominal(section.nominal, f"{where}.nominal", motions)
    unread = (f"{name} is left out: it {error.problem}" for name, error in refused.items())
    return replace(motions, notes=(*unread, *motions.notes))


def _reordered(
    found: Sequence[Recording], reorder: Mapping[str, Sequence[str | int]], key: str, part: str
) -> list[Recording]:
    """Recordings of a folder with the markers of those that the configuration names in another order; names, and which
    are gripped, stay where they are along the rope."""
    orders = {name.partition("/")[2]: order for name, order in reorder.items() if name.startswith(f"{part}/")}
    unknown = sorted(orders.keys() - {r.name for r in found})
    if unknown:
        names = ", ".join(r.name for r in found[:5])
        raise ConfigError(key, f"names a recording that {part} does not have", unknown[0], f"use such as {names}")
    changed = []
    for r in found:
        order = list(range(len(r.markers)))
        if r.name in orders:
            try:
                order = list(marker_indices("reorder", orders[r.name], r.markers))
            except RecordingError as error:
                raise ConfigError(f"{key}.{part}/{r.name}", error.problem, error.got, error.fix) from error
        if len(order) != len(r.markers):
            fix = f"list all {len(r.markers)} in their order along the rope"
            raise ConfigError(f"{key}.{part}/{r.name}", "does not hold every marker", len(order), fix)
        changed.append(replace(r, positions=r.positions[:, order]) if r.name in orders else r)
    return changed


def _check_nominal(nominal: Sequence[Sequence[float]], key: str, motions: Sequence[GrippedMotion]) -> None:
    for motion in motions:
        for end, direction in zip((False, True), nominal, strict=True):
            try:
                motion.grip(end, slice(None), unit_vector("nominal", direction))
            except SceneError as error:
                raise ConfigError(key, f"{error.problem} of {motion.recording.name}", error.got, error.fix) from error


def rope_files(config: GrippedConfig) -> list[str]:
    """Every file that `fit_ropes` may write; names relative to the folder."""
    form = config.output.figures
    names = ["fit.json", "report.txt", TABLE, PAGE, *([] if form == "none" else [f"predicted.{form}"])]
    return ["report.txt", *(f"{rope.name}/{name}" for rope in config.gripped_rope for name in names)]


def fit_ropes(
    console: Console, config: GrippedConfig, ropes: Sequence[RopeData], folder: Path, strict: bool
) -> Outcome:
    """Fit every rope, report each as soon as it is done, and write it to a folder of its own.

    After Ctrl-C what is whole is reported: the ropes that are done, and of the present one the last finished rung.
    """
    form, page = figures_form(console, config), page_possible(console)
    reports: list[RopeReport] = []
    files: list[str] = []
    stopped = False
    for rope in ropes:
        heading(
            console, rope.section.name, f"{len(rope.train)} recordings to fit, {len(rope.unseen)} unseen", above="\n"
        )
        try:
            found = _fit(console, config, rope, [RUNGS[name] for name in rope.section.rungs])
            report, stopped = _judged(console, config, rope, found)
        except KeyboardInterrupt:
            if not reports:
                raise
            stopped = True
            break
        reports.append(report)
        show(console, report.rich, report.plain)
        files += _write(report, form, page, rope, folder)
        if stopped:
            break
    summary = plain_section(overview(reports))
    write_text(folder / "report.txt", "\n".join(summary) + "\n")
    console.print("\n" + "\n".join(summary), markup=False, soft_wrap=True)
    console.print(f"\nwritten to {folder}: report.txt, {', '.join(files)}", soft_wrap=True)
    missing = [rope.section.name for rope in ropes[len(reports) :]]
    if missing:
        console.print(f"interrupted: not fitted are {', '.join(missing)}")
    data = {
        "name": config.experiment.name,
        "output": str(folder),
        "files": ["report.txt", *files],
        "ropes": {r.name: r.to_dict() for r in reports},
        "not_fitted": missing,
    }
    results = [report.result for report in reports]
    return Outcome(data, Code.INTERRUPTED if stopped else code_of(results, strict or config.fit.strict))


def _fit(console: Console, config: GrippedConfig, rope: RopeData, ladder: Sequence[Rung]) -> RopeFit:
    began = time.perf_counter()
    s = rope.section
    return fit_rope(
        rope.train,
        density=s.density,
        marker_mass=s.marker_mass,
        nominal=None if s.nominal is None else (s.nominal[0], s.nominal[1]),
        ladder=ladder,
        validate=s.validate_share,
        bending_lengths=s.bending_lengths,
        starts=s.starts,
        windows="all" if s.windows == "all" else [(length, total) for length, total in s.windows],
        segments=s.segments,
        max_segments=s.max_segments,
        substeps=s.substeps,
        smoothing=s.smoothing,
        sigma=s.sigma,
        gravity=None if s.gravity is None else (s.gravity[0], s.gravity[1], s.gravity[2]),
        given=None if s.density_sd is None else {f"{NAME}_density": s.density_sd},
        threads=config.fit.threads,
        say=lambda text: console.print(f"  {time.perf_counter() - began:6.1f} s  {text}", soft_wrap=True),
    )


def _judged(console: Console, config: GrippedConfig, rope: RopeData, found: RopeFit) -> tuple[RopeReport, bool]:
    """What the rope predicts, and whether Ctrl-C ended the work."""
    report = RopeReport(rope.section.name, found, evaluate(found, rope.unseen) if rope.unseen else None)
    if found.fit.result.interrupted:
        return report, True
    if not config.fit.without_twist or not rope.unseen:
        return report, False
    console.print("  for comparison without twist:")
    kept = {name for step in found.steps if step.stays for name in step.name.split(AND)}
    ladder = [RUNGS[name] for name in rope.section.rungs[1:]]
    try:
        bare = _fit(console, config, rope, [WITHOUT_TWIST, *(rung for rung in ladder if rung.name in kept)])
    except KeyboardInterrupt:
        return report, True
    except SheetbendError as error:  # a comparison that cannot be made costs no result
        console.print(f"  no comparison without twist: {error}", soft_wrap=True)
        return report, False
    return replace(report, without_twist=evaluate(bare, rope.unseen)), bare.fit.result.interrupted


def _write(report: RopeReport, form: str, page: bool, rope: RopeData, folder: Path) -> list[str]:
    """Everything that a rope leaves behind; names relative to the folder."""
    own = folder / report.name
    own.mkdir(parents=True, exist_ok=True)
    text = json.dumps(report.to_dict(), indent=2, allow_nan=False) + "\n"
    write_text(own / "fit.json", text)
    write_text(own / "report.txt", report.plain())
    write_text(own / TABLE, parameter_table(report.result))
    drawn = report.unseen or evaluate(report.found, rope.train)
    pages = write_rope_page(report, drawn, own) if page else []
    names = ["fit.json", "report.txt", TABLE, *pages, *write_figure(report, drawn, form, own)]
    return [f"{report.name}/{name}" for name in names]
