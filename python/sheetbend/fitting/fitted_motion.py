"""Where all nodes of a fitted scene are at the frames of its recording: what pictures, movies and pages draw."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..arrays.types import Array
from ..doubts.prediction import Comparison
from ..experiment.driven_motion import corrected
from ..experiment.found_start import start_nodes
from ..motion.equilibrium import equilibrium
from ..motion.simulate import simulate
from .fit import Fit


def fitted_positions(found: Fit, c: Comparison, frames: Sequence[int] | slice = slice(None)) -> Array:
    """(frames, nodes, 3) m of all nodes, at the substeps nearest to the recorded frames on the scene's clock; of a
    shape at rest one frame. Costs one simulation.

    Args:
        frames: of the comparison's recording; all by default.

    Raises:
        DivergenceError: the motion diverges at the fitted values.
    """
    e, values = c.experiment, found.values_of(c.experiment)
    if e.name in found.corrections:
        e = corrected(e, found.corrections[e.name])
    if e.static:
        return equilibrium(e.scene, values=values).nodes[None]
    at = np.maximum(e.scene_times(c.recording.times[frames], values), 0.0)
    times, which = np.unique(np.rint(at / e.solver.h) * e.solver.h, return_inverse=True)
    return simulate(e.scene, times, e.solver, values, start_nodes(e, values)).nodes[which]
