"""Figures of a fit: measured against simulated motions and shapes, and residuals.

Every function draws in the axes `ax`, or in a new figure that belongs to no window and changes no global state, and
returns its axes. `save` writes their figure.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import check_each, check_kind, is_list, numbers, some_indices
from ..arrays.types import Array
from ..doubts.prediction import Comparison
from ..errors import InputError
from ..files.whole import written
from .drawing import ACCENT, GRAY, INK, PALE, WARM, all_of, as_strip, clean, key, panels_in, seen_points, strip

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


_MOST_PANELS = 6
_AXES = "xyz"


def save(drawn: Figure | Axes | Array, path: str | Path) -> None:
    """Write a figure, or the figure of some axes, whole or not at all; the format follows from the name (png, svg,
    pdf).

    Raises:
        InputError: nothing drawn, or a name whose ending is no format of figures.
    """
    first: Any = next(iter(all_of(drawn)), None)
    if not hasattr(first, "figure"):
        raise InputError("drawn", "must be a figure, or axes", drawn, "give what a function of sb.plot returns")
    figure = first.figure.figure  # of axes in a part of a figure the whole one
    with written(path) as beside:
        ending, formats = Path(path).suffix[1:].lower(), figure.canvas.get_supported_filetypes()
        if ending not in formats:
            raise InputError(
                "path", "has an ending that is not a format", str(path), f"use one of {', '.join(formats)}"
            )
        figure.savefig(beside, dpi=160, facecolor="white")


def compared(c: Comparison) -> dict[str, Any]:
    """What `plot_trajectories` and `plot_residuals` take of a motion that a fit compared:
    `plot_trajectories(**compared(fit.comparisons[0]))`.

    Raises:
        InputError: it is no comparison.
    """
    check_kind("c", c, Comparison, "give one of a fit's comparisons")
    times = c.recording.times
    held_out = times[c.held_out]
    return {
        "measured": c.recording.positions,
        "simulated": c.simulated,
        "times": times,
        "markers": c.recording.markers,
        "held_out": (float(held_out[0]), float(held_out[-1])) if len(held_out) else None,
        "title": c.experiment.name,
    }


def plot_trajectories(
    measured: Array,
    simulated: Array,
    times: Array,
    *,
    markers: Sequence[str] = (),
    axis: int | None = None,
    baseline: Array | None = None,
    held_out: tuple[float, float] | None = None,
    title: str = "",
    ax: Axes | Sequence[Axes] | Array | None = None,
) -> Array:
    """One coordinate of each marker over time, measured (dots) against simulated (line), and below the last one how far
    the simulated ones are off.

    Args:
        measured: (frames, markers, 3) m, NaN in gaps.
        simulated: (frames, markers, 3) m.
        times: (frames,) s.
        markers: their names; of more than six, six spread evenly are drawn.
        axis: 0, 1 or 2; the one that moves most when left out.
        baseline: (frames, markers, 3) m, a prediction without physics, drawn thin beside.
        held_out: (first, last) s of the part that the fit did not see; it is shaded.
        title: above the figure.
        ax: axes to draw in, one for each marker that is drawn.

    Returns:
        (panels,) axes.

    Raises:
        InputError: arrays that do not match, or another number of axes than of panels.
    """
    measured, simulated, times = _same_shape(measured, simulated, times)
    names = list(markers) or [f"m{index}" for index in range(measured.shape[1])]
    shown = np.unique(np.linspace(0, measured.shape[1] - 1, min(_MOST_PANELS, measured.shape[1])).astype(int))
    axis = _liveliest(measured) if axis is None else axis
    alone = ax is None  # then the strip has a row of its own, so that all of them begin at one place
    heights = [1.0] * len(shown) + [0.7] * alone
    size = (7.2, 1.8 + 1.15 * len(shown))
    panels, _ = panels_in(ax, len(shown) + alone, size, title, sharex=True, height_ratios=heights)
    below = as_strip(panels.pop(), "off [mm]") if alone else strip(panels[-1], "off [mm]", share=0.4)
    for panel, marker in zip(panels, shown, strict=True):
        clean(panel)
        panel.plot(times, 1e3 * measured[:, marker, axis], ".", color=GRAY, markersize=3.6, markeredgewidth=0)
        if baseline is not None:
            panel.plot(times, 1e3 * baseline[:, marker, axis], color=WARM, linewidth=0.9)
        panel.plot(times, 1e3 * simulated[:, marker, axis], color=ACCENT, linewidth=1.3)
        panel.margins(x=0)
        panel.text(1.01, 0.5, names[marker], transform=panel.transAxes, va="center", color=INK)
        _shade(panel, held_out)
    without = [("without physics", WARM)] if baseline is not None else []
    key(panels[0], [("measured", GRAY), ("simulated", ACCENT), *without, *_shaded(held_out)])
    panels[len(panels) // 2].set_ylabel(f"{_AXES[axis]} [mm]")
    off = 1e3 * (simulated - measured)[:, shown, axis]
    below.plot(times, off, color=GRAY, linewidth=0.5)
    below.plot(times, off[:, int(np.nansum(off**2, axis=0).argmax())], color=WARM, linewidth=0.8)
    _shade(below, held_out)
    below.set_xlabel("time [s]")
    return np.array(panels)


@dataclass(frozen=True)
class Motion:
    """One coordinate of one recording over time: its name, times (frames,) s, measured and simulated (frames,) m,
    held-out span s."""

    name: str
    times: Array
    measured: Array
    simulated: Array
    held_out: tuple[float, float] | None = None


def plot_motions(
    motions: Sequence[Motion], *, title: str = "", ax: Axes | Sequence[Axes] | Array | None = None
) -> Array:
    """One coordinate of each of several recordings, measured (dots) against simulated (line), and below each how far
    the simulated one is off.

    Args:
        motions: at least one.
        title: above the figure.
        ax: axes to draw in, one for each motion.

    Returns:
        (motions,) axes.

    Raises:
        InputError: no motion, or another number of axes than of motions.
    """
    check_each("motions", motions, Motion, "give sb.plot.Motion(...)")
    panels, whole = panels_in(ax, len(motions), (7.2, 0.6 + 2.2 * len(motions)), title or " ")
    for panel, motion in zip(panels, motions, strict=True):
        clean(panel)
        panel.plot(motion.times, 1e3 * motion.measured, ".", color=GRAY, markersize=4, markeredgewidth=0)
        panel.plot(motion.times, 1e3 * motion.simulated, color=ACCENT, linewidth=1.3)
        panel.margins(x=0)
        panel.set_title(motion.name, fontsize=9, color=INK, loc="left", pad=4)
        panel.set_ylabel("[mm]")
        below = strip(panel, "off [mm]")
        below.plot(motion.times, 1e3 * (motion.simulated - motion.measured), color=WARM, linewidth=0.8)
        for part in (panel, below):
            _shade(part, motion.held_out)
    below.set_xlabel("time [s]")
    spans = (motion.held_out for motion in motions if motion.held_out)
    key(whole, [("measured", GRAY), ("simulated", ACCENT), *_shaded(next(spans, None))])
    return np.array(panels)


def _places(field: str, shapes: Sequence[Array]) -> list[Array]:
    """Shapes of points (points, 3) m each."""
    if not is_list(shapes):
        raise InputError(field, "must be a list of shapes", shapes, "give (points, 3) m of each")
    found = [numbers(f"{field}[{k}]", shape, InputError) for k, shape in enumerate(shapes)]
    for k, shape in enumerate(found):
        if shape.ndim != 2 or shape.shape[1] != 3:
            raise InputError(f"{field}[{k}]", "has the wrong shape", shape.shape, "give (points, 3) m")
    return found


def plot_shapes(
    measured: Sequence[Array],
    simulated: Sequence[Array],
    *,
    rings: Sequence[Array] = (),
    names: Sequence[str] = (),
    plane: tuple[int, int] = (0, 2),
    title: str = "",
    ax: Axes | Sequence[Axes] | Array | None = None,
) -> Array:
    """Static shapes in a plane: measured points and the simulated line, one panel each, equal axes.

    Args:
        measured: of each shape (points, 3) m.
        simulated: of each shape (nodes, 3) m, in order along the line.
        rings: of each shape the simulated markers (points, 3) m, where they do not lie on the line; none when left out.
        names: of the shapes.
        plane: the two axes that are drawn, 0 to 2.
        title: above the figure.
        ax: axes to draw in, one for each shape.

    Returns:
        (shapes,) axes.

    Raises:
        InputError: no shapes, measured ones that are not as many as simulated ones, or another number of axes.
    """
    measured, simulated = _places("measured", measured), _places("simulated", simulated)
    rings, across = _places("rings", rings), some_indices("plane", plane, 3) if is_list(plane) else []
    if len(across) != 2:
        raise InputError("plane", "must be two axes", plane, "give two of 0, 1 and 2")
    if not is_list(names) or not all(isinstance(name, str) for name in names):
        raise InputError("names", "must be texts", names, "give a name for each shape, or leave them out")
    if not measured or len(measured) != len(simulated):
        got = (len(measured), len(simulated))
        raise InputError("measured", "must hold one shape per simulated one, at least one", got, "pair them up")
    columns = min(3, len(measured))
    rows = -(-len(measured) // columns)
    width, height = np.ptp(seen_points(np.vstack([*measured, *simulated])[:, across]), axis=0)
    cell = 7.6 / columns
    ratio = min(max(height / max(width, 1e-9), 0.2), 1.5)
    size = (7.6, 0.75 + rows * ((cell - 0.35) * ratio + 0.3))
    grid = {"nrows": rows, "ncols": columns, "sharex": True, "sharey": True}
    panels, whole = panels_in(ax, len(measured), size, title or " ", **grid)
    for panel in panels[len(measured) :]:
        panel.set_visible(False)
    labels = list(names) or [f"shape {index}" for index in range(len(measured))]
    for panel, points, line, label in zip(panels, measured, simulated, labels, strict=False):
        clean(panel)
        panel.plot(*(1e3 * points[:, across]).T, "o", color=GRAY, markersize=3.2, markeredgewidth=0)
        panel.plot(*(1e3 * line[:, across]).T, color=ACCENT, linewidth=1.4)
        panel.set_title(label, fontsize=9, color=INK, loc="left", pad=4)
        panel.set_aspect("equal", adjustable="box")
    for panel, ring in zip(panels, rings, strict=False):
        panel.plot(*(1e3 * ring[:, across]).T, "o", color=ACCENT, markersize=7, markerfacecolor="none")
    for index, panel in enumerate(panels[: len(measured)]):
        if index % columns == 0:
            panel.set_ylabel(f"{_AXES[across[1]]} [mm]")
        if index + columns >= len(measured):
            panel.set_xlabel(f"{_AXES[across[0]]} [mm]")
            panel.tick_params(labelbottom=True)
    key(whole, [("measured", GRAY), ("simulated", ACCENT)])
    return np.array(panels[: len(measured)])


def plot_residuals(
    measured: Array,
    simulated: Array,
    times: Array,
    *,
    markers: Sequence[str] = (),
    held_out: tuple[float, float] | None = None,
    title: str = "",
    ax: Axes | None = None,
) -> Axes:
    """Distance between measured and simulated markers over time: each marker thin, their rms heavy.

    The marker that is worst on the whole is drawn in the warm color and named. Arguments as in
    `plot_trajectories`.

    Returns:
        The axes.

    Raises:
        InputError: arrays that do not match, or no single axes.
    """
    measured, simulated, times = _same_shape(measured, simulated, times)
    names = list(markers) or [f"m{index}" for index in range(measured.shape[1])]
    gap = 1e3 * np.linalg.norm(measured - simulated, axis=2)
    seen = np.isfinite(gap)
    squares = np.where(seen, gap, 0.0) ** 2
    mean = np.sqrt(squares.sum(1) / np.maximum(seen.sum(1), 1))
    mean[~seen.any(1)] = np.nan
    worst = int(np.argmax(squares.sum(0) / np.maximum(seen.sum(0), 1)))
    (panel,), _ = panels_in(ax, 1, (7.2, 3.0), title)
    clean(panel)
    panel.plot(times, gap, color=GRAY, linewidth=0.5, alpha=0.5)
    panel.plot(times, gap[:, worst], color=WARM, linewidth=0.9)
    panel.plot(times, mean, color=ACCENT, linewidth=1.8)
    _shade(panel, held_out)
    panel.set_ylim(bottom=0)
    panel.margins(x=0)
    panel.set_xlabel("time [s]")
    panel.set_ylabel("distance [mm]")
    key(
        panel,
        [
            ("each marker", GRAY),
            (f"worst marker: {names[worst]}", WARM),
            ("all markers, rms", ACCENT),
            *_shaded(held_out),
        ],
    )
    return panel


def _shade(panel: Axes, span: tuple[float, float] | None) -> None:
    if span is not None:
        panel.axvspan(*span, color=PALE, zorder=0, linewidth=0)


def _shaded(span: tuple[float, float] | None) -> list[tuple[str, str]]:
    """What the key says of a shaded part."""
    return [] if span is None else [("shaded: held out", INK)]


def _liveliest(measured: Array) -> int:
    return int(np.argmax(np.nansum(np.nanvar(measured, axis=0), axis=0)))


def _same_shape(measured: ArrayLike, simulated: ArrayLike, times: ArrayLike) -> tuple[Array, Array, Array]:
    """The three as arrays."""
    given = {"measured": measured, "simulated": simulated, "times": times}
    x, y, t = (numbers(field, values, InputError) for field, values in given.items())
    if x.ndim != 3 or x.shape[2] != 3 or x.shape != y.shape:
        raise InputError("measured", "must match simulated", (x.shape, y.shape), "give both as (frames, markers, 3)")
    if t.shape != x.shape[:1]:
        raise InputError("times", "must match the frames", t.shape, f"give shape ({x.shape[0]},)")
    return x, y, t
