"""Where steps end that go on by one factor.

Gauss-Newton's matrix lacks the curvature of the residuals. Where these stay large, as of a model that is not quite
right, its steps become a geometric series: each is the one before times a factor, which is negative where they swing
about the minimum. A factor of -0.75 takes eight steps for a digit. The sum of the series follows from its last two
steps (Aitken 1926, Proc. R. Soc. Edinburgh 46, 289).
"""

from __future__ import annotations

import numpy as np

LEAST, MOST = 0.3, 0.95  # of the factor: below, few steps are left; above, the sum is uncertain
ALIKE = 0.15  # relative: the part of a step that is not the factor times the one before


class GeometricSteps:
    """The steps of a search, one after the other.

    Attributes:
        sum: (n,) where the last ones end, if three of them went on by one factor; None otherwise.
    """

    def __init__(self, wanted: bool = True) -> None:
        self._points: list[np.ndarray] = []
        self._wanted = wanted
        self.sum: np.ndarray | None = None

    def add(self, point: np.ndarray) -> bool:
        """Add the point (n,) where one more step ended; whether the steps have a sum now. A point twice is a step that
        was rejected, after which others are shorter: they begin anew."""
        stays = bool(self._points) and np.array_equal(self._points[-1], point)
        self._points = [point] if stays else [*self._points[-3:], point]
        self.sum = self._summed() if self._wanted else None
        return self.sum is not None

    def _summed(self) -> np.ndarray | None:
        if len(self._points) < 4:
            return None
        first, second, third = np.diff(self._points, axis=0)
        size = np.max(np.abs([first, second, third]), axis=0)
        moves = size > 0.0
        a, b, c = (step[moves] / size[moves] for step in (first, second, third))
        factor = float(c @ b / (b @ b))
        before = float(b @ a / (a @ a))
        alike = max(float(np.linalg.norm(c - factor * b)), float(np.linalg.norm(b - factor * a)))
        if not LEAST < abs(factor) < MOST or factor * before < 0.0 or alike > ALIKE * float(np.linalg.norm(b)):
            return None
        return np.asarray(self._points[-1] + third * factor / (1.0 - factor))
