"""A check of a fit's residual Jacobian by differences.

It covers what the gradient check of a rollout does not: markers, offsets, clock shifts and equilibria.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import SheetbendError
from ..quantities.parameters import Parameter
from .problem import FitProblem

BOUND = 1e-4  # the differences' own accuracy limits it
STEP = 1e-3  # of the internal coordinate: the logarithm, the parameter's scale, or its value
MOVED = 0.1  # standard deviations: what a step of a parameter moves that is zero and has no scale
MOST_NOISE = 1e-2  # of a column: differences with a larger error do not excuse a larger gap
SMALLEST = (
    1e-4  # of the largest residual, or of one standard deviation; smaller columns are judged as if they were that large
)


@dataclass(frozen=True)
class JacobianRow:
    """The column of one parameter: its largest entry, the largest gap to central differences relative to that (or to
    `SMALLEST`), and what these may be off by for their own error, likewise."""

    name: str
    largest: float
    differences: float
    passed: bool
    noise: float = 0.0


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
        """Values for JSON: each column by name, with its relative error and whether it passed."""
        columns = {
            r.name: {"largest": r.largest, "differences": r.differences, "noise": r.noise, "passed": r.passed}
            for r in self.rows
        }
        return {"recording": self.recording, "residuals": self.residuals, "parameters": columns, "passed": self.passed}

    def __str__(self) -> str:
        width = max(len(r.name) for r in self.rows)
        verdict = "passed" if self.passed else "FAILED"
        lines = [f"Jacobian check of '{self.recording}' over {self.residuals} residuals: {verdict}"]
        lines.append(f"  {'':{width}}  {'largest':>9}  {'differences':>11}")
        lines += [f"  {r.name:{width}}  {r.largest:9.2e}  {r.differences:11.1e}{_mark(r)}" for r in self.rows]
        return "\n".join([*lines, f"  bound: {BOUND:g}"])


def _mark(row: JacobianRow) -> str:
    if not row.passed:
        return "  <- fails"
    return f"  differences good to {row.noise:.0e}" if row.noise > BOUND else ""


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
    size = max(float(np.abs(r).max()), 1.0)
    rounding = np.finfo(float).eps * max(
        float(np.nanmax(np.abs(part.positions))) / e.sigma
        for e, part in zip(problem.experiments, problem.recordings, strict=True)
    )
    for column, name in enumerate(problem.parameters.free):
        exact, largest = J[:, column], float(np.abs(J[:, column]).max())
        step = _step(problem.parameters[name], u[column], largest)
        coarse, fine = _differences(problem, u, column, step), _differences(problem, u, column, step / 2.0)
        # Where nothing depends on a parameter, its column and the differences are nothing but rounding.
        least = max(largest, SMALLEST * size)
        gap = np.abs(exact - (4.0 * fine - coarse) / 3.0)
        error = np.abs(fine - coarse) + rounding / step
        passed = bool((gap <= BOUND * least + np.minimum(error, MOST_NOISE * least)).all())
        rows.append(JacobianRow(name, largest, float(gap.max()) / least, passed, float(error.max()) / least))
    return JacobianReport(recording, len(r), tuple(rows))


def _step(p: Parameter, at: float, largest: float) -> float:
    """What a step of a parameter is, in internal coordinates."""
    if p.log:
        return STEP
    if p.scale is not None or at != 0.0:
        return STEP * (p.scale or abs(at))
    return MOVED / largest if largest > 0.0 else STEP


def _differences(problem: FitProblem, u: np.ndarray, column: int, step: float) -> np.ndarray:
    ends = []
    for sign in (1.0, -1.0):
        at = u.copy()
        at[column] += sign * step
        ok, r, _ = problem.evaluate(at, jacobian=False)
        ends.append(r if ok else np.full(len(r), np.nan))
    return np.asarray((ends[0] - ends[1]) / (2.0 * step))
