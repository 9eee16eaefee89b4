"""sheetbend textile: curves of a testing machine, their KES numbers, and the law that follows them."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal

import typer
from rich.console import Console

from ..errors import ConfigError, InputError
from ..files.whole import write_text
from ..textile import Curve, fit_pull, forecast_pull, mean_curve, read_curves
from ..textile.units import quantity
from .folders import made
from .outcome import Code, Json, Outcome, run
from .spelling import options
from .targets import check_targets
from .textile_figure import write_figure
from .textile_report import report, to_dict, write_mean

Test = Literal["tension", "shear", "bending"]
Along = Literal["warp", "weft"]
LawName = Literal["linear", "exponential", "sinh", "spline", "limit", "two_regimes", "chosen", "none"]
Way = Literal["loading", "unloading", "skeleton"]
Form = Literal["png", "svg", "pdf", "none"]


def textile(
    files: Annotated[
        list[Path],
        typer.Argument(
            help="Text files of a testing machine (CSV, TXT), each with one or more specimens.", show_default=False
        ),
    ],
    test: Annotated[Test, typer.Option(help="Type of the test.")] = "tension",
    length: Annotated[
        str | None,
        typer.Option(
            help="Length between the jaws, such as 20cm, or the words before it in the head of the file.",
            show_default=False,
        ),
    ] = None,
    width: Annotated[
        str | None,
        typer.Option(
            help="Width of the specimen, such as 5cm, or the words before it in the head of the file.",
            show_default=False,
        ),
    ] = None,
    column: Annotated[
        list[str] | None,
        typer.Option(
            help="Column of a role, as ROLE=NAME or ROLE=NUMBER. Roles: deformation, load, time, repeat.",
            show_default=False,
        ),
    ] = None,
    unit: Annotated[
        list[str] | None,
        typer.Option(
            help="Unit of a role, as ROLE=UNIT, if the file does not give it. Example: load=cN.", show_default=False
        ),
    ] = None,
    decimal: Annotated[str | None, typer.Option(help="Decimal mark: a point or a comma.", show_default=False)] = None,
    pretension: Annotated[
        str | None,
        typer.Option(help="Load at which the strain is taken as zero, such as 2N or 1cN/cm.", show_default=False),
    ] = None,
    along: Annotated[Along, typer.Option(help="Direction of the tension test.")] = "warp",
    law: Annotated[LawName, typer.Option(help="Law that is fitted to a tension test.")] = "exponential",
    weights: Annotated[
        str,
        typer.Option(
            help="Weight of small loads in a fit of tension: a power of the load (0: equal weights), or 'chosen'."
        ),
    ] = "0",
    forecast: Annotated[
        bool, typer.Option("--forecast", help="Extrapolate a tension test to 1/0.6 times its strain, with an interval.")
    ] = False,
    poisson: Annotated[float, typer.Option(help="sqrt(nu_uv nu_vu) of the fabric, if it is known.")] = 0.0,
    way: Annotated[Way, typer.Option(help="Part of the loop that the elastic law follows.")] = "loading",
    cycle: Annotated[int, typer.Option(help="Number of the cycle, from 0; -1 is the last.")] = 0,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            help="Folder for the report, the mean curve and the figure. Default: out/NAME.",
            show_default=False,
        ),
    ] = None,
    figures: Annotated[Form, typer.Option(help="Format of the figure.")] = "png",
    json: Json = False,
) -> None:
    """Read curves of a testing machine, print their KES values, and fit a law of tension with intervals.

    Example: sheetbend textile strips.csv --length 20cm --width 5cm --law chosen
    """

    def command(console: Console) -> Outcome:
        curves = _read(files, test, length, width, column, unit, decimal)
        if pretension is not None:
            curves = [c.from_pretension(_pretension(pretension, c)) for c in curves]
        curves = _told_apart(curves)
        folder = _folder(output, files[0], figures)
        fit = None
        if test == "tension" and law != "none":
            fit = fit_pull(curves, along, law, weights=_weights(weights), way=way, cycle=cycle, poisson=poisson)
        further = forecast_pull(curves, way=way, cycle=cycle) if forecast else None
        text = report(curves, fit, cycle) + ("" if further is None else f"\n{further}\n")
        console.print("\n" + text, soft_wrap=True, end="")
        mean = mean_curve(curves, way, cycle=cycle)
        write_text(folder / "report.txt", text)
        write_mean(curves[0].test, mean, folder / "mean.csv")
        written = ["report.txt", "mean.csv", *write_figure(curves, mean, way, fit, along, figures, folder)]
        console.print(f"\nwritten to {folder}: {', '.join(written)}", soft_wrap=True)
        data = {"output": str(folder), "files": written} | to_dict(curves, fit, cycle)
        if further is not None:
            data["forecast"] = further.to_dict()
        unknown = fit is not None and all(e.verdict == "not identifiable" for e in fit.estimates)
        return Outcome(data, Code.NOT_IDENTIFIABLE if unknown else Code.DONE)

    run(command, json)


def _read(
    files: Sequence[Path],
    test: Test,
    length: str | None,
    width: str | None,
    column: Sequence[str] | None,
    unit: Sequence[str] | None,
    decimal: str | None,
) -> list[Curve]:
    """The curves of all files."""
    columns, units = _numbered(_pairs("--column", column)), _pairs("--unit", unit)
    at, across = _size("--length", length), _size("--width", width)
    with options(columns="--column", units="--unit", decimal="--decimal", length="--length", width="--width"):
        return [
            curve
            for file in files
            for curve in read_curves(
                file, test=test, length=at, width=across, columns=columns, units=units, decimal=decimal
            )
        ]


def _told_apart(curves: list[Curve]) -> list[Curve]:
    """Curves with numbers before their names, where two have the same name."""
    if len({c.name for c in curves}) == len(curves):
        return curves
    return [replace(c, name=f"{k} {c.name}") for k, c in enumerate(curves, start=1)]


def _folder(output: Path | None, file: Path, figures: Form) -> Path:
    """The folder of the results, made, in which nothing of theirs is a folder or may not be written."""
    folder = output if output is not None else Path("out") / file.stem
    check_targets("--output", folder, [folder / name for name in ("report.txt", "mean.csv", f"curves.{figures}")])
    made("--output", folder)
    return folder


def _pairs(option: str, given: Sequence[str] | None) -> dict[str, str]:
    pairs = {}
    for text in given or ():
        role, sign, value = text.partition("=")
        if not (sign and role and value):
            raise ConfigError(option, "must be ROLE=VALUE", text, f"write it as {option} load=...")
        pairs[role] = value
    return pairs


def _weights(given: str) -> float | str:
    try:
        return float(given)
    except ValueError:
        return given


def _numbered(columns: Mapping[str, str]) -> dict[str, str | int]:
    return {role: int(value) if re.fullmatch(r"[0-9]{1,6}", value) else value for role, value in columns.items()}


def _size(option: str, given: str | None) -> float | str | None:
    """m; words that the preamble is to be searched for stay words."""
    if given is None or not given[:1].isdigit():
        return given
    return quantity(option, given, "length")[0]


def _pretension(given: str, curve: Curve) -> float:
    value, dimension = quantity("--pretension", given, "force", "force per width")
    if dimension == "force per width":
        return value
    if curve.width is None:
        raise InputError("--pretension", "is a force, and the width is not known", given, "give --width, or N/m")
    return value / curve.width
