"""The moving pictures that `sheetbend fit` and `sheetbend simulate` write on request."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from ..equilibrium import equilibrium
from ..fit import Fit
from ..movie import Motion, check_movie, movie_paths, save_movie
from ..prediction import Comparison
from ..scene import Scene
from ..simulate import simulate
from .folders import made

OPTION = "--movie"
MoviePath = Annotated[
    Path | None,
    typer.Option(
        OPTION,
        help="Also write a moving picture (GIF) of cloths, colored by strain, and ropes; a fit's with the measured "
        "markers. Several recordings: one file each, FILE_NAME.gif.",
        show_default=False,
    ),
]


def check_before(path: Path, scenes: Sequence[Scene]) -> None:
    """Raise before any work starts, see `movie.check_movie`; makes the file's folder."""
    check_movie(OPTION, path, scenes)
    made(OPTION, path.parent)


def write_movies(found: Fit, path: Path) -> list[str]:
    """One for every recording of a motion; gives the files."""
    moving = [c for c in found.comparisons if not c.experiment.static]
    paths = movie_paths(path, [c.experiment.name for c in moving])
    for c in moving:
        save_movie(_motion(found, c), paths[c.experiment.name], c.experiment.name)
    return [str(file) for file in paths.values()]


def _motion(found: Fit, c: Comparison) -> Motion:
    """The fitted motion at the substeps nearest to the recorded frames."""
    e, values = c.experiment, found.values_of(c.experiment)
    at = np.maximum(e.scene_times(c.recording.times, values), 0.0)
    times, frames = np.unique(np.rint(at / e.solver.h) * e.solver.h, return_inverse=True)
    start = equilibrium(e.scene, values=values).positions if e.start == "equilibrium" else None
    positions = simulate(e.scene, times, e.solver, values, start).positions[frames]
    return Motion(e.scene, c.recording.times, positions, c.recording.positions, c.simulated)
