"""sheetbend fit: parameters with error bars from the recordings of a configuration."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from ..config import Config, GrippedConfig, Study, build, parse_any
from ..config.values import with_values, write
from ..door import reading
from ..errors import ConfigError
from ..fit import Fit
from ..fit import fit as run_fit
from ..movie import movie_paths
from ..problem import FitProblem, as_parameters
from ..report import plain, rich_report
from ..result import FitResult
from .figures import figure_files, write_figures
from .folders import made
from .gripped import fit_ropes, load_ropes, rope_files
from .movies import OPTION, MoviePath, check_before, write_movies
from .outcome import Outcome, code_of, run
from .progress import Iterations
from .screen import heading, show
from .targets import check_targets


def fit(
    config: Annotated[
        Path, typer.Argument(help="A TOML configuration, see docs/configuration.md.", show_default=False)
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            help="Folder for fit.json, figures, report and fitted.toml; out/NAME when left out.", show_default=False
        ),
    ] = None,
    resume: Annotated[
        Path | None, typer.Option(help="Start from the values of an earlier fit.json.", show_default=False)
    ] = None,
    movie: MoviePath = None,
    strict: Annotated[
        bool, typer.Option("--strict", help="Exit 3 when any parameter is not identifiable, not only when all are.")
    ] = False,
    json: Annotated[
        bool, typer.Option("--json", help="One JSON object on stdout; everything else goes to stderr.")
    ] = False,
) -> None:
    """Fit parameters to recordings. Ctrl-C stops at the best point so far and still reports."""
    run(lambda console: _fit(console, config, output, resume, movie, strict), json)


def _fit(
    console: Console, path: Path, output: Path | None, resume: Path | None, movie: Path | None, strict: bool
) -> Outcome:
    config = parse_any(path)
    if isinstance(config, GrippedConfig):
        if resume is not None:
            fix = "leave it out: the recipe finds its own starts"
            raise ConfigError("--resume", "is not for ropes between grips", str(resume), fix)
        if movie is not None:
            raise ConfigError(OPTION, "is not for ropes between grips", str(movie), "leave it out")
        with reading(path, ConfigError):
            ropes = load_ropes(config, path.parent)
        check_targets("--output", _place(config, output), [_place(config, output) / f for f in rope_files(config)])
        return fit_ropes(console, config, ropes, _folder(console, config, output), strict)
    with reading(path, ConfigError):
        study = _study(config, path.parent, resume)
    check_targets("--output", _place(config, output), [_place(config, output) / f for f in _files(study)])
    if movie is not None:
        check_before(movie, [e.scene for e in study.experiments if not e.static])
        names = [e.name for e in study.experiments if not e.static]
        check_targets(OPTION, movie.parent, movie_paths(movie, names).values())
    config, folder = study.config, _folder(console, config, output)
    fitted = [e for e in study.experiments if e.predict is None]
    problem = FitProblem(fitted, as_parameters(study.parameters, study.experiments))
    _check_starts(config, problem)
    with Iterations(console, problem.parameters) as progress:
        found = run_fit(study.experiments, parameters=study.parameters, progress=progress, **study.options)
    show(console, lambda: rich_report(found.result), lambda: plain(found.result))
    files = _write(found, study, folder)
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
    return ["fit.json", "report.txt", "fitted.toml", *figure_files(study.experiments, study.config)]


def _folder(console: Console, config: Config | GrippedConfig, output: Path | None) -> Path:
    """Where results go, made; and the experiment's name on the screen."""
    folder = _place(config, output)
    made("--output", folder)
    heading(console, config.experiment.name, config.experiment.about)
    return folder


def _study(config: Config, source: Path, resume: Path | None) -> Study:
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
    if resume is not None:
        if not resume.is_file():
            raise ConfigError("--resume", "is no file", str(resume), "give the fit.json of an earlier fit")
        config = with_values(config, FitResult.load(resume).values)
    return build(config, source)


def _check_starts(config: Config, problem: FitProblem) -> None:
    for i, start in enumerate(config.fit.starts):
        for name in start:
            if name not in problem.parameters.free:
                raise ConfigError(
                    f"fit.starts[{i}].{name}",
                    "is no free parameter",
                    name,
                    f"use some of: {', '.join(problem.parameters.free)}",
                )


def _write(found: Fit, study: Study, folder: Path) -> list[str]:
    """Everything a fit leaves behind; names relative to the folder."""
    found.save(folder / "fit.json")
    (folder / "report.txt").write_text(plain(found.result), encoding="utf-8")
    write(with_values(study.config, found.values), folder / "fitted.toml", study.folder)
    return ["fit.json", "report.txt", "fitted.toml", *write_figures(found, study.config, folder)]
