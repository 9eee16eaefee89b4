"""sheetbend fit: parameters with error bars from the recordings of a configuration."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from ..config import Config, GrippedConfig, Study, build, parse_any
from ..config.driven_motion import driven_files, save_driven, with_driven
from ..config.values import with_finer, with_values, write
from ..doubts.implausible import implausible
from ..errors import ConfigError
from ..files.door import reading
from ..files.whole import write_text
from ..fitting.fit import Fit
from ..fitting.fit import fit as run_fit
from ..minimum.discretization import FINER_MESH
from ..pictures.movie import movie_paths
from ..problem.cluster import workers as workers_of
from ..problem.journal import Journal
from ..problem.problem import FitProblem
from ..problem.workers import working_on
from ..recording.recording import Recording
from ..report.fit_result import FitResult
from ..report.parameter_table import TABLE, parameter_table
from ..report.report import plain, rich_report
from .ensemble import fit_all
from .figures import figure_files, figures_form, write_figures
from .folders import alone, made, made_again
from .gripped import fit_ropes, load_ropes, rope_files
from .journals import NAME, journal_in, made_from
from .journals import OPTION as GOING_ON
from .movies import OPTION, MoviePath, check_before, write_movies
from .outcome import Code, Json, Outcome, code_of, run
from .pages import PAGE, page_possible, write_fit_page
from .predicted import predicted_files, save_predicted
from .progress import Iterations
from .screen import heading, listing, show
from .targets import check_targets

STAYS = "the journal stays: the same command with --resume continues from here"
PATTERN = re.compile(r"[*?[]")  # of several files


def fit(
    configs: Annotated[
        list[Path],
        typer.Argument(
            help="A TOML configuration (docs/configuration.md). Several, or a pattern such as 'ropes/*.toml', are "
            "fitted one after the other.",
            show_default=False,
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            help="Folder for fit.json, report.html, report.txt, figures and fitted.toml. Default: out/NAME. Of several "
            "fits, the folder that holds the folder NAME of each.",
            show_default=False,
        ),
    ] = None,
    start: Annotated[
        Path | None, typer.Option("--from", help="Start from the values of an earlier fit.json.", show_default=False)
    ] = None,
    resume: Annotated[
        bool,
        typer.Option(
            "--resume", help="Continue a fit that was killed or stopped, from the journal in its output folder."
        ),
    ] = False,
    movie: MoviePath = None,
    workers: Annotated[
        int, typer.Option(min=1, help="Number of processes that evaluate recordings, starts and leave-one-out fits.")
    ] = 1,
    dask: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS",
            help="Use the workers of a Dask scheduler, given by its address or file (docs/cluster.md).",
            show_default=False,
        ),
    ] = None,
    strict: Annotated[
        bool,
        typer.Option("--strict", help="Exit with 3 if any parameter is not identifiable. Default: only if all are."),
    ] = False,
    json: Json = False,
) -> None:
    """Fit parameters to recordings, and write a report.

    Ctrl-C and SIGTERM stop the fit; the report then shows the best point so far.

    Example: sheetbend fit experiments/twin/twin.toml --output out/twin
    """

    def command(console: Console) -> Outcome:
        config, *others = configs
        for other in others:
            if other.suffix.lower() != ".toml" and not PATTERN.search(str(other)):
                fix = "give TOML files; values of an earlier fit are started from with --from fit.json"
                raise ConfigError("--resume" if resume else "configs", "is not a configuration", str(other), fix)
        if others or (PATTERN.search(str(config)) and not config.exists()):
            if start is not None or movie is not None:
                option = "--from" if start is not None else OPTION
                raise ConfigError(option, "is not for several fits", str(start or movie), "leave it out")
            with workers_of(workers, dask) as executor:
                where = Path.cwd() if dask else Path()  # workers elsewhere know no relative paths
                place = where / (output or "out")
                return fit_all(console, [str(where / c) for c in configs], place, strict, _single, executor)
        with workers_of(workers, dask) as executor, working_on(executor) as traffic:
            outcome = _fit(console, config, output, start, resume, movie, strict)
            if executor is not None:
                console.print(str(traffic), soft_wrap=True)
            return outcome

    run(command, json)


def _single(console: Console, config: Path, output: Path, strict: bool) -> Outcome:
    """One fit of several. It goes on with what a killed one left, unless that was made from something else."""
    if (output / NAME).exists():
        try:
            return _fit(console, config, output, None, True, None, strict)
        except ConfigError as error:
            if error.field != GOING_ON:
                raise
            console.print(f"{output}: {error.problem} (got {error.got!r})", soft_wrap=True)
    return _fit(console, config, output, None, False, None, strict)


def _fit(
    console: Console,
    path: Path,
    output: Path | None,
    start: Path | None,
    resume: bool,
    movie: Path | None,
    strict: bool,
) -> Outcome:
    config = parse_any(path)
    if isinstance(config, GrippedConfig):
        if start is not None:
            fix = "leave it out: the recipe finds its own starts"
            raise ConfigError("--from", "is not for ropes between grips", str(start), fix)
        if movie is not None:
            raise ConfigError(OPTION, "is not for ropes between grips", str(movie), "leave it out")
        with reading(path, ConfigError):
            ropes = load_ropes(config, path.parent)
        place = _place(config, output)
        check_targets("--output", place, [place / f for f in rope_files(config)])
        recordings = [m.recording for rope in ropes for m in (*rope.train, *rope.unseen)]
        with _kept(console, config, recordings, place, resume) as (folder, journal):
            outcome = fit_ropes(console, config, ropes, folder, strict)
            _end(console, journal, outcome)
            return outcome
    with reading(path, ConfigError):
        study = _study(config, path.parent, start)
    place = _place(config, output)
    check_targets("--output", place, [place / f for f in _files(study)])
    if movie is not None:
        check_before(movie, [e.scene for e in study.experiments if not e.static])
        names = [e.name for e in study.experiments if not e.static]
        check_targets(OPTION, movie.parent, movie_paths(movie, names).values())
    recordings = [e.recording for e in study.experiments]
    with _kept(console, study.config, recordings, place, resume) as (folder, journal):
        outcome = _fit_study(console, study, path, folder, movie, strict)
        _end(console, journal, outcome)
        return outcome


def _fit_study(console: Console, study: Study, source: Path, folder: Path, movie: Path | None, strict: bool) -> Outcome:
    config = study.config
    fitted = [e for e in study.experiments if e.predict is None]
    problem = FitProblem(fitted, study.wanted)
    _check_starts(config, problem)
    listing(console, study.assumptions)
    listing(console, (f"warning: {words}" for words in implausible(problem)))
    form, page = figures_form(console, config), page_possible(console)
    with Iterations(console, problem.parameters) as progress:
        found = run_fit(study.experiments, parameters=study.parameters, progress=progress, **study.options)
    found = replace(found, result=replace(found.result, assumed=study.assumptions))
    show(console, lambda: rich_report(found.result), lambda: plain(found.result))
    if removed := made_again(folder):
        console.print(f"\n{removed}", markup=False, soft_wrap=True)
    files = _write(found, study, source, form, page, folder)
    console.print(f"\nwritten to {folder}: {', '.join(files)}", soft_wrap=True)
    if movie is not None:
        movies = write_movies(found, movie)
        console.print(f"moving picture: {', '.join(movies)}", soft_wrap=True)
        files += movies
    data = found.result.to_dict() | {"name": config.experiment.name, "output": str(folder), "files": files}
    return Outcome(data, code_of([found.result], strict or config.fit.strict))


def _place(config: Config | GrippedConfig, output: Path | None) -> Path:
    return output if output is not None else Path("out") / config.experiment.name


def _files(study: Study) -> list[str]:
    """What `_write` may leave behind."""
    markers = [*predicted_files(e.name for e in study.experiments), *driven_files(study.experiments)]
    figures = figure_files(study.experiments, study.config)
    return ["fit.json", "report.txt", TABLE, PAGE, "fitted.toml", *markers, *figures]


@contextmanager
def _kept(
    console: Console, config: Config | GrippedConfig, recordings: Sequence[Recording], place: Path, resume: bool
) -> Iterator[tuple[Path, Journal | None]]:
    """Make and lock the folder of the results, open the journal of the fit in it, and print the experiment's name."""
    folder = made("--output", place)
    heading(console, config.experiment.name, config.experiment.about)

    def say(text: str) -> None:
        console.print(text, markup=False, soft_wrap=True)

    with alone("--output", folder), journal_in(folder, made_from(config, recordings), resume, say) as journal:
        try:
            yield folder, journal
        except KeyboardInterrupt:  # before there is any result
            if journal is not None:
                say(STAYS)
            raise


