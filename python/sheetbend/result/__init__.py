"""What a fit gives back, as plain data."""

from ..moved import old_contents

__getattr__ = old_contents(__name__)
