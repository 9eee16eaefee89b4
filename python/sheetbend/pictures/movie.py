"""Moving pictures: cloths colored by strain and ropes as lines, with measured markers as dots, as a GIF or MP4."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..arrays.types import Array
from ..errors import InputError
from ..files.whole import written
from ..optional import require
from ..scene.scene import Scene
from .body_lines import body_lines, point_masses
from .collider_lines import collider_lines
from .drawing import ACCENT, GRAY, INK, WARM, key, new_figure, seen_points
from .field_plot import box_in_space, field_colors
from .strain import largest_strain

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Layer = Callable[[int], None]
"""Draws a frame."""
SUFFIXES = (".gif", ".mp4")
MOST_FRAMES, RATE = {".gif": 75, ".mp4": 750}, 25.0  # drawn at most; and per second at most
_DPI = {".gif": 100, ".mp4": 160}
_WITH_EDGES = 1000  # triangles: plain edges of more would hide colors and markers


@dataclass(frozen=True)
class Motion:
    """What a moving picture shows.

    Attributes:
        scene: whose cloths, solids, ropes and bodies are drawn.
        times: (frames,) s.
        positions: (frames, nodes, 3) m of all nodes, such as `Trajectory.nodes`; of particles alone where there is no
            body.
        measured: (frames, markers, 3) m, drawn as dots, NaN where not seen; None without a recording.
        simulated: (frames, markers, 3) m, of the same markers: a line leads from each dot to where it should be.
    """

    scene: Scene
    times: Array
    positions: Array
    measured: Array | None = None
    simulated: Array | None = None


def check_movie(field: str, path: Path, scenes: Sequence[Scene]) -> None:
    """Everything that would stop `save_movie` after the work is done.

    Raises:
        InputError: a file that is no GIF or MP4, or a scene without cloth, solid, rope or body.
        MissingExtraError: matplotlib, Pillow (GIF) or a program that encodes (MP4) is not installed.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise InputError(field, "is not a GIF or MP4", str(path), f"give a file that ends in {' or '.join(SUFFIXES)}")
    if path.is_dir():
        raise InputError(field, "is a folder", str(path), "give a file")
    bare = [scene.name for scene in scenes if not scene.sheets and not scene.ropes and not scene.bodies]
    if bare or not scenes:
        raise InputError(field, "needs a motion of a body, a solid, a cloth or a rope", bare or "none", "leave it out")
    _writer(path, RATE)


def _writer(path: Path, rate: float) -> Any:
    """What turns drawn frames into a file: Pillow for a GIF; for an MP4 ffmpeg, or the one in imageio-ffmpeg."""
    animation = require("matplotlib.animation", "plot")
    if path.suffix.lower() == ".gif":
        require("PIL", "plot")
        return animation.PillowWriter(fps=rate)
    if not animation.FFMpegWriter.isAvailable():
        program = require("imageio_ffmpeg", "movie").get_ffmpeg_exe()
        require("matplotlib", "plot").rcParams["animation.ffmpeg_path"] = program
    return animation.FFMpegWriter(fps=rate, codec="libx264", extra_args=["-pix_fmt", "yuv420p"])


def save_movie(motion: Motion, path: Path, title: str = "") -> int:
    """Write a GIF or an MP4 in the motion's own time, as far as its frames allow.

    An MP4 needs ffmpeg, or the extra `movie`.

    Returns:
        The number of frames.

    Raises:
        InputError: see `check_movie`.
    """
    check_movie("path", path, [motion.scene])
    kind = path.suffix.lower()
    shown = _chosen(motion.times, MOST_FRAMES[kind])
    seconds = float(motion.times[shown[-1]] - motion.times[shown[0]])
    rate = min((len(shown) - 1) / seconds, RATE) if seconds > 0 else 1.0
    figure, draw = _picture(motion, shown, title)
    path.parent.mkdir(parents=True, exist_ok=True)
    writer = _writer(path, rate)
    with written(path) as beside, writer.saving(figure, str(beside), dpi=_DPI[kind]):
        for frame in shown:
            draw(frame)
            writer.grab_frame()
    return len(shown)


def _chosen(times: Array, most: int) -> Array:
    """Equally spaced frames, no more than are worth drawing."""
    wanted = max(2, round((times[-1] - times[0]) * RATE) + 1)
    return np.unique(np.linspace(0, len(times) - 1, min(wanted, most, len(times))).round().astype(int))


