"""The figures that `sheetbend fit` writes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from rich.console import Console

from ..config import Config, GrippedConfig
from ..doubts.prediction import Comparison
from ..experiment.experiment import Experiment
from ..fitting.fit import Fit
from ..motion.equilibrium import equilibrium
from ..optional import require
from ..pictures import plotting
from ..pictures.along_plot import plot_along
from ..pictures.estimate_plot import plot_estimates
from ..pictures.force_plot import plot_forces
from ..pictures.over_time_plot import plot_over_time
from ..report.report_over_time import without_modes
from .cloth_figures import cloth_figures, stiffness_figures

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BACKENDS = {"png": "agg", "svg": "svg", "pdf": "pdf"}


def figures_form(console: Console, config: Config | GrippedConfig) -> str:
    """The format of figures that is asked for; "none" where matplotlib is missing or does not load, which is said
    before the work."""
    form = config.output.figures
    if form == "none":
        return form
    try:
        require("matplotlib.figure", "plot")
        require(f"matplotlib.backends.backend_{BACKENDS[form]}", "plot")
    except Exception as error:  # a broken installation may raise anything while it loads
        console.print(f"no figures will be drawn: {error}", markup=False, soft_wrap=True)
        return "none"
    return form


def write_figures(found: Fit, config: Config, form: str, folder: Path) -> list[str]:
    """Measured against simulated for every recording, and the estimates; gives the files' names."""
    if form == "none":
        return []
    figures: dict[str, Axes | np.ndarray] = {}  # some axes of each
    static = [c for c in found.comparisons if c.experiment.static and not c.experiment.scene.cloths]
    if static:
        figures["shapes"] = _shapes(found, static)
    moving = [c for c in found.comparisons if _follows_markers(c.experiment)]
    if len(moving) > 1:
        figures["motions"] = plotting.plot_motions([_liveliest(c) for c in moving], title=config.experiment.name)
    for c in moving:
        name = c.experiment.name
        figures[f"{name}_markers"] = plotting.plot_trajectories(**plotting.compared(c))
        figures[f"{name}_residuals"] = plotting.plot_residuals(**plotting.compared(c))
    for c in found.comparisons:
        figures |= {f"{c.experiment.name}_{one.sensor}": plot_forces(one) for one in c.forces}
        figures |= {f"{c.experiment.name}_{name}": figure for name, figure in cloth_figures(found, c).items()}
    figures |= stiffness_figures(found)
    figures |= {one.name: plot_along(one) for one in found.result.fields if one.place == "joint"}
    figures |= {f"{one.recording}_{one.name}": plot_over_time(one) for one in found.result.over_time}
    published = _published(found, config)
    told = without_modes(found.result).estimates
    figures["estimates"] = plot_estimates(told, published=published, title=config.experiment.name)
    for name, figure in figures.items():
        plotting.save(figure, folder / f"{name}.{form}")
    return [f"{name}.{form}" for name in figures]


def figure_files(experiments: Sequence[Experiment], config: Config) -> list[str]:
    """Every file that `write_figures` may write, known before the fit."""
    form = config.output.figures
    if form == "none":
        return []
    names = ["estimates", "shapes", "motions"]
    for e in experiments:
        names += [] if not _follows_markers(e) else [f"{e.name}_markers", f"{e.name}_residuals"]
        names += [f"{e.name}_{sensor.name}" for sensor in e.forces]
        names += [f"{e.name}_{name}" for name in (*e.scene.cloths, *e.scene.over_time)]
        varied = (*e.scene.cloths.values(), *e.scene.ropes.values())
        names += [one.field.name for one in varied if one.field is not None]
    return [f"{name}.{form}" for name in names]


def _follows_markers(e: Experiment) -> bool:
    """Whether there are series over time to draw: not at rest, and not of a cloud, whose points have no names."""
    return not e.static and not e.is_cloud


def _shapes(found: Fit, comparisons: list[Comparison]) -> np.ndarray:
    return plotting.plot_shapes(
        [c.recording.positions[0] for c in comparisons],
        [_line(found, c) for c in comparisons],
        rings=[c.simulated[0] if _stands_off(c) else c.simulated[:0, 0] for c in comparisons],
        names=[c.experiment.name for c in comparisons],
        plane=_plane(comparisons),
    )


def _plane(comparisons: list[Comparison]) -> tuple[int, int]:
    """The two axes that count; where all three do, upwards and the wider of the others."""
    axes = {tuple(sorted("xyz".index(a) for a in c.experiment.axes)) for c in comparisons}
    if len(axes) == 1 and len(only := axes.pop()) == 2:
        return only[0], only[1]
    spread = np.ptp(
        np.vstack([c.recording.positions[0] for c in comparisons if np.isfinite(c.recording.positions).any()]), axis=0
    )
    return (0 if spread[0] >= spread[1] else 1), 2


def _stands_off(c: Comparison) -> bool:
    """Whether markers stand off the line that carries them."""
    places = (c.experiment.places[i] for i in c.experiment.compared)
    return any(place is not None and place.offset is not None for place in places)


def _liveliest(c: Comparison) -> plotting.Motion:
    """The coordinate that moves most, of the marker that moves most."""
    x = c.recording.positions
    marker, axis = np.unravel_index(np.argmax(np.nanvar(x, axis=0)), x.shape[1:])
    name = f"{c.experiment.name}: {c.recording.markers[marker]}, {'xyz'[axis]}"
    held_out = plotting.compared(c)["held_out"]
    return plotting.Motion(name, c.recording.times, x[:, marker, axis], c.simulated[:, marker, axis], held_out)


def _line(found: Fit, c: Comparison) -> np.ndarray:
    """The rope from end to end; the markers alone where there is not exactly one rope."""
    scene = c.experiment.scene
    if len(scene.ropes) != 1:
        return c.simulated[0]
    (rope,) = scene.ropes.values()
    return equilibrium(scene, values=found.values_of(c.experiment)).positions[rope.particles]


def _published(found: Fit, config: Config) -> dict[str, float | tuple[float, float]]:
    """Published values by name of the estimate; the reference of a private parameter serves each of its estimates."""
    marks: dict[str, float | tuple[float, float]] = {}
    for estimate in found.result.estimates:
        value = config.published.get(estimate.name, config.published.get(estimate.name.partition("[")[0]))
        if value is not None:
            marks[estimate.name] = (value[0], value[1]) if isinstance(value, list) else value
    return marks
