"""Figures with matplotlib (the extra `plot`), under the names that users write: `sheetbend.plot.trajectories(...)`.

Every function takes `ax`, axes to draw in, and returns the axes that it has drawn in. Without `ax` it makes a figure
that belongs to no window; `save` writes it, and a notebook shows `axes.figure`.
"""

from .pictures.along_plot import plot_along as along
from .pictures.estimate_plot import plot_estimates as estimates
from .pictures.field_plot import Field
from .pictures.field_plot import plot_fields as fields
from .pictures.force_plot import plot_forces as forces
from .pictures.over_time_plot import plot_over_time as over_time
from .pictures.plotting import Motion, compared, save
from .pictures.plotting import plot_motions as motions
from .pictures.plotting import plot_residuals as residuals
from .pictures.plotting import plot_shapes as shapes
from .pictures.plotting import plot_trajectories as trajectories
from .pictures.strain import green_strain, largest_strain, strain_fields

__all__ = [
    "Field",
    "Motion",
    "along",
    "compared",
    "estimates",
    "fields",
    "forces",
    "green_strain",
    "largest_strain",
    "motions",
    "over_time",
    "residuals",
    "save",
    "shapes",
    "strain_fields",
    "trajectories",
]
