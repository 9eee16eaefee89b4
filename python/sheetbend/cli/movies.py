"""The moving pictures that `sheetbend fit` and `sheetbend simulate` write on request."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from ..fitting.fit import Fit
from ..fitting.fitted_motion import fitted_positions
from ..pictures.movie import Motion, check_movie, movie_paths, save_movie
from ..scene.scene import Scene
from .folders import made

OPTION = "--movie"
MoviePath = Annotated[
    Path | None,
    typer.Option(
        OPTION,
        help="Also write a GIF or MP4 movie of ropes and of cloths, colored by strain; the movie of a fit also shows "
        "the measured markers. With several recordings, one file for each: FILE_NAME.gif or .mp4.",
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
        x = c.recording
        motion = Motion(c.experiment.scene, x.times, fitted_positions(found, c), x.positions, c.simulated)
        save_movie(motion, paths[c.experiment.name], c.experiment.name)
    return [str(file) for file in paths.values()]