def _picture(motion: Motion, shown: Array, title: str) -> tuple[Figure, Layer]:
    """The figure, and what draws a frame of it: one layer after the other, what is measured in front."""
    figure = new_figure(7.2, 5.4, title or " ")
    panel: Any = figure.add_subplot(projection="3d", computed_zorder=False)
    scene, solids = motion.scene, _solid_lines(motion)
    layers = [
        _sheets(figure, panel, motion, shown),
        _lines(panel, solids),
        _ropes_and_weights(panel, motion),
        _markers(figure, panel, motion),
    ]
    drawn = [np.zeros(0, int), *(p.particles for p in (*scene.ropes.values(), *scene.sheets))]
    reach = [motion.positions[shown][:, np.concatenate(drawn)].reshape(-1, 3)]
    reach += [lines[shown].reshape(-1, 3) for lines in solids]
    if motion.measured is not None:
        reach.append(seen_points(motion.measured[shown].reshape(-1, 3)))
    box_in_space(panel, np.vstack(reach), scene.gravity)
    clock = figure.text(0.02, 0.02, "", color=INK, fontsize=10)

    def draw(frame: int) -> None:
        clock.set_text(f"{motion.times[frame]:.2f} s")
        for layer in layers:
            layer(frame)

    return figure, draw


def _sheets(figure: Figure, panel: Any, motion: Motion, shown: Array) -> Layer:
    """Cloths and solids, colored by their largest strain, with its scale."""
    art = require("mpl_toolkits.mplot3d.art3d", "plot")
    cloths, x = motion.scene.sheets, motion.positions
    strains = {c.name: {k: 1e2 * largest_strain(c.mesh, x[k, c.particles]) for k in shown} for c in cloths}
    if not cloths:
        return lambda frame: None
    every = np.concatenate([values for own in strains.values() for values in own.values()])
    sparse = sum(len(c.mesh.triangles) for c in cloths) <= _WITH_EDGES
    shades = np.append(np.minimum(every, np.quantile(every, 0.995)), 0.0)
    colors = {**field_colors(shades), "edgecolor": GRAY, "linewidth": 0.2 if sparse else 0.05}
    drawn = [
        panel.add_collection3d(art.Poly3DCollection(x[0, c.particles][c.mesh.triangles], **colors)) for c in cloths
    ]
    bar = figure.colorbar(drawn[0], ax=panel, shrink=0.6, pad=0.08, aspect=24)
    bar.set_label("largest strain [%]", color=INK, fontsize=9)
    bar.ax.tick_params(colors=INK, labelsize=8)
    bar.outline.set_visible(False)

    def draw(frame: int) -> None:
        for cloth, triangles in zip(cloths, drawn, strict=True):
            triangles.set_verts(x[frame, cloth.particles][cloth.mesh.triangles])
            triangles.set_array(strains[cloth.name][frame])

    return draw


def _solid_lines(motion: Motion) -> list[Array]:
    """(frames, lines, 2, 3) m, the edges of each collider and body."""
    colliders = collider_lines(motion.scene, motion.times, motion.positions)
    return [*colliders.values(), *body_lines(motion.scene, motion.positions).values()]


def _lines(panel: Any, solids: Sequence[Array]) -> Layer:
    """Colliders and bodies."""
    art = require("mpl_toolkits.mplot3d.art3d", "plot")
    drawn = [
        panel.add_collection3d(art.Line3DCollection(lines[0], colors=GRAY, linewidth=0.5, zorder=0)) for lines in solids
    ]

    def draw(frame: int) -> None:
        for lines, outline in zip(solids, drawn, strict=True):
            outline.set_segments(lines[frame])

    return draw


def _ropes_and_weights(panel: Any, motion: Motion) -> Layer:
    """Ropes as lines and point masses as dots."""
    x, heavy = motion.positions, point_masses(motion.scene)
    ropes = [(r.particles, panel.plot([], [], [], color=ACCENT, linewidth=1.8)[0]) for r in motion.scene.ropes.values()]
    weights = panel.plot([], [], [], "o", color=INK, markersize=8, markeredgewidth=0, zorder=2)[0]

    def draw(frame: int) -> None:
        weights.set_data_3d(*x[frame, heavy].T)
        for particles, line in ropes:
            line.set_data_3d(*x[frame, particles].T)

    return draw


def _markers(figure: Figure, panel: Any, motion: Motion) -> Layer:
    """Measured markers, each with a line to its simulated place."""
    measured, simulated = motion.measured, motion.simulated
    if measured is None:
        return lambda frame: None
    art = require("mpl_toolkits.mplot3d.art3d", "plot")
    dots = panel.plot([], [], [], "o", color=WARM, markersize=3.2, markeredgewidth=0, zorder=10)[0]
    off = panel.add_collection3d(art.Line3DCollection(np.zeros((1, 2, 3)), colors=INK, linewidth=1.2, zorder=9))
    key(figure, [("measured markers", WARM), ("line to the simulated place", INK)])

    def draw(frame: int) -> None:
        dots.set_data_3d(*seen_points(measured[frame]).T)
        if simulated is not None:
            pairs = np.stack([measured[frame], simulated[frame]], axis=1)
            off.set_segments(pairs[np.isfinite(pairs).all(axis=(1, 2))])

    return draw


def movie_paths(path: Path, names: Sequence[str]) -> Mapping[str, Path]:
    """One file of its own for each motion: the path itself where there is one, else with the motion's name."""
    if len(names) == 1:
        return {names[0]: path}
    return {name: path.with_name(f"{path.stem}_{name}{path.suffix}") for name in names}
