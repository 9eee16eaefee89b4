"""The look of all figures: palette, axes, and keys in words. Figures belong to no window and change no global state."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ..optional import require

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

INK, GRAY, PALE, ACCENT, WARM = "#22262b", "#8a9099", "#eef0f2", "#0b6e8c", "#c8553d"
"""One palette: measured is gray, simulated is the accent, what needs attention is warm."""


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
    offset = {"xybox": (0, 4 if inside else -4), "boxcoords": "offset points"}
    parent.add_artist(
        boxes.AnnotationBbox(row, (1, 1), box_alignment=corner, xycoords=coordinates, frameon=False, pad=0, **offset)
    )
