"""Whether the data speak against the limit of a discretization.

An estimate moves to the limit of short substeps or of fine meshes because a real recording knows neither. A recording
that was simulated does: it is explained best at its own substep and on its own mesh, and there the move would be an
error. So would it be where the discretization is too coarse for a limit, or makes up for something that the model
lacks. Then the estimate stays, and all that the limit would move counts in its interval.
"""

from __future__ import annotations

import numpy as np

from ..arrays.types import Array
from ..problem.problem import FitProblem
from ..statistics.spectral import frames_alike

CLEAR = 3.0  # standard deviations
_ALIKE = 0.05  # autocorrelation that still counts


def refuted(problem: FitProblem, u: Array, there: Array) -> bool:
    """Whether the limit explains the data worse than the fit does, by more than chance would make a right limit do.

    Were the limit right, with residuals q, the fit's were r = q - d, and |q|^2 - |r|^2 would scatter by 2 s |d| about
    -|d|^2, with s the residuals' standard deviation (times the root of the frames that count as one).

    Args:
        u: (free,) minimum of the fit.
        there: (rows,) residuals at the minimum in the limit.
    """
    rows = problem.core.data_rows
    r = problem.evaluate(u)[1][:rows]
    q = there[:rows]
    lost, apart = float(q @ q - r @ r), float((q - r) @ (q - r))
    if lost <= 0.0:
        return False
    frames = frames_alike(r, problem.rows_layout(), _ALIKE)
    return lost + apart > CLEAR * 2.0 * float(np.sqrt(frames * (r @ r) / rows * apart))


def words(what: str, simulated: str, option: str) -> str:
    """A warning that the estimate was not moved to the limit of `what`."""
    return (
        f"in the limit of {what} the model explains the data worse. So the estimate is not moved to that limit, and "
        "the interval includes the whole difference. Possible causes: the recording was simulated "
        f"{simulated} (then use {option}), the discretization is too coarse, or it compensates for something that the "
        "model lacks"
    )
