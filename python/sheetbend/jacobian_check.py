"""A check of a fit's residual Jacobian by differences.

It covers what the gradient check of a rollout does not: markers, offsets, clock shifts and equilibria.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from .errors import SheetbendError
from .problem import FitProblem

BOUND = 1e-4  # the differences' own accuracy limits it
STEP = 1e-3  # of the internal coordinate: the logarithm, or the parameter's scale
SMALLEST = (
    1e-4  # of the largest residual, or of one standard deviation; smaller columns are judged as if they were that large
)


@dataclass(frozen=True)
class JacobianRow:
    """The column of one parameter: its largest entry, and the largest gap to central differences relative to that (or
    to `SMALLEST`)."""

    name: str
    largest: float
    differences: float
    passed: bool


@dataclass(frozen=True)
class JacobianReport:
    """What `check_jacobian` found."""

    recording: str
    residuals: int
    rows: tuple[JacobianRow, ...]

    @property
    def passed(self) -> bool:
        return all(row.passed for row in self.rows)

    def to_dict(self) -> dict[str, Any]:
        """For JSON: each column by name with its relative error and pass or fail."""
        columns = {r.name: {"largest": r.largest, "differences": r.differences, "passed": r.passed} for r in self.rows}
        return {"recording": self.recording, "residuals": self.residuals, "parameters": columns, "passed": self.passed}

    def __str__(self) -> str:
        width = max(len(r.name) for r in self.rows)
        verdict = "passed" if self.passed else "FAILED"
        lines = [f"Jacobian check of '{self.recording}' over {self.residuals} residuals: {verdict}"]
        lines.append(f"  {'':{width}}  {'largest':>9}  {'differences':>11}")
        lines += [
            f"  {r.name:{width}}  {r.largest:9.2e}  {r.differences:11.1e}{'' if r.passed else '  <- fails'}"
            for r in self.rows
        ]
        return "\n".join([*lines, f"  bound: {BOUND:g}"])


def check_jacobian(problem: FitProblem, recording: str = "") -> JacobianReport:
    """Compare the residuals' Jacobian at the start with central differences, one Richardson step, in internal
    coordinates.

    Raises:
        SheetbendError: the start itself diverges or has no equilibrium.
    """
    u = problem.parameters.initial()
    ok, r, J = problem.evaluate(u)
    if not ok:
        raise SheetbendError(f"{recording}: the residuals cannot be evaluated at the start: {problem.core.failure}")
    rows = []
    for column, name in enumerate(problem.parameters.free):
        p = problem.parameters[name]
        step = STEP * (1.0 if p.log else p.scale or max(abs(u[column]), 1.0))
        coarse, fine = _differences(problem, u, column, step), _differences(problem, u, column, step / 2.0)
        exact, rough = J[:, column], (4.0 * fine - coarse) / 3.0
        largest = float(np.abs(exact).max())
        gap = float(np.abs(exact - rough).max())
        # Where nothing depends on a parameter, its column and the differences are nothing but rounding.
        relative = gap / max(largest, SMALLEST * max(float(np.abs(r).max()), 1.0))
        rows.append(JacobianRow(name, largest, relative, relative <= BOUND))
    return JacobianReport(recording, len(r), tuple(rows))


def _differences(problem: FitProblem, u: np.ndarray, column: int, step: float) -> np.ndarray:
    ends = []
    for sign in (1.0, -1.0):
        at = u.copy()
        at[column] += sign * step
        ok, r, _ = problem.evaluate(at, jacobian=False)
        ends.append(r if ok else np.full(len(r), np.nan))
    return np.asarray((ends[0] - ends[1]) / (2.0 * step))
