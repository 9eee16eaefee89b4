"""Named numbers: quantities of scenes, parameters of fits, units of constraints, and how reports write them."""

from ..moved import old_contents

__getattr__ = old_contents(__name__)
