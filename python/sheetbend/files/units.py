"""The units of length that files may be in."""

from typing import Literal, get_args

Length = Literal["m", "cm", "mm", "in", "ft"]
METERS = dict(zip(get_args(Length), (1.0, 1e-2, 1e-3, 0.0254, 0.3048), strict=True))
