"""Whether the parameters of a fit can be told apart where it starts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays.types import Array
from ..quantities.wording import short

POOR = 1e4  # condition from which on the parameters that are alike are named
TAKES_PART = 0.1  # of the weakest direction's largest component


@dataclass(frozen=True)
class Condition:
    """How well a start tells its parameters apart.

    Attributes:
        number: largest over smallest singular value of the Jacobian with columns of unit length; infinite where it has
            no rank.
        alike: parameters whose effects cancel in the direction that is told worst, the strongest first.
        unseen: parameters without any effect at the start.
        window: s, of which part of every motion it is; None for the whole.
    """

    number: float
    alike: tuple[str, ...]
    unseen: tuple[str, ...]
    window: float | None = None

    @staticmethod
    def of(jacobian: Array, names: Sequence[str], window: float | None = None) -> Condition:
        """The condition of a Jacobian (rows, free) in internal coordinates, rows of priors included."""
        size = np.linalg.norm(jacobian, axis=0)
        seen = np.isfinite(size) & (size > 0.0)
        unseen = tuple(name for name, there in zip(names, seen, strict=True) if not there)
        if not seen.any():
            return Condition(np.inf, (), unseen, window)
        _, values, right = np.linalg.svd(np.linalg.qr(jacobian[:, seen] / size[seen], mode="r"))
        known = [name for name, there in zip(names, seen, strict=True) if there]
        number = np.inf if unseen or len(values) < len(known) or values[-1] == 0.0 else values[0] / values[-1]
        weight = np.abs(right[-1])
        order = np.argsort(-weight)
        alike = tuple(known[i] for i in order if weight[i] > TAKES_PART * weight.max()) if len(known) > 1 else ()
        return Condition(float(number), alike, unseen, window)

    @property
    def words(self) -> str:
        """One sentence."""
        parts = [f"condition of the scaled Jacobian {short(self.number, 2)}" if np.isfinite(self.number) else ""]
        if self.number > POOR and len(self.alike) > 1:
            parts.append(f"{' and '.join(self.alike)} can hardly be told apart here")
        if self.unseen:
            parts.append(f"{' and '.join(self.unseen)} moves nothing here")
        return "; ".join(part for part in parts if part)
