"""Ropes held by two grips: from recordings to stiffness, twist, damping, rest shape and yield."""

from .model import RopeModel
from .motion import GrippedMotion
from .recipe import LADDER, RopeFit, Rung, Step, fit_rope

__all__ = ["LADDER", "GrippedMotion", "RopeFit", "RopeModel", "Rung", "Step", "fit_rope"]
