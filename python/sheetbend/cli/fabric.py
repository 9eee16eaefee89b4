"""sheetbend fabric: one fabric from all files of a laboratory."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from ..config.fabric_file import write_fabric
from ..config.fabric_tests import load_fabric_tests
from ..files.whole import write_text
from ..report.tables import plain_section
from ..textile import fit_tests
from .fabric_figures import PICTURES, fabric_pictures
from .fabric_page import fabric_page_of
from .fabric_report import fabric_dict, fabric_sections
from .folders import made
from .outcome import Code, Json, Outcome, run
from .pages import page_possible
from .screen import heading
from .targets import check_targets

FILES = ("fabric.toml", "report.txt", "report.html", *PICTURES)


def fabric(
    file: Annotated[
        Path,
        typer.Argument(help="A TOML file that lists the tests of the laboratory (docs/fabric.md).", show_default=False),
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            help="Folder for the report, the figures and fabric.toml, which scenes can use. Default: out/NAME.",
            show_default=False,
        ),
    ] = None,
    json: Json = False,
) -> None:
    """Find one fabric, with intervals, from all tests of a laboratory: pulls, shear, bending, drape and weight.

    Example: sheetbend fabric denim_tests.toml
    """
    run(lambda console: _fabric(console, file, output), json)


def _fabric(console: Console, file: Path, output: Path | None) -> Outcome:
    study = load_fabric_tests(file)
    about = study.config.fabric
    folder = output if output is not None else Path("out") / about.name
    check_targets("--output", folder, [folder / name for name in FILES])
    made("--output", folder)
    heading(console, about.name, about.about)
    with_page = page_possible(console)
    found = fit_tests(study.tests)
    sections = fabric_sections(study, found)
    text = "\n\n".join("\n".join(plain_section(section)) for section in sections) + "\n"
    console.print("\n" + text, soft_wrap=True, end="")
    write_text(folder / "report.txt", text)
    comment = f"{about.name}: found by `sheetbend fabric {file.name}`.\nIn a scene: [[scene.cloth]] fabric_file"
    write_fabric(
        folder / "fabric.toml", found.fit.fabric, {e.name: (e.lower, e.upper) for e in found.fit.estimates}, comment
    )
    pictures = fabric_pictures(console, study, found, folder)
    written = ["fabric.toml", "report.txt", *pictures]
    if with_page:
        page = fabric_page_of(study, found, sections, [folder / p for p in pictures], file)
        write_text(folder / "report.html", page)
        written.insert(1, "report.html")
    console.print(f"\nwritten to {folder}: {', '.join(written)}", soft_wrap=True)
    unknown = all(e.verdict == "not identifiable" for e in found.fit.estimates)
    data = {"name": about.name, "output": str(folder), "files": written, **fabric_dict(found)}
    return Outcome(data, Code.NOT_IDENTIFIABLE if unknown else Code.DONE)
