"""A recording with the scene that is to explain it, its force sensors, its clock and corrections of its motion."""

from ..moved import old_contents

__getattr__ = old_contents(__name__)
