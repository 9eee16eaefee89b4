"""Moving pictures: cloths colored by strain and ropes as lines, with measured markers as dots, as a GIF or MP4."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

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

Array = np.ndarray
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
        raise InputError(field, "is no GIF or MP4", str(path), f"give a file that ends in {' or '.join(SUFFIXES)}")
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


def _picture(motion: Motion, shown: Array, title: str) -> tuple[Figure, Any]:
    """The figure, and what draws a frame of it."""
    art = require("mpl_toolkits.mplot3d.art3d", "plot")
    figure = new_figure(7.2, 5.4, title or " ")
    panel: Any = figure.add_subplot(projection="3d", computed_zorder=False)  # what is measured stays in front
    cloths = motion.scene.sheets
    strains = {
        c.name: {k: 1e2 * largest_strain(c.mesh, motion.positions[k, c.particles]) for k in shown} for c in cloths
    }
    sheets = []
    if strains:
        every = np.concatenate([values for own in strains.values() for values in own.values()])
        sparse = sum(len(c.mesh.triangles) for c in cloths) <= _WITH_EDGES
        shades = np.append(np.minimum(every, np.quantile(every, 0.995)), 0.0)
        colors = {**field_colors(shades), "edgecolor": GRAY, "linewidth": 0.2 if sparse else 0.05}
        for cloth in cloths:
            drawn = panel.add_collection3d(
                art.Poly3DCollection(motion.positions[0, cloth.particles][cloth.mesh.triangles], **colors)
            )
            sheets.append((cloth, drawn))
        bar = figure.colorbar(sheets[0][1], ax=panel, shrink=0.6, pad=0.08, aspect=24)
        bar.set_label("largest strain [%]", color=INK, fontsize=9)
        bar.ax.tick_params(colors=INK, labelsize=8)
        bar.outline.set_visible(False)
    boxes = body_lines(motion.scene, motion.positions)
    solids = [
        (lines, panel.add_collection3d(art.Line3DCollection(lines[0], colors=GRAY, linewidth=0.5, zorder=0)))
        for lines in (*collider_lines(motion.scene, motion.times, motion.positions).values(), *boxes.values())
    ]
    ropes = [(r.particles, panel.plot([], [], [], color=ACCENT, linewidth=1.8)[0]) for r in motion.scene.ropes.values()]
    heavy = point_masses(motion.scene)
    weights = panel.plot([], [], [], "o", color=INK, markersize=8, markeredgewidth=0, zorder=2)[0]
    dots = panel.plot([], [], [], "o", color=WARM, markersize=3.2, markeredgewidth=0, zorder=10)[0]
    off = panel.add_collection3d(art.Line3DCollection(np.zeros((1, 2, 3)), colors=INK, linewidth=1.2, zorder=9))
    drawn_particles = np.concatenate(
        [np.zeros(0, int), *(p.particles for p in (*motion.scene.ropes.values(), *cloths))]
    )
    reach = [motion.positions[shown][:, drawn_particles].reshape(-1, 3)]
    reach += [lines[shown].reshape(-1, 3) for lines, _ in solids]
    if motion.measured is not None:
        reach.append(seen_points(motion.measured[shown].reshape(-1, 3)))
        key(figure, [("measured markers", WARM), ("line to the simulated place", INK)])
    box_in_space(panel, np.vstack(reach), motion.scene.gravity)
    clock = figure.text(0.02, 0.02, "", color=INK, fontsize=10)

    def draw(frame: int) -> None:
        clock.set_text(f"{motion.times[frame]:.2f} s")
        for cloth, drawn in sheets:
            drawn.set_verts(motion.positions[frame, cloth.particles][cloth.mesh.triangles])
            drawn.set_array(strains[cloth.name][frame])
        for lines, outline in solids:
            outline.set_segments(lines[frame])
        weights.set_data_3d(*motion.positions[frame, heavy].T)
        for particles, line in ropes:
            line.set_data_3d(*motion.positions[frame, particles].T)
        if motion.measured is not None:
            dots.set_data_3d(*seen_points(motion.measured[frame]).T)
            if motion.simulated is not None:
                pairs = np.stack([motion.measured[frame], motion.simulated[frame]], axis=1)
                off.set_segments(pairs[np.isfinite(pairs).all(axis=(1, 2))])

    return figure, draw


def movie_paths(path: Path, names: Sequence[str]) -> Mapping[str, Path]:
    """One file of its own for each motion: the path itself where there is one, else with the motion's name."""
    if len(names) == 1:
        return {names[0]: path}
    return {name: path.with_name(f"{path.stem}_{name}{path.suffix}") for name in names}
