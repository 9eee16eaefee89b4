"""The look of all figures: palette, axes, and keys in words. Figures belong to no window and change no global state."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from ..optional import require

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

INK, GRAY, PALE, ACCENT, WARM = "#22262b", "#8a9099", "#eef0f2", "#0b6e8c", "#c8553d"
"""One palette: measured is gray, simulated is the accent, what needs attention is warm."""
FOUND = [("found", ACCENT), ("shaded: 95 % interval", INK)]
"""The key of `band`."""


def new_figure(width: float, height: float, title: str) -> Figure:
    """An empty figure of a width and height in inches, with a title at its left."""
    figure: Figure = require("matplotlib.figure", "plot").Figure(figsize=(width, height), layout="constrained")
    require("matplotlib.backends.backend_agg", "plot").FigureCanvasAgg(figure)
    if title:
        figure.suptitle(title, fontsize=11, color=INK, x=0.01, ha="left", weight="bold")
    return figure


def clean(panel: Axes) -> None:
    """Axes at the left and below only, in the palette."""
    for side in ("top", "right"):
        panel.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        panel.spines[side].set_color(GRAY)
        panel.spines[side].set_linewidth(0.7)
    panel.tick_params(colors=INK, labelsize=8, width=0.7, color=GRAY)
    panel.xaxis.label.set(color=INK, size=9)
    panel.yaxis.label.set(color=INK, size=9)


def key(parent: Axes | Figure, entries: Sequence[tuple[str, str]]) -> None:
    """Words in the color of what they name, above a panel or at the top of a figure, flush right."""
    boxes = require("matplotlib.offsetbox", "plot")
    words = [boxes.TextArea(word, textprops={"color": color, "fontsize": 9}) for word, color in entries]
    row = boxes.HPacker(children=words, pad=0, sep=14)
    inside = hasattr(parent, "transAxes")
    coordinates, corner = ("axes fraction", (1, 0)) if inside else ("figure fraction", (1, 1))
    offset = {"xybox": (0, 4) if inside else (-8, -4), "boxcoords": "offset points"}
    parent.add_artist(
        boxes.AnnotationBbox(row, (1, 1), box_alignment=corner, xycoords=coordinates, frameon=False, pad=0, **offset)
    )


def band(panel: Axes, x: np.ndarray, values: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> None:
    """What a fit found along x (line) and its 95 % intervals (band); `FOUND` is the key."""
    panel.fill_between(x, lower, upper, color=PALE, linewidth=0)
    panel.plot(x, values, color=ACCENT, linewidth=1.3)
    panel.margins(x=0)


def strip(panel: Axes, label: str, *, share: float = 0.25) -> Axes:
    """A panel for residuals in the lower part of another one's place, on the same time axis, which it labels from now
    on.

    Args:
        share: of the place.
    """
    figure, place = panel.figure, panel.get_subplotspec()
    if place is not None:
        grid = place.subgridspec(2, 1, height_ratios=[1.0 - share, share], hspace=0.0)
        panel.set_subplotspec(grid[0])
        below: Axes = figure.add_subplot(grid[1], sharex=panel)
    else:
        box = panel.get_position()
        panel.set_position((box.x0, box.y0 + 1.2 * share * box.height, box.width, (1.0 - 1.2 * share) * box.height))
        below = figure.add_axes((box.x0, box.y0, box.width, share * box.height), sharex=panel)
    panel.tick_params(labelbottom=False, bottom=False)
    panel.set_xlabel("")
    panel.spines["bottom"].set_visible(False)
    return as_strip(below, label)


def as_strip(panel: Axes, label: str) -> Axes:
    """A panel made ready for residuals, with a line at zero."""
    clean(panel)
    panel.axhline(0.0, color=GRAY, linewidth=0.6, zorder=0)
    panel.set_ylabel(label)
    panel.locator_params(axis="y", nbins=3)
    return panel


def panels_in(
    ax: Any, count: int, size: tuple[float, float], title: str, **grid: Any
) -> tuple[list[Axes], Axes | Figure]:
    """The panels of a picture: the caller's, or new ones in a figure of their own, one below the other.

    Args:
        ax: axes, or a sequence or array of them; None for a new figure.
        count: of panels.
        size: of a new figure, inches.
        title: of a new figure, or above the first of the caller's panels.
        grid: options of `Figure.subplots`.

    Returns:
        The panels, and what the key of the whole picture belongs to.

    Raises:
        InputError: more or fewer axes than there are panels, or something else than axes.
    """
    if ax is None:
        figure = new_figure(*size, title)
        return list(figure.subplots(**{"nrows": count, "squeeze": False, **grid}).ravel()), figure
    panels = all_of(ax)
    if len(panels) != count or not all(hasattr(one, "add_artist") for one in panels):
        got = [type(one).__name__ for one in panels]
        raise InputError("ax", f"must be axes, {count} of them", got, "leave it out for a new figure")
    if title.strip():
        panels[0].set_title(title, fontsize=11, color=INK, loc="left", weight="bold")
    return panels, panels[0]


def all_of(drawn: Any) -> list[Any]:
    """Axes or a figure, alone or in lists and arrays, as one list."""
    if isinstance(drawn, np.ndarray):
        return list(drawn.ravel())
    return [one for each in drawn for one in all_of(each)] if isinstance(drawn, list | tuple) else [drawn]


def seen_points(points: np.ndarray) -> np.ndarray:
    """The points that were seen, of points (n, 3): rows without NaN."""
    return points[np.isfinite(points).all(axis=1)]
