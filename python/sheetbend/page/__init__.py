"""One HTML file to look at: a fit's report, or the motion of a simulation or a recording, that opens offline."""

from .notebook import show_in_notebooks
from .of_fabric import fabric_page
from .of_fit import fit_page, result_page
from .of_motion import motion_page
from .shown import Shown, fitted_motion, of_recording, of_trajectory, predicted_motion

__all__ = [
    "Shown",
    "fabric_page",
    "fit_page",
    "fitted_motion",
    "motion_page",
    "of_recording",
    "of_trajectory",
    "predicted_motion",
    "result_page",
    "show_in_notebooks",
]
