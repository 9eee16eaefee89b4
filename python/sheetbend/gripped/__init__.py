"""Ropes held by two grips: from recordings to stiffness, twist, damping, rest shape and yield."""

from .evaluation import Evaluation, evaluate
from .ladder import LADDER, WITHOUT_TWIST, Rung
from .model import RopeModel
from .motion import GrippedMotion
from .recipe import RopeFit, fit_rope
from .report import RopeReport
from .screening import Screened, screened
from .steps import Step
from .trades import trades

__all__ = [
    "LADDER",
    "WITHOUT_TWIST",
    "Evaluation",
    "GrippedMotion",
    "RopeFit",
    "RopeModel",
    "RopeReport",
    "Rung",
    "Screened",
    "Step",
    "evaluate",
    "fit_rope",
    "screened",
    "trades",
]
