"""The stiffness along a rope, as a fit found it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..arrays.checks import check_kind
from ..result.field import FieldFit
from .drawing import FOUND, GRAY, band, clean, key, panels_in

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def plot_along(found: FieldFit, *, title: str = "", ax: Axes | None = None) -> Axes:
    """EI (line) and its 95 % interval (band) over the arc length, and the share of the prior that is left below.

    Args:
        found: of `FitResult.fields`, of a rope or rod.
        title: above the figure; the name of the field when left out.
        ax: axes to draw the stiffness in, alone.

    Returns:
        The axes of the stiffness.

    Raises:
        MissingExtraError: matplotlib is not installed.
    """
    check_kind("found", found, FieldFit, "give one of a result's fields")
    panels, whole = panels_in(ax, 1 if ax is not None else 2, (7.2, 4.4), title or found.name)
    s, E, half = np.array(found.centers)[:, 0], np.array(found.stiffness), np.array(found.half_widths)
    clean(panels[0])
    band(panels[0], s, E, E * np.exp(-half), E * np.exp(half))
    panels[0].set_ylabel(f"EI [{found.unit}]")
    for panel in panels[1:]:
        clean(panel)
        panel.plot(s, 100 * np.array(found.left), color=GRAY, linewidth=1.3)
        panel.set_ylabel("left of the prior [%]")
        panel.set_ylim(bottom=0.0)
        panel.margins(x=0)
    panels[-1].set_xlabel("along the rope [m]")
    key(whole, FOUND)
    return panels[0]
