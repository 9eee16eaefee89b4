"""Types of the module that links Ceres; it is built where Ceres is installed and loads when a fit asks for it."""

from collections.abc import Callable, Sequence
from typing import Any

from numpy.typing import ArrayLike

def minimize(
    *,
    evaluation: object,
    u: ArrayLike,
    lower: ArrayLike,
    upper: ArrayLike,
    longest_step: ArrayLike,
    held: Sequence[int],
    residual_seconds: float = 0.0,
    max_iterations: int,
    tolerance: float,
    observe: Callable[..., bool],
) -> dict[str, Any]: ...
