"""Recordings of markers and of forces: their checks, their files, and what predicts them without physics."""

from ..moved import old_contents

__getattr__ = old_contents(__name__)