def _end(console: Console, journal: Journal | None, outcome: Outcome) -> None:
    """All results are written: the journal goes, unless `--resume` can go on with it."""
    if journal is None:
        return
    if outcome.code is Code.INTERRUPTED:
        console.print(STAYS, soft_wrap=True)
    else:
        journal.finish()


def _study(config: Config, source: Path, start: Path | None) -> Study:
    if not config.recording:
        raise ConfigError(
            "recording", "is missing", None, "add a [[recording]] with its file, or use `sheetbend simulate`"
        )
    if all(r.predict is not None for r in config.recording):
        raise ConfigError(
            "recording[0].predict",
            "leaves nothing to fit: all recordings are only predicted",
            config.recording[0].predict,
            "leave it out for one",
        )
    if not config.parameters:
        raise ConfigError(
            "parameters",
            "is missing",
            None,
            "add a [parameters.NAME] for what is to be fitted; `sheetbend info` lists the names",
        )
    if start is not None:
        if not start.is_file():
            raise ConfigError("--from", "is not a file", str(start), "give the fit.json of an earlier fit")
        config = with_values(config, FitResult.load(start).values)
    return build(config, source)


def _check_starts(config: Config, problem: FitProblem) -> None:
    for i, start in enumerate([] if isinstance(config.fit.starts, int) else config.fit.starts):
        for name in start:
            if name not in problem.parameters.free:
                raise ConfigError(
                    f"fit.starts[{i}].{name}",
                    "is not a free parameter",
                    name,
                    f"use some of: {', '.join(problem.parameters.free)}",
                )


def _write(found: Fit, study: Study, source: Path, form: str, page: bool, folder: Path) -> list[str]:
    """Everything a fit leaves behind; names relative to the folder."""
    found.save(folder / "fit.json")
    write_text(folder / "report.txt", plain(found.result))
    write_text(folder / TABLE, parameter_table(found.result))
    # a simulation of it runs on the mesh of the fit, where only these values predict what the report says
    on_mesh = with_values(study.config, {**found.values, **found.on_mesh})
    for refit in found.result.refits:
        if refit.name == FINER_MESH:
            on_mesh = with_finer(on_mesh, refit.moved)
    driven = save_driven(found, folder)
    write(with_driven(study, on_mesh, driven, folder), folder / "fitted.toml", study.folder)
    pages = write_fit_page(found, study.config, source, folder) if page else []
    markers = [
        file for c in found.comparisons for file in save_predicted(c.recording, c.simulated, c.experiment.name, folder)
    ]
    figures = write_figures(found, study.config, form, folder)
    return ["fit.json", "report.txt", TABLE, *pages, "fitted.toml", *driven.values(), *markers, *figures]
