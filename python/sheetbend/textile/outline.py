"""The outline of a draped cloth's shadow, from points or a picture."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..arrays.checks import finite
from ..arrays.types import Array
from ..errors import InputError, RecordingError
from ..files.door import bounded_bytes, reading
from ..files.units import METERS
from ..optional import require

PICTURES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp")
_LARGEST, _MOST_PIXELS, _KEPT = 2**24, 10**8, 2**24  # bytes of a table, pixels that are read, and traced
_RAYS, _MOST_FOLDS = 720, 36
_LEVELS = 256  # of gray


@dataclass(frozen=True, eq=False)
class Outline:
    """The outline of a shadow.

    Attributes:
        name: for reports.
        points: (n, 2) m, in order around it.

    Raises:
        InputError: fewer than eight points, another shape, or numbers that are not finite.
    """

    name: str
    points: Array

    def __post_init__(self) -> None:
        points = finite(f"{self.name}.points", self.points, (np.shape(self.points)[0], 2), InputError)
        if len(points) < 8:
            raise InputError(f"{self.name}.points", "are too few for an outline", len(points), "give eight or more")
        object.__setattr__(self, "points", points)

    @property
    def area(self) -> float:
        """m^2, inside of the outline."""
        x, y = self.points.T
        return abs(float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))) / 2.0

    @property
    def nodes(self) -> int:
        """Number of folds: the strongest wave of the radius about the middle, from two on."""
        x, y = (self.points - self.points.mean(axis=0)).T
        angle, radius = np.arctan2(y, x), np.hypot(x, y)
        even = np.interp(2.0 * np.pi * np.arange(_RAYS) / _RAYS - np.pi, *_around(angle, radius))
        return 2 + int(np.abs(np.fft.rfft(even))[2 : _MOST_FOLDS + 1].argmax())

    def coefficient(self, diameter: float, plate: float) -> float:
        """The drape coefficient in %: the part of the overhanging ring that the shadow covers.

        Args:
            diameter, plate: of the cloth and the plates, m.

        Raises:
            InputError: a shadow smaller than the plate or larger than the cloth, so that the unit or the scale is off.
        """
        inner, outer = math.pi * plate**2 / 4.0, math.pi * diameter**2 / 4.0
        if not inner < self.area < outer:
            fix = "check the units, the scale, and the sizes of cloth and plate"
            got = f"{1e4 * self.area:.4g} cm^2, of {1e4 * inner:.4g} to {1e4 * outer:.4g}"
            raise InputError(self.name, "is smaller than the plate or larger than the cloth", got, fix)
        return 100.0 * (self.area - inner) / (outer - inner)


def read_outline(path: str | Path, *, units: str | None = None, width: float | None = None) -> Outline:
    """Read an outline from a table of points, or from a picture of the shadow.

    A table has x and y in two columns (commas, semicolons, tabs or blanks between them), in order around the outline.
    A picture has a shadow that is darker or brighter than what is around it; the outline is the longest contour at the
    gray level that tells the two apart best (Otsu 1979).

    Args:
        path: of the file.
        units: of a table: "m", "cm", "mm", "in" or "ft".
        width: of a picture from side to side, m.

    Raises:
        RecordingError: the file holds no outline.
        InputError: no units of a table, or no width of a picture.
        MissingExtraError: Pillow and contourpy are not installed (extra `plot`).
    """
    path = Path(path)
    with reading(path, RecordingError):
        if path.suffix.lower() in PICTURES:
            if width is None or not width > 0.0:
                raise InputError("width", "of the picture is not known", width, "give how many m it shows side to side")
            return Outline(path.stem, _contour(path, width))
        if units not in METERS:
            raise InputError("units", "of the outline are not known", units, f"use one of {', '.join(METERS)}")
        return Outline(path.stem, METERS[units] * _table(path))


def _table(path: Path) -> Array:
    rows: list[list[float]] = []
    for number, line in enumerate(bounded_bytes(path, _LARGEST, RecordingError).decode("utf-8").splitlines(), start=1):
        cells = [cell for cell in re.split(r"[;,\s]+", line.strip()) if cell]
        try:
            numbers = [float(cell) for cell in cells]
        except ValueError:
            numbers = []
        if len(numbers) == 2:
            rows.append(numbers)
        elif cells and rows:
            raise RecordingError(
                f"{path.name}, line {number}", "is not a point", line[:60], "give x and y in each line"
            )
    if len(rows) < 8:
        raise RecordingError(path.name, "holds too few points for an outline", len(rows), "give x and y in each line")
    return np.array(rows)


def _contour(path: Path, width: float) -> Array:
    images = require("PIL.Image", "plot")
    with images.open(path) as picture:
        if picture.size[0] * picture.size[1] > _MOST_PIXELS:
            raise RecordingError(path.name, "is too large", picture.size, f"give at most {_MOST_PIXELS} pixels")
        pixels = math.ceil(math.sqrt(picture.size[0] * picture.size[1] / _KEPT))  # along either axis, to one
        gray = np.asarray(picture.convert("L").reduce(pixels), dtype=float)
        scale = width * pixels / picture.size[0]
    level = _threshold(gray)
    if np.median(np.concatenate([gray[0], gray[-1], gray[:, 0], gray[:, -1]])) > level:
        gray, level = -gray, -level  # a dark shadow
    lines = require("contourpy", "plot").contour_generator(z=gray).lines(level)
    closed = [line for line in lines if len(line) >= 8 and np.allclose(line[0], line[-1])]
    if not closed:
        fix = "give a picture that shows all of the shadow, darker or brighter than what is around it"
        raise RecordingError(path.name, "shows no closed outline", f"{len(lines)} open lines", fix)
    longest = max(closed, key=lambda line: Outline(path.stem, line[:-1]).area)
    return np.asarray(longest[:-1] * [1.0, -1.0] * scale)


def _threshold(gray: Array) -> float:
    """The level between the two classes of gray that differ most (N. Otsu, IEEE Trans. Syst. Man Cybern. 9, 1979)."""
    counts, edges = np.histogram(gray, _LEVELS, (0.0, 256.0))
    share = np.cumsum(counts) / counts.sum()
    mean = np.cumsum(counts * (edges[:-1] + 0.5)) / counts.sum()
    with np.errstate(divide="ignore", invalid="ignore"):
        between = (mean[-1] * share - mean) ** 2 / (share * (1.0 - share))
    between = np.nan_to_num(between)
    return float(edges[1:][np.isclose(between, between.max())].mean())  # the middle of equally good ones


def _around(angle: Array, radius: Array) -> tuple[Array, Array]:
    """Sorted by angle, a turn longer at both ends."""
    order = np.argsort(angle)
    a, r = angle[order], radius[order]
    return np.concatenate([a - 2.0 * np.pi, a, a + 2.0 * np.pi]), np.tile(r, 3)
