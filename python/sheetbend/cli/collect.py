"""sheetbend collect: the results of many fits in one table, and the population that their specimens are of."""

from __future__ import annotations

import json as json_
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from ..errors import ConfigError
from ..files.whole import write_text
from ..optional import MissingExtraError
from ..pictures.forest import plot_forest
from ..pictures.plotting import save
from ..report.collected import Collected
from ..report.fit_result import FitResult
from .ensemble import ERROR, RESULT
from .folders import made
from .journals import NAME
from .outcome import Json, Outcome, run, strict
from .targets import check_targets

FILES = ("fits.csv", "parameters.tsv", "population.json", "population.txt", "forest.png")


def collect(
    results: Annotated[
        list[Path],
        typer.Argument(
            help="Output folders of fits, folders that contain such folders, or fit.json files.", show_default=False
        ),
    ],
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder for the tables and the forest plot.")] = Path(
        "out/collected"
    ),
    json: Json = False,
) -> None:
    """Collect the fits of many specimens into one table, with the mean and spread of each parameter.

    The errors of the single fits are subtracted from the spread (random effects, REML).

    Example: sheetbend collect out/ropes
    """
    run(lambda console: _collect(console, results, output), json)


def _collect(console: Console, results: list[Path], output: Path) -> Outcome:
    files = [file for path in results for file in _fits_in(path)]
    check_targets("--output", output, [output / name for name in FILES])
    fits: dict[str, FitResult] = {}
    for file in dict.fromkeys(files):
        name = file.resolve().parent.name
        fits[name if name not in fits else str(file.parent)] = FitResult.load(file)
    unmade = {name: words for path in results for name, words in _unmade(path).items()}
    without = {name: words for name, words in unmade.items() if name not in fits}
    older = {name: words for name, words in unmade.items() if name in fits}
    found = Collected.of(fits)
    folder, report = made("--output", output), found.report()
    console.print("\n" + report, soft_wrap=True, end="")
    for name, words in without.items():
        console.print(f"no result of {name}: {words}", soft_wrap=True)
    for name, words in older.items():
        console.print(f"the result of {name} is that of an earlier fit; the last one failed: {words}", soft_wrap=True)
    write_text(folder / "fits.csv", found.table())
    write_text(folder / "parameters.tsv", found.petab())
    write_text(folder / "population.json", json_.dumps(strict(found.to_dict()), indent=2, allow_nan=False) + "\n")
    write_text(folder / "population.txt", report)
    names = list(FILES[:-1])
    if any(trait.found is not None for trait in found.traits):
        try:
            save(plot_forest(found), folder / FILES[-1])
            names.append(FILES[-1])
        except MissingExtraError as error:
            console.print(f"no forest plot: {error}", soft_wrap=True)
    console.print(f"\nwritten to {folder}: {', '.join(names)}", soft_wrap=True)
    told = {
        "fits": list(fits),
        "without": without,
        "older": older,
        "markers": found.markers,
        "output": str(folder),
        "files": names,
    }
    return Outcome({"population": found.to_dict(), **told})


def _unmade(path: Path) -> dict[str, str]:
    """Why the last fits in the folders at a path made no result, by the name of the folder."""
    folders = [] if path.is_file() else [path, *sorted(path.glob("*/"))]
    found = {}
    for folder in folders:
        if (folder / ERROR).is_file():
            found[folder.name] = (folder / ERROR).read_text(encoding="utf-8").rstrip()
        elif (folder / NAME).is_file() and not (folder / RESULT).is_file():
            found[folder.name] = "the fit did not finish"
    return found


def _fits_in(path: Path) -> list[Path]:
    """The fit.json at a path: itself, in the folder, or in the folders in there."""
    if path.is_file():
        return [path]
    found = [path / RESULT] if (path / RESULT).is_file() else sorted(path.glob(f"*/{RESULT}"))
    if not found:
        unmade = [f"{name}: {words}" for name, words in _unmade(path).items()]
        more = f"; and {len(unmade) - 1} more" if len(unmade) > 1 else ""
        why = f"hold no fit.json; {unmade[0]}{more}" if unmade else "hold no fit.json"
        raise ConfigError("results", why, str(path), "give the folders that `sheetbend fit` wrote to")
    return found
