"""What a rod and a cloth say of their yield: a curvature and a share, which belong together."""

from __future__ import annotations

from ..arrays.checks import is_number
from ..errors import SceneError


def check_yield(name: str, curvature: float | None, share: float | None, stiffness: str) -> None:
    """Refuse one of them without the other, and a share that is none.

    Args:
        stiffness: the argument that they are a part of.

    Raises:
        SceneError: names `<name>.yield_share`.
    """
    if (curvature is None) != (share is None):
        fix = "give yield_curvature and yield_share, or neither"
        raise SceneError(f"{name}.yield_share", "and yield_curvature belong together", share, fix)
    if share is not None and not (is_number(share) and 0 < share < 1):
        raise SceneError(f"{name}.yield_share", "must lie between 0 and 1", share, f"give a part of {stiffness}")
