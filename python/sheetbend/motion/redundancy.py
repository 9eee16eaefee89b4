"""Rigid constraints that others imply: both diagonals of a flat square of rigid links, a door on two hinges."""

from __future__ import annotations

import warnings


class RedundantConstraintsWarning(UserWarning):
    """Some rigid constraints follow from others. They are left out: their forces are zero, and gradients with respect
    to their rest values are zero."""


def warn_redundant(where: str, which: str) -> None:
    """Warn that a scene has such constraints; `which` is the core's description, empty where there are none. A row that
    follows from no other is no such constraint: its pivot is lost in rounding, or no number."""
    if not which:
        return
    if any(not part.partition("follows from")[2].strip() for part in which.split("; ") if "follows from" in part):
        lost = ", ".join(part.partition(" follows from")[0] for part in which.split("; ") if "follows from" in part)
        warnings.warn(
            f"{where}: constraints are left out that have no answer in double precision: {lost}. Fix: give a substep, "
            "stiffness and masses whose sizes differ by less",
            RedundantConstraintsWarning,
            stacklevel=3,
        )
    else:
        warnings.warn(
            f"{where}: rigid constraints that follow from others are left out: {which}. Their forces are zero, and "
            "their rest values have no effect. Fix: remove them, or give them a compliance",
            RedundantConstraintsWarning,
            stacklevel=3,
        )
